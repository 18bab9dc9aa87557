"""The contract of a joint law: restoring force along one relative displacement."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from jointlib import parameter
from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, numerical_first_harmonic
from jointlib.motion import Motion
from jointlib.pieces import in_pieces, turns

__all__ = ["JointLaw", "MemorylessLaw", "Motion", "memoryless"]

_FEW_TURNS = 0.25
"""Of the samples of a path; with more turns it is stepped sample by sample."""
_TOGETHER = 32768
"""Numbers that are stepped together where no step needs the one before it; they stay in the processor's cache."""


DIFFERENCE = 1e-4
"""Differences are taken over this share of the amplitude or position."""
_LEAST = 1e-9
"""m; below it the step does not shrink further."""


def difference_step(amplitude: Array, bias: Array) -> Array:
    """Over how many metres of the static position a difference is taken."""
    return np.asarray(DIFFERENCE * np.maximum(np.maximum(amplitude, np.abs(bias)), _LEAST))


class JointLaw(ABC):
    """Restoring force f(z, ż, state) in N; a law remembers nothing, state goes in and comes out.

    The force pulls with −f on side p and +f on side q of z = x_p − x_q. Implementations are frozen dataclasses
    whose fields are declared with :func:`jointlib.parameter.parameter`. In `step` and `jacobian` parameters may be
    arrays that broadcast against the motion, so that a path is stepped once for a whole grid of them.
    """

    kind: ClassVar[str]
    """The word for the law in files."""
    in_time: ClassVar[bool] = True
    """False for a law that exists in the frequency domain only."""
    passive: ClassVar[bool] = True
    """True if no closed cycle yields energy, whatever the admissible parameters."""
    linear: ClassVar[bool] = False
    """True if the force of a sum of motions is the sum of their forces: each line of a spectrum then has its own gain,
    and no periodic steady state need be stepped."""
    by_turns: ClassVar[bool] = False
    """True if one long step along a path that does not turn ends as many short ones do: the force then depends on where
    the path turned and where it is, not on how fast or how finely."""
    side_by_side: ClassVar[bool] = False
    """True if in `first_harmonic` and `by_bias` too parameters may be arrays that broadcast against the motion."""
    states: ClassVar[tuple[str, ...]] = ()
    """Names of the internal states; empty for a law without memory."""

    def __post_init__(self) -> None:
        parameter.check(self, self.kind)

    @abstractmethod
    def initial_state(self, displacement: Array) -> Array:
        """Virgin state at a displacement z in m: shape (*z.shape, number of states)."""

    @abstractmethod
    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        """Force in N at the end of the step and the new state."""

    @abstractmethod
    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        """Tangent stiffness ∂f/∂z (N/m) and damping ∂f/∂ż (N s/m) at the end of the step from ``state``."""

    def along(self, displacement: Array, velocity: Array, time_step: float) -> Array:
        """Force in N along a path in m and m/s sampled every ``time_step`` s (time on the first axis), from the virgin
        state: one step after the other, or by ways round that end at the same force."""
        z, v = displacement, velocity
        begin = self.initial_state(z[0])
        if self.by_turns and len(z) > 1:
            found = turns(z)
            if len(found.at) < _FEW_TURNS * len(z):
                there, speeds = (np.take_along_axis(x, found.at, axis=0) for x in (z, np.broadcast_to(v, z.shape)))
                states = self.states_after(begin, there, speeds, time_step)
                force = np.empty((len(z), *np.broadcast_shapes(z.shape[1:], states.shape[1:-1])))
                rows = max(1, _TOGETHER // max(1, force[0].size))
                for first in range(0, len(z), rows):
                    part = slice(first, first + rows)
                    force[part] = self.step(Motion(z[part], v[part], time_step), found.spread(states, part))[0]
                return force

        def step(z: Array, v: Array, state: Array) -> tuple[Array, Array]:
            return self.step(Motion(z, v, time_step), state)

        return in_pieces(begin, self.initial_state, step, z, v)

    def states_after(self, begin: Array, z: Array, v: Array, time_step: float) -> Array:
        """The state after each step of a path (time on the first axis) that begins in the state ``begin``."""

        def step(z: Array, v: Array, state: Array) -> tuple[Array, Array]:
            after = self.step(Motion(z, v, time_step), state)[1]
            return after, after

        return in_pieces(begin, self.initial_state, step, z, v)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        """Angles θ of z = bias + A cos θ at which the steady force is not smooth, shape (*A.shape, n).

        Entries may repeat; none means smooth. Quadrature splits the cycle there.
        """
        return np.empty((*np.broadcast_shapes(amplitude.shape, omega.shape, bias.shape), 0))

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Describing function G and its derivatives; numerical unless the law has a closed form.

        G = (1/(πA)) ∫₀^2π f(z0 + A cos θ, −ωA sin θ) e^(−jθ) dθ (Dhupia et al. 2008, eq. 22, with the sign that
        makes a viscous law +jωc). Amplitudes in m, angular frequencies in rad/s, bias z0 in m; they broadcast.
        """
        return numerical_first_harmonic(self, amplitude, omega, bias)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """∂G/∂z0 (N/m²), ∂N0/∂A and ∂N0/∂z0 (N/m) of the dual-input describing function.

        Central differences unless the law has closed forms; arrays broadcast as in `first_harmonic`.
        """
        h, a = difference_step(amplitude, bias), DIFFERENCE * amplitude
        up, down = (self.first_harmonic(amplitude, omega, bias + s * h) for s in (1.0, -1.0))
        more, less = (self.first_harmonic(amplitude + s * a, omega, bias).mean for s in (1.0, -1.0))
        by_amplitude = np.where(a > 0, (more - less) / np.where(a > 0, 2 * a, 1.0), 0.0)
        return (up.gain - down.gain) / (2 * h), by_amplitude, (up.mean - down.mean) / (2 * h)

    def describing_function(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> complex:
        """The gain G(A, ω) in N/m alone (complex, of the broadcast shape)."""
        gain: complex = self.first_harmonic(amplitude, omega, bias).gain  # type: ignore[assignment]
        return gain


class MemorylessLaw(JointLaw):
    """A law whose force is a function f(z, ż) alone."""

    @abstractmethod
    def force(self, displacement: Array, velocity: Array) -> Array:
        """Restoring force in N for z in m and ż in m/s (arrays that broadcast)."""

    @abstractmethod
    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        """∂f/∂z in N/m and ∂f/∂ż in N s/m."""

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        """Displacements (m) and velocities (m/s) at which the force is not smooth, or bends sharply."""
        return (), ()

    def initial_state(self, displacement: Array) -> Array:
        return np.empty((*np.shape(displacement), 0))

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self.force(motion.displacement, motion.velocity), state

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self.slopes(motion.displacement, motion.velocity)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        amplitude, omega, bias = np.broadcast_arrays(amplitude, omega, bias)
        positions, speeds = self.kinks()
        angles = []
        for z in positions:
            theta = np.arccos(np.clip((z - bias) / np.maximum(amplitude, 1e-300), -1, 1))
            angles += [theta, 2 * np.pi - theta]
        for v in speeds:
            theta = np.arcsin(np.clip(-v / np.maximum(amplitude * omega, 1e-300), -1, 1))
            angles += [theta % (2 * np.pi), np.pi - theta]
        return np.stack(angles, axis=-1) if angles else np.empty((*amplitude.shape, 0))


def memoryless(law: JointLaw, displacement: Array, velocity: Array) -> Array:
    """Force in N of a law without states along motions, in pieces that stay in the processor's cache."""
    z, v = displacement, velocity
    if z.ndim == 0 or len(z) <= _TOGETHER:
        return law.step(Motion(z, v), law.initial_state(z))[0]
    parts = [slice(first, first + _TOGETHER // 4) for first in range(0, len(z), _TOGETHER // 4)]
    return np.concatenate([law.step(Motion(z[p], v[p]), law.initial_state(z[p]))[0] for p in parts])
