"""Milling lobes and Floquet multipliers of a tool with modes, by Chebyshev collocation on the arc of cut.

M q̈ + C q̇ + K q = −w·H(t)·[q(t) − q(t − τ)] over one tooth period: without a tooth in the cut the modes ring freely and
exactly; in the cut they are collocated at Chebyshev nodes, with the surface left at the same nodes one period earlier
(cf. Bayly et al. 2003; Butcher et al. 2009). With H = U·Vᵀ, η = Vᵀq at the nodes and g = η − η(t − τ), the modal state
x over one period is

    η = R·x(0) − w·T·g,   x(τ) = E·x(0) − w·L·g,

where R, T, E and L depend on the spindle speed but not on the depth. The multipliers are the eigenvalues of
(x, η) → (x, η) one period on; and the loop T + R·(e^(jωτ) − E)⁻¹·L gives the boundary without a scan over depths.
Too few nodes make a cut look stable, so every result is computed with n and n + 4 nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed

from ...tool.tool_model import ToolModel
from ..process.cutting import Cutting

MORE = 10
"""Nodes beyond θ = ω_max·t of a stretch of cut."""
_LONGEST = 60.0
"""θ above which a stretch is split."""
FINER = 4
_Stretch = tuple[float, float, Array]
MOST_NODES, MOST_SETTLED = 1000, 4000
"""Nodes up to which the map is searched, and up to which a crossing is followed on it."""


@dataclass(frozen=True, eq=False)
class ArcMap:
    """One tooth period at a speed, or at several along a first axis; see the module for R, T, E and L.

    ``time`` of the nodes in tooth periods, ``weight`` of a quadrature over them, ``along`` U, shape (nodes, axes, r).
    """

    entry: Array
    volterra: Array
    period: Array
    push: Array
    time: Array
    weight: Array
    along: Array

    def __call__(self, fraction: Array) -> ComplexArray:
        """The loop at ν = ωτ/2π, shape (g, nodes·r, nodes·r), for the search of the boundary at one speed."""
        turn = np.exp(2j * np.pi * fraction)[:, None, None]
        ring = np.linalg.solve(turn * np.eye(len(self.period)) - self.period, self.push.astype(complex))
        return np.asarray(self.volterra + self.entry @ ring)

    def force(self, fraction: float, carried: ComplexArray, orders: Array) -> ComplexArray:
        """Harmonics of the force at ω + qω_T for an eigenvector of the loop, shape (orders, axes)."""
        chip = carried.reshape(len(self.time), -1) * self.weight[:, None]
        turn = np.exp(-2j * np.pi * (fraction + orders)[:, None] * self.time)
        return np.asarray(turn @ np.einsum("kar,kr->ka", self.along, chip))

    @property
    def size(self) -> int:
        """Number of Floquet multipliers."""
        return int(self.period.shape[-1] + self.volterra.shape[-1])

    def multipliers(self, depth: Array) -> ComplexArray:
        """All Floquet multipliers at depths in m, shape (…, d) → (…, d, size)."""
        if self.volterra.ndim == 2:
            return np.asarray(np.linalg.eigvals(self.maps(depth)), dtype=complex)
        several = np.broadcast_to(depth, (len(self.volterra), depth.shape[-1]))
        return np.stack([self.at(i).multipliers(w) for i, w in enumerate(several)])

    def at(self, i: int) -> ArcMap:
        """The map at one of several speeds."""
        return replace(self, entry=self.entry[i], volterra=self.volterra[i], period=self.period[i], push=self.push[i])

    def maps(self, depth: Array) -> Array:
        """(x, η) → (x, η) one tooth period on, at depths in m, shape (…, d) → (…, d, size, size)."""
        states, one = self.period.shape[-1], np.eye(self.volterra.shape[-1])
        w = depth[..., None, None]
        entry, push = self.entry[..., None, :, :], self.push[..., None, :, :]
        Z = np.linalg.inv(one + w * self.volterra[..., None, :, :])
        whole = np.empty((*Z.shape[:-2], self.size, self.size))
        whole[..., states:, :states] = Z @ entry
        np.subtract(one, Z, out=whole[..., states:, states:])
        pushed = w * (push @ Z)
        whole[..., :states, states:] = pushed
        whole[..., :states, :states] = self.period[..., None, :, :] - pushed @ entry
        return whole


def arc_map(
    model: ToolModel,
    cutting: Cutting,
    speed: float | Array,
    more: int = MORE,
    share: float = 1.0,
    most: int = MOST_NODES,
) -> ArcMap:
    """The map over one tooth period at a speed in rpm, with ⌈``share``·θ⌉ + ``more`` nodes per stretch of cut.

    More nodes than ``most`` are refused. Several speeds, shape (b,), have the nodes of the slowest in common and become
    the first axis of the map.
    """
    slowest, stretches = float(np.min(speed)), _stretches(cutting)
    needed = _count(model, stretches, slowest, more)
    if needed > most:
        raise CheckFailed(
            f"collocation: at {slowest:g} rpm the cut of a tooth takes {needed} nodes for modes of up to "
            f"{model.fastest / (2 * np.pi):.0f} Hz, expected at most {most}: a faster speed or lower modes"
        )
    modes, axes = len(model.poles), tuple("xy".index(axis) for axis in model.axes)
    pitch = 2 * np.pi / cutting.cuts_per_revolution
    turning = 2 * np.pi * np.asarray(speed, dtype=float) / 60
    shape = turning.shape
    state = np.broadcast_to(np.concatenate([np.eye(modes), 1j * np.eye(modes)], axis=1), (*shape, modes, 2 * modes))
    pushed: list[ComplexArray] = []
    entry, rows, times, weights, forces = [], [], [], [], []
    seen = model.weight[:, None] * model.outputs
    for start, end, cut in stretches:
        duration = (end - start) / turning
        if not len(cut):
            ring = np.exp(model.poles * duration[..., None])[..., None]
            state, pushed = ring * state, [ring * part for part in pushed]
            continue
        pieces, count = _nodes(model, float(np.min(turning)), end - start, more, share)
        _, derivative, rule = chebyshev(count)
        rate = 2 * pieces / duration[..., None, None, None]
        inverse = np.linalg.inv(rate * derivative[1:, 1:] - model.poles[:, None, None] * np.eye(count))
        free = -rate[..., 0] * (inverse @ derivative[1:, 0])
        for piece in range(pieces):
            angle, U, V = _cut(cutting, axes, (start, end), (piece, pieces), count)
            look, drive = np.tensordot(seen, V, (1, 1)), np.tensordot(model.inputs, U, (1, 1))
            ring = np.einsum("pkr,...pk->...krp", look, free).reshape(*shape, -1, modes)
            entry.append((ring @ state).real)
            earlier = [(ring @ part).real for part in pushed]
            own = np.einsum("pkr,...pklc->...krlc", look, inverse[..., None] * drive[:, None]).real
            every = np.arange(count)
            own[..., every, :, every, :] += np.einsum("kar,ab,kbc->krc", V, model.direct, U).reshape(
                count, *(1,) * len(shape), U.shape[2], U.shape[2]
            )
            rows.append([*earlier, own.reshape(*shape, count * U.shape[2], -1)])
            state = free[..., -1, None] * state
            pushed = [free[..., -1, None] * part for part in pushed]
            pushed.append((inverse[..., -1, :, None] * drive).reshape(*shape, modes, -1))
            times.append(angle[1:] / pitch)
            weights.append(rule * (end - start) / pieces / 2 / pitch)
            forces.append(U)
    total = sum(part.shape[-1] for part in pushed)
    volterra = np.zeros((*shape, total, total))
    at = 0
    for row in rows:
        flat = np.concatenate(row, axis=-1)
        volterra[..., at : at + flat.shape[-2], : flat.shape[-1]] = flat
        at += flat.shape[-2]
    push = np.concatenate(pushed, axis=-1)
    return ArcMap(
        np.concatenate(entry, axis=-2),
        volterra,
        np.concatenate([state.real, state.imag], axis=-2),
        np.concatenate([push.real, push.imag], axis=-2),
        np.concatenate(times),
        np.concatenate(weights),
        np.concatenate(forces),
    )


def node_count(model: ToolModel, cutting: Cutting, speed: float, more: int = MORE) -> int:
    """Nodes of `arc_map` at a speed in rpm."""
    return _count(model, _stretches(cutting), speed, more)


def _count(model: ToolModel, stretches: list[_Stretch], speed: float, more: int) -> int:
    nodes = [_nodes(model, 2 * np.pi * speed / 60, end - start, more) for start, end, teeth in stretches if len(teeth)]
    return sum(pieces * each for pieces, each in nodes)


@lru_cache(maxsize=64)
def _stretches(cutting: Cutting) -> list[_Stretch]:
    """Angles of tooth 0 over one pitch between which the same teeth cut: from, to, and those teeth as `_teeth`."""
    edges = _edges(cutting, 2 * np.pi / cutting.cuts_per_revolution).tolist()
    return [(start, end, _teeth(cutting, (start + end) / 2)) for start, end in pairwise(edges)]


def _nodes(model: ToolModel, turning: float, angle: float, more: int, share: float = 1.0) -> tuple[int, int]:
    """Equal pieces of a stretch of cut, and nodes of each, at a speed in rad/s."""
    theta = (model.fastest + 2 * turning) * angle / turning
    pieces = max(1, int(np.ceil(theta / _LONGEST)))
    return pieces, int(np.ceil(share * theta / pieces)) + more


def _edges(cutting: Cutting, pitch: float) -> Array:
    """Angles of tooth 0 over one pitch at which a tooth enters or leaves the cut, and both ends."""
    if cutting.process != "milling":
        return np.array([0.0, pitch])
    edges = np.unique(np.concatenate([[0.0, pitch], np.mod([cutting.entry_angle, cutting.exit_angle], pitch)]))
    edges = edges[np.append(np.diff(edges) > 1e-12 * pitch, True)]
    edges[-1] = pitch
    return np.asarray(edges)


def _teeth(cutting: Cutting, angle: float) -> Array:
    """Angles, relative to tooth 0, of the teeth in the cut when tooth 0 is at ``angle``."""
    if cutting.process != "milling":
        return np.zeros(1)
    offset = 2 * np.pi / cutting.cuts_per_revolution * np.arange(cutting.cuts_per_revolution)
    place = np.mod(angle + offset, 2 * np.pi)
    return np.asarray(offset[(place > cutting.entry_angle) & (place < cutting.exit_angle)])


@lru_cache(maxsize=256)
def _cut(
    cutting: Cutting, axes: tuple[int, ...], stretch: tuple[float, float], part: tuple[int, int], count: int
) -> tuple[Array, Array, Array]:
    """Angles of tooth 0 at the nodes of a piece of a stretch, ``part`` its place and how many there are, and
    `_directions` of the teeth in the cut there."""
    (start, end), (piece, pieces) = stretch, part
    angle = start + (end - start) * (piece + (chebyshev(count)[0] + 1) / 2) / pieces
    return angle, *_directions(cutting, axes, angle[:, None] + _teeth(cutting, (start + end) / 2))


def _directions(cutting: Cutting, axes: tuple[int, ...], angle: Array) -> tuple[Array, Array]:
    """U and V with H = U·Vᵀ at the nodes but the first, shape (nodes, axes, r); r = 1 while one tooth cuts."""
    u, v = (part[..., list(axes)] for part in cutting.tooth(angle[1:]))
    alone = cutting.process != "milling" or (
        cutting.exit_angle - cutting.entry_angle <= 2 * np.pi / cutting.cuts_per_revolution * (1 + 1e-12)
    )
    if len(axes) == 2 and alone:
        return u[:, 0, :, None], v[:, 0, :, None]
    H = np.einsum("kja,kjb->kab", u, v)
    return H, np.broadcast_to(np.eye(len(axes)), H.shape)


@lru_cache(maxsize=64)
def chebyshev(count: int) -> tuple[Array, Array, Array]:
    """Nodes x_0 = −1 … x_n = 1, the differentiation matrix and Clenshaw–Curtis weights of the nodes but the first."""
    j = np.arange(count + 1)
    x = -np.cos(np.pi * j / count)
    c = np.where((j == 0) | (j == count), 2.0, 1.0) * (-1.0) ** j
    # Differences from half angles keep their digits.
    gap = 2 * np.sin(np.pi * (j[:, None] + j) / (2 * count)) * np.sin(np.pi * (j[:, None] - j) / (2 * count))
    D = (c[:, None] / c) / (gap + np.eye(count + 1))
    D = D - np.diag(np.sum(D, axis=1))
    k = np.arange(1, count // 2 + 1)
    b = np.where(2 * k == count, 1.0, 2.0)
    rule = 2 / count / np.abs(c) * (1 - np.sum(b / (4 * k**2 - 1) * np.cos(2 * np.pi * k * j[:, None] / count), axis=1))
    return x, D, rule[1:]
