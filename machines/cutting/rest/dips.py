"""Where the boundary of a chart may dip between the speeds that are known of it.

``known`` holds the fields of a chart by speed, in rows of ascending speed (rpm).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array

from ...indices import Index, Mask

NEAR, AS_LOW = 1.5, 1.02
"""Times the lowest limit up to which a low place is looked at; of a mean cut, whose lobes are all nearly as low."""
_SAME, _PHASES = 0.02, 10
"""Share by which frequencies of one chatter differ, and parts of a wave between teeth that are told apart."""
_GAINED, _TOLD = 1e-7, 1e-4
"""Share by which the bottom of a parabola lies below what is known where the lowest place, and another, is closed."""
_CLOSED = 2e-5
"""Share of the speed to which low places are closed in; the lowest to a tenth of it."""
_NARROW = 1e-3
"""Share of the speed below which an interval is not halved."""
_LEVEL = 1e-3
"""Share by which the limit rises from a low place to the speeds beside it, up to which no closer look is needed."""
_DIPS = 1 - 1e-3
_RESOLVED = 3
"""Flips from which on what lies between two Hopf chatters is known."""


def hidden(known: Mapping[str, Array], grid: Array) -> Mask:
    """The lowest speed of every interval of the grid that dips below both its ends."""
    speed, depth = known["speed"], known["depth"]
    ends = depth[np.searchsorted(speed, grid)]
    interval = np.clip(np.searchsorted(grid, speed, side="right") - 1, 0, len(grid) - 2)
    below = depth < _DIPS * np.minimum(ends[interval], ends[interval + 1])
    found = np.zeros(len(speed), dtype=bool)
    order = np.lexsort((depth, interval))
    order = order[below[order]]
    found[order[np.unique(interval[order], return_index=True)[1]]] = True
    return found


def changes(known: Mapping[str, Array], cuts: int) -> Array:
    """A speed inside every interval between neighbouring speeds in which another chatter takes over.

    Where two speeds of either chatter are known it is that at which straight lines through their depths meet: there the
    limit is highest and a third chatter shows most. One that is as good as known is left out.
    """
    speed, depth, found = known["speed"], known["depth"], list[float]()
    half = np.floor(120 * known["chatter_frequency"] / (cuts * speed))
    same = np.column_stack([half, known["lobe"], known["kind"] == "flip"])
    other = np.any(same[1:] != same[:-1], axis=1) & (np.diff(speed) > _NARROW * speed[1:])
    for row in np.flatnonzero(other).tolist():
        a, b = float(speed[row]), float(speed[row + 1])
        at = (a + b) / 2
        if 0 < row < len(speed) - 2 and np.all(same[[row - 1, row + 2]] == same[[row, row + 1]]):
            rises = (depth[row] - depth[row - 1]) / (a - speed[row - 1])
            falls = (depth[row + 2] - depth[row + 1]) / (speed[row + 2] - b)
            meet = (depth[row + 1] - depth[row] + rises * a - falls * b) / (rises - falls) if rises > falls else at
            at = float(meet) if a < meet < b else at
        if min(at - a, b - at) > _NARROW / 2 * at:
            found.append(at)
    return np.array(found)


def half(known: Mapping[str, Array], cuts: int) -> Array:
    """Speeds at which a Hopf chatter meets half of the teeth, by its frequency at the nearest speeds on either side."""
    hopf = np.flatnonzero(known["kind"] == "hopf")
    speed, f, lobe = (known[key][hopf] for key in ("speed", "chatter_frequency", "lobe"))
    waves, between = np.floor(120 * f / (cuts * speed)), np.diff(hopf) - 1
    met = (waves[1:] == waves[:-1] - 1) & (lobe[1:] == lobe[:-1]) & (between < _RESOLVED)
    a = np.flatnonzero(met & (np.diff(speed) > _CLOSED * speed[1:]))
    slope = (f[a + 1] - f[a]) / (speed[a + 1] - speed[a])
    # Where 120·(f + slope·(n − speed)) = cuts·waves·n.
    at = 120 * (f[a] - slope * speed[a]) / (cuts * waves[a] - 120 * slope)
    new = (at > speed[a]) & (at < speed[a + 1])
    near = np.min(np.abs(at[:, None] - known["speed"]), axis=1, initial=np.inf)
    return np.asarray(at[new & (near > _CLOSED / 2 * at)])


def _lows(depth: Array, near: float) -> Index:
    """Rows that are lower than both neighbours and at most ``near`` times the lowest of all."""
    padded = np.concatenate([[np.inf], depth, [np.inf]])
    low = (depth <= padded[:-2]) & (depth <= padded[2:]) & (depth <= near * np.min(depth)) & np.isfinite(depth)
    return np.flatnonzero(low)


def alike(known: Mapping[str, Array], cuts: int, mean: bool) -> Array:
    """Speeds at which a chatter that is lowest somewhere stands to the teeth as it does there, or at half of them.

    The lowest place of a chatter tells of all its lobes: of one frequency and, but in a ``mean`` cut, which knows no
    halves, of one phase between teeth. Where a lobe is lowest on both sides of such a speed it is known there.
    """
    speed = known["speed"]
    rows, found = _lows(known["depth"], NEAR), [np.zeros(0)]
    own = np.round(np.log(known["chatter_frequency"][rows]) / _SAME)
    if not mean:
        waves = 60 * known["chatter_frequency"][rows] / (cuts * speed[rows])
        own = own + np.round(_PHASES * (waves % 1)) % _PHASES / _PHASES
    order = np.lexsort((known["depth"][rows], own))
    rows = rows[order[np.unique(own[order], return_index=True)[1]]]
    for row in rows.tolist():
        f = float(known["chatter_frequency"][row])
        waves = 60 * f / (cuts * speed[row])
        k = np.arange(int(60 * f / (cuts * speed[0])) + 2.0)
        again = k + waves % 1
        again = 60 * f / (cuts * again[again > 0])
        found += [again] if mean else [again[~_between(known, again, f)], 60 * f / (cuts * k[1:] / 2)]
    wanted = np.unique(np.concatenate(found))
    wanted = wanted[(wanted > speed[0]) & (wanted < speed[-1])]
    away = np.min(np.abs(wanted[:, None] - speed), axis=1, initial=np.inf) > _NARROW / 4 * wanted
    return np.asarray(wanted[away])


def _between(known: Mapping[str, Array], speed: Array, frequency: float) -> Mask:
    """Which speeds lie between two at which the same lobe of a chatter at a frequency in Hz is lowest."""
    after = np.clip(np.searchsorted(known["speed"], speed), 1, len(known["speed"]) - 1)
    near = np.abs(np.log(known["chatter_frequency"] / frequency)) < _SAME
    both = (known["lobe"][after] == known["lobe"][after - 1]) & (known["kind"][after] == known["kind"][after - 1])
    return np.asarray(both & near[after] & near[after - 1])


def beside(known: Mapping[str, Array], near: float) -> Array:
    """Speeds at which to look for the bottom of every low place that is at most ``near`` times the lowest.

    That is where the parabola through three speeds with its chatter has its bottom; where that lies beyond, the middle
    of the interval on that side, and where fewer are known, of either. A place above the lowest that is level with both
    its neighbours is known.
    """
    speed, depth, found = known["speed"], known["depth"], list[float]()
    for row in _lows(depth, near).tolist():
        ends = speed[max(row - 1, 0) : row + 2]
        level = np.max(depth[max(row - 1, 0) : row + 2]) <= (1 + _LEVEL) * depth[row]
        if level and (1 - _LEVEL) * depth[row] > np.min(depth):
            continue
        lowest = depth[row] <= (1 + _LEVEL) * np.min(depth)
        apart, gained = (_CLOSED / 10, _GAINED) if lowest else (_CLOSED, _TOLD)
        sides, own = list(pairwise(ends.tolist())), _own(known, row)
        if len(own) == 3:
            at, lower = _bottom(speed[own], depth[own], float(speed[row]))
            if ends[0] < at < ends[-1]:
                if lower > gained * depth[row] and np.min(np.abs(at - ends)) > apart / 2 * at:
                    found.append(at)
                continue
            sides = sides[:1] if at <= ends[0] else sides[-1:]
        found += [(a + b) / 2 for a, b in sides if b - a > apart * b]
    return np.unique(found)


def _own(known: Mapping[str, Array], row: int) -> Index:
    """The rows next to one, itself among them, at which the same chatter is lowest: three, or fewer where it ends."""
    alike = (known["lobe"] == known["lobe"][row]) & (known["kind"] == known["kind"][row])
    first = row - int(np.argmin(np.append(alike[row::-1], False))) + 1
    last = row + int(np.argmin(np.append(alike[row:], False)))
    start = int(np.clip(row - 1, first, max(first, last - 3)))
    return np.arange(start, min(start + 3, last))


def _bottom(speed: Array, depth: Array, of: float) -> tuple[float, float]:
    """Where a parabola through three places has its bottom, and by how much that lies below one ``of`` them."""
    left, right = speed[1] - speed[0], speed[2] - speed[1]
    falls, rises = (depth[1] - depth[0]) / left, (depth[2] - depth[1]) / right
    bend = (rises - falls) / (left + right)
    if not bend > 0:
        return (np.inf if falls + rises < 0 else -np.inf), 0.0
    at = (speed[0] + speed[1] - falls / bend) / 2
    return float(at), float(bend * (at - of) ** 2)
