"""Whether vectors of modes lie so far apart that the share of each in a motion can be told."""

from __future__ import annotations

import numpy as np
import scipy

from jointlib.arrays import ComplexArray

_APART = 1e8
"""Largest σ₁/σₙ of unit vectors for which shares in them can be told."""
_CLEARLY = 0.5
"""Share of it up to which an estimate decides."""
_ROUNDS = 12
_FEW = 50
"""Vectors up to which their singular values are had at once."""


def told_apart(vectors: ComplexArray) -> bool:
    """Whether unit vectors, the columns, do not coincide: σ₁/σₙ is below 10⁸.

    Singular values of a thousand vectors take as long as the vectors themselves; their triangle QᴴV and its inverse
    take a third of that and tell both σ to a few per cent.
    """
    if vectors.shape[1] > _FEW:
        triangle: ComplexArray = np.asarray(np.linalg.qr(vectors, mode="r"))
        inverse, singular = scipy.linalg.lapack.ztrtri(triangle)
        with np.errstate(all="ignore"):
            if not singular and _size(triangle) * _size(inverse) < _CLEARLY * _APART:
                return True
    reach = np.linalg.svd(vectors, compute_uv=False)
    return bool(reach[-1] * _APART > reach[0])


def _size(matrix: ComplexArray) -> float:
    """The largest singular value, by power iteration: from below, nan where numbers do not reach."""
    x: ComplexArray = np.random.default_rng(0).standard_normal(matrix.shape[1:]).astype(complex)
    back, size = matrix.conj().T, 0.0
    for _ in range(_ROUNDS):
        x = np.asarray(back @ (matrix @ (x / np.linalg.norm(x))))
        size = float(np.sqrt(np.linalg.norm(x)))
    return size
