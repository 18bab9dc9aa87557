"""The recommended pocket: where between the lobes to set the machine, how deep, and with what margin."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from ...indices import Mask
from ...model.machine import Machine
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from .frozen_lobes import lobes_at_amplitude

Limit: TypeAlias = Callable[[Array], Array]
"""The limit in m at speeds in rpm: what `safe_depth` has at those of a chart."""

WANDER = 0.02
"""Share by which the spindle speed, and with it the place of the lobes, may be off."""
RESERVE = 0.10
"""Share by which the depth stays below the lowest limit inside that."""
_FEWEST = 3
_STEP, _CLOSED = WANDER / 4, 2e-4
"""Share of the speed that speeds inside the band are apart at most, and to which a low place in it is closed in."""
_NEAR = 1.1
"""Times the lowest limit of the band up to which a low place in it is looked at."""
_ROUNDS, _SECONDS = 200, 60.0
"""How often, and for how long, further speeds are asked for."""


@dataclass(frozen=True)
class Pocket:
    """A speed and a depth that stay stable when the speed is off by `WANDER` either way."""

    speed: float
    """rpm."""
    depth: float
    """m; `RESERVE` below the lowest limit anywhere within ± `WANDER` of the speed."""
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
        return f"{self.speed:.0f} rpm, {told_depth(self.depth)}, {margin}{rate}"


def told_depth(depth: float) -> str:
    """A depth (m) in mm with three digits, none of which says more than is safe."""
    least = 10.0 ** (np.floor(np.log10(depth * 1e3)) - 2)
    return f"{np.floor(depth * 1e3 / least * (1 + 1e-12)) * least:.3g} mm"


def safe_depth(charts: Sequence[StabilityLobes]) -> Array:
    """The lowest sure limit of several charts at the same speeds, such as those of several amplitudes, in m."""
    return np.asarray(np.min([chart.sure.ravel() for chart in charts], axis=0))


def limit_of(machine: Machine, amplitudes: Sequence[float], method: str | None) -> Limit:
    """The lowest sure limit over tool-point amplitudes (m) at any speeds, by the method of the charts."""
    return lambda speeds: safe_depth([lobes_at_amplitude(machine, speeds, A, method) for A in amplitudes])


def pocket(charts: Sequence[StabilityLobes], cutting: Cutting, limit: Limit | None = None) -> Pocket | None:
    """The recommended pocket under the lowest limit of charts at the same speeds; see `best_pocket`."""
    if any(chart.speed.shape != charts[0].speed.shape or np.any(chart.speed != charts[0].speed) for chart in charts):
        raise InputError("pocket: the charts have different speeds, expected the same")
    return best_pocket(charts[0].speed.ravel(), safe_depth(charts), cutting, limit)


def best_pocket(
    speeds: Array,
    safe: Array,
    cutting: Cutting,
    limit: Limit | None = None,
    at: int | None = None,
    seconds: float = _SECONDS,
) -> Pocket | None:
    """The setting that removes most material per time at constant feed, that is the largest speed × depth.

    ``speeds`` in rpm, ascending, with the limit ``safe`` in m at each. The limit counted at a speed is the lowest one
    within ± 2 % of it, so that a narrow peak between two lobes is not recommended for a height that a small error in
    a natural frequency would take away: with a ``limit`` the lowest of that whole band, at its edges and between the
    speeds as well, as far as so many ``seconds`` suffice; without, that of the speeds in it and of those next to it on
    either side. No depth goes beyond the edges of the cutter, where their length is known. None where there are too
    few speeds to tell (fewer than three within that band), or where neither limit nor length was found. Of all speeds
    that counts which is asked for by its number, ``at``.
    """
    settling, ends = settle(speeds, safe[None], [cutting], at), time.monotonic() + seconds
    try:
        wanted = next(settling)
        while True:
            wanted = settling.send(None if limit is None else _in_time(limit, wanted, ends))
    except StopIteration as settled:
        found: list[Pocket | None] = settled.value
    return found[0]


def _in_time(limit: Limit, wanted: Array, ends: float) -> Array | None:
    """The limits at speeds; None where the time is up, or where the method settles at none of them."""
    try:
        return None if time.monotonic() > ends else limit(wanted)[None]
    except CheckFailed:
        return None


def settle(
    speeds: Array, safe: Array, cuttings: Sequence[Cutting], at: int | None = None, rounds: int = _ROUNDS
) -> Generator[Array, Array | None, list[Pocket | None]]:
    """`best_pocket` of machines that nobody can tell apart when the speed is set, such as samples of one: it is the
    same for all, the one at which they remove most on average, and each has the depth that is stable there for it.

    ``safe`` is (machines, speeds). Machines without any limit have no pocket and no say. Asks for the limits,
    (machines, n), at n further speeds, so many ``rounds`` at most: the speeds that seem best are looked at until none
    can be better than the best of which the whole band is known. Sent None, it goes on with what it has.
    """
    none: list[Pocket | None] = [None] * len(safe)
    reach = np.array([[deepest(cutting)] for cutting in cuttings])
    told, safe = safe, np.minimum(safe, reach)
    bounded = np.any(np.isfinite(safe), axis=1)
    if len(speeds) < _FEWEST or np.any(np.diff(speeds) <= 0) or not np.any(bounded):
        return none
    known, limits, inside = speeds, safe, _inside(speeds)
    inside &= True if at is None else np.arange(len(speeds)) == at
    whole, more = np.zeros(len(speeds), dtype=bool), True
    for left in range(rounds, -1, -1):
        # What is known is at least as large as the lowest of the band, which ends the search.
        worst = _lowest(known, limits, speeds, beyond=False)
        if not more or not left:
            worst = np.where(whole, worst, _lowest(known, limits, speeds, beyond=True))
        counts = inside & np.all(np.isfinite(worst[bounded]), axis=0)
        if not np.any(counts):
            return none
        mean = np.mean(np.where(counts, worst, 0.0)[bounded], axis=0)
        best = int(np.argmax(np.where(counts, speeds * mean, -np.inf)))
        if whole[best] or not more or not left:
            break
        further = _further(known, limits[bounded], float(speeds[best]))
        if not len(further):
            whole[best] = True
            continue
        found = yield further
        more = found is not None
        if found is not None:
            found = np.minimum(found, reach)
            order = np.argsort(np.concatenate([known, further]), kind="stable")
            known = np.concatenate([known, further])[order]
            limits = np.concatenate([limits, found], axis=1)[:, order]
    found_at = none
    speed = float(speeds[best])
    for i in np.flatnonzero(bounded).tolist():
        depth = float((1 - RESERVE) * worst[i, best])
        if depth > 0:
            found_at[i] = Pocket(speed, depth, float(told[i, best]), removal_rate(cuttings[i], speed, depth))
    return found_at


def deepest(cutting: Cutting) -> float:
    """The limit in m at which a pocket, `RESERVE` below, is as deep as the edges of the cutter reach; else inf."""
    return np.inf if cutting.flute_length is None else cutting.flute_length / (1 - RESERVE)


def _further(known: Array, limits: Array, speed: float) -> Array:
    """Speeds in the band round one at which the limits, (machines, known), have yet to be looked at; none when closed.

    First its edges and speeds in between; then those beside every low place, which is met between two of them.
    """
    low, high = speed * (1 - WANDER), speed * (1 + WANDER)
    rows = np.flatnonzero((known >= low) & (known <= high))
    stops = np.unique([low, *known[rows], high])
    parts = [np.linspace(a, b, int(np.ceil((b - a) / (_STEP * speed) - 1e-9)) + 1) for a, b in pairwise(stops)]
    wanted = np.setdiff1d(np.concatenate(parts), known)
    if len(wanted):
        return wanted
    beside, at = [np.zeros(0)], known[rows]
    for depth in limits[:, rows]:
        inner = depth[1:-1]
        lows = (inner <= depth[:-2]) & (inner <= depth[2:]) & (inner <= _NEAR * np.min(depth)) & np.isfinite(inner)
        for row in np.flatnonzero(lows).tolist():
            ends = (pair for pair in pairwise(at[row : row + 3].tolist()) if pair[1] - pair[0] > _CLOSED * speed)
            beside += [np.linspace(*pair, 4)[1:-1] for pair in ends]
    return np.unique(np.concatenate(beside))


def worst_near(speeds: Array, safe: Array) -> tuple[Array, Mask]:
    """The lowest of the limits, (machines, speeds), within ± `WANDER` of each speed, and where that band is known.

    The first speeds beyond its edges count as well: where the limit falls to one of them it is lower at the edge.
    """
    return _lowest(speeds, safe, speeds, beyond=True), _inside(speeds)


def _inside(speeds: Array) -> Mask:
    """Speeds (rpm, ascending) whose whole band lies among them, with three or more in it."""
    low = np.searchsorted(speeds, speeds * (1 - WANDER))
    high = np.searchsorted(speeds, speeds * (1 + WANDER), side="right")
    within = (speeds * (1 - WANDER) >= speeds[0]) & (speeds * (1 + WANDER) <= speeds[-1])
    return np.asarray(within & (high - low >= _FEWEST))


def _lowest(known: Array, limits: Array, speeds: Array, beyond: bool) -> Array:
    """The lowest known limit within ± `WANDER` of each speed, or up to the first speeds on or ``beyond`` its edges."""
    if beyond:
        low = np.maximum(np.searchsorted(known, speeds * (1 - WANDER), side="right") - 1, 0)
        high = np.minimum(np.searchsorted(known, speeds * (1 + WANDER)) + 1, len(known))
    else:
        low = np.searchsorted(known, speeds * (1 - WANDER))
        high = np.searchsorted(known, speeds * (1 + WANDER), side="right")
    ends = np.stack([low, np.maximum(high, low + 1)], axis=1).ravel()
    padded = np.concatenate([limits, np.full((len(limits), 1), np.inf)], axis=1)
    return np.asarray(np.minimum.reduceat(padded, ends, axis=1)[:, ::2])


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
