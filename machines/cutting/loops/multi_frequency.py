"""Milling lobes from a receptance at all harmonics of the tooth frequency; no modes are fitted.

Budak & Altintas (1998): with H_r = (N/2π)∫H₁(φ)e^(−jrNφ)dφ over the arc of cut the loop is

    A_pq(ω) = H_(p−q)·G(ω + qω_T),   p, q = −P … P.

H₁ = u·vᵀ has rank one, so on the nodes φ_k of a quadrature over the arc (weights W_k) the same eigenvalues, but for
zeros, belong to

    B_kl(ω) = Σ_q v_kᵀ·G(ω + qω_T)·u_l·e^(jqN(φ_k − φ_l))·W_l,

which is far smaller at partial immersion: whichever of the two is smaller is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...deadline import in_time
from ..process.cutter import Cutter
from ..process.cutting import Cutting

Spectrum = Callable[[Array], ComplexArray]
"""G at frequencies in Hz of either sign, shape (…) → (…, n, n)."""

_BLOCK = 2_000_000


_RULES = 96
"""Nodes beyond which a rule has a multiple of so many."""

_gauss = lru_cache(maxsize=64)(np.polynomial.legendre.leggauss)


@dataclass(frozen=True)
class HarmonicLoop:
    """The loop at one speed with P harmonics on either side; called with ν = ω/ω_T.

    ``tooth_frequency`` in Hz; ``axes`` are the directions that move, 0 for x and 1 for y.
    """

    receptance: Spectrum
    cutting: Cutting
    axes: tuple[int, ...]
    tooth_frequency: float
    harmonics: int

    @cached_property
    def nodes(self) -> tuple[Array, Array]:
        """Angles φ_k in rad and weights (N/2π)·W_k of a Gauss rule that integrates the products of all harmonics."""
        arc = self.cutting.exit_angle - self.cutting.entry_angle
        x, w = _gauss(self._nodes)
        angle = self.cutting.entry_angle + arc * (x + 1) / 2
        return angle, w * arc / 2 * self.cutting.cuts_per_revolution / (2 * np.pi)

    @property
    def _nodes(self) -> int:
        """How many nodes the rule has; many are rounded up, so that neighbouring speeds share a rule."""
        arc = self.cutting.exit_angle - self.cutting.entry_angle
        turns = (self.harmonics + 1) * self.cutting.cuts_per_revolution * arc
        count = int(np.ceil(0.5 * turns + 2.5 * max(turns, 1.0) ** (1 / 3))) + 5
        return count if count <= _RULES else -(-count // _RULES) * _RULES

    def lines(self, fraction: Array) -> ComplexArray:
        """G(ω + qω_T), shape (g, 2P + 2, n, n)."""
        return self.receptance((fraction[:, None] + self.orders) * self.tooth_frequency)

    @property
    def orders(self) -> Array:
        """q = −P−1 … P: symmetric about zero frequency at ν = 1/2, where flips are."""
        return np.arange(-self.harmonics - 1.0, self.harmonics + 1.0)

    def __call__(self, fraction: Array) -> ComplexArray:
        into, out = self._directions
        nodes, lines, n = out.shape
        if nodes > lines * n:
            return np.concatenate([self.by_lines(some) for some in np.array_split(fraction, -(-len(fraction) // 64))])
        parts = []
        block = max(1, _BLOCK // out.size)
        for start in range(0, len(fraction), block):
            in_time()
            felt = self._felt(out, self.lines(fraction[start : start + block])).reshape(-1, nodes, lines * n)
            parts.append(felt @ into.reshape(nodes, lines * n).T)
        return np.concatenate(parts)

    def by_lines(self, fraction: Array) -> ComplexArray:
        """H_(p−q)·G(ω + qω_T), shape (g, lines·n, lines·n)."""
        return coupled(self._coupled, self.lines(fraction))

    @cached_property
    def _coupled(self) -> ComplexArray:
        return self.coupling(self.orders)

    def coupling(self, orders: Array, others: Array | None = None) -> ComplexArray:
        """H_(p−q) between lines p of these orders and q of the same or of ``others``, shape (lines·n, lines·n)."""
        apart = (orders[:, None] - (orders if others is None else others)).astype(int)
        reach, n = int(np.max(np.abs(apart))), len(self.axes)
        every = self.of_cut(reach)
        return np.asarray(every[apart + reach].transpose(0, 2, 1, 3).reshape(n * apart.shape[0], n * apart.shape[1]))

    def of_cut(self, reach: int) -> ComplexArray:
        """H_r of r = −reach … reach, shape (2·reach + 1, n, n), in closed form."""
        every = _of_cut(self.cutting, self.axes, 1 << reach.bit_length())
        middle = len(every) // 2
        return every[middle - reach : middle + reach + 1]

    def force(self, carried: ComplexArray) -> ComplexArray:
        """The force on the tool at ω + qω_T, q as `orders`, for an eigenvector of the loop, (2P + 2, n)."""
        into, _ = self._directions
        nodes, lines, n = into.shape
        return np.asarray(np.tensordot(carried, into, 1) if nodes <= lines * n else carried.reshape(lines, n))

    def motion(self, fraction: float, carried: ComplexArray) -> Array:
        """Size of the tool's displacement at ω + qω_T for an eigenvector of the loop, (2P + 2,)."""
        moved = np.einsum("qab,qb->qa", self.lines(np.array([fraction]))[0], self.force(carried))
        return np.asarray(np.linalg.norm(moved, axis=1))

    @cached_property
    def _directions(self) -> tuple[ComplexArray, ComplexArray]:
        """u·W·e^(−jqNφ) and v·e^(jqNφ), shape (nodes, lines, n)."""
        angle, weight = self.nodes
        u, v = (part[:, None, list(self.axes)] for part in self.cutting.tooth(angle))
        turn = np.exp(1j * self.cutting.cuts_per_revolution * angle[:, None] * self.orders)[:, :, None]
        return np.asarray(turn.conj() * u * weight[:, None, None]), np.asarray(turn * v)

    @property
    def size(self) -> int:
        """Rows of its matrices."""
        return min(self._nodes, len(self.orders) * len(self.axes))

    @staticmethod
    def _felt(out: ComplexArray, G: ComplexArray) -> ComplexArray:
        """vᵀG at every node and line, shape (g, nodes, lines, n)."""
        (nodes, lines, n), many = out.shape, len(G)
        felt = np.swapaxes(out, 0, 1) @ G.transpose(1, 2, 0, 3).reshape(lines, n, many * n)
        return np.asarray(felt.reshape(lines, nodes, many, n).transpose(2, 1, 0, 3))


