"""Mean forces of joints that vibrate about a place, and how means move aside under a force that one of them holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

from ..indices import Mask
from ..solved import solve_each
from ..statics.mean_force import MeanForce
from .assembly import is_linear

_RAMP, _STEPS = 6, 12
_SETTLED = 1e-6


@dataclass(frozen=True)
class Parts:
    """The laws of a joint with memory, and those without."""

    remembering: Joint
    rest: Joint
    bends: bool
    """Whether what does not remember has a gain that the mean can change."""

    @classmethod
    def of(cls, joint: Joint) -> Parts:
        remembering, rest = joint.parted(lambda law: bool(law.states) and not law.linear)
        return cls(remembering, rest, bool(rest.laws) and not is_linear(rest))

    def mean_and_gain(
        self, amplitude: Array, omega: Array, bias: Array, kept: Mask | bool
    ) -> tuple[Array, ComplexArray]:
        """Mean force in N, where ``kept`` that of the sliders as well, and gain in N/m of what does not remember."""
        mean, gain = np.zeros_like(amplitude), np.zeros(len(amplitude), dtype=complex)
        if self.rest.laws:
            found = self.rest.first_harmonic(amplitude, omega, bias)
            mean, gain = mean + found.mean, gain + found.gain
        if self.remembering.laws:
            mean += kept * MeanForce(self.remembering).mean(amplitude, omega, bias)
        return mean, gain


def carried(laws: tuple[Parts, ...], A: Array, omega: Array, place: Array, kept: Mask) -> tuple[Array, ComplexArray]:
    """Mean forces in N, where ``kept`` (rows, nj) with those of sliders, and gains in N/m of what does not remember."""
    found = [part.mean_and_gain(A[:, k], omega, place[:, k], kept[:, k]) for k, part in enumerate(laws)]
    return np.stack([mean for mean, _ in found], axis=1), np.stack([gain for _, gain in found], axis=1)


def stiffness(laws: tuple[Parts, ...], A: Array, omega: Array, place: Array, kept: Mask) -> Array:
    """∂N/∂δ in N/m, (rows, nj)."""
    nudge = 1e-4 * np.maximum(A, 1e-3 * np.max(A, axis=1, keepdims=True))
    up, down = (carried(laws, A, omega, place + side * nudge, kept)[0] for side in (1.0, -1.0))
    return np.asarray((up - down) / (2 * nudge))


def raised(
    laws: tuple[Parts, ...],
    C: Array,
    reference: Array,
    A: Array,
    omega: Array,
    mean: Array,
    kept: Mask,
    pull: Array,
) -> tuple[Array, Mask]:
    """δ of all joints in m, (rows, nj), while held forces (N) rise from nothing, and where it settled."""
    aside = np.zeros_like(A)
    at_rest, length = carried(laws, A, omega, mean, kept)[0], np.full(len(A), np.inf)
    for share in np.arange(1, _RAMP + 1) / _RAMP:
        for _ in range(_STEPS):
            K = stiffness(laws, A, omega, mean + aside, kept)
            more = carried(laws, A, omega, mean + aside, kept)[0] - at_rest
            left = aside + (more - share * pull - aside * reference) @ C.T
            step = solve_each(np.eye(len(C)) + C * (K - reference)[:, None, :], -left[:, :, None])[:, :, 0]
            aside = aside + step
            length = np.max(np.abs(step), axis=1)
            if np.all(length <= _SETTLED * np.maximum(1e-4 * np.max(A, axis=1), np.max(np.abs(aside), axis=1))):
                break
    return aside, length <= 1e-3 * np.max(np.abs(aside), axis=1) + _SETTLED * np.max(A, axis=1)
