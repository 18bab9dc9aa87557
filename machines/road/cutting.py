"""The cut of a run: stability charts at tool-point amplitudes, what they say together, and test cuts against them."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from jointlib.errors import CheckFailed
from jointlib.loop.answer.report import Verdict

from .piece import Piece, Step, open_joints

if TYPE_CHECKING:
    from pathlib import Path

    from .. import Machine, StabilityLobes
    from ..cutting.amplitude.pocket import Pocket
    from .run import Run


BUDGET = 300.0
"""Seconds for the chart at rest; of `jointlib lobes` also for limits over amplitude."""
KNOCKS_BUDGET = 60.0
"""Seconds for the depth below which knocks die out."""


def cutting_pieces(machine: Machine, amplitudes: Sequence[float]) -> list[Piece]:
    """A chart at each amplitude (m), each alone; then the lobes of all that were found; then test cuts."""
    needs = open_joints(machine)
    tried = [
        Piece(
            "cuts",
            f"Test cuts of {path.name}",
            partial(_test_cuts, path=path),
            f"`jointlib trace {path} --machine {machine.source} -o DIR` repeats it alone.",
            path.name,
            needs,
        )
        for path in machine.cuts
    ]
    if machine.cutting is None:
        return tried
    charts = [
        Piece(
            "lobes",
            f"Stability lobes at {_size(A)}",
            partial(_chart, amplitude=A, before=tuple(amplitudes[:i])),
            f"`jointlib lobes {machine.source} --amplitude {A:g}` repeats it alone; fewer speeds (`--speed`) or "
            "another `--method` ask for less.",
            _size(A),
            needs,
        )
        for i, A in enumerate(amplitudes)
    ]
    together = partial(_together, amplitudes=tuple(amplitudes))
    if machine.tool_name is not None and machine.source is not None:
        alone = f"`jointlib lobes {machine.source}` repeats it alone."
        charts.append(Piece("tools", "Stability lobes of every tool", _each_tool, alone, needs=needs))
    return [*charts, Piece("lobes", "Stability lobes", together, "The charts are in lobes.npz.", needs=needs), *tried]


def _size(amplitude: float) -> str:
    return f"a tool-point amplitude of {amplitude * 1e6:g} um" if amplitude else "vanishing vibration"


def _sizes(amplitudes: Sequence[float]) -> str:
    if len(amplitudes) == 1 or 0.0 in amplitudes:
        return " and at ".join(_size(A) for A in amplitudes)
    words = [f"{A * 1e6:g}" for A in amplitudes]
    return f"tool-point amplitudes of {', '.join(words[:-1])} and {words[-1]} um"


def _chart(road: Run, amplitude: float, before: Sequence[float] = ()) -> None:
    """The chart at an amplitude; with very many joints none is begun after one ``before`` of which nothing is known.

    Where it would take too long, the limit at the speed that is recommended at rest is what is asked for.
    """
    from ..cutting.amplitude.amplitude_limits import depends_on_amplitude
    from ..cutting.amplitude.chattering_tool import seconds_of_chart
    from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
    from ..cutting.amplitude.lobes_over_range import lobes_over_range
    from ..cutting.amplitude.pocket import pocket
    from ..cutting.forced.forced_vibration import too_many
    from ..cutting.process.cutting import Cutting
    from ..cutting.rest.chart_file import default_speeds

    onset, cutting = road.charts.get(0.0), Cutting(**(road.machine.cutting or {}))
    speeds = default_speeds(road.machine, 100) if onset is None else onset.speed
    with road.progress.step(f"stability lobes at {_size(amplitude)}"):
        if amplitude and depends_on_amplitude(road.machine) and too_many(road.machine):
            lost = [A for A in before if A and A not in road.charts and A not in road.near_pocket]
            if lost:
                raise CheckFailed(f"not begun, as it takes as long as that at {_size(lost[0])}, which was not done")
            needed = seconds_of_chart(road.machine, cutting, amplitude, BUDGET)
            if needed > BUDGET:
                raise CheckFailed(f"it would take about {needed / 60:.0f} minutes, more than {BUDGET / 60:g}")
            if onset is not None and (set_to := pocket([onset], cutting)) is not None:
                _near_pocket(road, amplitude, set_to, speeds.size)
        road.charts[amplitude] = (
            lobes_at_amplitude(road.machine, speeds, amplitude)
            if amplitude
            else lobes_over_range(road.machine, speeds, budget=BUDGET)
        )


def _near_pocket(road: Run, amplitude: float, at_rest: Pocket, count: int) -> None:
    """Refuse a chart of so many speeds that takes too long, with the limit at the speed recommended at rest."""
    from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
    from ..cutting.amplitude.pocket import WANDER

    def limit(rpm: float) -> float:
        return float(lobes_at_amplitude(road.machine, [rpm], amplitude).minimum_depth)

    begun, rpm = time.monotonic(), at_rest.speed
    depth = limit(rpm)
    needed = (time.monotonic() - begun) * count
    if needed <= BUDGET:
        return
    depth = min(depth, limit(rpm * (1 - WANDER)), limit(rpm * (1 + WANDER)))
    holds = f"the cut is stable below {depth * 1e3:.3g} mm" if np.isfinite(depth) else "no depth chatters"
    less = ", less than the depth recommended for small vibrations" if depth < at_rest.depth else ""
    near = f"at {rpm:.0f} rpm and {100 * WANDER:g} % off it {holds}{less}"
    road.near_pocket[amplitude] = f"At {_size(amplitude)} the recommended speed alone is known: {near}."
    raise CheckFailed(f"{count} speeds would take about {needed / 60:.0f} minutes, more than {BUDGET / 60:g}; {near}")


def _each_tool(road: Run) -> None:
    """What every tool of the file cuts, where none was asked for."""
    from ..cutting.amplitude.lobes_over_range import lobes_over_range
    from ..cutting.rest.chart_file import default_speeds
    from .each_tool import each_tool, words_of

    used = road.machine
    if not road.tools or used.source is None:
        return
    budget = BUDGET / len(road.tools)  # a piece of a run has an end as well

    def chart_of(machine: Machine) -> StabilityLobes:
        return lobes_over_range(machine, default_speeds(machine, 100), budget=budget)

    known = road.charts.get(0.0) or chart_of(used)
    road.tool_lobes = each_tool(used, used.source, road.tools, chart_of, known, True, road.progress)
    road.said += words_of(road.tool_lobes, used.tool_name)
    road.steps.append({"step": "tools", "tools": [tool.as_json() for tool in road.tool_lobes]})


def _together(road: Run, amplitudes: tuple[float, ...]) -> None:
    from ..cutting.amplitude.milling_at_amplitude import HELD
    from ..cutting.amplitude.pocket import limit_of, pocket
    from ..cutting.forced.advice import advice
    from ..cutting.forced.forced_field import forced_field
    from ..cutting.forced.forced_vibration import unforced
    from ..cutting.forced.held_at_rest import held_if_many
    from ..cutting.process.cutting import Cutting
    from ..cutting.rest.chart_file import chart_data, write_lobes
    from ..report.sections import lobes_section, tools_section
    from .knocks import knocks_in_pocket, safe_from_knocks

    sizes = [A for A in amplitudes if A in road.charts]
    if not sizes:
        return
    charts = [road.charts[A] for A in sizes]
    speeds = charts[0].speed
    write_lobes(road.path("lobes.npz"), charts, speeds, sizes)
    road.json("lobes.json", chart_data(charts, speeds, sizes))
    road.steps.append({"step": "lobes", "minimum_depth": [c.minimum_depth for c in charts], "amplitude": sizes})
    pairs, cutting = list(zip(sizes, charts, strict=True)), Cutting(**(road.machine.cutting or {}))
    told = sorted({w for c in charts for w in c.warnings})
    road.doubts += [warning for warning in told if warning != HELD]
    road.warnings += [warning for warning in told if warning == HELD]
    road.doubts += road.near_pocket.values()
    missing = [A for A in amplitudes if A not in road.charts and A not in road.near_pocket]
    if missing:
        road.doubts.append(f"The limits at {_sizes(missing)} are not known.")
    forced = best = None
    if cutting.process == "milling" and cutting.feed is not None and (left := unforced(road.machine)):
        road.doubts.append(f"The vibration that the teeth force is {left}.")
    if amplitudes[0] in road.charts:
        with road.progress.step("looking for the best speed"):
            road.pocket = best = pocket(charts, cutting, limit_of(road.machine, sizes, charts[0].method))
        with road.progress.step("the vibration that the teeth force"):
            road.advice += advice(pairs, cutting, best, road.machine)
            shaken = held_if_many(road.machine, float(np.median(speeds)))[0]
            forced = forced_field(shaken, charts[0]) if sizes[0] == 0 else None
            road.doubts += [] if forced is None else forced.words()
        rest = road.charts.get(0.0)
        knocks, words = ({}, []) if rest is None else safe_from_knocks(road.machine, rest, KNOCKS_BUDGET, road.progress)
        road.advice += [f"{said[0].upper()}{said[1:]}." for said in words if knocks]
        if rest is not None:
            road.advice += knocks_in_pocket(road.machine, rest, best, KNOCKS_BUDGET, road.progress)[1]
        road.numbers += _figures(pairs, best, road.machine, knocks.get("safe_at_every_speed"))
    else:
        road.advice.append(f"No speed and depth are recommended: the limits at {_size(amplitudes[0])} are not known.")
    road.front.insert(0, lobes_section(pairs, cutting, best, forced))
    if road.tool_lobes:
        road.front.insert(1, tools_section(road.machine.tool_name, *_told(road)))


def _told(road: Run) -> tuple[list[tuple[str, StabilityLobes]], tuple[str, ...], list[tuple[str, ...]], list[str]]:
    """Charts of the tools by name, the header and rows of their table, and what is to be said of them."""
    from .each_tool import remarks_of, rows_of

    charts = [(tool.name, tool.chart) for tool in road.tool_lobes if tool.chart is not None]
    return charts, *rows_of(road.tool_lobes), remarks_of(road.tool_lobes, road.machine.tool_name)


def _test_cuts(road: Run, path: Path) -> None:
    """Hold test cuts against the machine. The joints that carry it stay as they are: mending is left to the verb."""
    from jointlib import read_measurement

    from ..cut_loop.trace_cuts import SAFE, trace_cuts
    from ..report.cuts_section import cuts_section

    test = read_measurement(path)
    with road.progress.step(f"weighing the machine by the cuts of {path.name}"):
        best = road.pocket
        found = trace_cuts(test, road.machine, asked=None if best is None else (best.speed, best.depth))
    name = path.name.removesuffix(".toml").removesuffix(".measurement")
    road.json(f"{name}.trace.json", found.as_json())
    road.tests.append(test)
    if found.verdict is Verdict.NOTHING_MISSING:
        road.advice += [found.sentence, found.next_words()]
    else:  # before what is recommended, which does not know of it
        road.advice[:0] = [found.sentence, found.next_words()]
        road.doubts.append("The test cuts contradict the machine file, from which this was computed.")
    if found.asked is not None and found.asked < SAFE and found.verdict is not Verdict.UNEXPLAINED:
        road.doubts.append(
            f"By the test cuts of {path.name} the recommended cut is stable with a probability of {found.asked:.3f}, "
            f"less than {SAFE:g}."
        )
    road.warnings += found.warnings
    road.front.append(cuts_section(found))
    next_cut = {"speed": found.next_cut.speed, "depth": found.next_cut.depth, "probability": found.next_cut.probability}
    road.steps.append({"step": "cuts", "of": path.name, "verdict": found.verdict.value, "next_cut": next_cut})


def _figures(
    charts: Sequence[tuple[float, StabilityLobes]],
    best: Pocket | None,
    machine: Machine,
    knocks: Mapping[str, float] | None = None,
) -> list[tuple[str, str]]:
    """Where to set the machine, the depth that is safe whatever the speed, and what would chatter there.

    Where something depends on amplitude, the depth is that below which ``knocks`` die out, or it is told up to which
    tool-point amplitude it is known.
    """
    from ..cutting.amplitude.amplitude_limits import depends_on_amplitude
    from ..cutting.amplitude.pocket import told_depth

    lowest = min((chart for _, chart in charts), key=lambda chart: chart.minimum_depth)
    said = [] if best is None else [("recommended", f"{told_depth(best.depth)} at {best.speed:.0f} rpm")]
    if not np.isfinite(lowest.minimum_depth):
        return said
    depth, of = lowest.minimum_depth, ""
    if knocks is not None and lowest.everywhere:
        depth, of = min(depth, knocks["depth"]), f", knocks of up to {knocks['amplitude'] * 1e6:.3g} µm included"
    elif depends_on_amplitude(machine):
        largest = max(A for A, _ in charts)
        of = f", vibrations beyond {largest * 1e6:g} µm left out" if largest else ", larger vibrations left out"
    where = "safe depth at every speed" if lowest.everywhere else "lowest depth at the speeds computed"
    said.append((where + of, told_depth(depth)))
    if depth == lowest.minimum_depth:
        said.append(("chatter that limits it", f"{lowest.minimum_frequency:.0f} Hz"))
    return said


STEP = Step("cutting", cutting_pieces, after=("coupling",))
