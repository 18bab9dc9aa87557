"""Limits of a cut whose own teeth shake the joints: depth and forced motion agree.

The forced motion grows with the depth, and the joints that it shakes set the depth that chatters. At a depth b a
vibration of amplitude A dies out while b < b_lim(A | forced motion at b), with the joints as `BesideForced` has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.errors import CheckFailed, InputError

from ...harmonic_balance.assembly import is_linear
from ...model.machine import Machine
from ...model.spindle_speed import at_speed
from ..amplitude.amplitude_limits import AmplitudeLimits, amplitude_limits
from ..amplitude.frozen_lobes import lobes_at_amplitude
from ..process.cutting import Cutting
from .beside_forced import beside_forced
from .forced_vibration import ForcedVibration, forced_vibration, too_many

SMALL = 1e-8
"""m; a chatter so small that it changes nothing."""
_STEP, _ROUNDS = 1.3, 8
_SIZES = 8
_CLOSE = 5e-3
_SAME = 0.01


def shakes(machine: Machine) -> bool:
    """Whether the teeth shake something that depends on amplitude: milling with a feed, and a nonlinear joint."""
    cutting = Cutting(**dict(machine.cutting or {}))
    return cutting.process == "milling" and cutting.feed is not None and not all(map(is_linear, machine.joints()))


def shaken_limit(machine: Machine, speed: float, depth: float, amplitude: float = 0.0) -> float:
    """b_lim in m at a speed (rpm) and a vibration (m), with the joints as the teeth shake them at a depth in m.

    nan where the forced motion, or the limit beside it, is not to be had.
    """
    try:
        machine = at_speed(machine, speed)
        forced = forced_vibration(machine, speed, depth)
        if not forced.settled[0]:
            return np.nan
        shaken = beside_forced(machine, forced)
        return float(lobes_at_amplitude(shaken, [speed], max(amplitude, SMALL), "collocation").depth[0])
    except (CheckFailed, InputError):
        return np.nan


def agreeing_limit(machine: Machine, speed: float, amplitude: float, start: float) -> float:
    """The lowest depth in m at which a vibration of that amplitude (m) persists beside the forced motion there.

    Looked for from ``start``, the limit without forced motion, downwards while the vibration persists and else upwards
    up to some eight times that; inf where none is met, nan where the forced motion is not known.
    """
    if not np.isfinite(start):
        return np.nan

    def excess(depth: float) -> float:
        limit = shaken_limit(machine, speed, depth, amplitude)
        return float(np.log(limit / depth))

    low = high = start
    first = at_low = at_high = excess(start)
    for _ in range(_ROUNDS):
        if not np.isfinite(at_low) or not np.isfinite(at_high) or at_low * at_high <= 0:
            break
        if first < 0:
            high, at_high = low, at_low
            low /= _STEP
            at_low = excess(low)
        else:
            low, at_low = high, at_high
            # The limit itself is the next depth to try, where it is not far.
            high *= float(np.clip(np.exp(at_high), 1.02, _STEP))
            at_high = excess(high)
    if np.isnan(at_low) or np.isnan(at_high):
        return np.nan
    if at_low * at_high > 0:
        return np.inf if first > 0 else 0.0
    for _ in range(_ROUNDS):
        if high / low - 1 < _CLOSE or at_low == at_high:
            break
        share = float(np.clip(at_low / (at_low - at_high), 0.1, 0.9))
        middle = low * (high / low) ** share
        value = excess(middle)
        if not np.isfinite(value):
            return np.nan
        if value * at_low > 0:
            low, at_low = middle, value
        else:
            high, at_high = middle, value
        if abs(value) < _CLOSE:
            return float(middle)
    return low if first > 0 else high


def limits_beside(moved: Machine, limits: AmplitudeLimits, index: int) -> AmplitudeLimits | None:
    """Limits over amplitude at one speed of ``limits``, of a machine whose joints the teeth shake (`beside_forced`).

    None where they are not to be had.
    """
    sizes = limits.amplitude[limits.amplitude <= limits.largest[index]]
    if not len(sizes):
        return None
    try:
        few = np.geomspace(sizes[0], sizes[-1], _SIZES)
        return amplitude_limits(moved, limits.speed[[index]], few, "collocation", rounds=1)
    except (CheckFailed, InputError):
        return None


@dataclass(frozen=True, eq=False)
class SteadyCut:
    """What a stable cut does at one speed (rpm) and depth (m): the vibration of its teeth, and what that changes."""

    machine: Machine
    speed: float
    depth: float

    @cached_property
    def forced(self) -> ForcedVibration:
        """The one cut."""
        return forced_vibration(self.machine, self.speed, self.depth)

    @cached_property
    def limit(self) -> tuple[float, float]:
        """b_lim in m of the smallest vibration: with the joints at rest, and as the teeth shake them (nan: unknown)."""
        rest = float(lobes_at_amplitude(self.machine, [self.speed]).depth[0])
        return rest, shaken_limit(self.machine, self.speed, self.depth) if shakes(self.machine) else rest

    def words(self) -> str:
        """The size of the vibration, where it moves a joint beyond its range, and where it moves the limit."""
        forced = self.forced
        if not forced.settled[0]:
            return "The tooth-passing vibration there is not known: its motion and the joints do not agree."
        parts = [f"{axis} {1e6 * size:.3g}" for axis, size in zip(forced.axes, forced.peak_to_peak[0], strict=True)]
        said = f"There the tooth-passing vibration is {1e6 * forced.amplitude[0]:.3g} µm"
        said += f" ({' and '.join(parts)} µm peak to peak)."
        for name, size, reach in zip(forced.connections, forced.joint_amplitude[0], forced.reach, strict=True):
            if size > reach:
                said += (
                    f" It moves {name} by {1e6 * size:.3g} µm, beyond the {1e6 * reach:.3g} µm it was identified on."
                )
        rest, shaken = self.limit
        if np.isfinite(rest) and np.isfinite(shaken) and abs(shaken / rest - 1) > _SAME:
            said += f" With the joints as it shakes them the limit at that speed is {1e3 * shaken:.3g} mm."
        return said

    @property
    def data(self) -> dict[str, object]:
        """As numbers in SI for programs."""
        forced = self.forced
        joints = {
            name: {"amplitude": float(size), "beyond": float(past)}
            for name, size, past in zip(forced.connections, forced.joint_amplitude[0], forced.beyond[0], strict=True)
        }
        return {
            "speed": self.speed,
            "depth": self.depth,
            "amplitude": float(forced.amplitude[0]),
            "peak_to_peak": dict(zip(forced.axes, forced.peak_to_peak[0].tolist(), strict=True)),
            "rms": dict(zip(forced.axes, forced.rms[0].tolist(), strict=True)),
            "joints": joints,
            "limit": self.limit[1],
        }


def steady_cut(machine: Machine, speed: float, depth: float) -> SteadyCut | None:
    """The cut at a speed and depth; None where nothing forces it, or its vibration cannot be computed."""
    cutting = Cutting(**dict(machine.cutting or {}))
    if cutting.process != "milling" or cutting.feed is None or too_many(machine):
        return None
    cut = SteadyCut(at_speed(machine, speed), speed, depth)
    try:
        assert len(cut.forced.speed) == 1
    except (CheckFailed, InputError):
        return None
    return cut