@lru_cache(maxsize=32)
def _of_cut(cutting: Cutting, axes: tuple[int, ...], reach: int) -> ComplexArray:
    """H_r of r = −reach … reach; no speed changes it."""
    many = cutting.cuts_per_revolution
    every = many / (2 * np.pi) * Cutter.of(cutting).harmonics(many * np.arange(-reach, reach + 1.0))[0]
    return np.asarray(every[:, axes][:, :, axes])


def coupled(coupling: ComplexArray, lines: ComplexArray) -> ComplexArray:
    """H_(p−q)·G(ω + qω_T), shape (g, m, k), of H (m, k) and G (g, lines, n, n)."""
    rows, n = len(coupling), lines.shape[-1]
    felt = coupling.reshape(rows, -1, n)
    turned = np.zeros((len(lines), *felt.shape), dtype=complex)
    for a in range(n):
        for b in range(n):
            turned[..., b] += felt[..., a] * lines[:, None, :, a, b]
    return turned.reshape(len(lines), rows, -1)


@lru_cache(maxsize=16)
def stiffest_direction(cutting: Cutting, axes: tuple[int, ...]) -> float:
    """Largest stiffness of the cut per depth over a turn of the tool, N/m²."""
    many = cutting.cuts_per_revolution
    apart = 2 * np.pi / many * np.arange(many) if cutting.pitch is None else np.radians(np.cumsum(cutting.pitch))
    place = np.asarray(np.mod(np.linspace(0, 2 * np.pi, 721)[:, None] + apart, 2 * np.pi))
    u, v = (part[..., list(axes)] for part in cutting.tooth(place))
    u = u * ((place >= cutting.entry_angle) & (place <= cutting.exit_angle))[..., None]
    return float(np.max(np.linalg.norm(np.einsum("kja,kjb->kab", u, v), ord=2, axis=(1, 2))))
