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

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed

from .cutting import Cutting
from .tool_model import ToolModel

MORE = 10
"""Nodes beyond θ = ω_max·t of a stretch of cut."""
_LONGEST = 60.0
"""θ above which a stretch is split."""
FINER = 4
_RAISES = 8
_GUARD = 1e-7
_BLOCK = 1_000_000


@dataclass(frozen=True, eq=False)
class ArcMap:
    """One tooth period at one speed; see the module for R, T, E and L.

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
        """The loop at ν = ωτ/2π, shape (g, nodes·r, nodes·r), for the search of the boundary."""
        turn = np.exp(2j * np.pi * fraction)[:, None, None]
        ring = np.linalg.solve(turn * np.eye(len(self.period)) - self.period, self.push.astype(complex))
        return np.asarray(self.volterra + self.entry @ ring)

    def force(self, fraction: float, carried: ComplexArray, orders: Array) -> ComplexArray:
        """Harmonics of the force at ω + qω_T for an eigenvector of the loop, shape (orders, axes)."""
        chip = carried.reshape(len(self.time), -1) * self.weight[:, None]
        turn = np.exp(-2j * np.pi * (fraction + orders)[:, None] * self.time)
        return np.asarray(turn @ np.einsum("kar,kr->ka", self.along, chip))

    def multipliers(self, depth: Array) -> Array:
        """Largest size of a Floquet multiplier at depths in m, shape (d,)."""
        size = len(self.period) + len(self.volterra)
        block = max(1, _BLOCK // size**2)
        parts = [np.linalg.eigvals(self.maps(depth[start : start + block])) for start in range(0, len(depth), block)]
        return np.concatenate([np.max(np.abs(part), axis=1) for part in parts])

    def maps(self, depth: Array) -> Array:
        """(x, η) → (x, η) one tooth period on, at depths in m, shape (d, states + nodes·r, …)."""
        states, count = len(self.period), len(self.volterra)
        w = depth[:, None, None]
        Z = np.linalg.inv(np.eye(count) + w * self.volterra)
        whole = np.empty((len(depth), states + count, states + count))
        np.matmul(Z, self.entry, out=whole[:, states:, :states])
        whole[:, states:, states:] = np.eye(count) - Z
        pushed = w * (self.push @ Z)
        whole[:, :states, states:] = pushed
        whole[:, :states, :states] = self.period - pushed @ self.entry
        return whole


def arc_map(model: ToolModel, cutting: Cutting, speed: float, more: int = MORE, share: float = 1.0) -> ArcMap:
    """The map over one tooth period at a speed in rpm, with ⌈``share``·θ⌉ + ``more`` nodes per stretch of cut."""
    modes, axes = len(model.poles), ["xy".index(axis) for axis in model.axes]
    pitch = 2 * np.pi / cutting.cuts_per_revolution
    turning = 2 * np.pi * speed / 60
    state = np.concatenate([np.eye(modes), 1j * np.eye(modes)], axis=1)
    pushed: list[ComplexArray] = []
    entry, rows, times, weights, forces = [], [], [], [], []
    seen = model.weight[:, None] * model.outputs
    edges = _edges(cutting, pitch)
    for start, end in pairwise(edges.tolist()):
        cut = _teeth(cutting, (start + end) / 2)
        duration = (end - start) / turning
        if not len(cut):
            ring = np.exp(model.poles * duration)[:, None]
            state, pushed = ring * state, [ring * part for part in pushed]
            continue
        theta = (model.fastest + 2 * turning) * duration
        pieces = max(1, int(np.ceil(theta / _LONGEST)))
        count = int(np.ceil(share * theta / pieces)) + more
        x, derivative, rule = _chebyshev(count)
        step = duration / pieces
        inverse = np.linalg.inv(2 / step * derivative[1:, 1:] - model.poles[:, None, None] * np.eye(count))
        free = -2 / step * (inverse @ derivative[1:, 0])
        for piece in range(pieces):
            angle = start + (end - start) * (piece + (x + 1) / 2) / pieces
            U, V = _directions(cutting, axes, angle[:, None] + cut)
            driven = inverse[:, :, :, None] * np.tensordot(model.inputs, U, (1, 1))[:, None]
            look = np.tensordot(seen, V, (1, 1))
            ring = (look * free[:, :, None]).transpose(1, 2, 0)
            entry.append((ring @ state).real)
            earlier = [(ring @ part).real for part in pushed]
            own = np.einsum("pkr,pklc->krlc", look, driven).real
            own[np.arange(count), :, np.arange(count), :] += np.einsum("kar,ab,kbc->krc", V, model.direct, U)
            rows.append([*earlier, own.reshape(count, U.shape[2], -1)])
            state = free[:, -1, None] * state
            pushed = [free[:, -1, None] * part for part in pushed]
            pushed.append(driven[:, -1].reshape(modes, -1))
            times.append(angle[1:] / pitch)
            weights.append(rule * (end - start) / pieces / 2 / pitch)
            forces.append(U)
    total = sum(part.shape[1] for part in pushed)
    volterra = np.zeros((total, total))
    at = 0
    for row in rows:
        flat = np.concatenate([part.reshape(part.shape[0] * part.shape[1], -1) for part in row], axis=1)
        volterra[at : at + len(flat), : flat.shape[1]] = flat
        at += len(flat)
    push = np.concatenate(pushed, axis=1)
    return ArcMap(
        np.concatenate([part.reshape(-1, 2 * modes) for part in entry]),
        volterra,
        np.concatenate([state.real, state.imag]),
        np.concatenate([push.real, push.imag]),
        np.concatenate(times),
        np.concatenate(weights),
        np.concatenate(forces),
    )


def largest_multipliers(model: ToolModel, cutting: Cutting, speed: Array, depth: Array) -> Array:
    """Largest |μ| over one tooth period at every speed (rpm) and depth (m), shape (speeds, depths).

    The number of nodes is raised until four more change no multiplier at the largest and the middle depth by more than
    10⁻⁷ of itself (of 1 where it is smaller); a speed at which that fails raises `CheckFailed`.
    """
    out = np.empty((len(speed), len(depth)))
    check = np.unique([np.max(depth), np.median(depth)])
    for i, rpm in enumerate(speed):
        coarse = arc_map(model, cutting, float(rpm))
        before = coarse.multipliers(check)
        for raise_ in range(_RAISES):
            found = arc_map(model, cutting, float(rpm), MORE + FINER * (raise_ + 1))
            after = found.multipliers(check)
            if np.all(np.abs(after - before) <= _GUARD * np.maximum(after, 1.0)):
                break
            coarse, before = found, after
        else:
            raise CheckFailed(
                f"collocation: at {rpm:g} rpm the multipliers still change with the number of nodes; "
                "lower the depth, or use multi-frequency"
            )
        out[i] = coarse.multipliers(depth)
    return out


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


def _directions(cutting: Cutting, axes: list[int], angle: Array) -> tuple[Array, Array]:
    """U and V with H = U·Vᵀ at the nodes but the first, shape (nodes, axes, r); r = 1 while one tooth cuts."""
    u, v = cutting.tooth(angle[1:])
    u, v = u[..., axes], v[..., axes]
    alone = cutting.process != "milling" or (
        cutting.exit_angle - cutting.entry_angle <= 2 * np.pi / cutting.cuts_per_revolution * (1 + 1e-12)
    )
    if len(axes) == 2 and alone:
        return u[:, 0, :, None], v[:, 0, :, None]
    H = np.einsum("kja,kjb->kab", u, v)
    return H, np.broadcast_to(np.eye(len(axes)), H.shape)


@lru_cache(maxsize=64)
def _chebyshev(count: int) -> tuple[Array, Array, Array]:
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
