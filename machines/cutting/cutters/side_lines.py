"""Any cutter from a receptance at all harmonics of its pattern; no modes are fitted, no sections are made.

A vibration e^(jωt)·Σ_q x_q·e^(jqω_P·t), ω_P the frequency at which the pattern passes, meets itself as b·A(ω)·x = −x,

    A_pq = [h(r·n)·Σ_j e^(−jrnψ_j)·(S(rnκ_j·b) − e^(−jω_q·τ_j)·S(rnκ_j·b + ω_q·Δκ_j·b/Ω))/Θ + rubbing]·G(ω_q),

r = p − q, ω_q = ω + qω_P, Θ the pattern and n = 2π/Θ, h(s) = ∫H₁(φ)e^(−jsφ)dφ over the arc of cut and
S(x) = (1 − e^(−jx))/(jx) the mean over the depth: a helix takes every harmonic by itself, so that all of it is closed
(Budak & Altintas 1998; Zatarain, Muñoa, Peigné & Insperger 2006). For equal pitches and no helix it is `HarmonicLoop`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..loops.multi_frequency import Spectrum
from ..process.cutter import Cutter

_BLOCK = 400_000


@dataclass(frozen=True)
class SideLines:
    """The loop at one speed (rpm) with P ``harmonics`` of the pattern on either side; ``axes`` as in `HarmonicLoop`."""

    receptance: Spectrum
    cutter: Cutter
    axes: tuple[int, ...]
    speed: float
    harmonics: int

    @property
    def frequency(self) -> float:
        """Hz at which the pattern passes."""
        return self.cutter.frequency(self.speed)

    @property
    def orders(self) -> Array:
        """q = −P−1 … P: symmetric about zero frequency at ν = 1/2, where flips are."""
        return np.arange(-self.harmonics - 1.0, self.harmonics + 1.0)

    @cached_property
    def _of_cut(self) -> tuple[ComplexArray, ComplexArray]:
        """h(r·n)/Θ of u·vᵀ and of v·vᵀ for r = −(lines − 1) … lines − 1, (r, n, n)."""
        many, axes = len(self.orders), list(self.axes)
        r = np.arange(1.0 - many, many) * self.cutter.patterns
        return tuple(  # type: ignore[return-value]
            part[:, axes][:, :, axes] / self.cutter.pattern for part in self.cutter.harmonics(r)
        )

    def closed(self, fraction: Array, depth: float) -> ComplexArray:
        """b·A at ν = ω/ω_P, (g,) → (g, lines·n, lines·n), at a depth b in m."""
        size = len(self.orders) * len(self.axes)
        step = max(1, _BLOCK // size**2)
        parts = [self._closed(fraction[i : i + step], depth) for i in range(0, len(fraction), step)]
        return np.concatenate(parts)

    def _closed(self, fraction: Array, depth: float) -> ComplexArray:
        many, n = len(self.orders), len(self.axes)
        turning = 2 * np.pi * self.speed / 60
        omega = 2 * np.pi * self.frequency * (fraction[:, None] + self.orders)
        r = np.arange(1.0 - many, many) * self.cutter.patterns
        across = (np.arange(many)[:, None] - np.arange(many)) + many - 1
        met = np.zeros((len(fraction), many, many), dtype=complex)
        rubbed = np.zeros(2 * many - 1, dtype=complex)
        for flute in self.cutter.flutes:
            place = np.exp(-1j * r * flute.place)
            held = place * over_depth(r * flute.lag * depth)
            rubbed += held
            late = np.exp(-1j * omega * flute.behind / turning)[:, None, :]
            if flute.spread:
                bent = (r * flute.lag * depth)[across] + (omega * flute.spread * depth / turning)[:, None, :]
                met += held[across] - late * place[across] * over_depth(bent)
            else:
                met += held[across] * (1 - late)
        force, rub = self._of_cut
        G = self.receptance(omega / (2 * np.pi))
        whole = force[across] @ G[:, None] * met[..., None, None]
        share = self.cutter.rubbing(self.speed)
        if share:
            moving = 1j * omega[:, :, None, None] * G
            whole += share * (rubbed[:, None, None] * rub)[across] @ moving[:, None]
        return np.asarray(depth * whole.swapaxes(2, 3).reshape(len(fraction), many * n, many * n))

    def motion(self, fraction: float, carried: ComplexArray) -> Array:
        """Size of the tool's displacement at ω + qω_P for an eigenvector, (lines,)."""
        G = self.receptance((fraction + self.orders) * self.frequency)
        return np.asarray(np.linalg.norm(np.einsum("qab,qb->qa", G, carried.reshape(-1, len(self.axes))), axis=1))


def over_depth(turn: Array) -> ComplexArray:
    """S(x): mean of e^(−jx·z/b) over the depth."""
    return np.asarray(np.exp(-0.5j * turn) * np.sinc(turn / (2 * np.pi)))
