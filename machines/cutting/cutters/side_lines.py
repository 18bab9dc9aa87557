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

from ...indices import Index
from ..loops.multi_frequency import Spectrum
from ..process.cutter import Cutter, Flute

_BLOCK = 400_000
_KEPT = 1_000_000
"""Lines whose receptance is kept."""


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
    def of_cut(self) -> tuple[ComplexArray, ComplexArray]:
        """h(r·n)/Θ of u·vᵀ and of v·vᵀ for r = −(lines − 1) … lines − 1, (r, n, n)."""
        axes = list(self.axes)
        return tuple(  # type: ignore[return-value]
            part[:, axes][:, :, axes] / self.cutter.pattern for part in self.cutter.harmonics(self.apart)
        )

    def closed(self, fraction: Array, depth: float) -> ComplexArray:
        """b·A at ν = ω/ω_P, (g,) → (g, lines·n, lines·n), at a depth b in m."""
        size = len(self.orders) * len(self.axes)
        step = max(1, _BLOCK // size**2)
        cut = self._of_depth(depth)
        found = np.empty((len(fraction), size, size), dtype=complex)
        for i in range(0, len(fraction), step):
            found[i : i + step] = self._closed(fraction[i : i + step], depth, cut)
        return found

    def _of_depth(self, depth: float) -> list[ComplexArray]:
        """b·h(r·n)·e^(−jrnψ)·S/Θ of every flute whose delay is one, and last what rubs, (q, p·n, n).

        The same at every ν: what a line q meets of all lines p.
        """
        many, n, r = len(self.orders), len(self.axes), self.apart
        force, rub = self.of_cut
        held = [np.exp(-1j * r * f.place) * over_depth(r * f.lag * depth) for f in self.cutter.flutes]
        parts = [force * of[:, None, None] for f, of in zip(self.cutter.flutes, held, strict=True) if not f.spread]
        if self.cutter.rubbing(self.speed):
            parts.append(self.cutter.rubbing(self.speed) * rub * np.sum(held, axis=0)[:, None, None])
        return [(depth * part)[self._across].reshape(many, many * n, n) for part in parts]

    def _closed(self, fraction: Array, depth: float, cut: list[ComplexArray]) -> ComplexArray:
        many, n = len(self.orders), len(self.axes)
        turning = 2 * np.pi * self.speed / 60
        omega = 2 * np.pi * self.frequency * (fraction[:, None] + self.orders)
        G, bent = self._tool(fraction), [flute for flute in self.cutter.flutes if flute.spread]
        whole = np.zeros((len(fraction), many, many * n, n), dtype=complex)
        rest = iter(cut)
        for flute in self.cutter.flutes:
            if not flute.spread:
                back = 1 - np.exp(-1j * omega * flute.behind / turning)
                whole += next(rest) @ (G * back[:, :, None, None])
        for rubbing in rest:
            whole += rubbing @ (1j * omega[:, :, None, None] * G)
        if bent:
            met = depth * np.sum([self._met(flute, depth, omega) for flute in bent], axis=0)
            felt = self.of_cut[0][self._across] * met[..., None, None]
            whole += felt.reshape(whole.shape) @ G
        return np.asarray(whole.swapaxes(1, 2).reshape(len(fraction), many * n, many * n))

    def _met(self, flute: Flute, depth: float, omega: Array) -> ComplexArray:
        """What a flute whose delay changes along the depth makes of lines q at lines p, (g, q, p)."""
        turning = 2 * np.pi * self.speed / 60
        r = self.apart
        place = np.exp(-1j * r * flute.place)
        late = np.exp(-1j * omega * flute.behind / turning)[:, :, None]
        bent = (r * flute.lag * depth)[self._across] + (omega * flute.spread * depth / turning)[:, :, None]
        held = place * over_depth(r * flute.lag * depth)
        return np.asarray(held[self._across] - late * place[self._across] * over_depth(bent))

    @cached_property
    def apart(self) -> Array:
        """r·n for r = p − q = −(lines − 1) … lines − 1."""
        return np.arange(1.0 - len(self.orders), len(self.orders)) * self.cutter.patterns

    @cached_property
    def _across(self) -> Index:
        """The place of p − q among those, (q, p)."""
        every = np.arange(len(self.orders))
        return np.asarray(every - every[:, None] + len(every) - 1)

    def _tool(self, fraction: Array) -> ComplexArray:
        """G at every line of some ν, (g, lines, n, n); each is asked for once, at many depths."""
        known = self._known
        if len(known) * len(self.orders) > _KEPT:
            known.clear()
        missing = np.array([nu for nu in dict.fromkeys(fraction.tolist()) if nu not in known])
        if len(missing):
            known |= zip(
                missing.tolist(), self.receptance((missing[:, None] + self.orders) * self.frequency), strict=True
            )
        return np.stack([known[nu] for nu in fraction.tolist()])

    @cached_property
    def _known(self) -> dict[float, ComplexArray]:
        return {}

    def motion(self, fraction: float, carried: ComplexArray) -> Array:
        """Size of the tool's displacement at ω + qω_P for an eigenvector, (lines,)."""
        G = self.receptance((fraction + self.orders) * self.frequency)
        return np.asarray(np.linalg.norm(np.einsum("qab,qb->qa", G, carried.reshape(-1, len(self.axes))), axis=1))


def over_depth(turn: Array) -> ComplexArray:
    """S(x): mean of e^(−jx·z/b) over the depth."""
    return np.asarray(np.exp(-0.5j * turn) * np.sinc(turn / (2 * np.pi)))
