"""Dynamic rig: a runner block shaken against a rail with a steel block, free in space."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.rig.excitation import Excitation


@dataclass(frozen=True)
class SteadyState:
    """One period of the rig in steady state; arrays (samples, records), behind an ideal anti-alias filter."""

    displacement: Array
    """z = z1 − z2 in m."""
    velocity: Array
    """ż in m/s."""
    joint_force: Array
    """f in N, from body 1 to the others."""
    shaker_force: Array
    """P in N on body 1."""
    channels: dict[str, Array]
    """a1, a2, a3 in m/s² and P in N, as the sensors would show them without noise."""
    unsettled: float
    """Largest difference of z between the two ends of the period, relative to its largest size."""


@dataclass(frozen=True)
class Course:
    """Relative motion and joint force at every step of an integration, arrays (steps, records)."""

    displacement: Array
    velocity: Array
    force: Array
    state: Array
    """State of the joint after the last step."""


@dataclass(frozen=True)
class DynamicRig:
    """m1 a1 = P − f(z, ż), m2 a2 + m3 a3 = f, rail and block moving as one (Dhupia et al. 2008, fig. 8, eq. 11).

    Nothing holds the rig and the joint sees the relative motion alone: μ z̈ + f(z, ż) = μ P/m1 with the reduced mass
    1/μ = 1/m1 + 1/(m2+m3). Masses in kg.
    """

    joint: Joint
    runner_block: float = 0.942
    rail: float = 1.1
    block: float = 1.1

    @property
    def reduced_mass(self) -> float:
        """μ in kg."""
        return 1 / (1 / self.runner_block + 1 / (self.rail + self.block))

    def motion(self, shaker: Array, time_step: float, start: tuple[Array, Array, Array]) -> Course:
        """Integrate under a shaker force P in N given at every step, shape (steps + 1, records).

        From ``start`` = (z, ż, state); element 0 of the course is the start. Fourth-order Adams formulas, explicit
        for ż and implicit for z, which costs nothing as ż is known by then. The joint is stepped exactly once per
        step, so what it remembers is carried without a detour.
        """
        h, mu = time_step, self.reduced_mass
        drive = shaker / self.runner_block
        z, v, state = start
        zs, vs, fs = (np.empty((len(shaker), *np.shape(z))) for _ in range(3))
        f, state = self.joint.step(Motion(z, v, 0.0), state)
        zs[0], vs[0], fs[0] = z, v, f
        rates, speeds = deque([drive[0] - f / mu], maxlen=4), deque([v], maxlen=4)
        for n in range(1, len(shaker)):
            v = v + h * _weighted(_EXPLICIT[len(rates)], rates)
            speeds.append(v)
            z = z + h * _weighted(_IMPLICIT[len(speeds)], speeds)
            f, state = self.joint.step(Motion(z, v, h), state)
            rates.append(drive[n] - f / mu)
            zs[n], vs[n], fs[n] = z, v, f
        return Course(zs, vs, fs, state)

    def steady_state(self, excitations: Sequence[Excitation], *, settle: int = 2, substeps: int = 4) -> SteadyState:
        """Shake from rest and keep one period after ``settle`` whole ones; the records run side by side.

        ``substeps`` integration steps per sample. A lightly damped joint forgets its start as e^(−ζωt): the paper's
        rig by eight decades in a period of 50 ms.
        """
        first = excitations[0]
        if settle < 0 or substeps < 1:
            raise InputError(f"dynamic rig: settle {settle}, substeps {substeps}, expected at least 0 and 1")
        if any((e.period, e.sample_rate) != (first.period, first.sample_rate) for e in excitations):
            raise InputError("dynamic rig: excitations of different period or sample rate, expected one grid")
        once = np.stack([e.force(substeps) for e in excitations], axis=-1)
        shaker = np.concatenate([np.tile(once, (settle + 1, 1)), once[:1]])
        rest = np.zeros(len(excitations))
        start = rest, rest, self.joint.initial_state(rest)
        course = self.motion(shaker, 1 / (first.sample_rate * substeps), start)
        last = slice(settle * len(once), -1)
        z, v, f, P = (
            filtered(x, first.period)
            for x in (course.displacement[last], course.velocity[last], course.force[last], once)
        )
        a1, a2 = (P - f) / self.runner_block, f / (self.rail + self.block)
        gap = np.abs(course.displacement[-1] - course.displacement[last][0])
        unsettled = float(np.max(gap / np.maximum(np.max(np.abs(z), axis=0), 1e-300)))
        return SteadyState(z, v, f, P, {"a1": a1, "a2": a2, "a3": a2.copy(), "P": P}, unsettled)


_EXPLICIT = {
    1: (1.0,),
    2: (-1 / 2, 3 / 2),
    3: (5 / 12, -16 / 12, 23 / 12),
    4: (-9 / 24, 37 / 24, -59 / 24, 55 / 24),
}
"""Adams–Bashforth weights, oldest value first."""
_IMPLICIT = {2: (1 / 2, 1 / 2), 3: (-1 / 12, 8 / 12, 5 / 12), 4: (1 / 24, -5 / 24, 19 / 24, 9 / 24)}
"""Adams–Moulton weights, oldest value first."""


def _weighted(weights: tuple[float, ...], values: deque[Array]) -> Array:
    total = weights[0] * values[0]
    for weight, value in zip(weights[1:], list(values)[1:], strict=True):
        total = total + weight * value
    return total


def filtered(fine: Array, period: int) -> Array:
    """One period of a signal at ``period`` samples, all above half their rate removed without phase lag."""
    spectrum = np.fft.rfft(fine, axis=0)[: (period + 1) // 2]
    return np.asarray(np.fft.irfft(spectrum, period, axis=0) * (period / len(fine)))
