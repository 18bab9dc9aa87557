"""Charts of Floquet multipliers of any cutter over spindle speed and depth of cut.

At one speed the coefficients a_k of det(1 − z·M(b)) = Σ a_k·z^k are smooth in the depth b, with helix too, though not
entire there: computed at a few Chebyshev depths and interpolated they give every other depth, as in
`loops.multipliers`. Depths computed by themselves, with more nodes, prove it.
"""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed

from ...indices import Index
from ...tool.tool_model import ToolModel
from ..loops import multipliers
from ..loops.characteristic import coefficients, decided, largest_multiplier
from ..process.cutter import Cutter
from ..process.cutting import Cutting
from .march import Marcher
from .pattern_map import FINER, MORE, Answers, PatternMap, pattern_map, pattern_nodes

_GUARD, _RAISES = 5e-4, 5
_FIRST, _MORE, _WORTH, _LEAST = 16, 8, 3, 2
_FEW = 0.25
"""Share of the speeds that must be proved for more depths to be worth while: with helix there may be kinks in depth."""
_TOGETHER, _ALIKE = 60, 1.25
"""Speeds at once, and how many times the slowest of them the fastest may be."""
_COARSE, _KEPT, _ROUNDS, _RESIDUAL = 3, 24, 3, 1e-5
"""Nodes of the maps that are interpolated, beyond the phase; multipliers that take part, rounds to find them, and
by how much of itself the largest may fail to be one."""
_WIDE, _SOME = 300, 4
"""Places of a pattern from which on maps are applied instead of formed, and multipliers asked for then."""


def largest_multipliers(model: ToolModel, cutting: Cutting, speed: Array, depth: Array) -> Array:
    """Largest |μ| from one tooth to the next at every speed (rpm) and depth (m), shape (speeds, depths).

    For teeth that are alike see `loops.multipliers`. Else μ is that over one pattern of m flutes and |μ|^(1/m) is told,
    the growth a tooth on average, proved to 5·10⁻⁴ at some depths of every speed. A speed at which that fails raises
    `CheckFailed`.
    """
    if cutting.plain:
        return multipliers.largest_multipliers(model, cutting, speed, depth)
    cutter = Cutter.of(cutting)
    if np.max(depth) >= cutter.deepest:
        raise CheckFailed(
            f"collocation: at a depth of {np.max(depth) * 1e3:.4g} mm two flutes of different helix meet, which they "
            f"do from {cutter.deepest * 1e3:.4g} mm on; expected depths below that"
        )
    out = np.empty((len(speed), len(depth)))
    for rows in _groups(speed):
        slowest = float(np.min(speed[rows]))
        if len(pattern_nodes(model.fastest, cutter, float(np.max(depth)), slowest).places) > _WIDE:
            for i in rows.tolist():
                out[i] = _one_by_one(model, cutter, float(speed[i]), depth)
            continue
        left = rows
        if len(depth) >= _WORTH * _FIRST:
            left = _in_pieces(out, model, cutter, speed, rows, depth)
        if len(left):
            left = _every_depth(out, model, cutter, speed, left, depth)
        for i in left.tolist():
            out[i] = _one_by_one(model, cutter, float(speed[i]), depth)
    return np.asarray(out ** (1 / len(cutter.flutes)))


def _groups(speed: Array) -> list[Index]:
    """Speeds that share their nodes."""
    groups: list[list[int]] = []
    for i in np.argsort(speed, kind="stable").tolist():
        if groups and len(groups[-1]) < _TOGETHER and speed[i] <= _ALIKE * speed[groups[-1][0]]:
            groups[-1].append(i)
        else:
            groups.append([i])
    return [np.array(group) for group in groups]


def _in_pieces(out: Array, model: ToolModel, cutter: Cutter, speed: Array, rows: Index, depth: Array) -> Index:
    """Fill rows of a chart piece by piece of the depths; those that could not be proved.

    Where the top of an edge comes into the cut as the tip of the next one does, the coefficients have a kink: κ·b is a
    pitch then. Uneven flutes have more and weaker kinks, through which more depths lead sooner than pieces.
    """
    turn = cutter.flutes[0].lag * depth / cutter.pattern if len(cutter.flutes) == 1 else 0 * depth
    pieces = [np.flatnonzero(np.floor(turn) == k) for k in np.unique(np.floor(turn))]
    left = rows
    for piece in pieces:
        part = np.empty((len(out), len(piece)))
        low = float(np.min(depth[piece])) if len(pieces) > 1 and piece[0] != 0 else 0.0
        missing = _filled(part, model, cutter, speed, rows, depth[piece], low)
        if len(missing) and len(pieces) > 1:
            missing = _every_depth(part, model, cutter, speed, missing, depth[piece])
        out[np.ix_(rows, piece)] = part[rows]
        left = np.intersect1d(left, rows[~np.isin(rows, missing)])
    return rows[~np.isin(rows, left)]


