"""What differs from one record to the next and is no effect: a structure warms up, a sensor is set anew.

Every record has a small error δ of its natural frequencies and λ of its level of its own, H (1 + λ) at ω/(1 + δ), with
deviations that the laboratory knows by experience. To first order they add H λ − ω ∂H/∂ω δ, so that the errors of one
record are no longer independent: their covariance is I + D Dᵀ, in units of the noise, with D the two directions times
their deviations. A residual times the root of its inverse is white again. Its sum of squares is that of the residual
with λ and δ fitted and their priors added, and on a record that was left out it counts what is not known of them there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...indices import Index
from .deviation import FEWEST, local_slopes

FREQUENCY = 1e-3
"""Deviation of the natural frequencies from record to record, relative."""
LEVEL = 1e-2
"""Deviation of the level from record to record, relative."""
FARTHEST = 4.0
"""So many deviations a drift may be: where the noise is small, it would else stand in for any response."""


@dataclass(frozen=True, eq=False)
class _Of:
    """Directions of one record, orthonormal as columns of [Re, Im] rows, and the standard deviation along each."""

    rows: Index
    basis: Array
    deviation: Array
    ways: Array
    """Shares of λ and δ in the directions, each in its own deviations, (directions, 2)."""

    @property
    def short(self) -> Array:
        """By how much a white residual is shorter along each direction, 1/√(1 + s²)."""
        return np.asarray(1 / np.sqrt(1 + self.deviation**2))

    @property
    def edge(self) -> Array:
        """Where along each direction the likeliest drift is the largest that is allowed."""
        s = self.deviation
        return np.asarray(FARTHEST * (1 + s**2) / np.where(s > 0, s, 1e-300))

    def along(self, residual: ComplexArray) -> Array:
        """Coordinates in the directions, (directions,) or (directions, columns)."""
        return np.asarray(self.basis.T @ np.concatenate([residual[self.rows].real, residual[self.rows].imag]))

    def moved(self, residual: ComplexArray, change: Array) -> ComplexArray:
        """The residual on these rows with its coordinates changed so."""
        out = residual[self.rows]
        real, n = self.basis @ change, len(self.rows)
        return np.asarray(out + real[:n] + 1j * real[n:])


@dataclass(frozen=True, eq=False)
class Drift:
    """The drifts of all records at some points, in units of the noise."""

    records: tuple[_Of, ...]
    offset: ComplexArray
    """What the drift that is taken out of the frequencies already does, to first order, (points,)."""

    @classmethod
    def of(
        cls, frequency: Array, measured: ComplexArray, record: Index, test: Index, sigma: Array, taken: Array
    ) -> Drift:
        """Directions from the measured responses themselves; records of one ``test`` have drive and response alike.

        ``taken`` is the δ of every record by which ``frequency`` is moved already.
        """
        slope = _slopes(frequency, measured, record, test)
        found = []
        for k in np.unique(record):
            rows = np.flatnonzero(record == k)
            ways = np.stack([LEVEL * measured[rows], -FREQUENCY * frequency[rows] * slope[rows]], axis=1)
            ways /= sigma[rows, None]
            both = np.linalg.svd(np.concatenate([ways.real, ways.imag]), full_matrices=False)
            found.append(_Of(rows, *both))
        return cls(tuple(found), -taken[record] * frequency * slope / sigma)

    def residual(self, error: ComplexArray) -> ComplexArray:
        """The white residual of errors in units of the noise, (points,), as it would be with no drift taken out yet.

        Along a direction it is c/√(1 + s²) up to where the likeliest drift is `FARTHEST`, and goes on with slope 1.
        """
        r = error + self.offset
        out = np.array(r, dtype=complex)
        for part in self.records:
            c, edge, short = part.along(r), part.edge, part.short
            white = np.where(np.abs(c) <= edge, c * short, c - np.sign(c) * edge * (1 - short))
            out[part.rows] = part.moved(r, white - c)
        return out

    def error(self, residual: ComplexArray) -> ComplexArray:
        """The inverse of `residual`."""
        out = np.array(residual, dtype=complex)
        for part in self.records:
            c, edge, short = part.along(residual), part.edge, part.short
            inner = np.abs(c) <= edge * short
            out[part.rows] = part.moved(residual, np.where(inner, c / short, c + np.sign(c) * edge * (1 - short)) - c)
        return np.asarray(out - self.offset)

    def slopes(self, residual: ComplexArray, change: ComplexArray) -> ComplexArray:
        """Of the residual, where it stands, by numbers that change the error so: (points, numbers)."""
        out = np.array(change, dtype=complex)
        for part in self.records:
            c, along, short = part.along(residual), part.along(change), part.short
            share = np.where(np.abs(c) <= part.edge * short, short, 1.0)
            out[part.rows] = part.moved(change, (share - 1)[:, None] * along)
        return out

    def likeliest(self, residual: ComplexArray) -> Array:
        """λ and δ of every record, (records, 2), given a `residual`."""
        out = []
        for part in self.records:
            # D = U S V: x = Vᵀ S/(1 + S²) Uᵀ r, and r is √(1 + S²) times as long along U as where it is white.
            x = np.clip(part.deviation * part.short * part.along(residual), -FARTHEST, FARTHEST)
            out.append(np.array([LEVEL, FREQUENCY]) * (part.ways.T @ x))
        return np.array(out)


def _slopes(frequency: Array, measured: ComplexArray, record: Index, test: Index) -> ComplexArray:
    """dH/df of every point in m/(N Hz), from the lines around it; of records of a few lines from those of others."""
    out = np.zeros(len(frequency), dtype=complex)
    poor: list[Index] = []
    for k in np.unique(record):
        rows = np.flatnonzero(record == k)
        if len(rows) >= FEWEST:
            out[rows] = local_slopes(frequency[rows], measured[rows])
        else:
            poor.append(rows)
    rich = np.setdiff1d(np.arange(len(frequency)), np.concatenate(poor)) if poor else np.arange(0)
    for rows in poor:
        like = rich[test[rich] == test[rows[0]]]
        if len(like):
            like = like[np.argsort(frequency[like])]
            out[rows] = np.interp(frequency[rows], frequency[like], out[like])
        elif len(rows) > 1:
            out[rows] = np.gradient(measured[rows], frequency[rows])
    return out
