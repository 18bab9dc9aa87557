"""Mean and first harmonic of a joint about a static position; friction keeps what it was loaded with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.harmonic import FirstHarmonic
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion

SLOW = 1e6
"""s; how long a quasi-static step takes."""
_STEP = 1e-4
"""Differences are taken over this share of the amplitude or position."""
_LEAST = 1e-9
"""m; below it the step does not shrink further."""


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
        parts = [law.by_bias(amplitude, omega, bias) for law in self.joint.laws]
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            left = tuple(law for law, part in zip(self.joint.laws, parts, strict=True) if part is None)
            known.append(self._by_differences(left, amplitude, omega, bias))
        gain, mean_by_amplitude, mean = (np.sum(every, axis=0) for every in zip(*known, strict=True))
        return Slopes(here.gain, here.d_amplitude, gain, here.mean, mean_by_amplitude, mean)

    def _by_differences(
        self, laws: tuple[JointLaw, ...], amplitude: Array, omega: Array, bias: Array
    ) -> tuple[ComplexArray, Array, Array]:
        """`JointLaw.by_bias` of some of the laws by central differences."""
        some = MeanForce(Joint(laws))
        h = _STEP * np.maximum(np.maximum(amplitude, np.abs(bias)), _LEAST)
        up, down = (some._free.first_harmonic(amplitude, omega, bias + s * h) for s in (1.0, -1.0))
        further, nearer = up.mean, down.mean
        if some._kept.laws:
            further, nearer = further + some._centre(amplitude, bias + h), nearer + some._centre(amplitude, bias - h)
        a = _STEP * amplitude
        more, less = (some.mean(amplitude + s * a, omega, bias) for s in (1.0, -1.0))
        by_amplitude = np.where(a > 0, (more - less) / np.where(a > 0, 2 * a, 1.0), 0.0)
        return (up.gain - down.gain) / (2 * h), by_amplitude, (further - nearer) / (2 * h)

    def mean_slope(self, amplitude: Array, omega: Array, bias: Array, mean: Array) -> Array:
        """∂N0/∂z0 in N/m beside a known N0, by a difference that is good enough to start a secant."""
        h = _STEP * np.maximum(np.maximum(amplitude, np.abs(bias)), _LEAST)
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


def same_joints(joints: Sequence[Joint]) -> list[list[int]]:
    """Joints by their place, those together that are the same one and so can be asked together."""
    groups: dict[int, list[int]] = {}
    for i, joint in enumerate(joints):
        groups.setdefault(id(joint), []).append(i)
    return list(groups.values())
