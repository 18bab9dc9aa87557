"""The end of a spindle in one plane, coupled with a known blank and taken off it again: formulas of arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

PARTS = ((0, 0), (0, 1), (1, 1))
"""What is unknown of a symmetric 2 × 2 receptance: deflection by force, deflection by moment, rotation by moment."""


@dataclass(frozen=True, eq=False)
class Hits:
    """Measured responses of an assembly in one plane, and what its blank does at the same places when it is free.

    Parameters
    ----------
    assembly, deviation
        G and √(E|error|²) in m/N, shape (responses, lines).
    free
        R_ik of the blank alone between the same places in m/N, same shape.
    response, drive
        R_i2 from the coupled end to the place that moves, and to the one that is driven, by force (m/N) and moment
        (1/N) at the end, (responses, lines, 2).
    end
        R_22 at the coupled end, deflection and rotation by force and moment, (lines, 2, 2).
    """

    assembly: ComplexArray
    deviation: Array
    free: ComplexArray
    response: ComplexArray
    drive: ComplexArray
    end: ComplexArray

    @property
    def tells_all(self) -> bool:
        """Whether these responses alone determine all three parts: two places move and two are driven."""
        rows = _products(self.response, self.drive).transpose(1, 0, 2)
        size = np.linalg.norm(rows, axis=(1, 2), keepdims=True)
        scaled = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300 * np.maximum(size, 1.0))
        return bool(len(self.free) >= 3 and np.median(np.linalg.svd(scaled, compute_uv=False)[:, -1]) > _INDEPENDENT)

    def coupled(self, S: ComplexArray) -> ComplexArray:
        """G_ik = R_ik − R_i2 (R_22 + S)⁻¹ R_2k with the end S of a spindle, (lines, 2, 2) → (responses, lines)."""
        forces = np.einsum("lab,rlb->rla", np.linalg.inv(self.end + S), self.drive)
        return np.asarray(self.free - np.einsum("rla,rla->rl", self.response, forces))


_INDEPENDENT = 1e-9


def symmetric(parts: ComplexArray) -> ComplexArray:
    """The symmetric 2 × 2 matrices of (…, 3) parts."""
    return np.asarray(parts[..., [0, 1, 1, 2]].reshape(*parts.shape[:-1], 2, 2))


def parts_of(matrix: ComplexArray) -> ComplexArray:
    """The (…, 3) parts of symmetric 2 × 2 matrices."""
    return np.stack([matrix[..., i, k] for i, k in PARTS], axis=-1)


def taken_off(hits: Hits) -> ComplexArray:
    """S = T⁻¹ − R_22, line by line, where the symmetric T solves R_ik − G_ik = R_i2 T R_2k by weighted least squares.

    With the tip i = k = 1 and its rotation this is S = R_21 (R_11 − G_11)⁻¹ R_12 − R_22 of receptance coupling
    (Schmitz, Donaldson, CIRP Annals 49, 2000), read backwards; T is linear in what was measured, so places along the
    blank stand for a rotation, without differences. Returns (lines, 2, 2).
    """
    A = np.moveaxis(_products(hits.response, hits.drive) / hits.deviation[..., None], 0, 1)
    right = ((hits.free - hits.assembly) / hits.deviation).T
    size = np.linalg.norm(A, axis=1, keepdims=True)
    Q, R = np.linalg.qr(A / size)
    T = np.linalg.solve(R, np.einsum("lra,lr->la", Q.conj(), right)[..., None])[..., 0] / size[:, 0]
    return np.asarray(np.linalg.inv(symmetric(T)) - hits.end)


@dataclass(frozen=True, eq=False)
class Information:
    """What responses say of the parts p of S on every line, by −log likelihood p†Jp − 2 Re p†b + c up to a constant.

    ``matrix`` J is (lines, 3, 3), ``vector`` b (lines, 3), ``constant`` c (lines,).
    """

    matrix: ComplexArray
    vector: ComplexArray
    constant: Array

    def __add__(self, other: Information) -> Information:
        return Information(
            self.matrix + other.matrix, self.vector + other.vector, np.asarray(self.constant + other.constant)
        )

    def where(self, kept: Array) -> Information:
        """The same on some lines, nothing on the others."""
        return Information(
            self.matrix * kept[:, None, None], self.vector * kept[:, None], np.asarray(self.constant * kept)
        )


def information(hits: Hits, S: ComplexArray, unit: Array, doubt: Array | float = 0.0) -> Information:
    """What the responses say near S: dG_ik = u_iᵀ dS u_k with u = (R_22 + S)⁻¹ R_2.

    ``unit``: of the three parts, so that they are of one size. ``doubt``: a deviation in m/N beside that of the noise.
    """
    T = np.linalg.inv(hits.end + S)
    u, v = (np.einsum("lab,rlb->rla", T, side) for side in (hits.response, hits.drive))
    A = _products(u, v) * unit
    y = hits.assembly - hits.coupled(S) + np.einsum("rla,la->rl", A, parts_of(S) / unit)
    weight = 1 / (hits.deviation**2 + np.square(doubt))
    return Information(
        np.einsum("rla,rl,rlb->lab", A.conj(), weight, A),
        np.einsum("rla,rl,rl->la", A.conj(), weight, y),
        np.einsum("rl,rl->l", weight, np.abs(y) ** 2),
    )


def bend(hits: Hits, S: ComplexArray, covariance: ComplexArray, unit: Array) -> Array:
    """Bound of √E|u_iᵀ dS T dS u_k|², what `information` leaves out where S has this covariance; m/N like G."""
    T = np.linalg.inv(hits.end + S)
    u, v = (np.einsum("lab,rlb->rla", T, side) for side in (hits.response, hits.drive))
    scale = np.sqrt(unit[[0, 2]])  # S = scale · s · scale with s in m/N
    moved = [
        np.sqrt(np.maximum(np.einsum("rlai,lij,rlaj->rl", L, covariance, L.conj()).real, 0.0))
        for L in (np.einsum("jab,rlb->rlaj", _UNITS, w * scale) for w in (u, v))
    ]
    return np.asarray(np.linalg.norm(T * scale[:, None] * scale, axis=(1, 2)) * moved[0] * moved[1])


def doubt_of(hits: Hits, S: ComplexArray, covariance: ComplexArray, unit: Array) -> Array:
    """√E|(R_22 + S)⁻¹ dS|² on every line: the relative error of the interface that the blank feels."""
    scale = np.sqrt(unit[[0, 2]])
    T = np.linalg.inv(hits.end + S) * scale[:, None] * scale
    L = np.einsum("lab,jbc->lacj", T, _UNITS).reshape(len(T), 4, 3)
    return np.asarray(np.sqrt(np.maximum(np.einsum("lij,ljk,lik->l", L, covariance, L.conj()).real, 0.0)))


def inverse(matrix: ComplexArray) -> ComplexArray:
    """Inverses of Hermitian matrices whose rows differ in size; nearly singular ones give large numbers."""
    size = np.sqrt(np.maximum(np.einsum("laa->la", matrix).real, 1e-300))
    even = matrix / size[:, :, None] / size[:, None, :] + _ROUNDING * np.eye(3)
    return np.asarray(np.linalg.inv(even) / size[:, :, None] / size[:, None, :])


_ROUNDING = 1e-15
_UNITS = np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 1.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]])
"""dS/dp of the three parts."""


def _products(a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """Coefficients of the three parts of a symmetric X in aᵀ X b, (…, 2) → (…, 3)."""
    mixed = a[..., 0] * b[..., 1] + a[..., 1] * b[..., 0]
    return np.stack([a[..., 0] * b[..., 0], mixed, a[..., 1] * b[..., 1]], axis=-1)
