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
_LOOKS = 2
"""Speeds inside an interval beside a low place, at every closer look."""
_CLOSED = 2e-5
"""Share of the speed to which low places are closed in."""
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


def changes(known: Mapping[str, Array], cuts: int) -> Mask:
    """Intervals between neighbouring speeds in which another chatter takes over."""
    half = np.floor(120 * known["chatter_frequency"] / (cuts * known["speed"]))
    other = (
        (half[1:] != half[:-1]) | (known["kind"][1:] != known["kind"][:-1]) | (known["lobe"][1:] != known["lobe"][:-1])
    )
    return np.asarray(other & (np.diff(known["speed"]) > _NARROW * known["speed"][1:]))


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
    halves, of one phase between teeth.
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
        order = k + waves % 1 if mean else np.concatenate([k + waves % 1, k / 2])
        found.append(60 * f / (cuts * order[order > 0]))
    wanted = np.unique(np.concatenate(found))
    wanted = wanted[(wanted > speed[0]) & (wanted < speed[-1])]
    away = np.min(np.abs(wanted[:, None] - speed), axis=1, initial=np.inf) > _NARROW / 4 * wanted
    return np.asarray(wanted[away])


def beside(known: Mapping[str, Array], near: float) -> Array:
    """Speeds inside the intervals round every low place that is at most ``near`` times the lowest.

    One above the lowest that is level with both its neighbours is known.
    """
    speed, depth, found = known["speed"], known["depth"], [np.zeros(0)]
    for row in _lows(depth, near).tolist():
        level = np.max(depth[max(row - 1, 0) : row + 2]) <= (1 + _LEVEL) * depth[row]
        if level and (1 - _LEVEL) * depth[row] > np.min(depth):
            continue
        for a, b in pairwise(speed[max(row - 1, 0) : row + 2].tolist()):
            if b - a > _CLOSED * b:
                found.append(np.linspace(a, b, _LOOKS + 2)[1:-1])
    return np.unique(np.concatenate(found))
