"""Charts of Floquet multipliers over spindle speed and depth of cut.

At one speed det(1 − z·M(w)) = Σ a_k(w)·z^k, M being the map over one tooth period at depth w. The multipliers
themselves part and meet as the depth grows, but the a_k are smooth: a_k = w^max(0, k − states)·f_k(w) with entire f_k,
as at w = 0 only the modes carry anything over a period. So the multipliers are computed at a few Chebyshev depths;
f_k from them, interpolated, give every other depth. Their last Chebyshev coefficients tell what is left out, and depths
computed without interpolation, with more nodes, prove it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed

from ...indices import Index
from ...tool.tool_model import ToolModel
from ..process.cutting import Cutting
from .characteristic import coefficients, decided, largest_multiplier
from .collocation import FINER, MORE, ArcMap, arc_map, node_count

_GUARD = 1e-7
_RAISES, _RAISES_OF_GROUPS = 8, 4
_FIRST, _MORE_DEPTHS, _SPARE = 12, 4, 2
_WORTH = 3
"""Depths of the chart for which each Chebyshev depth must stand."""
_LEFT, _NOTHING = 3e-10, 1e-12
_ROUNDING, _LEVEL, _RANDOM = 1e-6, 30.0, 5.0
"""Last terms below the first, within the second of each other, are errors of rounding; what is looked at must be the
third closer then, as elsewhere such errors may be larger."""
_ALIKE = 3
_RANGE, _SMALLEST = 100.0, 1e-300
"""Powers of ten over which the a_k may spread."""
_BLOCK, _HELD = 200_000, 5
"""Numbers held at once, in about so many arrays, so that memory does not grow with the chart."""


def largest_multipliers(model: ToolModel, cutting: Cutting, speed: Array, depth: Array) -> Array:
    """Largest |μ| over one tooth period at every speed (rpm) and depth (m), shape (speeds, depths).

    The number of nodes is raised until four more change no multiplier at the depths looked at by more than 10⁻⁷ of
    itself (of 1 where it is smaller): the largest and the middle one, in an interpolated chart also the one that
    leaves out most and the one nearest the boundary. A speed at which that fails raises `CheckFailed`.
    """
    out = np.empty((len(speed), len(depth)))
    left, single, count = np.arange(len(speed)), list[int](), _FIRST
    for more in range(MORE, MORE + FINER * _RAISES_OF_GROUPS, FINER):
        failed = list[int]()
        for group in _groups(model, cutting, speed[left], more):
            rows = left[group]
            series = _interpolated(arc_map(model, cutting, speed[rows], more), depth, count)
            if series is None:
                single.extend(rows.tolist())
                continue
            count = series.needed + _SPARE
            looked = _filled(out, rows, series, depth)
            finer = arc_map(model, cutting, speed[rows], more + FINER).multipliers(depth[looked])
            exact = np.max(np.abs(finer), axis=-1)
            guard = _GUARD / _RANDOM if series.rounded else _GUARD
            proved = np.abs(out[rows[:, None], looked] - exact) <= guard * np.maximum(exact, 1)
            (single if series.rounded else failed).extend(rows[~np.all(proved, axis=1)].tolist())
        left = np.array(failed, dtype=np.intp)
    for i in (*single, *left.tolist()):
        out[i] = _one_by_one(model, cutting, float(speed[i]), depth)
    return out


@dataclass(frozen=True, eq=False)
class _Series:
    """Chebyshev coefficients of f_k over depth, shape (k, speeds, count), and how many of them matter.

    They are ``rounded`` where they end in errors of rounding, as with many modes that last alike.
    """

    terms: Array
    states: int
    deepest: float
    needed: int
    rounded: bool

    def __call__(self, depth: Array) -> tuple[Array, Array]:
        """Largest |μ| at depths and the share of it that the last terms have in the a_k, shape (speeds, d) each."""
        share = depth / self.deepest
        count = self.terms.shape[-1]
        k = np.arange(len(self.terms))[:, None, None]
        grown = share ** np.maximum(0, k - self.states)
        basis = np.cos(np.arange(count)[:, None] * np.arccos(np.clip(2 * share - 1, -1, 1)))
        size = largest_multiplier(self.terms @ basis * grown)
        last = np.sum(np.abs(self.terms[:, :, -_SPARE:]), axis=2)
        return size, np.einsum("kb,kbd->bd", last, grown / size**k)


def _interpolated(coarse: ArcMap, depth: Array, count: int) -> _Series | None:
    """The series of one or more speeds; None where it needs so many depths that the chart is sooner computed."""
    states, deepest = coarse.period.shape[-1], float(np.max(depth))
    while count * _WORTH <= len(depth):
        share, transform = _chebyshev(count)
        mu = coarse.multipliers(deepest * share)
        size = np.maximum(np.max(np.abs(mu), axis=-1), _SMALLEST)
        a = coefficients(mu / size[..., None])
        a = a[: int(np.flatnonzero(np.max(np.abs(a), axis=(1, 2)) > _NOTHING)[-1]) + 1]
        if len(a) * np.max(np.abs(np.log10(size))) > _RANGE:
            return None
        k = np.arange(len(a))[:, None, None]
        grown = share ** np.maximum(0, k - states)
        terms = (a * size**k / grown) @ transform
        weight = np.max(grown / size**k, axis=(1, 2))
        left = weight @ np.max(np.abs(terms), axis=1)
        end = left[-_MORE_DEPTHS:]
        rounding = float(np.max(end)) if np.max(end) < min(_ROUNDING, _LEVEL * np.min(end)) else 0.0
        needed = 1 + int(np.flatnonzero(left > max(_LEFT, 2 * rounding))[-1])
        if needed + _SPARE <= count:
            return _Series(terms, states, deepest, needed, rounding > _LEFT)
        count += _MORE_DEPTHS
    return None


def _filled(out: Array, rows: Index, series: _Series, depth: Array) -> Index:
    """Fill rows of a chart; the depths to look at, shape (rows, 4)."""
    worst, nearest = np.zeros((2, len(rows))), np.zeros((2, len(rows)))
    nearest[1] = np.inf
    block = max(1, _BLOCK // (_HELD * len(series.terms) * len(rows)))
    for start in range(0, len(depth), block):
        size, left = series(depth[start : start + block])
        out[rows, start : start + block] = size
        for kept, value in ((worst, -left), (nearest, np.abs(size - 1))):
            at = np.argmin(value, axis=1)
            lowest = np.take_along_axis(value, at[:, None], axis=1)[:, 0]
            kept[:] = np.where(lowest < kept[1], (start + at, lowest), kept)
    order = np.argsort(depth)
    always = np.broadcast_to([[order[-1]], [order[len(order) // 2]]], (2, len(rows)))
    return np.stack([*always, worst[0], nearest[0]], axis=1).astype(np.intp)


def _groups(model: ToolModel, cutting: Cutting, speed: Array, more: int) -> list[Index]:
    """Speeds that need about as many nodes, as many as fit into a block; the slowest alone, to learn from it."""
    count = np.array([node_count(model, cutting, rpm, more) for rpm in speed.tolist()], dtype=int)
    groups: list[list[int]] = []
    for i in np.argsort(-count, kind="stable").tolist():
        most = int(count[groups[-1][0]]) if groups else 0
        room = _BLOCK // (_HELD * (most * len(model.axes) + 2 * len(model.poles)) ** 2)
        if len(groups) > 1 and count[i] > most - _ALIKE and len(groups[-1]) < room:
            groups[-1].append(i)
        else:
            groups.append([i])
    return [np.array(group) for group in groups]


@lru_cache(maxsize=32)
def _chebyshev(count: int) -> tuple[Array, Array]:
    """Depths as shares of the deepest and the matrix from values there (rows) to Chebyshev terms (columns)."""
    angle = np.pi * (np.arange(count) + 0.5) / count
    transform = 2 / count * np.cos(angle[:, None] * np.arange(count))
    transform[:, 0] /= 2
    return (1 + np.cos(angle)) / 2, transform


def _one_by_one(model: ToolModel, cutting: Cutting, speed: float, depth: Array) -> Array:
    """Largest |μ| at one speed, every depth by itself."""
    check = np.unique([np.max(depth), np.median(depth)])
    coarse = arc_map(model, cutting, speed)
    sizes = [np.max(np.abs(coarse.multipliers(check)), axis=-1)]
    for raised in range(_RAISES):
        found = arc_map(model, cutting, speed, MORE + FINER * (raised + 1))
        sizes.append(np.max(np.abs(found.multipliers(check)), axis=-1))
        if np.all(np.abs(sizes[-1] - sizes[-2]) <= _GUARD * np.maximum(sizes[-1], 1.0)):
            break
        coarse = found
    else:
        if len(check) == len(depth) and (sure := decided(sizes)) is not None:
            return np.asarray(sure[np.searchsorted(check, depth)])
        raise CheckFailed(f"collocation: at {speed:g} rpm the multipliers still change with the number of nodes")
    block = max(1, _BLOCK // coarse.size**2)
    parts = [coarse.multipliers(depth[start : start + block]) for start in range(0, len(depth), block)]
    return np.concatenate([np.max(np.abs(part), axis=-1) for part in parts])
