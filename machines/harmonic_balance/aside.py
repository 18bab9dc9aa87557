"""Mean forces of joints that vibrate about a place, and how means move aside under a force that one of them holds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

from ..indices import Mask
from ..solved import solve_each
from ..statics.asked_together import asked_together
from ..statics.mean_force import MeanForce
from .assembly import is_linear

_RAMP, _STEPS = 6, 12
_SETTLED = 1e-6


@dataclass(frozen=True, eq=False)
class Laws:
    """Joints that are not linear, those of each alike asked together."""

    remembering: tuple[Joint, ...]
    """What has memory of each, perhaps nothing."""
    rest: tuple[Joint, ...]
    """What has none."""

    @classmethod
    def of(cls, joints: Iterable[Joint]) -> Laws:
        parted = [joint.parted(lambda law: bool(law.states) and not law.linear) for joint in joints]
        return cls(tuple(part for part, _ in parted), tuple(part for _, part in parted))

    @cached_property
    def bends(self) -> Mask:
        """Where what does not remember has a gain that the mean can change, (nj,)."""
        return np.array([bool(joint.laws) and not is_linear(joint) for joint in self.rest])

    @cached_property
    def sliders(self) -> list[int]:
        """Places of joints that remember."""
        return [k for k, joint in enumerate(self.remembering) if joint.laws]

    @cached_property
    def _together(self) -> tuple[list[tuple[Joint, list[int]]], list[tuple[MeanForce, list[int]]]]:
        rest, remembering = (asked_together(some) for some in (self.rest, self.remembering))
        return (
            [(joint, columns) for joint, columns in rest if joint.laws],
            [(MeanForce(joint), columns) for joint, columns in remembering if joint.laws],
        )

    def carried(self, A: Array, omega: Array, place: Array, kept: Mask) -> tuple[Array, ComplexArray]:
        """Mean forces in N, where ``kept`` (rows, nj) those of sliders as well, and gains in N/m of what does not
        remember."""
        mean, gain = np.zeros_like(A), np.zeros(A.shape, dtype=complex)
        rest, remembering = self._together
        for joint, columns in rest:
            found = joint.first_harmonic(A[:, columns], omega[:, None], place[:, columns])
            mean[:, columns], gain[:, columns] = found.mean, found.gain
        for held, columns in remembering:
            mean[:, columns] += kept[:, columns] * held.mean(A[:, columns], omega[:, None], place[:, columns])
        return mean, gain

    def stiffness(self, A: Array, omega: Array, place: Array, kept: Mask) -> Array:
        """∂N/∂δ in N/m, (rows, nj)."""
        nudge = 1e-4 * np.maximum(A, 1e-3 * np.max(A, axis=1, keepdims=True))
        up, down = (self.carried(A, omega, place + side * nudge, kept)[0] for side in (1.0, -1.0))
        return np.asarray((up - down) / (2 * nudge))


def raised(
    laws: Laws,
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
    at_rest, length = laws.carried(A, omega, mean, kept)[0], np.full(len(A), np.inf)
    for share in np.arange(1, _RAMP + 1) / _RAMP:
        for _ in range(_STEPS):
            K = laws.stiffness(A, omega, mean + aside, kept)
            more = laws.carried(A, omega, mean + aside, kept)[0] - at_rest
            left = aside + (more - share * pull - aside * reference) @ C.T
            step = solve_each(np.eye(len(C)) + C * (K - reference)[:, None, :], -left[:, :, None])[:, :, 0]
            aside = aside + step
            length = np.max(np.abs(step), axis=1)
            if np.all(length <= _SETTLED * np.maximum(1e-4 * np.max(A, axis=1), np.max(np.abs(aside), axis=1))):
                break
    return aside, length <= 1e-3 * np.max(np.abs(aside), axis=1) + _SETTLED * np.max(A, axis=1)
