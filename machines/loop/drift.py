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

from ..indices import Index
from .deviation import FEWEST, local_slopes

FREQUENCY = 1e-3
"""Deviation of the natural frequencies from record to record, relative."""
LEVEL = 1e-2
"""Deviation of the level from record to record, relative."""


@dataclass(frozen=True, eq=False)
class _Of:
    """Directions of one record, orthonormal as columns of [Re, Im] rows, and the standard deviation along each."""

    rows: Index
    basis: Array
    deviation: Array
    ways: Array
    """Shares of λ and δ in the directions, each in its own deviations, (directions, 2)."""

    def scaled(self, residual: ComplexArray, factor: Array) -> ComplexArray:
        flat = residual[self.rows].reshape(len(self.rows), -1)
        real = np.concatenate([flat.real, flat.imag])
        real += self.basis @ ((factor - 1.0)[:, None] * (self.basis.T @ real))
        n = len(self.rows)
        return np.asarray((real[:n] + 1j * real[n:]).reshape(residual[self.rows].shape))


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
        """The white residual of errors in units of the noise: as it would be with no drift taken out yet."""
        return self.white(error + self.offset)

    def error(self, residual: ComplexArray) -> ComplexArray:
        """The inverse of `residual`."""
        return self.coloured(residual) - self.offset

    def white(self, residual: ComplexArray) -> ComplexArray:
        """Residuals (points, …) in units of the noise with the drift taken for noise as well."""
        out = np.array(residual, dtype=complex)
        for part in self.records:
            out[part.rows] = part.scaled(residual, 1 / np.sqrt(1 + part.deviation**2))
        return out

    def likeliest(self, white: ComplexArray) -> Array:
        """λ and δ of every record, (records, 2), given a `residual`."""
        out = []
        for part in self.records:
            s = part.deviation
            # D = U S V: x = Vᵀ S/(1 + S²) Uᵀ r, and r is √(1 + S²) times as long along U as where it is white.
            along = part.basis.T @ np.concatenate([white[part.rows].real, white[part.rows].imag])
            out.append(np.array([LEVEL, FREQUENCY]) * (part.ways.T @ (s / np.sqrt(1 + s**2) * along)))
        return np.array(out)

    def coloured(self, residual: ComplexArray) -> ComplexArray:
        """The inverse of `white`."""
        out = np.array(residual, dtype=complex)
        for part in self.records:
            out[part.rows] = part.scaled(residual, np.sqrt(1 + part.deviation**2))
        return out


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
