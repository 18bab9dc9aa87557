"""The coupled machine of a run: where it stands, checked against python-control, forced at every level."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.shown.progress import Inside

from ..deadline import OutOfTime, within
from .piece import BUDGET, Piece, Step, open_joints

if TYPE_CHECKING:
    from .. import Machine
    from .run import Run


def coupling_pieces(machine: Machine, amplitudes: Sequence[float] = ()) -> list[Piece]:
    """What is computed of the assembled machine before it cuts."""
    pieces, needs = list[Piece](), open_joints(machine)
    if machine.static is not None:
        pieces.append(
            Piece(
                "static",
                "Static working point",
                _stand,
                "Less load, or a joint that carries it: see [static] in the machine file.",
                needs=needs,
            )
        )
    if not machine.without_equations:
        pieces.append(
            Piece(
                "check",
                "Check against python-control",
                _check,
                f"`jointlib check {machine.source}` repeats it alone.",
                needs=needs,
            )
        )
    pieces.append(
        Piece(
            "frf",
            "Forced response",
            _force,
            f"`jointlib frf {machine.source} -o frf.npz` repeats it alone; less `--force` or a narrower `--frequency` "
            "asks for less.",
            needs=needs,
        )
    )
    if machine.compare:
        files = " ".join(str(path) for path in machine.compare)
        remedy = f"`jointlib inspect` tells what the measurement holds: {files}."
        pieces.append(Piece("compare", "Measured over predicted", _lay_over, remedy, needs=needs))
    return pieces


_SEARCHED = 0.8
"""Share of the time of the forced response for its peaks and jumps; the rest is for lines alone where that is over."""
_OVERTONES = 60.0
"""Seconds for further harmonics where joints remember; where they do not suffice the error of one harmonic is said."""
_OFF = 0.05
"""Share by which the lowest depth must be off from that with the measured tool point to be a doubt."""


def _lay_over(road: Run) -> None:
    from jointlib import read_measurement

    from ..compare.over_measured import over_measured
    from ..report.comparison_section import comparison_section

    with road.progress.step("laying measured frequency responses over the prediction"):
        laid, data = over_measured(road.machine, road.machine.compare)
    road.json("compare.json", data)
    road.tests += [read_measurement(path) for path in road.machine.compare]
    sentence = (data.get("depth") or {}).get("sentence")
    road.steps.append({"step": "compare", "frac": {c.record.name: c.frac for c in laid}})
    depth = data.get("depth") or {}
    doubted = bool(sentence) and not np.isclose(depth["predicted"], depth["measured"], rtol=_OFF, atol=0.0)
    road.said += [*([sentence] if sentence and not doubted else []), *(c.sentence() for c in laid)]
    road.doubts += [sentence] if sentence and doubted else []
    road.warnings += [warning for c in laid for warning in c.warnings]
    road.front.append(comparison_section(laid, sentence))


def _stand(road: Run) -> None:
    from ..report.working_point import working_point

    step, section = working_point(road.machine)
    road.steps.append(step)
    road.sections.append(section)


def _check(road: Run) -> None:
    from jointlib.io.atomic import write_npz

    from ..harmonic_balance.linear_check import linear_check
    from ..report.sections import check_section

    with road.progress.step("checking the coupled machine against python-control"):
        check = linear_check(road.machine)
    road.check = check
    excluded = [{"connection": e.connection, "law": e.law, "reason": e.reason} for e in check.excluded]
    size = check.max_relative_difference
    data = {"max_relative_difference": size, "passed": check.passed, "excluded": excluded}
    road.json("check.json", data)
    curves = {"coupled": check.coupled.receptance, "control": check.control.receptance}
    write_npz(road.path("check.npz"), {"frequency": check.frequency, **curves})
    road.steps.append({"step": "check", **data})
    road.sections.append(check_section(check))
    road.said.append(f"check against python-control: {size:.2g} in norm, {'passed' if check.passed else 'FAILED'}")
    if not check.passed:
        road.failed.append("receptance coupling and python-control differ")


def _force(road: Run) -> None:
    if not road.machine.force:
        road.warnings.append("There is no forced response: [response] gives no force.")
        return
    from ..forced_response.each_drive import drives_of, on_lines, peak_rows, responses
    from ..forced_response.response_file import write_response
    from ..report.sections import response_section

    # Every step of a cycle that is sampled costs: where joints remember, one harmonic stays if more take too long.
    remembering = any(joint.states for joint in road.machine.joints())
    machine, late, searched = road.machine, "", 0
    drives, results = drives_of(machine, None), list[Any]()
    with road.progress.step(f"forced response at each force, in at most {BUDGET / 60:g} minutes"):
        try:
            with within(_SEARCHED * BUDGET):
                with (
                    suppress(OutOfTime) if remembering else nullcontext(),
                    within(_OVERTONES if remembering else BUDGET),
                ):
                    results.extend(responses(machine, None, progress=Inside(), harmonics="auto", stability="auto"))
                for drive in drives[len(results) :]:
                    results.extend(responses(machine, drive, progress=Inside(), stability="auto"))
        except OutOfTime as error:
            late, searched = str(error), len(results)
            with suppress(OutOfTime) if results else nullcontext():
                results.extend(on_lines(machine, drive) for drive in drives[searched:])
    road.responses = results
    result = results[0]
    write_response(road.path("frf.npz"), results)
    road.json("frf.json", {**peak_rows(results), "file": "frf.npz"})
    outcomes = {f"{f:g} N": o.name.lower() for f, o in zip(result.force, result.outcomes, strict=True)}
    road.steps.append({"step": "frf", "outcomes": outcomes})
    short = [(f, o.value) for f, o in zip(result.force, result.outcomes, strict=True) if o.value]
    told = [*result.warnings, *(f"Forced response at {f:g} N: {why}" for f, why in short)]
    road.warnings += told
    reached = result.deflected
    if reached and road.machine.cutting is None:
        top = max(reached, key=lambda p: p.amplitude)
        unit = "µrad" if top.connection in result.turned else "µm"
        road.advice.append(
            f"At {top.force:g} N the joint {top.connection} moves by up to {top.amplitude * 1e6:.3g} {unit}, "
            f"at {top.frequency:.5g} Hz."
        )
        road.numbers.append((f"motion of {top.connection}", f"{top.amplitude * 1e6:.3g} {unit}"))
        road.doubts += told
    axes = {dof: axis for axis, dof in machine.tool.items()}
    road.front.append(response_section(results, axes))
    for k, drive in enumerate(drives[searched:] if late else [], start=searched):
        dof = machine.driven_dof(drive)
        along = f"forced response along {axes.get(dof, dof)}"
        again = f"`jointlib frf {machine.source} --drive {shlex.quote(dof)} -o frf.npz` computes it alone."
        if k < len(results):
            count = len(results[k].frfs[0].frequency)
            late_here = f"{late}; it is known on {count} lines, and may be higher between them"
            road.lost(Piece("frf", f"Peaks and jumps of the {along}", _force, again, dof), late_here)
        else:
            road.lost(Piece("frf", f"F{along[1:]}", _force, again, dof), late)


STEP = Step("coupling", coupling_pieces, after=("picture",))
