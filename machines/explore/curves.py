"""What is drawn of one setting: receptance, describing functions, lobes, and which of them first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError

from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.amplitude.pocket import Limit, best_pocket, limit_of
from ..cutting.process.chart import Integers, StabilityLobes, Words
from ..cutting.rest.solve import stability_lobes
from ..cutting.rest.together import preview
from ..model.limits import beyond_frequency
from ..model.machine import Machine
from ..model.spindle_speed import depends_on_speed
from ..modes.mode_energy import mode_energies
from ..modes.natural_modes import natural_modes
from .built import Built, Moment

SPEEDS = 200
"""Speeds of a chart, as many as `jointlib lobes` draws."""
_OWN_SPEEDS = 40
"""Where every speed has its own machine."""
_GAINS = 120
_FEW_MODES = 12
_PREVIEW = (
    "Lobes by the zero-order approximation, a preview; a click and the report take the method of `jointlib lobes`."
)
_NO_LOBES = "The file has no [cutting] with a range of speeds, so there are no lobes."


@dataclass(frozen=True, eq=False)
class Curves:
    """What is drawn of one setting."""

    frequency: Array
    """Hz."""
    receptance: Mapping[str, ComplexArray]
    """Direct receptance of the tool point in m/N with the joints frozen at the chosen amplitude of it, by axis."""
    receptance_at_rest: Mapping[str, ComplexArray]
    """The same for small motion."""
    amplitude: Array
    """Of a joint in m."""
    gains: Mapping[str, ComplexArray]
    """Describing function in N/m over `amplitude`, by connection; of a bundle one row."""
    gain_frequency: float
    """Hz; the chatter frequency at the minimum depth, or the highest peak where there are no lobes."""
    present: Mapping[str, float]
    """Amplitude in m of the joints at `gain_frequency` and the chosen tool-point amplitude; empty at rest."""
    limit: Mapping[str, float]
    """Largest amplitude in m at which the law of a connection is known; inf where nothing is said of it."""
    speed: Array
    """rpm; empty without a cut."""
    depth: Array
    """m; inf where the cut is stable at any depth."""
    sure: Array
    """m; the depth, no larger than what is known of the tool bears out."""
    chatter_frequency: Array
    kind: Words
    lobe: Integers
    method: str
    notes: tuple[str, ...]


def drawn(moment: Moment, places: Mapping[str, str], largest: float, exact: bool) -> Curves:
    """The curves of a moment; ``places`` tells the place of every connection.

    ``largest`` is an amplitude in m for joints of which no range is known. Lobes come from the fast method of the
    process, or where ``exact`` from that of `jointlib lobes`.
    """
    built, A, cutting = moment.built, moment.amplitude, moment.cutting
    notes: list[str] = []
    moving = built.moving(A, cutting)
    chart: StabilityLobes | None = None
    if cutting is None or cutting.speed is None:
        notes.append(_NO_LOBES)
    elif exact:
        moment.refuse_slow(cutting.speed[0])
        chart = lobes_at_amplitude(moment.machine, cutting.speeds(SPEEDS), A)
    elif depends_on_speed(moment.machine):
        chart = lobes_at_amplitude(moment.machine, cutting.speeds(_OWN_SPEEDS), A, preview(cutting.process))
        notes.append(f"The spindle depends on its speed: {_OWN_SPEEDS} speeds, by {chart.method}.")
    else:
        chart = built.quick_lobes(cutting.speeds(SPEEDS), A, cutting, moving)
        notes += [_PREVIEW, *_beside(moment, chart)] if chart.method == "zero-order" else []
    notes += [*(chart.warnings if chart is not None else ()), *beyond_frequency(moment.machine, *built.band)]
    frequency = chart.minimum_frequency if chart is not None else np.nan
    if not np.isfinite(frequency):
        frequency = float(moving.frequency[np.argmax(np.abs(moving.receptance[:, 0, 0]))])
    joints, held = built.joints_at(frequency, A, cutting)
    if held:
        notes.append(f"At {frequency:.4g} Hz a joint is held at its limit: {held}")
    known = [limit for limit in built.limits.values() if np.isfinite(limit)]
    size = 1.5 * max([*known, *joints.values()] or [largest]) * np.geomspace(1e-3, 1.0, _GAINS)
    gains = built.gains(places, size, frequency)
    none = np.zeros(0)
    return Curves(
        frequency=built.lines,
        receptance=_direct(built, moving.receptance),
        receptance_at_rest=_direct(built, built.rest.receptance),
        amplitude=size,
        gains=gains,
        gain_frequency=frequency,
        present={name: joints[name] for name in gains if name in joints},
        limit={name: built.limits[name] for name in gains},
        speed=none if chart is None else chart.speed,
        depth=none if chart is None else chart.depth,
        sure=none if chart is None else chart.sure,
        chatter_frequency=none if chart is None else chart.chatter_frequency,
        kind=np.zeros(0, dtype="<U4") if chart is None else chart.kind,
        lobe=np.zeros(0, dtype=np.int64) if chart is None else chart.lobe,
        method="" if chart is None else chart.method,
        notes=tuple(dict.fromkeys(notes)),
    )


def limit(moment: Moment, method: str) -> Limit:
    """The limit at any speeds by the ``method`` of the curves of a moment."""
    built, A, cutting = moment.built, moment.amplitude, moment.cutting
    if cutting is None or method != preview(cutting.process) or depends_on_speed(moment.machine):
        return limit_of(moment.machine, [A], method)
    moving = built.moving(A, cutting)
    return lambda speeds: built.quick_lobes(speeds, A, cutting, moving).sure


def _beside(moment: Moment, quick: StabilityLobes) -> list[str]:
    """What the method of `jointlib lobes` has where one would cut after the preview.

    At rest and with few modes only, where that is as quick as the rest.
    """
    model, cutting = moment.built.model, moment.cutting
    best = None if cutting is None else best_pocket(quick.speed, quick.sure, cutting, limit(moment, quick.method))
    if moment.amplitude or model is None or len(model.poles) > _FEW_MODES or cutting is None or best is None:
        return []
    try:
        moment.refuse_slow(best.speed)
        exact = stability_lobes(model, cutting, best.speed)
    except CheckFailed as failed:
        return [str(failed)]
    found = f"{float(exact.depth) * 1e3:.3g} mm" if np.isfinite(exact.depth) else "no limit"
    return [f"At {best.speed:.0f} rpm the preview has {best.limit * 1e3:.3g} mm, {exact.method} {found}."]


def _direct(built: Built, receptance: ComplexArray) -> dict[str, ComplexArray]:
    return {axis: receptance[:, i, i] for i, axis in enumerate(built.machine.tool_axes)}


def leading(machine: Machine, places: Mapping[str, str], curves: Curves) -> str | None:
    """Of the joints in `Curves.gains` that with most energy in the mode that the tool feels most; None without one.

    Of a bundle and of joints that are alike, ``places`` by connection, the whole counts.
    """
    try:
        modes = natural_modes(machine)
    except InputError:  # a part is known by its receptance only
        return next(iter(curves.gains), None)
    share: dict[str, float] = dict.fromkeys(places.values(), 0.0)
    if len(modes.pole):
        strain = mode_energies(modes).strain[:, int(np.argmax(modes.tool_peak))]
        for connection, held in zip(machine.flexible, strain.tolist(), strict=True):
            share[places[connection.name]] += held
    return max(curves.gains, key=lambda name: share[places[name]], default=None)
