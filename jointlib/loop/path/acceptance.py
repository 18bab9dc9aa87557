"""When an effect counts as found: size, every condition, chance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.path.regression import Index

SHARE = 0.20
"""Of the current excess that a term must remove."""
CHANCE = 0.01
"""Largest probability that random signs of the block gains would do as well."""
TIE = 0.01
"""Families whose gains differ by this fraction are not told apart."""
_FLIPS = 9999


@dataclass(frozen=True)
class Assessment:
    """The gain of a term over the current model on held-out data."""

    gain: float
    """Drop of the mean relative loss."""
    share: float
    """Fraction of the current excess E = Σ max(0, loss − floor) that goes."""
    share_error: float
    """Standard error of ``share`` from the spread of the blocks, taken as independent."""
    per_fold: tuple[float, ...]
    chance: float
    """Sign-flip permutation over blocks."""
    reasons: tuple[str, ...]
    """What it fails; empty if accepted."""

    @property
    def accepted(self) -> bool:
        return not self.reasons


def excess(loss: Array, floor: Array) -> float:
    """E = Σ max(0, loss − floor) over blocks."""
    return float(np.maximum(loss - floor, 0.0).sum())


def assess(current: Array, new: Array, floor: Array, folds: Index, seed: int) -> Assessment:
    """Compare held-out losses per block before and after a term; ``folds`` numbers the fold of every block.

    A fold counts as active if it holds at least one per cent of the current excess. The gain must be positive in
    every active fold where there are at most four, else in four fifths of them.
    """
    over_now, over_new = np.maximum(current - floor, 0.0), np.maximum(new - floor, 0.0)
    total = float(over_now.sum())
    gains = over_now - over_new
    share = float(gains.sum() / total) if total > 0 else 0.0
    error = float("nan")
    if total > 0 and len(gains) > 1:
        with np.errstate(over="ignore"):  # A model that runs away on what it has not seen.
            error = float(np.sqrt(len(gains)) * np.std(gains / total, ddof=1))
    numbers = range(int(folds.max()) + 1)
    per_fold = tuple(float(gains[folds == h].sum()) for h in numbers)
    active = [g for h, g in zip(numbers, per_fold, strict=True) if over_now[folds == h].sum() >= 0.01 * total]
    positive = sum(g > 0 for g in active)
    chance = sign_flip(current - new, seed)
    reasons = []
    if share < SHARE:
        reasons.append(f"removes {100 * share:.0f} % of what is left, {100 * SHARE:.0f} % are needed")
    if not active or (positive < len(active) if len(active) <= 4 else positive < 0.8 * len(active)):
        reasons.append(f"gains in {positive} of {len(active)} conditions")
    if chance > CHANCE:
        reasons.append(f"random signs do as well with probability {chance:.2g}")
    return Assessment(float(np.mean(current - new)), share, error, per_fold, chance, tuple(reasons))


def sign_flip(gains: Array, seed: int) -> float:
    """Probability that the sum of block gains with random signs reaches the observed one."""
    reached = np.count_nonzero(_signs(seed, len(gains)) @ gains >= gains.sum() * (1 - 1e-12))
    return float((reached + 1) / (_FLIPS + 1))


@lru_cache(maxsize=2)
def _signs(seed: int, count: int) -> Array:
    """Drawn once for all candidates, (flip, block)."""
    return np.random.default_rng(seed).choice([-1.0, 1.0], size=(_FLIPS, count))
