"""The model that candidates compete beside: what it leaves, and what it can move by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from scipy.linalg import qr

from jointlib.arrays import Array
from jointlib.loop.balance.layout import Layout

DEPENDENT = 1e-5
"""A column of which less than this share is left after the model's columns cannot be told from them."""


@dataclass(frozen=True)
class Model:
    """Whitened residual y and the columns the current model can move by, laid out in rows of reals.

    y has n entries, columns are rows of an array (p, n), ``records`` says to which record an entry belongs. Losses
    are sums of squares; where nothing is missing E Σy² is ``entries``, the number of valid complex entries.
    """

    y: Array
    columns: Array
    records: tuple[slice, ...]
    entries: int
    layout: Layout | None = None

    @cached_property
    def basis(self) -> Array:
        """Orthonormal rows that span the columns; dependent columns are dropped.

        Columns that one record has of its own come first, so that their rows stay 0 on all others: left out, that
        record must not lend them a coefficient from what the others share with it.
        """
        if not len(self.columns):
            return self.columns
        size = np.linalg.norm(self.columns, axis=1, keepdims=True)
        scaled = self.columns / np.where(size > 0, size, 1)
        reached = np.array([np.any(scaled[:, s], axis=1) for s in self.records]).reshape(-1, len(scaled)).sum(axis=0)
        own, shared = scaled[reached == 1], scaled[reached != 1]
        first = _orthonormal(own)
        for _ in range(2):
            shared = shared - (shared @ first.T) @ first
        return np.concatenate([first, _orthonormal(shared)])

    @cached_property
    def left(self) -> Array:
        """y after the best fit of the model's own columns."""
        return self.y - (self.basis @ self.y) @ self.basis

    @property
    def loss(self) -> float:
        return float(self.left @ self.left)

    @property
    def hidden(self) -> float:
        """Loss that noise could hide."""
        return float(3 * np.sqrt(self.entries))

    @cached_property
    def excess_outside_joint(self) -> float:
        """Loss beyond noise in balance and redundancy with the columns fitted to these alone.

        There is nothing of what the form of a joint law leaves, nor of what such a rest makes of the faults' sizes.
        """
        if self.layout is None:
            return 0.0
        own = self.layout.outside_joint
        X, y = self.columns[:, own], self.y[own]
        X = X[np.any(X, axis=1)]
        left = y - np.linalg.lstsq(X.T, y, rcond=None)[0] @ X if len(X) else y
        entries = int(np.sum(np.any(y.reshape(-1, 2), axis=1)))
        return max(0.0, float(left @ left) - entries - self.hidden)

    @cached_property
    def gram(self) -> Array:
        """Gram matrices of the basis, record by record: (records, p, p)."""
        return np.array([self.basis[:, s] @ self.basis[:, s].T for s in self.records])

    @cached_property
    def moment(self) -> Array:
        """Basis on what is left, record by record: (records, p)."""
        return np.array([self.basis[:, s] @ self.left[s] for s in self.records])

    def without(self, block: Array) -> Array | None:
        """What the model's columns leave of a candidate's columns; None where that is nothing."""
        size = np.linalg.norm(block, axis=1)
        if not np.all(np.isfinite(size)) or np.any(size == 0):
            return None
        rest = block - (block @ self.basis.T) @ self.basis
        rest = rest - (rest @ self.basis.T) @ self.basis
        if np.any(np.linalg.norm(rest, axis=1) < DEPENDENT * size):
            return None
        return np.asarray(rest)

    @cached_property
    def halves(self) -> tuple[Array, Array]:
        """Gram matrices (2, p, p) of the basis and its products (2, p) with what is left, halves of records apart."""
        assert self.coarse is not None
        p = len(self.basis)
        gram, moment = np.zeros((2, p, p)), np.zeros((2, p))
        for i, (basis, left) in enumerate(self.in_time):
            for half, e, s in self.coarse.in_halves(i):
                gram[half] += basis[:, e, s] @ basis[:, e, s].T
                moment[half] += basis[:, e, s] @ left[e, s]
        return gram, moment

    @cached_property
    def coarse(self) -> Layout | None:
        """The layout with no more samples than its lines ask for."""
        if self.layout is None:
            return None
        return replace(
            self.layout, samples=tuple(2 * scipy.fft.next_fast_len(len(m), real=True) for m in self.layout.on_period)
        )

    @cached_property
    def in_time(self) -> tuple[tuple[Array, Array], ...]:
        """Basis and what is left as signals in time, record by record: (p, 3, samples), (3, samples).

        Spectra of whitened residuals become signals of the same sum of squares, so that halves of a record can be
        held out.
        """
        assert self.layout is not None
        assert self.coarse is not None
        out = []
        for i, s in enumerate(self.layout.records):
            rows = self.layout.spectrum(i, np.concatenate([self.basis[:, s], self.left[None, s]]))
            x = self.coarse.in_time(i, rows)
            out.append((np.ascontiguousarray(x[:-1]), x[-1]))
        return tuple(out)


def _orthonormal(rows: Array) -> Array:
    """Orthonormal rows that span rows of at most unit length, those left out that nearly depend on others."""
    if not len(rows):
        return rows
    Q, R, _ = qr(rows.T, mode="economic", pivoting=True)
    rank = int(np.sum(np.abs(np.diag(R)) > DEPENDENT))
    return np.ascontiguousarray(Q[:, :rank].T)


def least_squares(model: Model, damping: float = 0.0) -> tuple[Array, Array]:
    """Coefficients of all columns and their covariance, (Re XᴴX)⁻¹/2·max(1, χ²); XᴴX with a damped diagonal."""
    size = np.linalg.norm(model.columns, axis=1)
    size = np.where(size > 0, size, 1.0)
    X = model.columns / size[:, None]
    inverse = np.linalg.pinv(X @ X.T + damping * np.eye(len(X)), rcond=1e-13, hermitian=True)
    theta = inverse @ (X @ model.y)
    chi2 = max(1.0, float(np.sum((model.y - theta @ X) ** 2)) / max(1, model.entries))
    return theta / size, inverse * chi2 / 2 / np.outer(size, size)


def prediction_error(model: Model) -> Array:
    """y of every record left out in turn, after the model's columns were fitted to the others.

    What a record has of its own (columns that vanish on all others) is fitted to it.
    """
    out = model.y.copy()
    for here in model.records:
        X = model.basis
        theta = np.zeros(len(X))
        keep = np.ones(len(out), dtype=bool)
        keep[here] = False
        own = np.linalg.norm(X[:, keep], axis=1) < 1e-9 * np.maximum(np.linalg.norm(X, axis=1), 1e-300)
        if (~own).any():
            theta[~own] = np.linalg.lstsq(X[~own][:, keep].T, model.y[keep], rcond=None)[0]
        out[here] -= theta @ X[:, here]
        if own.any():
            beta = np.linalg.lstsq(X[own][:, here].T, out[here], rcond=None)[0]
            out[here] -= beta @ X[own][:, here]
    return out
