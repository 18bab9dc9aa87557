"""One cut beside the vibration of its own teeth, and what the limits over amplitude then say of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from ...model.machine import Machine
from ...model.spindle_speed import at_speed
from ...tool.machine_model import machine_model
from ..amplitude.amplitude_limits import AmplitudeLimits, Cycle
from ..amplitude.fate import SMALLEST, fate_at
from ..amplitude.unstable_depths import DEEPER, UnstableDepths, unstable_depths_of
from ..amplitude.words import moved_by_teeth, of_fate, reach_words, told
from ..cutters.settled_multipliers import settled_multipliers
from ..in_time.confirmation import in_time
from ..process.cutting import Cutting
from ..rest.solve import stability_lobes
from .beside_forced import beside_forced
from .forced_vibration import forced_vibration, too_many
from .shaken_limits import SMALL, agreeing_limit, limits_beside, shakes

_BELOW, _ABOVE = 0.97, 1.03
"""Shares of the safe depth and of the onset at which the cut is simulated."""


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
    machine = at_speed(machine, float(speed[0]))
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
        multiplier = float(settled_multipliers(model, cutting, speed, np.array([depth]))[0, 0])
        chart = stability_lobes(model, cutting, speed, "collocation")
    except (CheckFailed, InputError):
        return None
    try:
        (unstable,) = unstable_depths_of(model, cutting, chart, DEEPER * depth)
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
    the teeth shake joints that depend on amplitude, what is said of a cut holds beside that vibration. All of it is
    held against the cut in time, which has the last word.
    """
    shaking, said, later, cycles = shakes(machine), list[str](), list[str](), []
    for i in range(len(limits.speed)):
        said += _told_speed(machine, limits, i) if shaking else _stands(machine, limits, i, told(limits, i))
        row = list[tuple[Cycle, ...]]()
        for k, b in enumerate(depth):
            cut = beside_teeth(machine, limits, i, b) if shaking else None
            if cut is not None:
                fate = fate_at(cut.limits, b, 0, cut.unstable, cut.multiplier)
                sentence = of_fate(fate, reach_words(cut.limits), cut.forced)
            elif shaking:
                fate = replace(fate_at(limits, b, i), cycles=())
                sentence = moved_by_teeth(limits, b, i)
            else:
                zones, mu = (None if unstable is None else unstable[i]), (None if growth is None else growth[i][k])
                fate = fate_at(limits, b, i, zones, None if mu is None or np.isnan(mu) else float(mu))
                sentence = of_fate(fate, reach_words(limits, i))
            found = in_time(machine, fate, doubted=shaking and cut is None)
            later.append(sentence if found is None else str(found))
            row.append(() if fate.above else fate.cycles if found is None else found.cycles)
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
    if cut is None:
        return (moved_by_teeth(limits, depth, index),)
    return _stands(machine, cut.limits, 0, told(cut.limits, 0, (depth, cut.forced)))


def _stands(machine: Machine, limits: AmplitudeLimits, index: int, said: tuple[str, ...]) -> tuple[str, ...]:
    """What is said of a speed, or what the cut in time has instead: just below the safe depth, and above the onset."""
    low, high = limits.safe_up_to(float(limits.known[index]), index), float(limits.onset[index])
    for depth in (_BELOW * low, _ABOVE * high):
        if not np.isfinite(depth):
            continue
        fate = fate_at(limits, depth, index)
        found = in_time(machine, fate if depth < low else replace(fate, cycles=(), reach=SMALLEST * fate.reach))
        if found is not None:
            return (f"At {fate.speed:g} rpm limits over amplitude do not hold in time. {found}",)
    return said
