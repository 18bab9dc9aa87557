"""The cutter: where its flutes stand round it and along it, what they repeat with, and how late each one comes.

Flute j at height z above the tip stands at φ_j = Ωt − ψ_j − κ_j·z, ψ_j the sum of the pitches before it and
κ = 2·tan(helix)/diameter the lag of its helix. It cuts what flute j − 1 left,

    τ_j(z) = (pitch before flute j + (κ_j − κ_(j−1))·z)/Ω,

earlier: a delay a pitch (Altintas, Engin & Budak 1999), which changes along the depth where the helices differ (Sims,
Mann & Huyanan 2008). The cut repeats with the shortest run of flutes that does, at the latest with the revolution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

from .cutting import Cutting

_ALIKE = 1e-9
"""rad; pitches no further apart are the same."""
_GAUSS = np.polynomial.legendre.leggauss(10)
"""Gauss points of the angles that a flute cuts at at one moment; three digits to spare at half a turn."""


@dataclass(frozen=True)
class Flute:
    """One flute; angles at the tip in rad, lags along the depth in rad/m."""

    place: float
    """ψ_j, behind the first flute."""
    behind: float
    """The pitch before it."""
    lag: float
    """κ_j."""
    spread: float
    """κ_j − κ_(j−1)."""
    beyond: float = 0.0
    """ρ_j − ρ_(j−1) in m, by which it stands out beyond the one before it."""


@dataclass(frozen=True)
class Cutter:
    """The flutes of a cutter that come before it repeats.

    Parameters
    ----------
    cutting
        The operation; one edge that always cuts in turning.
    flutes
        Those of one pattern.
    pattern
        Angle in rad after which they repeat.
    """

    cutting: Cutting
    flutes: tuple[Flute, ...]
    pattern: float

    @classmethod
    def of(cls, cutting: Cutting, runout: bool = False) -> Cutter:
        """The cutter of an operation, with its ``runout`` or without, which a linear cut does not feel."""
        many = cutting.cuts_per_revolution
        given = [360 / many] * many if cutting.pitch is None else list(cutting.pitch)
        pitch = 2 * np.pi * np.array(given) / sum(given)
        helix = np.broadcast_to(np.asarray(0.0 if cutting.helix is None else cutting.helix), (many,))
        lag = np.zeros(many)
        if np.any(helix):
            assert cutting.diameter is not None
            lag = 2 * np.tan(np.radians(helix)) / cutting.diameter
        behind, spread = np.roll(pitch, 1), lag - np.roll(lag, 1)
        radius = np.array(cutting.runout if runout and cutting.runout is not None else [0.0] * many)
        place = np.concatenate([[0.0], np.cumsum(pitch)[:-1]])
        run = next(
            m
            for m in range(1, many + 1)
            if many % m == 0
            and np.all(np.abs(pitch - np.roll(pitch, m)) < _ALIKE)
            and np.all(np.abs(lag - np.roll(lag, m)) <= _ALIKE * (1 + np.max(np.abs(lag))))
            and np.all(np.abs(radius - np.roll(radius, m)) <= _ALIKE * np.max(np.abs(radius)))
        )
        beyond = radius - np.roll(radius, 1)
        columns = (behind, lag, spread, beyond)
        rows = zip(place[:run].tolist(), *(one.tolist() for one in columns), strict=False)
        return cls(cutting, tuple(Flute(*row) for row in rows), float(np.sum(pitch[:run])))

    @property
    def arc(self) -> tuple[float, float]:
        """Angles in rad between which an edge cuts."""
        if self.cutting.process != "milling":
            return 0.0, 2 * math.pi
        return self.cutting.entry_angle, self.cutting.exit_angle

    @property
    def twisted(self) -> bool:
        """Whether the depth of cut is inside the coefficients."""
        return any(flute.lag for flute in self.flutes)

    @property
    def patterns(self) -> float:
        """How often the pattern comes in a revolution."""
        return 2 * math.pi / self.pattern

    @property
    def deepest(self) -> float:
        """Depth in m at which one flute meets the next, inf where none does."""
        meets = [-flute.behind / flute.spread for flute in self.flutes if flute.spread < 0]
        return min(meets, default=math.inf)

    def frequency(self, speed: float) -> float:
        """Hz at which the pattern passes at a speed in rpm."""
        return self.patterns * speed / 60

    def rubbing(self, speed: float) -> float:
        """C_p/v in N s/m² at a speed in rpm: damping per depth of an edge in the cut, against the chip's thickness."""
        if self.cutting.process_damping is None:
            return 0.0
        assert self.cutting.diameter is not None
        return self.cutting.process_damping / (math.pi * self.cutting.diameter * speed / 60)

    def matrices(self, angle: Array) -> tuple[Array, Array]:
        """u·vᵀ in N/m² and v·vᵀ of an edge at angles φ, shape (…, 2, 2) each, see `Cutting.tooth`."""
        u, v = self.cutting.tooth(angle)
        return u[..., :, None] * v[..., None, :], v[..., :, None] * v[..., None, :]

    def harmonics(self, order: Array) -> tuple[ComplexArray, ComplexArray]:
        """∫ of both `matrices` times e^(−jsφ) over the arc of cut, for orders s, shape (…, 2, 2)."""
        first, last = self.arc
        middle, half = (first + last) / 2, (last - first) / 2

        def turned(s: Array) -> ComplexArray:
            return np.asarray(2 * half * np.exp(-1j * s * middle) * np.sinc(s * half / np.pi))

        parts = [part[..., None, None] for part in (turned(order), turned(order - 2), turned(order + 2))]
        found = []
        for at in zip(*(self.matrices(np.array(phi)) for phi in (0.0, np.pi / 2, np.pi / 4)), strict=True):
            mean = (at[0] + at[1]) / 2
            cosine, sine = at[0] - mean, at[2] - mean
            found.append(mean * parts[0] + cosine / 2 * (parts[1] + parts[2]) + sine / 2j * (parts[1] - parts[2]))
        return found[0], found[1]

    def sections(self, flute: Flute, angle: Array, depth: float) -> tuple[Array, Array, Array]:
        """Where a flute whose tip stands at an angle (rad) from its place cuts over a depth in m.

        Angles φ of its sections, their heights z in m and their shares of the depth, shape (…, sections). With helix a
        Gauss rule over the angles inside the arc; else the whole depth cuts at the one angle.
        """
        x, w = _GAUSS
        if flute.lag == 0:
            height, share = (depth * (x + 1) / 2, w / 2) if flute.spread else (np.array([depth / 2]), np.ones(1))
            phi = np.repeat(angle[..., None], len(share), axis=-1)
            return phi, np.broadcast_to(height, phi.shape), np.broadcast_to(share, phi.shape)
        first, last = self.arc
        low = np.maximum(first, angle - flute.lag * depth)
        width = np.maximum(np.minimum(last, angle) - low, 0.0)
        phi = low[..., None] + width[..., None] * (x + 1) / 2
        return phi, (angle[..., None] - phi) / flute.lag, width[..., None] * w / 2 / (flute.lag * depth)
