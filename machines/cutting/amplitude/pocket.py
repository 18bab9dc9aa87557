"""The recommended pocket: where between the lobes to set the machine, how deep, and with what margin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

from ...indices import Mask
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting

WANDER = 0.02
"""Share by which the spindle speed, and with it the place of the lobes, may be off."""
RESERVE = 0.10
"""Share by which the depth stays below the lowest limit inside that."""
_FEWEST = 3


@dataclass(frozen=True)
class Pocket:
    """A speed and a depth that stay stable when the speed is off by `WANDER` either way."""

    speed: float
    """rpm."""
    depth: float
    """m; `RESERVE` below the lowest limit within ± `WANDER` of the speed."""
    limit: float
    """m; the limit at the speed itself."""
    removal_rate: float | None
    """Of the cut in m³/s, see `removal_rate`."""

    @property
    def margin(self) -> float:
        """By what share of itself the depth may grow at this speed before the cut chatters."""
        return self.limit / self.depth - 1

    def words(self) -> str:
        """``7850 rpm, 3.1 mm, margin 18 %``."""
        rate = "" if self.removal_rate is None else f", {self.removal_rate * 60e6:.3g} cm³/min"
        margin = f"margin {100 * self.margin:.0f} %" if np.isfinite(self.margin) else "no limit met at the speed itself"
        return f"{self.speed:.0f} rpm, {self.depth * 1e3:.3g} mm, {margin}{rate}"


def safe_depth(charts: Sequence[StabilityLobes]) -> Array:
    """The lowest sure limit of several charts at the same speeds, such as those of several amplitudes, in m."""
    return np.asarray(np.min([chart.sure.ravel() for chart in charts], axis=0))


def pocket(charts: Sequence[StabilityLobes], cutting: Cutting) -> Pocket | None:
    """The recommended pocket under the lowest limit of charts at the same speeds; see `best_pocket`."""
    if any(chart.speed.shape != charts[0].speed.shape or np.any(chart.speed != charts[0].speed) for chart in charts):
        raise InputError("pocket: the charts have different speeds, expected the same")
    return best_pocket(charts[0].speed.ravel(), safe_depth(charts), cutting)


def best_pocket(speeds: Array, safe: Array, cutting: Cutting) -> Pocket | None:
    """The setting that removes most material per time at constant feed, that is the largest speed × depth.

    ``speeds`` in rpm, ascending, with the limit ``safe`` in m at each. The limit counted at a speed is the lowest one
    within ± 2 % of it, so that a narrow peak between two lobes is not recommended for a height that a small error in
    a natural frequency would take away. None where there are too few speeds to tell (fewer than three within that
    band), or where no limit was found at all.
    """
    return common_pockets(speeds, safe[None], [cutting])[0]


def common_pockets(speeds: Array, safe: Array, cuttings: Sequence[Cutting]) -> list[Pocket | None]:
    """`best_pocket` of machines that nobody can tell apart when the speed is set, such as samples of one: it is the
    same for all, the one at which they remove most on average, and each has the depth that is stable there for it.

    ``safe`` is (machines, speeds). Machines without any limit have no pocket and no say.
    """
    none: list[Pocket | None] = [None] * len(safe)
    bounded = np.any(np.isfinite(safe), axis=1)
    if len(speeds) < _FEWEST or np.any(np.diff(speeds) <= 0) or not np.any(bounded):
        return none
    worst, inside = worst_near(speeds, safe)
    counts = inside & np.all(np.isfinite(worst[bounded]), axis=0)
    if not np.any(counts):
        return none
    best = int(np.argmax(np.where(counts, speeds * np.mean(np.where(counts, worst, 0.0)[bounded], axis=0), -np.inf)))
    speed = float(speeds[best])
    found = none
    for i in np.flatnonzero(bounded).tolist():
        depth = float((1 - RESERVE) * worst[i, best])
        if depth > 0:
            found[i] = Pocket(speed, depth, float(safe[i, best]), removal_rate(cuttings[i], speed, depth))
    return found


def worst_near(speeds: Array, safe: Array) -> tuple[Array, Mask]:
    """The lowest of the limits, (machines, speeds), within ± `WANDER` of each speed, and where that band is known."""
    low = np.searchsorted(speeds, speeds * (1 - WANDER))
    high = np.searchsorted(speeds, speeds * (1 + WANDER), side="right")
    inside = (speeds * (1 - WANDER) >= speeds[0]) & (speeds * (1 + WANDER) <= speeds[-1]) & (high - low >= _FEWEST)
    ends = np.stack([low, np.maximum(high, low + 1)], axis=1).ravel()
    padded = np.concatenate([safe, np.full((len(safe), 1), np.inf)], axis=1)
    return np.asarray(np.minimum.reduceat(padded, ends, axis=1)[:, ::2]), np.asarray(inside)


def removal_rate(cutting: Cutting, speed: float, depth: float) -> float | None:
    """Volume cut per time in m³/s; None where the feed or the diameter is not given.

    Milling: Q = b·a·f_z·N·n with the radial depth a = immersion × diameter; turning: Q = b·f·π·D·n (n in 1/s).
    """
    if cutting.feed is None or cutting.diameter is None:
        return None
    turns = speed / 60
    if cutting.process == "turning":
        return depth * cutting.feed * np.pi * cutting.diameter * turns
    width = cutting.diameter * (1.0 if cutting.immersion is None else cutting.immersion)
    return depth * width * cutting.feed * cutting.cuts_per_revolution * turns
