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

import numpy as np

from jointlib.arrays import Array, ComplexArray

from .cutting import Cutting

Spectrum = Callable[[Array], ComplexArray]
"""G at frequencies in Hz of either sign, shape (…) → (…, n, n)."""

_BEYOND = 5
"""Harmonics kept past the highest frequency that matters."""
_BLOCK = 2_000_000


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

    @property
    def nodes(self) -> tuple[Array, Array]:
        """Angles φ_k in rad and weights (N/2π)·W_k of a Gauss rule that integrates the products of all harmonics."""
        arc = self.cutting.exit_angle - self.cutting.entry_angle
        turns = (self.harmonics + 1) * self.cutting.cuts_per_revolution * arc
        count = int(np.ceil(0.5 * turns + 4 * max(turns, 1.0) ** (1 / 3))) + 8
        x, w = np.polynomial.legendre.leggauss(count)
        angle = self.cutting.entry_angle + arc * (x + 1) / 2
        return angle, w * arc / 2 * self.cutting.cuts_per_revolution / (2 * np.pi)

    def lines(self, fraction: Array) -> ComplexArray:
        """G(ω + qω_T), shape (g, 2P + 2, n, n)."""
        return self.receptance((fraction[:, None] + self.orders) * self.tooth_frequency)

    @property
    def orders(self) -> Array:
        """q = −P−1 … P: symmetric about zero frequency at ν = 1/2, where flips are."""
        return np.arange(-self.harmonics - 1.0, self.harmonics + 1.0)

    def __call__(self, fraction: Array) -> ComplexArray:
        angle, weight = self.nodes
        n, lines = len(self.axes), len(self.orders)
        u, v = (part[:, list(self.axes)] for part in self.cutting.tooth(angle))
        turn = np.exp(1j * self.cutting.cuts_per_revolution * angle[:, None] * self.orders)
        into = (turn.conj()[:, :, None] * u[:, None, :] * weight[:, None, None]).reshape(len(angle), lines * n)
        out = (turn[:, :, None] * v[:, None, :]).reshape(len(angle), lines * n)
        parts = []
        block = max(1, _BLOCK // (len(angle) * lines * n))
        for start in range(0, len(fraction), block):
            G = self.lines(fraction[start : start + block])
            felt = np.einsum("kqa,gqab->gkqb", out.reshape(len(angle), lines, n), G, optimize=True)
            felt = felt.reshape(len(G), len(angle), lines * n)
            parts.append(felt @ into.T if len(angle) <= lines * n else into.T @ felt)
        return np.concatenate(parts)
