"""How large a co-simulation step a joint stands before the coupling itself becomes unstable."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import MemorylessLaw, Motion
from jointlib.parameter import Role, parameters_of

from .under_conditions import extremes

_AMPLITUDE, _VELOCITY = 20e-6, 0.1
"""Range taken where a joint states none, m and m/s."""


@dataclass(frozen=True)
class Range:
    """Amplitude (m) and velocity (m/s) up to which the joint is used; ``stated`` if the joint says so itself."""

    amplitude: float
    velocity: float
    stated: bool


@dataclass(frozen=True)
class StepLimit:
    """The largest tangent stiffness (N/m) and the smallest tangent damping (N s/m) over a range."""

    stiffness: float
    damping: float

    @property
    def max_step(self) -> float | None:
        """2c/(3k) in s: a force that lags 1.5 steps behind feeds in what the damping c takes out.

        A mass and a joint f = kx + cẋ that exchange values once per step H, both from the last instant, keep the
        damping c − (3/2)kH. None where there is no damping to spend, or no stiffness that spends it.
        """
        if self.stiffness <= 0 or self.damping <= 0:
            return None
        return 2 * self.damping / (3 * self.stiffness)


def kinks(joint: Joint) -> tuple[list[float], list[float]]:
    """Displacements (m) and velocities (m/s) at which a force of the joint bends."""
    positions: list[float] = []
    speeds: list[float] = []
    for law in joint.laws:
        if isinstance(law, MemorylessLaw):
            z, v = law.kinks()
            positions += [float(x) for x in z]
            speeds += [float(x) for x in v]
    return positions, speeds


def operating_range(joint: Joint) -> Range:
    """The validity of the joint in amplitude and velocity, or 20 µm and 0.1 m/s.

    A velocity that is not stated follows from the highest frequency if that is: 2π·frequency·amplitude.
    """
    validity = joint.validity
    amplitude = max(abs(x) for x in validity["amplitude"]) if "amplitude" in validity else 0.0
    velocity = max(abs(x) for x in validity["velocity"]) if "velocity" in validity else 0.0
    if amplitude and not velocity and "frequency" in validity:
        velocity = float(2 * np.pi * max(validity["frequency"]) * amplitude)
    return Range(amplitude or _AMPLITUDE, velocity or _VELOCITY, bool(amplitude and velocity))


def step_limit(joint: Joint, over: Range) -> StepLimit:
    """Scan the tangents of the joint over a range, and all that is known of its conditions.

    A law with memory reaches any of its tangents at any displacement, so its extremes are added to those of the
    rest; its stiffness parameters count in full, however narrow the band in which they act.
    """
    limits = [_tangents(each, over) for each in extremes(joint)]
    return StepLimit(max(limit.stiffness for limit in limits), min(limit.damping for limit in limits))


def _tangents(joint: Joint, over: Range) -> StepLimit:
    """Largest stiffness and smallest damping of a joint under one condition, part by part where a part remembers."""
    positions, speeds = kinks(joint)
    z = _scan(over.amplitude, positions)[:, None]
    v = _scan(over.velocity, speeds)[None, :]
    plain = replace(joint, laws=tuple(law for law in joint.laws if not law.states), covariance=None)
    k, c = plain.jacobian(Motion(z, v), plain.initial_state(z))
    stiffness, damping = float(np.max(k)), float(np.min(c))
    for law in joint.laws:
        if law.states:
            tangents = [law.jacobian(Motion(z, v), law.initial_state(start)) for start in (np.zeros_like(z), z)]
            own = [float(np.sum(getattr(law, p.name))) for p in parameters_of(law) if p.role is Role.STIFFNESS]
            stiffness += max(*own, *(float(np.max(k)) for k, _ in tangents))
            damping += min(float(np.min(c)) for _, c in tangents)
    return StepLimit(stiffness, damping)


def _scan(limit: float, bends: list[float]) -> Array:
    """Points on both sides of zero, dense near zero and beside every bend."""
    fine = limit * np.geomspace(1e-6, 1.0, 61)
    even = np.linspace(0.0, limit, 81)
    beside = [b * (1 + s) for b in bends for s in (-1e-9, 1e-9) if abs(b) < limit]
    return np.unique(np.concatenate([fine, -fine, even, -even, beside]))
