"""Least squares on columns with parts of the data held out, from the Gram matrices of the blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy
from numpy.typing import NDArray

from jointlib.arrays import Array, ArrayLike

Index: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

_NOTHING = 1e-300
_SEEN = 1e-2
"""Of the power of a column, which folds are scaled to at least: rounding of a column that a fold does not have, 1e-16
of its power, then lies below the 1e-12 at which singular values end."""


@dataclass(frozen=True)
class HeldOut:
    """A linear model fitted once without each fold."""

    coefficients: Array
    """(fold, column)."""
    training: Array
    """Sum of squared residuals on the data that the fold leaves, (fold,), N²."""
    blocks: Array
    """Mean squared residual of every block, from the fit that did not see it, (block,), N²."""


def block_grams(columns: Array, target: Array, rows: Sequence[Index]) -> Array:
    """[C y]ᵀ[C y] of every block, shape (block, columns + 1, columns + 1)."""
    return products(np.vstack([columns, target[None]]), None, rows)


def products(one: Array, other: Array | None, rows: Sequence[Index]) -> Array:
    """A Bᵀ of every block, (block, rows of A, rows of B); None for A Aᵀ."""
    out = np.empty((len(rows), len(one), len(one if other is None else other)))
    for r, block in zip(rows, out, strict=True):
        # The samples of a block follow one another, as a rule; a slice of them is no copy.
        own = slice(r[0], r[-1] + 1) if len(r) and r[-1] - r[0] + 1 == len(r) else r
        A = one[:, own]
        np.matmul(A, (A if other is None else other[:, own]).T, out=block)
    return out


def with_columns(grams: Array, stacked: Array, added: Array, rows: Sequence[Index]) -> Array:
    """Grams of [C y], whose rows are ``stacked``, with further columns between C and y."""
    n, k = stacked.shape[0] - 1, len(added)
    cross, own = products(stacked, added, rows), products(added, None, rows)
    out = np.empty((len(rows), n + k + 1, n + k + 1))
    old, new = np.r_[0:n, n + k], np.arange(n, n + k)
    out[:, old[:, None], old], out[:, new[:, None], new] = grams, own
    out[:, old[:, None], new], out[:, new[:, None], old] = cross, np.swapaxes(cross, 1, 2)
    return out


def hold_out(grams: Array, sizes: Array, folds: Index, weights: Array, signed: int = 0) -> HeldOut:
    """Fit without each fold (``folds[b]`` is the fold of block b) and judge its blocks.

    ``weights`` are those of the blocks in the fit; the last ``signed`` coefficients are kept from being negative.
    """
    weighted, count = grams * weights[:, None, None], int(folds.max()) + 1
    total = weighted.sum(axis=0)
    left = np.array([total - weighted[folds == h].sum(axis=0) for h in range(count)])
    least = np.maximum(_SEEN * np.diag(total)[:-1], _NOTHING)
    if signed:
        beta = np.array([solve_signed(A[:-1, :-1], A[:-1, -1], signed, least) for A in left])
    else:
        beta = solve(left[:, :-1, :-1], left[:, :-1, -1], least)
    return HeldOut(beta, loss(left, beta), loss(grams, beta[folds]) / sizes)


def loss(grams: Array, beta: Array) -> Array:
    """Sum of squared residuals ‖y − Cβ‖² from Gram matrices."""
    full = np.concatenate([-beta, np.ones((*beta.shape[:-1], 1))], axis=-1)
    return np.asarray(np.maximum(np.einsum("...i,...ij,...j->...", full, grams, full), 0.0))


def solve(A: Array, b: Array, least: ArrayLike = _NOTHING) -> Array:
    """Minimum-norm solution of A x = b for Gram matrices scaled to unit diagonal.

    A column of less power than ``least`` is scaled as one of that: what is rounding of it gets no coefficient.
    """
    d = np.sqrt(np.maximum(np.diagonal(A, axis1=-2, axis2=-1), least))
    unit = A / (d[..., :, None] * d[..., None, :])
    inverse = np.linalg.pinv(unit, rcond=1e-12, hermitian=True)
    return np.asarray(np.einsum("...ij,...j->...i", inverse, b / d) / d)


def solve_signed(A: Array, b: Array, signed: int, least: ArrayLike = _NOTHING) -> Array:
    """Least squares from Gram matrices with the last ``signed`` coefficients not negative, the others free.

    The free ones are eliminated; what is left is scaled to unit diagonal and solved by non-negative least squares on
    its Cholesky factor.
    """
    n = len(b) - signed
    d = np.sqrt(np.maximum(np.diag(A), least))
    U, y = A / np.outer(d, d), b / d
    inverse = np.linalg.pinv(U[:n, :n], rcond=1e-12, hermitian=True)
    reduced = U[n:, n:] - U[n:, :n] @ inverse @ U[:n, n:]
    target = y[n:] - U[n:, :n] @ inverse @ y[:n]
    values, vectors = np.linalg.eigh(reduced)
    root = np.sqrt(np.maximum(values, 1e-12 * max(float(values[-1]), 1e-300)))
    positive = scipy.optimize.nnls((vectors * root).T, (vectors / root).T @ target)[0]
    free = inverse @ (y[:n] - U[:n, n:] @ positive)
    return np.asarray(np.concatenate([free, positive]) / d)


def clustered_covariance(columns: Array, residual: Array, clusters: Sequence[Index]) -> Array:
    """Covariance of least-squares coefficients when residuals are dependent within clusters, not between them.

    (CᵀC)⁻¹ [Σ_b s_b s_bᵀ · B/(B−1)] (CᵀC)⁻¹ with s_b = C_bᵀ e_b: what a bootstrap over whole blocks tends to.
    """
    size = np.sqrt(np.maximum((columns**2).sum(axis=1), 1e-300))
    C = columns / size[:, None]
    inverse = np.linalg.pinv(C @ C.T, rcond=1e-12, hermitian=True)
    scores = np.array([C[:, r] @ residual[r] for r in clusters])
    middle = scores.T @ scores * len(clusters) / max(1, len(clusters) - 1)
    return np.asarray(inverse @ middle @ inverse / np.outer(size, size))