def _filled(out: Array, model: ToolModel, cutter: Cutter, speed: Array, rows: Index, depth: Array, low: float) -> Index:
    """Fill rows of a chart from a depth ``low`` on; those that could not be proved."""
    order = np.argsort(depth)
    deepest, early = float(np.max(depth)), int(order[len(order) // 8])
    count, states = _FIRST, 2 * len(model.poles)
    while count * _LEAST <= len(depth):
        angle = np.pi * (np.arange(count) + 0.5) / count
        share = (low + (deepest - low) * (1 + np.cos(angle)) / 2) / deepest
        transform = 2 / count * np.cos(angle[:, None] * np.arange(count))
        transform[:, 0] /= 2
        more = _COARSE + (count - _FIRST) // 4
        a = _coefficients(model, cutter, speed[rows], deepest * share, more)
        beyond = np.maximum(0, np.arange(len(a)) - states)[:, None, None]
        basis = np.cos(np.arange(count)[:, None] * np.arccos(np.clip(2 * (depth - low) / (deepest - low) - 1, -1, 1)))
        found = largest_multiplier((a / share**beyond) @ transform @ basis * (depth / deepest) ** beyond)
        near = np.argmin(np.abs(found - 1), axis=1)
        at = np.unique([early, int(np.argmax(depth)), int(np.median(near))])
        proved = np.stack([_exact(model, cutter, speed[rows], float(depth[k]), MORE) for k in at], axis=1)
        good = np.all(np.abs(found[:, at] - proved) <= _GUARD * np.maximum(proved, 1), axis=1)
        out[rows[good]] = found[good]
        rows = rows[~good]
        if not len(rows) or np.count_nonzero(good) < _FEW * len(good):
            break
        count += _MORE
    return rows


def _every_depth(out: Array, model: ToolModel, cutter: Cutter, speed: Array, rows: Index, depth: Array) -> Index:
    """Fill rows of a chart depth by depth, all speeds together; those that could not be proved."""
    out[rows] = np.stack([_exact(model, cutter, speed[rows], b, MORE) for b in depth.tolist()], axis=1)
    order = np.argsort(depth)
    at = np.unique(order[[len(order) // 2, -1]])
    proved = np.stack([_exact(model, cutter, speed[rows], float(depth[k]), MORE + FINER) for k in at], axis=1)
    return rows[np.any(np.abs(out[rows][:, at] - proved) > _GUARD * np.maximum(proved, 1), axis=1)]


def _coefficients(model: ToolModel, cutter: Cutter, speed: Array, depth: Array, more: int) -> Array:
    """a_k at speeds and depths, (k, speeds, depths), as many as matter."""
    axes = ["xy".index(axis) for axis in model.axes]
    found, answers = list[Array](), None
    for b in depth.tolist():
        if answers is None or cutter.twisted:
            answers = Answers.of(model, pattern_nodes(model.fastest, cutter, b, float(np.min(speed)), more), speed)
        found.append(coefficients(_strongest(PatternMap.of(answers, b, axes).maps())))
    most = max(len(a) for a in found)
    return np.stack([np.pad(a, ((0, most - len(a)), (0, 0))) for a in found], axis=2)


def _strongest(M: Array) -> ComplexArray:
    """The multipliers that are largest, at least of `_KEPT` of them the first half to all digits that matter.

    Those of a large map on the subspace that its powers turn any vectors into: they fall off so fast that few do. Where
    the largest there is no eigenvalue of the map, as on a machine whose many slow modes hardly die out over a pattern,
    all are computed: of every map as many.
    """
    size = M.shape[-1]
    if size <= 2 * _KEPT:
        return np.linalg.eigvals(M).astype(complex)
    V = np.broadcast_to(np.cos(np.arange(size)[:, None] * np.arange(1, _KEPT + 1) ** 2), (len(M), size, _KEPT))
    for _ in range(_ROUNDS):
        V, _ = np.linalg.qr(M @ (M @ V))
    moved = M @ V
    own = V.swapaxes(1, 2) @ moved
    found, vectors = np.linalg.eig(own)
    largest = np.argmax(np.abs(found), axis=1)[:, None]
    value, vector = np.take_along_axis(found, largest, axis=1), np.take_along_axis(vectors, largest[:, None], axis=2)
    left = np.linalg.norm(moved @ vector - value[..., None] * (V @ vector), axis=(1, 2))
    if np.all(left <= _RESIDUAL * np.abs(value[:, 0])):
        return np.asarray(found.astype(complex))
    return np.linalg.eigvals(M).astype(complex)


def _exact(model: ToolModel, cutter: Cutter, speed: Array, depth: float, more: int) -> Array:
    return np.asarray(np.max(np.abs(_strongest(pattern_map(model, cutter, speed, depth, more).maps())), axis=-1))


def _one_by_one(model: ToolModel, cutter: Cutter, speed: float, depth: Array) -> Array:
    """Largest |μ| over a pattern at one speed, every depth by itself: by a march, which needs no matrix of the map."""
    check, more = np.unique([np.max(depth), np.median(depth)]), MORE

    def sizes(depths: Array, more: int) -> Array:
        marcher = Marcher(model, cutter, speed, more)
        return np.array([abs(marcher.at(b).multipliers(count=_SOME)[0]) for b in depths.tolist()])

    found = [sizes(check, more)]
    for _ in range(_RAISES):
        found.append(sizes(check, more + FINER))
        if np.all(np.abs(found[-1] - found[-2]) <= _GUARD * np.maximum(found[-1], 1)):
            return sizes(depth, more)
        more += FINER
    if len(check) == len(depth) and (sure := decided(found)) is not None:
        return sure[np.searchsorted(check, depth)]
    raise CheckFailed(f"collocation: at {speed:g} rpm the multipliers still change with the number of nodes")
