"""The independent ones among the motions of joints: contacts between two rigid bodies move in six ways at most."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.linalg import qr, solve_triangular

from jointlib.arrays import Array, ComplexArray

from ..indices import Index

Numbers = TypeVar("Numbers", Array, ComplexArray)
_RANK = 1e-12
_NOTHING = 1e-14


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
        R, order = qr(scaled.T, mode="r", pivoting=True)
        own = np.abs(np.diag(R))
        r = int(np.sum(own > _RANK * own[0]))
        if r == nj:
            return every
        share = solve_triangular(R[:r, :r], R[:r, r:])
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
    def _outer(self) -> Array:
        """t_i t_iᵀ, (nj, r²)."""
        return (self.T[:, :, None] * self.T[:, None, :]).reshape(len(self.T), -1)

    def motions(self, q: Numbers) -> Numbers:
        """z of all joints, (..., nj)."""
        return q if self.complete else np.asarray(q @ self.T.T)

    def of_motions(self, z: Numbers) -> Numbers:
        """q, (..., r)."""
        return z if self.complete else z[..., self.rows]

    def together(self, force: Numbers) -> Numbers:
        """Tᵀ g, what the forces g of all joints come to, (..., r)."""
        return force if self.complete else np.asarray(force @ self.T)

    def through(self, H: ComplexArray, gain: ComplexArray) -> ComplexArray:
        """H Tᵀ diag(gain) T for H (..., m, r), gain (..., nj)."""
        if self.complete:
            return H * gain[..., None, :]
        r = len(self.rows)
        return np.asarray(H @ (gain @ self._outer).reshape(*gain.shape[:-1], r, r))

    def across(self, H: ComplexArray, slope: ComplexArray) -> ComplexArray:
        """H Tᵀ slope T for H (..., m, r), slope (..., nj, nj)."""
        if self.complete:
            return np.asarray(H @ slope)
        # Complex on both sides, and rows of all points at once: else no product of whole matrices is taken.
        T, (nj, r) = self.T.astype(complex), self.T.shape
        right = (np.ascontiguousarray(slope).reshape(-1, nj) @ T).reshape(*slope.shape[:-1], r)
        return np.asarray(H @ (np.ascontiguousarray(T.T) @ right))
