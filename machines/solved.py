"""Many small systems of equations, side by side, of which some may have no solution."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .indices import Mask


def solve_each(A: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """Solutions of A x = right per point, (points, n, columns); nan where A is singular or no number.

    A point without a solution leaves the others as they are, whatever they are solved beside.
    """
    fine: Mask = np.all(np.isfinite(A), axis=(1, 2)) & np.all(np.isfinite(right), axis=(1, 2))
    if np.all(fine):
        try:
            return np.asarray(np.linalg.solve(A, right))
        except np.linalg.LinAlgError:
            fine = _regular(A)
    else:
        fine[fine] = _regular(A[fine])
    out = np.full(right.shape, np.nan, dtype=np.result_type(A, right))
    out[fine] = np.linalg.solve(A[fine], right[fine])
    return out


def _regular(A: NDArray[Any]) -> Mask:
    """Where elimination meets no pivot of zero."""
    return np.asarray(np.linalg.slogdet(A)[0] != 0)
