"""Free vibrations of a machine whose joints are springs and dampers: the eigenproblem behind its natural modes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..components.mode_sum import modes
from ..coupling.second_order import MachineEquations
from ..coupling.state_equations import machine_states
from ..indices import Mask
from ..model.machine import Machine

_LEVEL = 1e-12
"""Share of a pole below which its imaginary part is rounding."""
_BRAKED = 1e-14
"""Damping of free motions, relative to the largest, that counts as rounding."""
_FREE = 1e-7
"""Share of the fastest pole of state equations below which one is a free motion, which rounding put beside zero."""
_STANDS, _RITZ = (2 * np.pi * 0.01) ** 2, 1e-20
"""(rad/s)², and share of the fastest, below which a motion is free: no machine swings in minutes, and rounding."""
_SUM = 1e-13
"""Share of what a sum is made of that rounding leaves of it."""
_STRETCHED = 1e-3
"""Share of a motion from which it stretches a joint, so that it is not free although its pole is."""
_FALLING = 1e-12
_INSTANT = 1e-12
_ITERATIONS = 30
_SAME = 1e-13
_LIKE = 0.5
"""Least likeness of a mode and what it became (MAC) for them to be taken as one."""


@dataclass(frozen=True, eq=False)
class Vibrations:
    """Oscillating poles s in rad/s with Im s > 0 and their vectors in the coordinates of the equations, (n, modes)."""

    pole: ComplexArray
    vector: ComplexArray
    decay: Array
    """Real poles in 1/s that are not zero."""
    free: Array
    """Motions that nothing holds, over the dofs, (dofs, count)."""

    def sorted(self) -> Vibrations:
        """The same, ascending in |s|."""
        order = np.argsort(np.abs(self.pole), kind="stable")
        return Vibrations(self.pole[order], self.vector[:, order], np.sort(self.decay), self.free)


@dataclass(frozen=True, eq=False)
class Shapes:
    """Modes over the dofs and the joints, normalised as `NaturalModes` says."""

    dofs: ComplexArray
    """(dofs, modes)."""
    joints: ComplexArray
    """(joints, modes)."""
    slope: ComplexArray
    """ds/dk of a spring beside every joint, (joints, modes)."""
    vector: ComplexArray
    """In the coordinates of the equations, (n, modes)."""


class Eigenproblem(ABC):
    """A machine whose joints are to be held at stiffness K (N/m) and damping C (N s/m), (joints,)."""

    @abstractmethod
    def solve(self, K: Array, C: Array) -> Vibrations:
        """All its vibrations."""

    @abstractmethod
    def near(self, K: Array, C: Array, pole: complex, vector: ComplexArray) -> tuple[complex, ComplexArray]:
        """The one vibration that this one becomes with these joints."""

    @abstractmethod
    def shapes(self, K: Array, C: Array, pole: ComplexArray, vector: ComplexArray) -> Shapes:
        """Vibrations over dofs and joints, each with joints of its own, K and C of shape (modes, joints)."""


@dataclass(frozen=True, eq=False)
class InMotions(Eigenproblem):
    """(s²M + sC + K) p = 0 of a machine whose components have equations of motion."""

    where: str
    equations: MachineEquations

    def _closed(self, K: Array, C: Array) -> tuple[Array, Array, Array]:
        e = self.equations
        J = e.joints
        return e.mass, e.damping + J.T @ (C[:, None] * J), e.stiffness + J.T @ (K[:, None] * J)

    def solve(self, K: Array, C: Array) -> Vibrations:
        M, D, S = self._closed(K, C)
        try:
            squared, shapes, fastest = modes(M, S)
        except InputError as error:
            value = np.linalg.eigvalsh(S / np.sqrt(np.outer(np.diag(M), np.diag(M))))
            if value[0] < -_FALLING * abs(value[-1]):
                raise InputError(_falls(self.where)) from None
            raise InputError(f"{self.where}: {error}") from None
        squared, shapes = held_again(self.equations, K, squared, shapes, fastest)
        held, loose = np.flatnonzero(squared > 0), np.flatnonzero(squared == 0)
        if len(loose) and np.min(np.einsum("ir,ij,jr->r", shapes[:, loose], S, shapes[:, loose])) < -_FALLING * fastest:
            raise InputError(_falls(self.where))
        natural, n = np.sqrt(squared[held]), len(held)
        damping = shapes.T @ D @ shapes
        braked = bool(np.max(np.abs(damping[loose]), initial=0.0) > _BRAKED * np.max(np.abs(damping), initial=0.0))
        kept = np.concatenate([held, loose]) if braked else held
        # States [Ω r, ṙ], and of the free motions their speeds alone, as nothing depends on where they are.
        A = np.zeros((n + len(kept), n + len(kept)))
        A[:n, n : 2 * n], A[n : 2 * n, :n] = np.diag(natural), -np.diag(natural)
        A[n:, n:] = -damping[np.ix_(kept, kept)]
        poles, V = np.linalg.eig(A)
        level = np.abs(poles.imag) <= _LEVEL * np.abs(poles)
        up, real = np.flatnonzero(~level & (poles.imag > 0)), poles[level].real
        moved = np.zeros((len(squared), len(up)), dtype=complex)
        moved[kept] = V[n:, up] / poles[up]
        decay = real[np.abs(real) > _FREE**2 * np.sqrt(fastest)]
        free = self.equations.shapes @ shapes[:, loose]
        return Vibrations(poles[up].astype(complex), np.asarray(shapes @ moved), decay, free).sorted()

    def near(self, K: Array, C: Array, pole: complex, vector: ComplexArray) -> tuple[complex, ComplexArray]:
        M, D, S = self._closed(K, C)
        s, p = pole, vector
        scale = 1 / np.sqrt(np.abs(np.diag(S)) + abs(pole) ** 2 * np.diag(M))
        for _ in range(_ITERATIONS):
            before, s = s, _rayleigh(M, D, S, p, s)
            if abs(s - before) <= _SAME * abs(s):
                break
            Z = (s**2 * M + s * D + S) * scale * scale[:, None]
            try:
                p = scale * np.linalg.solve(Z, scale * ((2 * s * M + D) @ p))
            except np.linalg.LinAlgError:
                break
            p = p / np.linalg.norm(p)
        if s.imag > _LEVEL * abs(s) and _likeness(M, p, vector) > _LIKE:
            return s, p
        found = self.solve(K, C)
        best = int(np.argmax([_likeness(M, other, vector) for other in found.vector.T]))
        return complex(found.pole[best]), found.vector[:, best]

    def shapes(self, K: Array, C: Array, pole: ComplexArray, vector: ComplexArray) -> Shapes:
        e = self.equations
        z = e.joints @ vector
        m, c = (np.sum(vector * (matrix @ vector), axis=0) for matrix in (e.mass, e.damping))
        p = vector * np.sqrt(2 * pole / (2 * pole * m + c + np.sum(C.T * z**2, axis=0)))
        p = p * _upright(e.shapes @ p)
        z = e.joints @ p
        return Shapes(np.asarray(e.shapes @ p), np.asarray(z), np.asarray(-(z**2) / (2 * pole)), p)


def held_again(
    equations: MachineEquations, K: Array, squared: Array, shapes: Array, fastest: float
) -> tuple[Array, Array]:
    """ω² and shapes, of `modes`, with those motions held again that only beside a very fast one look free.

    What rounding leaves of ω² grows with the fastest, here a splinter of a part. The energy in the joints,
    Σ k (J φ)², is a sum of squares instead, and exact to the square of the rounding of φ.
    """
    loose = np.flatnonzero(squared == 0)
    if not len(loose):
        return squared, shapes
    F, inside = shapes[:, loose], equations.stiffness
    J, own = equations.joints @ F, F.T @ inside @ F
    own = np.where(np.abs(own) > _SUM * (np.abs(F).T @ np.abs(inside) @ np.abs(F)), own, 0.0)
    value, turned = np.linalg.eigh((J.T * K) @ J + (own + own.T) / 2)
    squared, shapes = squared.copy(), shapes.copy()
    squared[loose] = np.where(value > max(_STANDS, _RITZ * fastest), value, 0.0)[::-1]
    shapes[:, loose] = F @ turned[:, ::-1]
    return squared, shapes


class InStates(Eigenproblem):
    """v̇ = A v + B f, x = C v + D f of a machine with components that have state equations only."""

    def __init__(self, machine: Machine) -> None:
        states = machine_states(machine)
        self.where = machine.where
        copies = np.tile(np.eye(len(machine.dofs)), (len(states.blocks), 1))
        self.A, B, out = (scipy.linalg.block_diag(*(getattr(b, key) for b in states.blocks)) for key in "ABC")
        self.B, self.out = B @ copies, copies.T @ out
        self.D = np.sum([b.D for b in states.blocks], axis=0)
        self.joints = states.joints
        self.stretch, self.push = self.joints @ self.out, self.B @ self.joints.T
        scale = np.max(np.abs(self.out), initial=0.0) * np.max(np.abs(self.B), initial=0.0)
        jumps = np.any(np.abs(self.stretch @ self.B) > _INSTANT * scale, axis=1)
        self.jumps: Mask = np.asarray(jumps | np.any(self.joints @ self.D != 0, axis=1))

    def _closed(self, K: Array, C: Array) -> tuple[Array, Array, Array]:
        """Closed A and B, and the forces of the joints by the states."""
        if np.any(self.jumps & (C != 0)):
            raise InputError(
                f"{self.where}: a damper holds what a force moves or speeds up at once (D of a state-space component, "
                "or a lag in it), so the machine has no modes of this form; leave D out, or move the damper"
            )
        across = self.joints @ self.D
        through = np.linalg.inv(np.eye(len(K)) + K[:, None] * (across @ self.joints.T))
        forces = through @ (K[:, None] * self.stretch + C[:, None] * (self.stretch @ self.A))
        return self.A - self.push @ forces, self.B - self.push @ through @ (K[:, None] * across), forces

    def solve(self, K: Array, C: Array) -> Vibrations:
        A, _, forces = self._closed(K, C)
        poles, V = np.linalg.eig(A)
        fastest = float(np.max(np.abs(poles), initial=0.0))
        free = np.abs(poles) <= _FREE * fastest
        level = np.abs(poles.imag) <= _LEVEL * np.abs(poles)
        up = np.flatnonzero(~free & ~level & (poles.imag > 0))
        if np.any(poles[~free & level].real > _FREE * fastest):
            raise InputError(_falls(self.where))
        x = self._motion(V[:, free], forces)
        drifts = np.concatenate([x.real, x.imag], axis=1)
        U, size, _ = np.linalg.svd(drifts, full_matrices=False)
        basis = self._unheld(U[:, size > 1e-6 * np.max(size, initial=1e-300)], K)
        found = Vibrations(poles[up].astype(complex), V[:, up].astype(complex), poles[~free & level].real, basis)
        return found.sorted()

    def _unheld(self, drifts: Array, K: Array) -> Array:
        """Those of motions, (dofs, count), that stretch no joint: beside a very fast pole others look free as well."""
        rows = self.joints[K != 0]
        size = np.linalg.norm(rows, axis=1, keepdims=True)
        _, stretched, turned = np.linalg.svd(rows / np.where(size > 0, size, 1.0) @ drifts)
        held = np.count_nonzero(stretched > _STRETCHED)
        return np.asarray(drifts @ turned[held:].T)

    def _motion(self, vector: ComplexArray, forces: Array) -> ComplexArray:
        return np.asarray((self.out - self.D @ self.joints.T @ forces) @ vector, dtype=complex)

    def near(self, K: Array, C: Array, pole: complex, vector: ComplexArray) -> tuple[complex, ComplexArray]:
        found = self.solve(K, C)
        scale = np.eye(len(vector))
        best = int(np.argmax([_likeness(scale, other, vector) for other in found.vector.T]))
        return complex(found.pole[best]), found.vector[:, best]

    def shapes(self, K: Array, C: Array, pole: ComplexArray, vector: ComplexArray) -> Shapes:
        x, back = np.zeros((2, len(self.out), len(pole)), dtype=complex)
        for i, (s, v) in enumerate(zip(pole, vector.T, strict=True)):
            if i == 0 or np.any(K[i] != K[i - 1]) or np.any(C[i] != C[i - 1]):
                A, B, forces = self._closed(K[i], C[i])
            # The left vector, by inverse iteration beside the pole.
            shifted, left = (A - s * (1 + 1e-10) * np.eye(len(A))).T, v.conj()
            for _ in range(3):
                left = np.linalg.solve(shifted, left)
                left = left / np.linalg.norm(left)
            x[:, i], back[:, i] = self._motion(v, forces), (left / (left @ v)) @ B
        largest, every = np.argmax(np.abs(x * back), axis=0), np.arange(len(pole))
        size = np.sqrt(2 * pole * back[largest, every] / x[largest, every])
        size = size * _upright(size * x)
        slope = -(self.joints @ x) * (self.joints @ back)
        phi: ComplexArray = size * x
        return Shapes(phi, np.asarray(self.joints @ phi), np.asarray(slope, dtype=complex), np.asarray(size * vector))


def _upright(shapes: ComplexArray) -> Array:
    """The sign that makes the largest motion of every shape positive."""
    largest = np.argmax(np.abs(shapes), axis=0)
    return np.where(shapes[largest, np.arange(shapes.shape[1])].real < 0, -1.0, 1.0)


def _rayleigh(M: Array, C: Array, K: Array, p: ComplexArray, near: complex) -> complex:
    """The root s of pᵀ(s²M + sC + K)p = 0 that lies next to ``near``: off by the square of the error of p."""
    m, c, k = (complex(p @ matrix @ p) for matrix in (M, C, K))
    root = np.sqrt(c**2 - 4 * m * k)
    found = [(-c + root) / (2 * m), (-c - root) / (2 * m)] if m else [near]
    return complex(min(found, key=lambda s: abs(s - near)))


def _likeness(M: Array, first: ComplexArray, second: ComplexArray) -> float:
    """Modal assurance criterion with the mass as its measure, 0 to 1."""
    across = abs(first.conj() @ M @ second) ** 2
    own = abs(first.conj() @ M @ first) * abs(second.conj() @ M @ second)
    return float(across / own) if own else 0.0


def _falls(where: str) -> str:
    return (
        f"{where}: the machine does not stand by itself: some joint pushes further what moves away, by more than the "
        "rest holds; expected stiffnesses above 0 N/m, or a preload that keeps contacts closed"
    )
