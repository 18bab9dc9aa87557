"""A joint fitted to backbones, as a whole and with parts left out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.loop.answer.refit import refit
from jointlib.ringdown.evidence import Evidence, free_of

_BLOCKS = 4


@dataclass(frozen=True)
class Folds:
    """What is left out in turn: conditions (levels), or parts of the amplitude where there is one."""

    masks: tuple[Array, ...]
    """True where an entry of the residual is left out."""
    names: tuple[str, ...]
    several: bool


def folds_of(evidence: Evidence) -> Folds:
    """One fold for each condition; of a single one quarters of its pieces."""
    label = [b.condition for b in evidence.backbones for _ in range(2 * len(b))]
    names = tuple(dict.fromkeys(label))
    if len(names) > 1:
        return Folds(tuple(np.array([one == name for one in label]) for name in names), names, True)
    part = np.concatenate([np.tile(_BLOCKS * np.arange(len(b)) // len(b), 2) for b in evidence.backbones])
    return Folds(tuple(part == k for k in range(_BLOCKS)), tuple(f"part {k + 1}" for k in range(_BLOCKS)), False)


@dataclass(frozen=True)
class Fitted:
    """A joint at its least squares, in sample and where folds are left out in turn."""

    joint: Joint
    loss: float
    """Σ r² in sample."""
    per_fold: Array
    """Σ r² of each fold, by the joint that was fitted without it; empty where this was not worked out."""
    share: float
    """rms of the residual over that of the force, on what was left out; in sample where this was not worked out."""
    left_out: Array = field(default_factory=lambda: np.zeros(0))
    """r where it was left out; empty where this was not worked out."""

    @property
    def held_out(self) -> float:
        """Σ r² over all folds."""
        return float(np.sum(self.per_fold))


def fit(evidence: Evidence, joint: Joint, *, quick: bool = False) -> Fitted:
    """Least squares on all records."""
    found, _ = refit(joint, evidence.residual, free_of(joint), quick=quick)
    r = evidence.residual(found)
    return Fitted(found, float(r @ r), np.zeros(0), evidence.share(found))


def with_folds(evidence: Evidence, folds: Folds, whole: Fitted) -> Fitted:
    """The same with each fold left out in turn.

    No motion tells of contacts that slip beyond it. So what a joint with a memory does at amplitudes beyond all that
    were kept is judged in sample.
    """
    losses, over, out = [], 0.0, np.zeros(len(folds.masks[0]))
    amplitude = np.concatenate([np.tile(b.amplitude, 2) for b in evidence.backbones])
    weight = amplitude**2
    in_sample = evidence.residual(whole.joint) if whole.joint.states else None
    force = sum(float(np.sum(np.abs(evidence.modal_mass * b.gain * b.amplitude) ** 2)) for b in evidence.backbones)
    for mask in folds.masks:

        def without(joint: Joint, mask: Array = mask) -> Array:
            return evidence.residual(joint)[np.logical_not(mask)]

        found, _ = refit(whole.joint, without, free_of(whole.joint), quick=True)
        out[mask] = evidence.residual(found)[mask]
        if in_sample is not None:
            beyond = mask & (amplitude > np.max(amplitude[np.logical_not(mask)]))
            out[beyond] = in_sample[beyond]
        losses.append(float(np.sum(out[mask] ** 2)))
        left = np.concatenate([part for one in evidence.left(found) for part in (one.real, one.imag)])
        over += float(np.sum((left**2 * weight)[mask]))
    return Fitted(whole.joint, whole.loss, np.array(losses), float(np.sqrt(over / force)), out)
