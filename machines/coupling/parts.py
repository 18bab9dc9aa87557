"""A machine that its nonlinear joints hold together: taken apart there, each part bears few of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ..components.mode_sum import ModeSum
from ..indices import Index

_NARROW = 3
"""Of the joints, as many times as a joint shares a part with others at most."""
FEW = 3 * _NARROW
"""Joints below which a full matrix is as good."""


@dataclass(frozen=True, eq=False)
class Parts:
    """H(ω) in m/N with the nonlinear joints open: zero but between what stands on one part.

    Every part is a sum over its own poles (`ModeSum`), so that time and memory grow with the joints and not with their
    pairs. Joints stand in an ``order`` in which those that share a part are neighbours, at most ``reach`` apart.
    """

    order: Index
    """Of the joints, (nj,)."""
    reach: int
    kinds: tuple[ModeSum, ...]
    """Parts that are not equal to others before them."""
    between: scipy.sparse.csr_matrix
    """Sparse weights (terms, nj (2 reach + 1)) of receptances between joints, by columns as `Banded.of` takes them."""
    driven: scipy.sparse.csr_matrix
    """(terms, nj inputs) from the inputs to the joints."""
    seen: scipy.sparse.csr_matrix
    """(terms, pairs) from joints in their order and then inputs to motions."""
    pairs: tuple[Index, Index]
    """Motions and forces of these, (pairs,), ascending in the motions."""
    motions: int
    inputs: int

    @classmethod
    def of(cls, equations: tuple[Array, Array, Array], joints: Array, inputs: Array, motions: Array) -> Parts | None:
        """From M, C and K with what is linear coupled in, and rows of joints, inputs and motions over its coordinates.

        None where the joints are few, a part bears many of them, or its sum would lose accuracy.
        """
        tied = np.any([matrix != 0 for matrix in equations], axis=0)
        count, owner = scipy.sparse.csgraph.connected_components(scipy.sparse.csr_matrix(tied))
        on = np.zeros((len(joints), count), dtype=int)
        row, column = np.nonzero(joints)
        on[row, owner[column]] = 1
        share = scipy.sparse.csr_matrix(on) @ scipy.sparse.csr_matrix(on).T
        order = scipy.sparse.csgraph.reverse_cuthill_mckee(share, symmetric_mode=True).astype(np.intp)
        place, (one, other) = np.argsort(order), share.nonzero()
        reach = int(np.max(np.abs(place[one] - place[other]), initial=0))
        if _NARROW * (2 * reach + 1) > len(joints):
            return None
        kinds: dict[tuple[bytes, ...], tuple[ModeSum, int]] = {}
        found, terms = list[_Part](), 0
        for part in range(count):
            own = np.flatnonzero(owner == part)
            matrices = [matrix[np.ix_(own, own)] for matrix in equations]
            key = tuple(matrix.tobytes() for matrix in matrices)
            if key not in kinds:
                poles = ModeSum.of(*matrices)
                if poles is None:
                    return None
                kinds[key], terms = (poles, terms), terms + _count(poles)
            rows = (np.flatnonzero(np.any(each[:, own], axis=1)) for each in (joints, inputs, motions))
            found.append(_Part(own, *kinds[key], *rows))
        sums = tuple(poles for poles, _ in kinds.values())
        return _assembled(sums, found, (joints, inputs, motions), order, reach)

    def terms(self, omega: Array) -> ComplexArray:
        """What the weights stand by, (nf, terms)."""
        return np.concatenate([kind.terms(omega) for kind in self.kinds], axis=1)

    def at(self, omega: Array) -> tuple[ComplexArray, ComplexArray]:
        """Receptances between joints, (nf, nj, 2 reach + 1), and from inputs to joints, (nf, nj, inputs), in order."""
        table, nj = self.terms(omega), len(self.order)
        between, driven = (np.asarray(table @ part, dtype=complex) for part in (self.between, self.driven))
        return between.reshape(len(omega), nj, 2 * self.reach + 1), driven.reshape(len(omega), nj, self.inputs)

    def moved(self, omega: Array, force: ComplexArray) -> ComplexArray:
        """Motions in m, (nf, motions), under forces in N of the joints and then of the inputs, (nf, nj + inputs)."""
        nj, (motion, by) = len(self.order), self.pairs
        ordered = np.concatenate([force[:, self.order], force[:, nj:]], axis=1)
        out = np.zeros((len(omega), self.motions), dtype=complex)
        if len(motion):
            each = (self.terms(omega) @ self.seen) * ordered[:, by]
            first = np.flatnonzero(np.diff(motion, prepend=-1))
            out[:, motion[first]] = np.add.reduceat(each, first, axis=1)
        return out

    def entries(self, harmonics: int) -> int:
        """Of the decomposed Jacobian at a point in so many harmonics."""
        wide = 2 * harmonics * (self.reach + 1)
        return 2 * harmonics * len(self.order) * (3 * wide - 2)

    def full(self, omega: Array) -> ComplexArray:
        """Receptances of all pairs, (nf, nj, nj + inputs), of joints as they are and not in order."""
        (between, driven), nj = self.at(omega), len(self.order)
        out = np.zeros((len(omega), nj, nj + self.inputs), dtype=complex)
        for d in range(-self.reach, self.reach + 1):
            column = np.arange(max(0, -d), nj - max(0, d))
            out[:, self.order[column + d], self.order[column]] = between[:, column, self.reach + d]
        out[:, self.order, nj:] = driven
        return out

    def motions_at(self, omega: Array) -> ComplexArray:
        """Receptances from joints and then inputs to all motions, (nf, motions, nj + inputs)."""
        motion, by = self.pairs
        column = np.append(self.order, len(self.order) + np.arange(self.inputs))[by]
        out = np.zeros((len(omega), self.motions, len(self.order) + self.inputs), dtype=complex)
        out[:, motion, column] = self.terms(omega) @ self.seen
        return out

    @property
    def sizes(self) -> Array:
        """Of all poles, 1/s, ascending."""
        return np.sort(np.abs(np.concatenate([part for kind in self.kinds for part in (kind.pairs, kind.real)])))


@dataclass(frozen=True, eq=False)
class _Part:
    """A part with what stands on it."""

    own: Index
    """Its coordinates."""
    poles: ModeSum
    first: int
    """Of its terms."""
    joints: Index
    inputs: Index
    motions: Index


def _assembled(
    kinds: tuple[ModeSum, ...], parts: Sequence[_Part], rows: tuple[Array, Array, Array], order: Index, reach: int
) -> Parts:
    """Weights of all parts in three tables."""
    (nj, ni), place, width = (len(rows[0]), len(rows[1])), np.argsort(order), 2 * reach + 1
    acting = [np.concatenate([place[part.joints], nj + part.inputs]) for part in parts]
    every = [(part.motions[:, None] * (nj + ni) + by).ravel() for part, by in zip(parts, acting, strict=True)]
    pairs = np.unique(np.concatenate(every))
    between, driven, seen = list[_Entries](), list[_Entries](), list[_Entries]()
    for part, by, asked in zip(parts, acting, every, strict=True):
        joints, inputs, motions = (
            each[np.ix_(here, part.own)] @ part.poles.shapes
            for each, here in zip(rows, (part.joints, part.inputs, part.motions), strict=True)
        )
        own, k = place[part.joints][:, None], len(joints)
        weights = part.poles.in_modes(joints, np.concatenate([joints, inputs])).weights
        between.append(_Entries(part.first, weights[:, :, :k], by[:k] * width + own - by[:k] + reach))
        driven.append(_Entries(part.first, weights[:, :, k:], own * ni + part.inputs))
        weights = part.poles.in_modes(motions, np.concatenate([joints, inputs])).weights
        seen.append(_Entries(part.first, weights, np.searchsorted(pairs, asked).reshape(len(motions), len(by))))
    terms = sum(_count(kind) for kind in kinds)
    tables = (_table(between, terms, nj * width), _table(driven, terms, nj * ni), _table(seen, terms, len(pairs)))
    return Parts(order, reach, kinds, *tables, (pairs // (nj + ni), pairs % (nj + ni)), len(rows[2]), ni)


@dataclass(frozen=True, eq=False)
class _Entries:
    """Weights (terms, rows, columns) of a part, the first of its terms, and the columns of a table they stand in."""

    first: int
    weights: Array
    at: Index


def _table(entries: Sequence[_Entries], terms: int, columns: int) -> scipy.sparse.csr_matrix:
    """Weights of all parts, those that stand in one place added up."""
    value, term, column = [], [], []
    for part in entries:
        shape = part.weights.shape
        value.append(part.weights.ravel())
        term.append(np.broadcast_to(part.first + np.arange(shape[0])[:, None, None], shape).ravel())
        column.append(np.broadcast_to(part.at, shape).ravel())
    where = np.concatenate(term), np.concatenate(column)
    return scipy.sparse.csr_matrix((np.concatenate(value), where), shape=(terms, columns))


def _count(kind: ModeSum) -> int:
    return int(kind.terms(np.ones(1)).shape[1])
