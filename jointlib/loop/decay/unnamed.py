"""Damping over amplitude told by a power of it: what the damping of a joint has to do as well as."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.loop.decay.fitted import Fitted, Folds
from jointlib.ringdown.evidence import Evidence

_POWERS = np.round(np.arange(-2.0, 4.0, 0.02), 2)
"""Of the amplitude, by which damping is tried to change; dry friction is −1, drag 1, the square of displacement 2."""
_CLEARLY = 3.0
"""Times what the power leaves, from which on what a joint leaves is clearly more."""
_STIFF = 1e-3
"""Of its damping, the largest stiffness of a law that damps alone."""


@dataclass(frozen=True)
class Power:
    """c = c0 + a·Aᵖ, which has no name, against the damping of a joint; both in squares of what is known of c."""

    exponent: float
    lost: float
    """Σ r² on what was left out in turn, of the power."""
    joint: float
    """Σ r² on the same, of the joint."""

    @property
    def alike(self) -> bool:
        """It leaves no more than the joint."""
        return self.lost <= self.joint

    @property
    def clear(self) -> bool:
        """It leaves clearly less than the joint."""
        return _CLEARLY * self.lost <= self.joint

    @property
    def words(self) -> str:
        return f"damping that changes with the amplitude to the power {self.exponent:.2g}"


def power_of(evidence: Evidence, folds: Folds, found: Fitted) -> Power:
    """The power that tells the measured damping best, fitted without each fold in turn."""
    mask = np.concatenate([np.repeat([False, True], len(b)) for b in evidence.backbones])
    A = np.concatenate([b.amplitude for b in evidence.backbones])
    weight, target = evidence.damping()
    weight = weight * np.concatenate([b.omega for b in evidence.backbones])
    x = A / np.max(A)

    def solved(kept: Array) -> tuple[float, Array]:
        best = (np.inf, 0.0, np.zeros(2))
        for p in _POWERS[_POWERS != 0]:
            columns = np.column_stack([weight, weight * x**p])
            size = np.linalg.norm(columns[kept], axis=0)
            found = np.linalg.lstsq(columns[kept] / size, target[kept], rcond=None)[0] / size
            loss = float(np.sum((target - columns @ found)[kept] ** 2))
            best = min(best, (loss, float(p), found), key=lambda one: one[0])
        return best[1], best[2]

    lost = 0.0
    for fold in folds.masks:
        out = fold[mask]
        p, (c0, a) = solved(np.logical_not(out))
        lost += float(np.sum((target - weight * (c0 + a * x**p))[out] ** 2))
    return Power(solved(np.ones(len(A), dtype=bool))[0], lost, float(np.sum(found.left_out[mask] ** 2)))


def against_names(evidence: Evidence, folds: Folds, before: Joint, found: Fitted) -> Power | None:
    """The power, where a joint got its damping from two effects and that tells it no worse, with no more numbers.

    Two effects that damp and a constant bend as any smooth curve does, so that a fit alone gives them no names.
    """
    added = found.joint.laws[len(before.laws) :]
    if len(added) < 2 or not all(_damps(evidence, Joint((law,))) for law in added):
        return None
    power = power_of(evidence, folds, found)
    return power if power.alike else None


def _damps(evidence: Evidence, law: Joint) -> bool:
    """Whether a law has damping and no stiffness."""
    gain = evidence.gains(law)
    return bool(np.max(np.abs(gain.real)) < _STIFF * np.max(np.abs(gain.imag)))
