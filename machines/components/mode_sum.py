"""Receptance as a sum over the poles of the equations of motion: one decomposition serves every frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..indices import Index

_SHIFT = 1e-4
_FREE = 1e-13
_NOTHING = 1e-14
"""Damping of a free motion, relative to the largest, that counts as rounding."""
_REAL = 1e-13
_SAME = 1e-10
_AGREES = 1e-11
_BLOCK = 2**22
"""Entries of an array that is worked on at a time; bounds the memory to about 64 MB."""


@dataclass(frozen=True, eq=False)
class ModeSum:
    """H(s) = Σ_r (α_r + s β_r)/(s² − 2 Re(λ_r) s + |λ_r|²) + Σ_k ρ_k/(s − λ_k) + ρ_0/s², s = jω.

    The poles λ_r come in conjugate pairs, λ_k are real, free motions have their double pole at zero. All weights are
    products of real columns, taken in the coordinates of the equations; damping of any form is exact.
    """

    shapes: Array
    """Undamped modes, p = shapes · q, (coordinates, modes)."""
    pairs: ComplexArray
    """λ_r in 1/s with Im > 0."""
    right: ComplexArray
    """Their right vectors in q, (modes, pairs), and left ones, (pairs, modes): the residue is right · left."""
    left: ComplexArray
    real: Array
    right_real: Array
    left_real: Array
    free: Index
    """Indices of free, undamped modes."""
    mixed: bool
    """Whether damping couples the modes, so that the residues of pairs have a real part."""

    @classmethod
    def of(cls, mass: Array, damping: Array, stiffness: Array) -> ModeSum | None:
        """The sum, or None where it would lose accuracy: critical damping, free motions that are damped,
        stiffness that is not positive."""
        try:
            squared, shapes, _ = modes(mass, stiffness)
        except InputError:
            return None
        if np.max(np.abs(shapes.T @ stiffness @ shapes - np.diag(squared))) > _SAME * np.max(squared):
            return None
        C = shapes.T @ damping @ shapes
        free, held = np.flatnonzero(squared == 0), np.flatnonzero(squared > 0)
        if len(free) and np.max(np.abs(C[free]), initial=0.0) > _NOTHING * np.max(np.abs(C), initial=0.0):
            return None
        natural, C, n = np.sqrt(squared[held]), C[np.ix_(held, held)], len(held)
        # States [Ω q, q̇]: skew-symmetric but for the damping, so the decomposition is well conditioned.
        A = np.zeros((2 * n, 2 * n))
        A[:n, n:], A[n:, :n], A[n:, n:] = np.diag(natural), -np.diag(natural), -C
        poles, V = np.linalg.eig(A)
        try:
            W = np.linalg.inv(V)
        except np.linalg.LinAlgError:
            return None
        poles = poles + np.einsum("ri,ir->r", W, A @ V - V * poles)
        out = np.zeros((len(squared), 2 * n), dtype=complex)
        out[held] = V[:n] / natural[:, None]
        into = np.zeros((2 * n, len(squared)), dtype=complex)
        into[:, held] = W[:, n:]
        level = np.abs(poles.imag) <= _REAL * np.abs(poles)
        up, real = np.flatnonzero(~level & (poles.imag > 0)), np.flatnonzero(level)
        found = cls(
            shapes,
            poles[up],
            out[:, up],
            into[up],
            poles[real].real,
            out[:, real].real,
            into[real].real,
            free,
            bool(np.any(np.diag(np.diag(C)) != C)),
        )
        whole = np.zeros((len(squared), len(squared)))
        whole[np.ix_(held, held)] = C
        return found if found._agrees(squared, whole) else None

    def _agrees(self, squared: Array, C: Array) -> bool:
        """Whether the sum is the inverse of the dynamic stiffness, next to resonances and away from them."""
        size = np.sort(np.abs(np.concatenate([self.pairs, self.real])))
        if not len(size):
            return True
        picked = np.unique(size[[0, len(size) // 2, -1]])
        omega = np.concatenate([1.001 * picked, 0.7 * picked])
        dynamic = 1j * omega[:, None, None] * C
        every = np.arange(len(squared))
        dynamic[:, every, every] += squared - omega[:, None] ** 2
        own = 1 / np.sqrt(np.abs(dynamic[:, every, every]))
        probe = np.cos(np.outer(every, [0.0, 1.0, np.sqrt(2.0)]))
        error = self.in_modes(np.eye(len(squared)), probe.T).at(omega) - np.linalg.solve(dynamic, probe.astype(complex))
        return bool(np.max(np.abs(error) / (own * np.max(own, axis=1, keepdims=True))[:, :, None]) < _AGREES)

    def receptance(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        """rows · H · columnsᵀ at angular frequencies (rad/s), (nf, rows, columns); both in the coordinates p."""
        return self.between(rows, columns).at(omega)

    def between(self, rows: Array, columns: Array) -> Residues:
        """The sum between rows and columns, both in the coordinates p, ready for any number of frequencies."""
        return self.in_modes(rows @ self.shapes, columns @ self.shapes)

    def in_modes(self, left: Array, right: Array) -> Residues:
        """The sum between rows and columns over the modes."""
        ahead, back = left @ self.right, self.left @ right.T
        residue = ahead.T[:, :, None] * back[:, None, :]
        weight: list[Array] = [-2 * (residue * self.pairs.conj()[:, None, None]).real]
        if self.mixed:
            weight.append(2 * residue.real)
        if len(self.real):
            weight.append((left @ self.right_real).T[:, :, None] * (self.left_real @ right.T)[:, None, :])
        if len(self.free):
            weight.append((left[:, self.free] @ right[:, self.free].T)[None])
        return Residues(self, np.concatenate(weight))

    def under(self, left: Array, right: Array) -> Motions:
        """The sum between rows and columns over the modes, for one vector of forces at a frequency."""
        return Motions(self, left, right, left @ self.right, (self.left @ right.T).T)

    def terms(self, omega: Array) -> ComplexArray:
        """What the weights of `Residues` stand by, (nf, terms)."""
        s, below = np.asarray(1j * omega[:, None], dtype=complex), self.below(omega)
        terms: list[ComplexArray] = [below]
        if self.mixed:
            terms.append(s * below)
        if len(self.real):
            terms.append(np.asarray(1 / (s - self.real), dtype=complex))
        if len(self.free):
            terms.append(np.asarray(-1 / omega[:, None] ** 2, dtype=complex))
        return np.concatenate(terms, axis=1)

    def below(self, omega: Array) -> ComplexArray:
        """1/(s² − 2 Re(λ_r) s + |λ_r|²), (nf, pairs)."""
        p, w = self.pairs, omega[:, None]
        return np.asarray(1 / (np.abs(p) ** 2 - w**2 - 2j * w * p.real), dtype=complex)


@dataclass(frozen=True, eq=False)
class Residues:
    """A sum over poles between some rows and columns."""

    poles: ModeSum
    weights: Array
    """α_r, β_r, ρ_k and ρ_0 as far as there are any, (terms, rows, columns)."""

    def at(self, omega: Array) -> ComplexArray:
        """The receptance in m/N at angular frequencies (rad/s), (nf, rows, columns)."""
        terms, *shape = self.weights.shape
        flat = self.weights.reshape(terms, -1)
        out = np.empty((len(omega), flat.shape[1]), dtype=complex)
        step = max(16, _BLOCK // max(1, flat.shape[1], 2 * len(self.poles.shapes)))
        for start in range(0, len(omega), step):
            now = slice(start, start + step)
            table = self.poles.terms(omega[now])
            parts = np.concatenate([table.real, table.imag]) @ flat
            out[now].real, out[now].imag = parts[: len(table)], parts[len(table) :]
        return out.reshape(len(omega), *shape)


@dataclass(frozen=True, eq=False)
class Motions:
    """A sum over poles between some rows and columns that are never joined: one vector of forces at a frequency takes
    the modes times rows and columns, where all receptances take rows times columns of them."""

    poles: ModeSum
    left: Array
    """Over the modes, (rows, modes)."""
    right: Array
    """(columns, modes)."""
    ahead: ComplexArray
    """Over the pairs, (rows, pairs)."""
    back: ComplexArray
    """(columns, pairs)."""

    def at(self, omega: Array, force: ComplexArray) -> ComplexArray:
        """Motions in m, (nf, rows), at angular frequencies (rad/s) under forces in N, (nf, columns)."""
        poles, p, s = self.poles, self.poles.pairs, 1j * omega[:, None]
        u, v = force @ self.back.real, force @ self.back.imag
        by_real, by_imaginary = -2 * (p.real * u + p.imag * v), -2 * (p.imag * u - p.real * v)
        if poles.mixed:
            by_real, by_imaginary = by_real + 2 * s * u, by_imaginary - 2 * s * v
        below = poles.below(omega)
        out = (below * by_real) @ self.ahead.real.T + (below * by_imaginary) @ self.ahead.imag.T
        if len(poles.real):
            pushed = force @ (self.right @ poles.left_real.T)
            out += (pushed / (s - poles.real)) @ (self.left @ poles.right_real).T
        if len(poles.free):
            free = poles.free
            out -= (force @ self.right[:, free] / omega[:, None] ** 2) @ self.left[:, free].T
        return np.asarray(out)


def modes(mass: Array, stiffness: Array) -> tuple[Array, Array, float]:
    """ω² in (rad/s)², descending, mass-normalised shapes, and a bound of the fastest ω².

    They are those of M φ = ν (K + σM) φ with ω² = 1/ν − σ: the slow modes, which decide a receptance, have the
    largest ν and come out to rounding, and so does what each fast one adds to the static compliance. σ, a
    ten-thousandth of the fastest ω², is there for free bodies; motions slower than rounding count as free.
    """
    fastest = float(np.max(np.diag(stiffness) / np.diag(mass), initial=0.0)) or 1.0
    shift = _SHIFT * fastest
    try:
        inverse, shapes = scipy.linalg.eigh(mass, stiffness + shift * mass)
    except np.linalg.LinAlgError:
        raise InputError(
            "equations of motion: masses or stiffnesses lie too far apart for floats, expected ones of like size"
        ) from None
    squared = 1 / inverse - shift
    return np.where(squared < _FREE * fastest, 0.0, squared), shapes / np.sqrt(inverse), fastest
