"""The independent ones among the motions of joints: contacts between two rigid bodies move in six ways at most."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ..indices import Index

Numbers = TypeVar("Numbers", Array, ComplexArray)
_RANK = 1e-12
_NOTHING = 1e-14


@dataclass(frozen=True, eq=False)
class _Bundle:
    """Motions and the joints that feel them and no others."""

    rows: Index | slice
    """(n,) of the motions q, a slice where they stand side by side."""
    joints: Index
    outer: Array
    """t_i t_iᵀ of its part of T, (joints, n²)."""

    def matrix(self, gain: Numbers) -> Numbers:
        """Its block of Tᵀ diag(gain) T, (..., n, n)."""
        n = round(self.outer.shape[1] ** 0.5)
        found = gain[..., self.joints] @ self.outer.astype(gain.dtype)
        return np.asarray(found.reshape(*gain.shape[:-1], n, n))


@dataclass(frozen=True, eq=False)
class Coordinates:
    """z = T q: the motions z of all joints follow from those q of as many as are independent.

    In q the balance of the joints is q + Hqq Tᵀ g(T q) = q_lin, smaller than z + Hzz g(z) = z_lin and the same.
    """

    rows: Index
    """Which joints q are, (r,)."""
    T: Array
    """(nj, r); a row of the unit matrix for each of those."""

    @classmethod
    def of(cls, B: Array) -> Coordinates:
        """From the rows z = B p of the joints over motions p that are free of each other."""
        nj = len(B)
        every = cls(np.arange(nj), np.eye(nj))
        size = np.linalg.norm(B, axis=1)
        if nj < 2 or not np.any(size):
            return every
        scaled = B / np.where(size > 0, size, 1.0)[:, None]
        R, order = scipy.linalg.qr(scaled.T, mode="r", pivoting=True)
        own = np.abs(np.diag(R))
        r = int(np.sum(own > _RANK * own[0]))
        if r == nj:
            return every
        share = scipy.linalg.solve_triangular(R[:r, :r], R[:r, r:])
        T = np.zeros((nj, r))
        T[order[:r]] = np.eye(r)
        T[order[r:]] = np.where(np.abs(share.T) > _NOTHING, share.T, 0.0)
        T *= size[:, None] / size[order[:r]]
        ascending = np.argsort(order[:r])
        return cls(np.asarray(order[:r][ascending]), T[:, ascending])

    @cached_property
    def complete(self) -> bool:
        """Whether all joints move independently: then q is z."""
        return len(self.rows) == len(self.T)

    @cached_property
    def _together(self) -> tuple[_Bundle, ...]:
        """Motions that no joint of another bundle feels: the connected parts of T, so that TᵀKT has blocks."""
        shared = self.T != 0
        reach = shared.T @ shared
        while np.any(further := reach @ reach & ~reach):
            reach |= further
        bundles = []
        for first in np.flatnonzero(~np.any(np.tril(reach, -1), axis=1)):
            rows = np.flatnonzero(reach[first])
            joints = np.flatnonzero(np.any(shared[:, rows], axis=1))
            t = self.T[np.ix_(joints, rows)]
            outer = (t[:, :, None] * t[:, None, :]).reshape(len(joints), -1)
            beside = rows[-1] - rows[0] == len(rows) - 1
            bundles.append(_Bundle(slice(rows[0], rows[-1] + 1) if beside else rows, joints, outer))
        return tuple(bundles)

    def motions(self, q: Numbers) -> Numbers:
        """z of all joints, (..., nj)."""
        return q if self.complete else np.asarray(q @ self.T.T)

    def of_motions(self, z: Numbers) -> Numbers:
        """q, (..., r)."""
        return z if self.complete else z[..., self.rows]

    def together(self, force: Numbers) -> Numbers:
        """Tᵀ g, what the forces g of all joints come to, (..., r)."""
        return force if self.complete else np.asarray(force @ self.T)

    def matrix(self, gain: Numbers) -> Numbers:
        """Tᵀ diag(gain) T of gains (..., nj), (..., r, r)."""
        r = len(self.rows)
        out = np.zeros((*gain.shape[:-1], r, r), dtype=gain.dtype)
        if self.complete:
            out[..., np.arange(r), np.arange(r)] = gain
            return out
        for bundle in self._together:
            rows = np.arange(r)[bundle.rows]
            out[..., rows[:, None], rows] = bundle.matrix(gain)
        return out

    def through(self, H: ComplexArray, gain: ComplexArray) -> ComplexArray:
        """H Tᵀ diag(gain) T for H (..., m, r), gain (..., nj)."""
        if self.complete:
            return H * gain[..., None, :]
        every = np.broadcast_shapes(H.shape[:-2], gain.shape[:-1])
        out = np.empty((*every, *H.shape[-2:]), dtype=complex)
        for bundle in self._together:
            out[..., bundle.rows] = H[..., bundle.rows] @ bundle.matrix(gain)
        return out

    def across(self, H: ComplexArray, slope: ComplexArray) -> ComplexArray:
        """H Tᵀ slope T for H (..., m, r), slope (..., nj, nj)."""
        if self.complete:
            return np.asarray(H @ slope)
        # Complex on both sides, and rows of all points at once: else no product of whole matrices is taken.
        T, (nj, r) = self.T.astype(complex), self.T.shape
        right = (np.ascontiguousarray(slope).reshape(-1, nj) @ T).reshape(*slope.shape[:-1], r)
        return np.asarray(H @ (np.ascontiguousarray(T.T) @ right))
