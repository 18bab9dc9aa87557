"""A candidate fitted beside the model, in parts that can be held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.fault import Shape
from jointlib.loop.contest.model import DEPENDENT, Model

_ABSENT = 1e-18
"""Of its square: less than this of a column on some records is rounding."""


@dataclass(frozen=True)
class Trial:
    """One family at one shape: its Gram matrices with the model, part by part; the columns themselves are not kept.

    Parts are what is held out: records, or halves of all records.
    """

    shape: Shape
    size: int
    """Number of columns q."""
    gram: Array
    """(parts, p + q, p + q): of the basis and of what it leaves of the columns."""
    moment: Array
    """(parts, p + q): the same on what is left of y."""

    @cached_property
    def coefficients(self) -> Array:
        q = self.size
        return solve(self.gram.sum(axis=0)[-q:, -q:], self.moment.sum(axis=0)[-q:])

    @property
    def gain(self) -> float:
        """Drop of the training loss."""
        return float(self.coefficients @ self.moment.sum(axis=0)[-self.size :])

    @property
    def moved(self) -> Array:
        """Squared change of the fitted y, part by part."""
        G = self.gram[:, -self.size :, -self.size :]
        return np.asarray(np.einsum("i,rij,j->r", self.coefficients, G, self.coefficients))


def trial(model: Model, shape: Shape, block: Array, joint_only: bool) -> Trial | None:
    """Fit a candidate beside the model, records apart; None where it cannot be told from the model.

    With ``joint_only`` the block holds the joint equation on period lines alone (:meth:`Layout.joint_row`).
    """
    slices = model.records
    inner, cross, own = [], [], []
    first = 0
    for h, s in enumerate(slices):
        if joint_only:
            assert model.layout is not None
            s = model.layout.joint_part[h]
        part = block[:, first : first + s.stop - s.start]
        first += s.stop - s.start
        inner.append(part @ part.T)
        cross.append(part @ model.basis[:, s].T)
        own.append(part @ model.left[s])
    return _trial(shape, model.gram, model.moment, np.array(inner), np.array(cross), np.array(own))


def trial_of_its_own(model: Model, shape: Shape, parts: Sequence[ComplexArray]) -> Trial | None:
    """Fit a candidate that has coefficients of its own in every record, halves of all records apart.

    ``parts`` are its whitened columns (q, lines, 3) in each record.
    """
    assert model.coarse is not None
    R, q, p = len(parts), len(parts[0]), len(model.basis)
    gram, moment = model.halves
    inner, cross, own = np.zeros((2, R * q, R * q)), np.zeros((2, R * q, p)), np.zeros((2, R * q))
    for i, (part, (basis, left)) in enumerate(zip(parts, model.in_time, strict=True)):
        x = model.coarse.in_time(i, part)
        here = slice(i * q, i * q + q)
        for half, e, s in model.coarse.in_halves(i):
            if np.any(part[..., e]):
                inner[half, here, here] += x[:, e, s] @ x[:, e, s].T
                cross[half, here] += x[:, e, s] @ basis[:, e, s].T
                own[half, here] += x[:, e, s] @ left[e, s]
    return _trial(shape, gram, moment, inner, cross, own)


def _trial(shape: Shape, gram: Array, moment: Array, inner: Array, cross: Array, own: Array) -> Trial | None:
    """Gram matrices with the columns residualised on the basis, from those with the columns as they are.

    With K = Σ cross the columns less K·basis have inner products inner − cross Kᵀ − K crossᵀ + K gram Kᵀ.
    """
    parts, q, p = cross.shape
    K = cross.sum(axis=0)
    KG = K @ gram
    G = np.empty((parts, p + q, p + q))
    G[:, :p, :p] = gram
    G[:, p:, :p] = cross - KG
    G[:, :p, p:] = np.swapaxes(G[:, p:, :p], 1, 2)
    G[:, p:, p:] = inner - cross @ K.T - K @ np.swapaxes(cross, 1, 2) + KG @ K.T
    m = np.concatenate([moment, own - moment @ K.T], axis=1)
    size, rest = np.diag(inner.sum(axis=0)), np.diag(G[:, p:, p:].sum(axis=0))
    if not np.all(np.isfinite(size)) or np.any(size <= 0) or np.any(rest < DEPENDENT**2 * size):
        return None
    return Trial(shape, q, G, m)


def prediction(model: Model, best: Trial, block: Array) -> Array:
    """Change of the fitted y by a candidate with its columns given again, (q, n)."""
    return np.asarray(best.coefficients @ (block - (block @ model.basis.T) @ model.basis))


def solve(G: Array, b: Array, whole: Array | None = None) -> Array:
    """Normal equations with Gram matrices scaled to a unit diagonal; nothing is regularised but exact rank loss.

    ``whole`` is the diagonal over all records: a column that is nothing on the records in G keeps its coefficient 0.
    """
    diagonal = np.diagonal(G, axis1=-2, axis2=-1)
    least = 1e-300 if whole is None else _ABSENT * whole
    size = np.sqrt(np.where(diagonal > least, diagonal, np.inf))
    inverse = np.linalg.pinv(G / (size[..., :, None] * size[..., None, :]), rcond=1e-13, hermitian=True)
    return np.asarray(np.einsum("...ij,...j->...i", inverse, b / size) / size)
