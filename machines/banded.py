"""Many banded systems of equations, side by side: decomposed as one, which is banded as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import scipy
from numpy.typing import NDArray

from .indices import Index, Mask


@dataclass(frozen=True, eq=False)
class Banded:
    """Matrices that are zero but next to the diagonal, as products of triangles with rows swapped (LAPACK gbtrf).

    A matrix that is singular or no number leaves the others as they are, whatever it is decomposed beside.
    """

    triangles: NDArray[Any]
    """(..., n, 3k + 1), by columns, k the entries on either side of the diagonal."""
    swapped: Index
    """By how many rows the pivot of every column stood lower, (..., n)."""
    regular: Mask
    """(...)."""

    @classmethod
    def of(cls, columns: NDArray[Any]) -> Banded:
        """From columns (..., n, 3k + 1), which are overwritten: what stands at i − j + 2k in column j is the entry of
        row i; the first k of every column are 0, for what elimination adds."""
        *many, n, width = columns.shape
        k, finite = (width - 1) // 3, np.ones(many, dtype=bool)
        if not np.isfinite(np.sum(columns)):
            finite = np.all(np.isfinite(columns), axis=(-2, -1))
            columns[~finite] = 0.0
        flat = columns.reshape(-1, width)
        if not len(flat):
            return cls(columns, np.zeros((*many, n), dtype=int), finite)
        decompose = _lapack("gbtrf", flat)
        found, pivot, _ = decompose(flat.T, k, k, overwrite_ab=True)
        triangles = found.T.reshape(columns.shape)
        swapped = (pivot - np.arange(len(flat))).reshape(*many, n)
        diagonal = triangles[..., 2 * k]
        regular = finite & np.all(diagonal != 0, axis=-1)
        diagonal += diagonal == 0  # of a matrix whose solution is not used
        return cls(triangles, swapped, regular)

    def at(self, points: Index | Mask | slice) -> Banded:
        """Some of them."""
        return Banded(self.triangles[points], self.swapped[points], self.regular[points])

    def solve(self, right: NDArray[Any], transposed: bool = False) -> NDArray[Any]:
        """x with A x = right, or Aᵀ x, (..., n); nan where A is singular or no number."""
        flat = self.triangles.reshape(-1, self.triangles.shape[-1])
        if not len(flat):
            return right
        k = (flat.shape[1] - 1) // 3
        substitute = _lapack("gbtrs", flat)
        fine = self.regular & np.all(np.isfinite(right), axis=-1)
        clean = np.where(fine[..., None], right, 0.0).reshape(-1, 1)
        pivot = (self.swapped + np.arange(len(flat)).reshape(self.swapped.shape)).ravel()
        x, _ = substitute(flat.T, k, k, clean, pivot, trans=int(transposed), overwrite_b=True)
        return np.where(fine[..., None], x.reshape(right.shape), np.nan)

    @property
    def negative(self) -> Mask:
        """Where the determinant of a real matrix is below zero, (...)."""
        k = (self.triangles.shape[-1] - 1) // 3
        turns = np.sum((self.triangles[..., 2 * k] < 0) ^ (self.swapped != 0), axis=-1)
        return np.asarray(turns % 2 == 1)


def _lapack(name: str, of: NDArray[Any]) -> Callable[..., Any]:
    """A routine for numbers of this type."""
    return cast(Callable[..., Any], scipy.linalg.get_lapack_funcs(name, (of,)))
