"""Lobes of a machine whose joints depend on amplitude: the depth at which a vibration of given size just persists."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError, Outcome
from jointlib.system.processes import on_every_core

from ...harmonic_balance.assembly import Assembly
from ...indices import Mask
from ...model.limits import beyond_frequency
from ...model.machine import Machine
from ...model.spindle_speed import at_speed, beyond_speeds, depends_on_speed
from ...operating.operating_point import OperatingPoint
from ...tool.at_rest import kept_tool
from ...tool.chatter_band import ChatterBand, chatter_band
from ..process.chart import BY_SPEED, StabilityLobes, joined
from ..process.cutting import Cutting
from ..rest.solve import spindle_speeds, stability_lobes
from .chattering_tool import LINES, on_lines, operating_receptance, wide_receptance
from .collocated_turning import collocated_turning
from .milling_at_amplitude import developed_lobes
from .rubbed_lobes import rubbed_lobes

_LINE_BY_LINE = (
    "Joints are held, on every line, as they are if the tool vibrated on it alone with this amplitude; with equal "
    "pitches and no helix they are held as the chatter line has them."
)

_OWN_SPEED = "Every speed is computed with the machine as it is at that speed."
_table = lru_cache(maxsize=4)(wide_receptance)
"""For those who ask for a few amplitudes speed by speed."""


def lobes_at_amplitude(
    machine: Machine, speed: ArrayLike, amplitude: float = 0.0, method: str | None = None, points: int = LINES
) -> StabilityLobes:
    """Stability lobes of a machine while its tool point vibrates with ``amplitude`` (m, the larger of x and y).

    Every joint is frozen at the describing-function gain it has at that amplitude, G(ω; A) is the receptance that
    follows, and b_lim(rpm, A) is computed from it: the depth at which a chatter line of that size neither grows nor
    dies. Amplitude 0 is the onset from rest. In milling see `DevelopedChatter`; by the zero-order approximation the
    vibration is, at each frequency, that of the eigenvector that chatters first.

    Parameters
    ----------
    machine
        With a tool point, a cutting operation and a frequency range; every connection must have its joint.
    speed
        Spindle speeds in rpm, any shape.
    amplitude
        m, peak.
    method
        As in `stability_lobes`.
    points
        Lines to begin with; more are added where the receptance bends.
    """
    if amplitude > 0 and (machine.cutting or {}).get("wear_land") is not None:
        return rubbed_lobes(
            machine, speed, amplitude, lambda rubbed, rpm: frozen_lobes(rubbed, rpm, amplitude, method, points)[0]
        )
    return frozen_lobes(machine, speed, amplitude, method, points)[0]


def frozen_lobes(
    machine: Machine,
    speed: ArrayLike,
    amplitude: float = 0.0,
    method: str | None = None,
    points: int = LINES,
    deepest: float = np.inf,
) -> tuple[StabilityLobes, Mask]:
    """`lobes_at_amplitude`, and per speed whether a joint is held at its limit at the chatter frequency.

    Of turning depths of up to ``deepest`` (m) alone may be asked for: lines that are far from it are not refined.
    """
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
    if depends_on_speed(machine):
        return _each_at_its_own(machine, spindle_speeds(speed), amplitude, method, points)
    return _frozen(machine, speed, amplitude, method, points, deepest)


def _each_at_its_own(
    machine: Machine, speed: Array, amplitude: float, method: str | None, points: int
) -> tuple[StabilityLobes, Mask]:
    """Every speed with the machine as it is at that speed; one method for all of them, that of the first."""

    def at(rpm: float, method: str | None) -> tuple[StabilityLobes, Mask]:
        own = at_speed(machine, rpm)
        chart, stuck = _frozen(own, [rpm], amplitude, method, points)
        band = chatter_band(own).said
        return replace(chart, warnings=tuple(said for said in chart.warnings if said not in band)), stuck

    first, *further = speed.ravel().tolist()
    found = [at(first, method)]
    found += on_every_core(partial(at, method=method or found[0][0].method), further, len(further))
    charts, held = [chart for chart, _ in found], [stuck for _, stuck in found]
    whole, back = joined(charts), np.argsort(np.argsort(speed.ravel(), kind="stable"))
    shaped = {key: getattr(whole, key)[back].reshape(speed.shape) for key in BY_SPEED}
    lowest = charts[int(np.argmin([chart.depth[0] for chart in charts]))]
    outcomes = [chart.outcome for chart in charts if chart.outcome is not Outcome.CONVERGED]
    whole = replace(
        whole,
        **shaped,
        branches=(),
        notes=(_OWN_SPEED, *whole.notes),
        warnings=(*whole.warnings, *_band(machine), *beyond_speeds(machine, speed)),
        minimum_depth=float(lowest.depth[0]),
        minimum_frequency=float(lowest.chatter_frequency[0]),
        minimum_phase=float(60 * lowest.chatter_frequency[0] / (whole.cuts_per_revolution * lowest.speed[0]) % 1),
        outcome=outcomes[0] if outcomes else Outcome.CONVERGED,
    )
    return whole, np.concatenate(held).reshape(speed.shape)


def _band(machine: Machine) -> tuple[str, ...]:
    """What is to be said of the frequencies over which the machine was searched, at the lowest speed of its cut."""
    lowest = (machine.cutting or {}).get("speed", (0.0,))[0]
    return tuple(
        f"{said.removesuffix('.')}, at {lowest:g} rpm." for said in chatter_band(at_speed(machine, lowest)).said
    )


def _frozen(
    machine: Machine, speed: ArrayLike, amplitude: float, method: str | None, points: int, deepest: float = np.inf
) -> tuple[StabilityLobes, Mask]:
    """The chart of a machine that is one at all speeds."""
    assert machine.cutting is not None
    axes = machine.tool_axes
    cutting = Cutting(**machine.cutting)
    if cutting.process != "milling" and not cutting.feed_direction and "x" not in axes:
        raise InputError(f"{machine.where}: [tool] has no x, the direction of the chip thickness in turning")
    if amplitude > 0 and not Assembly(machine, (), ()).nonlinear:
        amplitude = 0.0
    band = chatter_band(machine)
    if amplitude == 0 and band.undamped is not None:
        raise InputError(f"{machine.where}: {band.undamped}")
    exact = band.model if amplitude == 0 else None
    if method == "collocation" and exact is None and cutting.process != "milling":
        turned = _frozen(machine, speed, amplitude, "turning", points)[0]
        chart = collocated_turning(machine, cutting, turned, amplitude)
        return chart, _held(machine, cutting, chart, amplitude)
    if (
        cutting.process == "milling"
        and (cutting.plain or method == "collocation")
        and method != "zero-order"
        and (amplitude > 0 or (method == "collocation" and exact is None))
    ):
        table = _table(machine, amplitude, points)
        chart, held = developed_lobes(machine, cutting, speed, amplitude, method, table)
        return _within(chart, machine, band), held
    if amplitude == 0:
        chart = stability_lobes(kept_tool(machine), cutting, speed, method)
        return _within(chart, machine, band), np.zeros(chart.depth.shape, dtype=bool)
    point = operating_receptance(machine, amplitude, points, deepest=deepest)
    chart = stability_lobes(point.frf, cutting, speed, method, axes=axes)
    said = (*_limits(point, chart), *([] if cutting.plain or cutting.process != "milling" else [_LINE_BY_LINE]))
    chart = _within(replace(chart, warnings=chart.warnings + said), machine, band)
    limited = np.array([outcome is not Outcome.CONVERGED for outcome in point.outcomes])
    return chart, _chattering_on(limited, point.frf.frequency, chart.chatter_frequency)


def _within(chart: StabilityLobes, machine: Machine, band: ChatterBand) -> StabilityLobes:
    """The chart with what is to be said of the frequencies over which the machine was searched."""
    said = chart.warnings + band.said + beyond_frequency(machine, band.low, band.high)
    return replace(chart, warnings=said, known_to=None if band.whole else band.high)


def _limits(point: OperatingPoint, chart: StabilityLobes) -> tuple[str, ...]:
    """A sentence for every limit that a joint met where the chart chatters, with how much of it that touches."""
    said = []
    lines = point.frf.frequency
    for outcome, count in Counter(o for o in point.outcomes if o is not Outcome.CONVERGED).items():
        limited = np.array([o is outcome for o in point.outcomes])
        touched = int(np.count_nonzero(_chattering_on(limited, lines, chart.chatter_frequency)))
        if not touched:
            continue
        said.append(
            f"On {count} of {len(lines)} lines, {lines[limited][0]:.0f} to {lines[limited][-1]:.0f} Hz, a joint "
            f"is held at its limit ({outcome.value}); {touched} of {chart.depth.size} speeds chatter there."
        )
    return tuple(said)


def _held(machine: Machine, cutting: Cutting, chart: StabilityLobes, amplitude: float) -> Mask:
    """Per speed, whether a joint is held at its limit while the tool chatters with an amplitude in m."""
    chatter = np.unique(chart.chatter_frequency[np.isfinite(chart.chatter_frequency)])
    if amplitude == 0 or not len(chatter):
        return np.zeros(chart.depth.shape, dtype=bool)
    point = on_lines(machine, cutting, chatter, amplitude)
    limited = np.array([outcome is not Outcome.CONVERGED for outcome in point.outcomes])
    return _chattering_on(limited, chatter, chart.chatter_frequency)


def _chattering_on(chosen: Mask, lines: Array, chatter: Array) -> Mask:
    """Whether the line at or above each chatter frequency is one of the chosen; false where nothing chatters."""
    at = np.clip(np.searchsorted(lines, np.nan_to_num(chatter)), 0, len(lines) - 1)
    return np.asarray(np.isfinite(chatter) & chosen[at])
