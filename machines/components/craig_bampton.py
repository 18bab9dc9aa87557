"""Reduction of large matrices to named degrees of freedom, with its error measured against the full solution."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..indices import Index

FACTOR = 2.0
"""Fixed-interface modes are kept up to this multiple of the frequency range."""
_BLOCKS = 4
_DENSE = 1200
_LOSS = 0.02
"""Loss factor given to both models where they are compared, so that resonances do not decide the figure."""
_SHARES = (0.03, 0.3, 0.55, 0.8, 1.0)
_SINGULAR = 1e-13


@dataclass(frozen=True, eq=False)
class Reduction:
    """x = basis · p: interface displacements first, then motions with the interface held."""

    basis: Array
    """(rows of the full model, interface + inner motions)."""
    modes: int
    """Fixed-interface modes among the inner motions."""
    corrections: int
    """Blocks of residual inertia shapes among them."""
    error: float
    """Largest relative difference in norm of the interface receptance from the full one."""
    checked: Array
    """Frequencies in Hz at which the two were compared."""
    held: bool = True
    """Whether the interface, held, leaves the inside no free motion; only then are its static shapes exact."""

    def reduced(self, matrix: scipy.sparse.csc_matrix) -> Array:
        """Tᵀ A T, symmetric to the last bit."""
        small = np.asarray(self.basis.T @ (matrix @ self.basis))
        return np.asarray((small + small.T) / 2)


def craig_bampton(
    mass: scipy.sparse.csc_matrix,
    stiffness: scipy.sparse.csc_matrix,
    interface: Index,
    up_to: float,
    tolerance: float,
    where: str,
) -> Reduction:
    """Static shapes of unit interface displacements and the normal modes with the interface held.

    Craig, Bampton, AIAA J. 6 (1968): exact in statics. Modes are kept up to twice ``up_to`` (Hz). What the modes
    above leave out is then added in blocks: the static answer of the inside to the inertia forces of the static
    shapes, to the inertia forces of that answer, and so on (the residual of Kim, Lee, Int. J. Numer. Meth. Eng. 103,
    2015), until the receptance of the interface agrees with the sparse full solution within ``tolerance`` at five
    frequencies, or four blocks are in.
    """
    n = mass.shape[0]
    inner = np.setdiff1d(np.arange(n), interface)
    top = 2 * np.pi * up_to
    if not len(inner):
        return Reduction(np.eye(n)[:, interface], 0, 0, 0.0, np.array([up_to]))
    M, K = mass[inner][:, inner].tocsc(), stiffness[inner][:, inner].tocsc()
    # A body that its interface does not hold has no static shape; a slow imaginary frequency stands in for zero.
    shift, solver = 0.0, _factor(K)
    if solver is None:
        shift = -((0.01 * top) ** 2)
        solver = _factor(K - shift * M)
    if solver is None:
        raise InputError(f"{where}: stiffness and mass are singular together, expected every row to carry one of them")
    coupling = (stiffness - shift * mass)[inner][:, interface].toarray()
    static = -solver.solve(coupling) if len(interface) else coupling
    checked = np.array(_SHARES) * up_to
    full = [_interface_receptance(mass, stiffness, interface, 2 * np.pi * f, where) for f in checked]
    modes = _modes(M, K, solver, shift, FACTOR * top, where)
    residual = (mass[inner][:, interface].toarray() + M @ static) if len(interface) else static
    inside, block = modes, residual
    for corrections in range(_BLOCKS + 1):
        basis = np.zeros((n, len(interface) + inside.shape[1]))
        basis[interface, : len(interface)] = np.eye(len(interface))
        basis[inner] = np.concatenate([static, inside], axis=1)
        found = Reduction(basis, modes.shape[1], corrections, 0.0, checked, shift == 0)
        error = _error(found, mass, stiffness, len(interface), full)
        if error <= tolerance or corrections == _BLOCKS:
            break
        fresh = solver.solve(block)
        for _ in range(2):
            fresh -= inside @ (inside.T @ (M @ fresh))
        fresh = _ritz(M, K - shift * M, fresh)
        inside, block = np.concatenate([inside, fresh], axis=1), M @ fresh
    return replace(found, error=error)


def static_shapes(stiffness: scipy.sparse.csc_matrix, interface: Index) -> Array | None:
    """Displacement of every row for a unit displacement of each of the interface, the inside unloaded.

    None where the inside can move freely with the interface held.
    """
    n = stiffness.shape[0]
    inner = np.setdiff1d(np.arange(n), interface)
    shapes = np.zeros((n, len(interface)))
    shapes[interface] = np.eye(len(interface))
    if len(inner):
        solver = _factor(stiffness[inner][:, inner].tocsc())
        if solver is None:
            return None
        shapes[inner] = -solver.solve(stiffness[inner][:, interface].toarray())
    return shapes


def _ritz(M: scipy.sparse.csc_matrix, K: scipy.sparse.csc_matrix, shapes: Array) -> Array:
    """Mass-normalised Rayleigh–Ritz modes of these shapes, shapes that repeat others dropped."""
    size = np.sqrt(np.einsum("ij,ij->j", shapes, K @ shapes))
    shapes = shapes[:, size > 0] / size[size > 0]
    values, turn = np.linalg.eigh(shapes.T @ (K @ shapes))
    kept = values > 1e-11 * values[-1]
    shapes = shapes @ (turn[:, kept] / np.sqrt(values[kept]))
    inverse, turn = np.linalg.eigh(shapes.T @ (M @ shapes))
    kept = inverse > 1e-14 * inverse[-1]
    return np.asarray(shapes @ (turn[:, kept] / np.sqrt(inverse[kept])))


def _factor(matrix: scipy.sparse.csc_matrix) -> Any:
    """LU factors, or None for a singular matrix."""
    try:
        found = scipy.sparse.linalg.splu(matrix.tocsc())
    except RuntimeError:
        return None
    pivots = np.abs(found.U.diagonal())
    return found if pivots.min() > _SINGULAR * pivots.max() else None


def _modes(
    M: scipy.sparse.csc_matrix, K: scipy.sparse.csc_matrix, solver: Any, shift: float, top: float, where: str
) -> Array:
    """Mass-normalised modes below the angular frequency ``top``."""
    n = M.shape[0]
    if n <= _DENSE:
        try:
            # ν = 1/(ω² − shift) by the inverse problem: M may be singular, K − shift M may not.
            inverse, shapes = scipy.linalg.eigh(M.toarray(), (K - shift * M).toarray())
        except np.linalg.LinAlgError:
            raise InputError(f"{where}: stiffness is not positive, expected one that yields no energy") from None
        if inverse[0] < -1e-9 * inverse[-1]:
            raise InputError(f"{where}: mass is not positive, expected one that stores energy")
        kept = inverse > 1 / (top**2 - shift)
        return np.asarray(shapes[:, kept] / np.sqrt(inverse[kept]))
    operator = scipy.sparse.linalg.LinearOperator((n, n), matvec=solver.solve, dtype=float)
    count = 20
    while True:
        count = min(count, n - 2)
        squared, shapes = scipy.sparse.linalg.eigsh(K, k=count, M=M, sigma=shift, OPinv=operator, v0=np.ones(n))
        if squared.min() < -1e-6 * abs(squared).max() - abs(shift):
            raise InputError(f"{where}: stiffness is not positive, expected one that yields no energy")
        if squared.max() > top**2 or count == n - 2:
            return np.asarray(shapes[:, squared <= top**2])
        count *= 2


def _interface_receptance(
    mass: scipy.sparse.csc_matrix, stiffness: scipy.sparse.csc_matrix, interface: Index, omega: float, where: str
) -> ComplexArray:
    system = (stiffness * (1 + 1j * _LOSS) - omega**2 * mass).tocsc()
    force = np.zeros((mass.shape[0], len(interface)), dtype=complex)
    force[interface, np.arange(len(interface))] = 1.0
    try:
        return np.asarray(scipy.sparse.linalg.splu(system).solve(force)[interface])
    except RuntimeError:
        raise InputError(f"{where}: stiffness and mass are singular together, expected every row to move") from None


def _error(
    found: Reduction,
    mass: scipy.sparse.csc_matrix,
    stiffness: scipy.sparse.csc_matrix,
    ports: int,
    full: list[ComplexArray],
) -> float:
    M, K = found.reduced(mass), found.reduced(stiffness)
    worst = 0.0
    for f, H in zip(found.checked, full, strict=True):
        small = np.linalg.inv(K * (1 + 1j * _LOSS) - (2 * np.pi * f) ** 2 * M)[:ports, :ports]
        # Translations and rotations differ in unit: every row and column is measured by its own driving points.
        own = np.sqrt(np.abs(np.diag(H)))
        scale = np.where(own > 0, own, 1.0)
        difference = (small - H) / scale[:, None] / scale
        worst = max(worst, float(np.linalg.norm(difference) / np.linalg.norm(H / scale[:, None] / scale)))
    return worst
