"""How whitened residuals of several records lie in one row of real numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.balance.spectra import Mask

_BALANCE, _REDUNDANCY, _JOINT = 0, 1, 2
_PIECES = 8


@dataclass(frozen=True)
class Layout:
    """Per record: the joint equation on the period lines, then between them, balance, redundancy; re and im in turn.

    Effects of the joint that have no memory of other periods fill the first part alone, which is small.
    """

    samples: tuple[int, ...]
    """Samples of each record."""
    on_period: tuple[Mask, ...]
    """Period lines of each record."""

    @cached_property
    def records(self) -> tuple[slice, ...]:
        """The entries of each record."""
        ends = np.cumsum([6 * len(m) for m in self.on_period])
        return tuple(slice(int(e) - 6 * len(m), int(e)) for e, m in zip(ends, self.on_period, strict=True))

    @cached_property
    def joint_part(self) -> tuple[slice, ...]:
        """The entries of each record that hold the joint equation on period lines."""
        return tuple(
            slice(s.start, s.start + 2 * int(m.sum())) for s, m in zip(self.records, self.on_period, strict=True)
        )

    @cached_property
    def outside_joint(self) -> NDArray[np.intp]:
        """The entries of balance and redundancy, which contain no joint law."""
        parts = [np.arange(s.start + 2 * len(m), s.stop) for s, m in zip(self.records, self.on_period, strict=True)]
        return np.concatenate(parts)

    def row(self, columns: Sequence[ComplexArray]) -> Array:
        """Whitened columns of all records, (..., lines, 3) each, as rows (..., n)."""
        return np.concatenate([self.of_record(i, c) for i, c in enumerate(columns)], axis=-1)

    def of_record(self, i: int, column: ComplexArray) -> Array:
        """Whitened columns (..., lines, 3) of one record as rows over its entries."""
        m = self.on_period[i]
        J = column[..., _JOINT]
        parts = [J[..., m], J[..., ~m], column[..., _BALANCE], column[..., _REDUNDANCY]]
        return np.ascontiguousarray(np.concatenate(parts, axis=-1)).view(float)

    def joint_row(self, columns: Sequence[ComplexArray]) -> Array:
        """The joint equation on period lines alone, (..., lines, 3) of each record to (..., n of these)."""
        parts = [c[..., m, _JOINT] for c, m in zip(columns, self.on_period, strict=True)]
        return np.ascontiguousarray(np.concatenate(parts, axis=-1)).view(float)

    def spectra(self, row: Array) -> list[ComplexArray]:
        """A row back into whitened residuals (lines, 3) of each record."""
        return [self.spectrum(i, row[..., s]) for i, s in enumerate(self.records)]

    def spectrum(self, i: int, row: Array) -> ComplexArray:
        """Rows over the entries of one record back into (..., lines, 3)."""
        m = self.on_period[i]
        X = np.ascontiguousarray(row).view(complex)
        out = np.empty((*X.shape[:-1], len(m), 3), dtype=complex)
        inside, n = int(m.sum()), len(m)
        out[..., m, _JOINT], out[..., ~m, _JOINT] = X[..., :inside], X[..., inside:n]
        out[..., _BALANCE], out[..., _REDUNDANCY] = X[..., n : 2 * n], X[..., 2 * n :]
        return out

    def in_halves(self, i: int) -> Iterator[tuple[int, int, slice]]:
        """Two halves of one record, each every other eighth of it: number, equation and samples piece by piece.

        What changes along a record changes in both, so that neither is foretold from before or behind it.
        """
        ends = np.linspace(0, self.samples[i], _PIECES + 1).astype(int).tolist()
        for k, piece in enumerate(map(slice, ends[:-1], ends[1:])):
            for e in range(3):
                yield k % 2, e, piece

    def in_time(self, i: int, column: ComplexArray) -> Array:
        """Whitened columns (..., lines, 3) of one record as signals (..., 3, samples) of the same sum of squares."""
        N = self.samples[i]
        out = np.zeros((*column.shape[:-2], 3, N))
        for e in range(3):
            if np.any(column[..., e]):
                x = np.fft.irfft(column[..., e], N, axis=-1) * np.sqrt(N / 2)
                out[..., e, :] = x + (np.sqrt(2) - 1) / np.sqrt(2 * N) * column[..., :1, e].real
        return out
