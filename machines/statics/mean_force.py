"""Mean and first harmonic of a joint about a static position; friction keeps what it was loaded with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.harmonic import FirstHarmonic
from jointlib.joint import Joint
from jointlib.law import DIFFERENCE, Motion, difference_step

SLOW = 1e6
"""s; how long a quasi-static step takes."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Gain G (N/m) and mean N0 (N) with their derivatives by amplitude and by static position."""

    gain: ComplexArray
    gain_by_amplitude: ComplexArray
    gain_by_bias: ComplexArray
    mean: Array
    mean_by_amplitude: Array
    mean_by_bias: Array


@dataclass(frozen=True, eq=False)
class MeanForce:
    """A joint that moves as z0 + A cos ωt.

    Laws without memory have their mean from the dual-input describing function. Laws with memory are loaded from
    their virgin state at z = 0, slowly, to z0, and then shaken until the loop closes: the mean is the centre of that
    loop, exact for Jenkins and Iwan elements, which keep what does not slip. Their gain does not depend on z0.
    Viscous and dry friction without an elastic part carry nothing at rest.
    """

    joint: Joint

    @cached_property
    def _free(self) -> Joint:
        return Joint(tuple(law for law in self.joint.laws if not law.states))

    @cached_property
    def _at_rest(self) -> Joint:
        return Joint(tuple(law for law in self._free.laws if law.in_time))

    @cached_property
    def _kept(self) -> Joint:
        return Joint(tuple(law for law in self.joint.laws if law.states))

    def harmonic(self, amplitude: Array, omega: Array, bias: Array) -> FirstHarmonic:
        """First harmonic and mean at arrays that broadcast."""
        found = self._free.first_harmonic(amplitude, omega, bias)
        if not self._kept.laws:
            return found
        kept = self._kept.first_harmonic(amplitude, omega)
        total = found + kept
        mean = found.mean + self._centre(amplitude, bias)
        return FirstHarmonic(total.gain, total.d_amplitude, total.d_omega, mean, total.error)

    def mean(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        """N0 in N."""
        found = self._free.first_harmonic(amplitude, omega, bias).mean
        if not self._kept.laws:
            return found
        return found + self._centre(amplitude, bias)

    def _centre(self, amplitude: Array, bias: Array) -> Array:
        amplitude, bias = np.broadcast_arrays(amplitude, bias)
        state = self._kept.initial_state(np.zeros_like(bias))
        ends = []
        for side in (1.0, -1.0, 1.0, -1.0):
            force, state = self._kept.step(self._slowly(bias + side * amplitude), state)
            ends.append(force)
        return np.asarray((ends[2] + ends[3]) / 2)

    @staticmethod
    def _slowly(displacement: Array) -> Motion:
        return Motion(displacement, np.zeros_like(displacement), SLOW)

    def slopes(self, amplitude: Array, omega: Array, bias: Array) -> Slopes:
        """Everything Newton's method asks for; differences of laws that do not give a derivative themselves."""
        here = self.harmonic(amplitude, omega, bias)
        gain, mean_by_amplitude, mean = self._free.by_bias(amplitude, omega, bias)
        if self._kept.laws:  # whose gain does not depend on the static position
            by_amplitude, by_bias = self._centre_slopes(amplitude, bias)
            mean_by_amplitude, mean = mean_by_amplitude + by_amplitude, mean + by_bias
        return Slopes(here.gain, here.d_amplitude, gain, here.mean, mean_by_amplitude, mean)

    def _centre_slopes(self, amplitude: Array, bias: Array) -> tuple[Array, Array]:
        """Derivatives in N/m of the mean of the laws with memory, by amplitude and by static position."""
        h, a = difference_step(amplitude, bias), DIFFERENCE * amplitude
        by_bias = (self._centre(amplitude, bias + h) - self._centre(amplitude, bias - h)) / (2 * h)
        change = self._centre(amplitude + a, bias) - self._centre(amplitude - a, bias)
        return np.where(a > 0, change / np.where(a > 0, 2 * a, 1.0), 0.0), by_bias

    def mean_slope(self, amplitude: Array, omega: Array, bias: Array, mean: Array) -> Array:
        """∂N0/∂z0 in N/m beside a known N0, by a difference that is good enough to start a secant."""
        h = difference_step(amplitude, bias)
        return (self.mean(amplitude, omega, bias + h) - mean) / h

    def static(self, displacement: Array) -> tuple[Array, Array]:
        """Force in N and tangent stiffness in N/m at rest."""
        z = np.asarray(displacement, dtype=float)
        motion = Motion(z, np.zeros_like(z))
        force = self._at_rest.step(motion, self._at_rest.initial_state(z))[0]
        stiffness = self._at_rest.jacobian(motion, self._at_rest.initial_state(z))[0]
        if self._kept.laws:
            virgin = self._kept.initial_state(np.zeros_like(z))
            force = force + self._kept.step(self._slowly(z), virgin)[0]
            stiffness = stiffness + self._kept.jacobian(self._slowly(z), virgin)[0]
        return force, stiffness
