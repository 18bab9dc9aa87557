"""The vibration of the teeth over a chart of speed and depth, and what it does to the limits there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from ...harmonic_balance.assembly import is_linear
from ...model.machine import Machine
from ...model.spindle_speed import at_speed
from ...statics.working_point import tangents
from ...tool.machine_model import machine_model
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from ..rest.solve import stability_lobes
from .beside_forced import BesideForced, beside_forced
from .forced_vibration import ForcedVibration, forced_vibration, too_many
from .shaken_limits import SMALL
from .surface_error import surface_errors, worst_error

_MOST = 25
"""Speeds at which joints that depend on amplitude are balanced."""
_DEPTHS = (0.15, 0.4, 0.7, 1.0)
_UNMOVED = 1e-4
_MATTERS = 0.01


@dataclass(frozen=True, eq=False)
class ForcedField:
    """Half the peak-to-peak of the tool, and limits with the joints as the teeth shake them."""

    speed: Array
    """rpm, (n,), ascending."""
    depth: Array
    """m, (m,), ascending."""
    amplitude: Array
    """m, (n, m); nan where motion and joints do not agree."""
    rest: Array
    """Limits in m with the joints at rest, (n,)."""
    limit: Array
    """Limits in m of the smallest vibration, the joints as shaken at the limits at rest; nan where not known."""
    surface_error: Array
    """m by which the finished wall stands off at its worst, (n, m), see `surface_errors`; nan where not known."""

    @property
    def change(self) -> Array:
        """Share by which the limits change, (n,); nan where not known, or where nothing chatters."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.limit / self.rest - 1)

    def words(self) -> list[str]:
        """By how much, where that matters."""
        change, lost = np.nan_to_num(self.change), int(np.count_nonzero(np.isnan(self.limit)))
        moved, said = int(np.count_nonzero(np.abs(change) > _MATTERS)), []
        if moved:
            ends = {k: float(change[k]) for k in (int(np.argmin(change)), int(np.argmax(change)))}
            most = " and ".join(
                f"by {100 * by:+.0f} % at {self.speed[k]:.0f} rpm" for k, by in ends.items() if abs(by) > _MATTERS
            )
            said.append(
                f"The tooth-passing vibration shakes the joints: at {moved} of {len(change)} speeds that moves the "
                f"onset of chatter by more than {100 * _MATTERS:g} %, most {most}."
            )
        if lost:
            said.append(f"At {lost} of {len(change)} speeds what it does to the onset is not known.")
        return said


def forced_field(machine: Machine, chart: StabilityLobes, depth: Array | None = None) -> ForcedField | None:
    """Over the speeds of a chart at rest (at most 25 of them where joints depend on amplitude) and depths in m.

    Without depths: four up to the highest limit, or six times the middle one. None without a feed, outside milling,
    and where the forced motion cannot be computed at all.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    if cutting.process != "milling" or cutting.feed is None or too_many(machine):
        return None
    nonlinear = not all(map(is_linear, machine.joints()))
    order = np.argsort(chart.speed.ravel(), kind="stable")
    if nonlinear and len(order) > _MOST:
        order = order[np.unique(np.linspace(0, len(order) - 1, _MOST).round().astype(int))]
    speed, rest, chatter = (part.ravel()[order] for part in (chart.speed, chart.depth, chart.chatter_frequency))
    finite = rest[np.isfinite(rest)]
    if depth is None:
        deepest = min(float(np.max(finite)), 6 * float(np.median(finite))) if len(finite) else 1e-3
        depth = deepest * np.array(_DEPTHS)
    try:
        found = forced_vibration(machine, speed[:, None], depth)
    except (CheckFailed, InputError):
        return None
    amplitude = np.where(found.settled, found.amplitude, np.nan).reshape(len(speed), len(depth))
    limit = _shaken(machine, cutting, speed, rest, chatter) if nonlinear else rest
    walls = worst_error(surface_errors(cutting, found)).reshape(amplitude.shape)
    return ForcedField(speed, depth, amplitude, rest, limit, np.where(np.isnan(amplitude), np.nan, walls))


def _shaken(machine: Machine, cutting: Cutting, speed: Array, rest: Array, chatter: Array) -> Array:
    """The limits in m at speeds (rpm) with the gains that the chatter line (Hz) sees at the limits at rest (m)."""
    limit, ends = rest.copy(), np.flatnonzero(np.isfinite(rest))
    forced = forced_vibration(machine, speed[ends], rest[ends])
    for i, at in enumerate(ends):
        turning = at_speed(machine, float(speed[at]))
        limit[at] = _limit(turning, cutting, forced.at(i), float(rest[at]), float(chatter[at]))
    return limit


def _limit(machine: Machine, cutting: Cutting, forced: ForcedVibration, rest: float, chatter: float) -> float:
    """The limit in m of one cut."""
    if not forced.settled[0]:
        return np.nan
    gain = tangents(machine, chatter)
    before, omega = gain.copy(), np.array(2 * np.pi * chatter)
    for i, joint in enumerate(beside_forced(machine, forced).joints()):
        if shaken := [law for law in joint.laws if isinstance(law, BesideForced)]:
            steady = sum(complex(law.first_harmonic(0.0, omega).gain) for law in joint.laws if law.linear)
            gain[0, i] = steady + complex(shaken[0].gains(np.array(SMALL), omega))
    if np.all(np.abs(gain - before) <= _UNMOVED * np.abs(before)):
        return rest
    try:
        model = machine_model(machine, chatter, gain[0])
        return float(stability_lobes(model, cutting, [float(forced.speed[0])], "collocation").depth[0])
    except (CheckFailed, InputError):
        return np.nan
