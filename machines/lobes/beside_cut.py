"""One cut beside the vibration of its own teeth, and what the limits over amplitude then say of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from ..machine import Machine
from .beside_forced import beside_forced
from .cutting import Cutting
from .forced_vibration import forced_vibration, too_many
from .machine_model import machine_model
from .multipliers import largest_multipliers
from .shaken_limits import SMALL, agreeing_limit, limits_beside, shakes
from .solve import stability_lobes
from .threshold import AmplitudeLimits, Cycle
from .unstable_depths import UnstableDepths, unstable_depths_of
from .words import moved_by_teeth, told, told_at

_PAST = 1.1


@dataclass(frozen=True, eq=False)
class BesideTeeth:
    """What chatter does at one speed and depth while the teeth shake the joints as they do there."""

    forced: float
    """Amplitude of the tool in m that the teeth force."""
    limits: AmplitudeLimits
    """Over amplitude at that speed, the joints shaken as at that depth."""
    unstable: UnstableDepths | None
    """Of the smallest vibrations, where it could be had."""
    multiplier: float
    """Largest |μ| of the smallest vibrations at that depth."""


def beside_teeth(machine: Machine, limits: AmplitudeLimits, index: int, depth: float) -> BesideTeeth | None:
    """The cut at one speed of ``limits`` at rest and a depth in m; None where it is not to be had."""
    if too_many(machine):
        return None
    speed = limits.speed[[index]]
    cutting = Cutting(**dict(machine.cutting or {}))
    try:
        forced = forced_vibration(machine, speed, depth)
        if not forced.settled[0]:
            return None
        moved = beside_forced(machine, forced)
        beside = limits_beside(moved, limits, index)
        if beside is None:
            return None
        chatter = float(beside.onset_frequency[0])
        if not np.isfinite(chatter):
            chatter = float(limits.onset_frequency[index])
        omega = 2 * np.pi * chatter
        gain = np.array([complex(joint.first_harmonic(SMALL, omega).gain) for joint in moved.joints()])
        model = machine_model(moved, chatter, gain)
        multiplier = float(largest_multipliers(model, cutting, speed, np.array([depth]))[0, 0])
        chart = stability_lobes(model, cutting, speed, "collocation")
    except (CheckFailed, InputError):
        return None
    try:
        (unstable,) = unstable_depths_of(model, cutting, chart, _PAST * depth)
    except (CheckFailed, InputError):
        unstable = None
    return BesideTeeth(float(forced.amplitude[0]), beside, unstable, multiplier)


def told_cuts(
    machine: Machine,
    limits: AmplitudeLimits,
    depth: Sequence[float] = (),
    unstable: Sequence[UnstableDepths | None] | None = None,
    growth: Array | None = None,
) -> tuple[list[str], list[list[tuple[Cycle, ...]]]]:
    """Sentences on each speed of limits over amplitude and on cuts of each ``depth`` (m) there; cycles [speed][depth].

    ``unstable`` are the unstable depths at rest and ``growth`` the multipliers at rest, (speed, depth), if known. Where
    the teeth shake joints that depend on amplitude, what is said of a cut holds beside that vibration.
    """
    shaking, said, later, cycles = shakes(machine), list[str](), list[str](), []
    for i in range(len(limits.speed)):
        said += _told_speed(machine, limits, i) if shaking else told(limits, i)
        row = list[tuple[Cycle, ...]]()
        for k, b in enumerate(depth):
            if not shaking:
                zones, mu = (None if unstable is None else unstable[i]), (None if growth is None else growth[i][k])
                later.append(told_at(limits, b, i, zones, None if mu is None else float(mu)))
                row.append(limits.cycles(b, i))
                continue
            cut = beside_teeth(machine, limits, i, b)
            if cut is None:
                later.append(moved_by_teeth(limits, b, i))
                row.append(())
                continue
            later.append(told_at(cut.limits, b, 0, cut.unstable, cut.multiplier, cut.forced))
            row.append(cut.limits.cycles(b))
        cycles.append(row)
    return said + later, cycles


def _told_speed(machine: Machine, limits: AmplitudeLimits, index: int) -> tuple[str, ...]:
    """What is said of a speed, beside the vibration of the teeth in the least cut that chatters so."""
    onset = float(limits.onset[index])
    depth = onset if np.isfinite(onset) else float(limits.safe[index])
    if not np.isfinite(depth):
        return told(limits, index)
    agreed = np.nan if too_many(machine) else agreeing_limit(machine, float(limits.speed[index]), 0.0, depth)
    depth = agreed if np.isfinite(agreed) and agreed > 0 else depth
    cut = beside_teeth(machine, limits, index, depth)
    return (moved_by_teeth(limits, depth, index),) if cut is None else told(cut.limits, 0, (depth, cut.forced))
