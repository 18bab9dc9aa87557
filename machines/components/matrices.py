"""Component from the matrices of a finite-element model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section

from ..shapes.drawn import Drawn
from .component import Component, SecondOrder, checked_dofs, checked_square
from .craig_bampton import Reduction, craig_bampton, static_shapes
from .lumped import receptance_of
from .matrix_rows import aligned, matrix_file, named_rows
from .modal_coordinates import in_modes
from .nodes import TOLERANCE, Nodes, checked_nodes
from .static_load import axis_of, turns

SMALL = 200
"""Models of at most so many rows are not reduced."""
_ERROR = 1e-6
_STRAINED = 1e-6
"""Share of the forces inside a part that may be left where it moves as a rigid body."""
_UNITS = {"SI": 1.0, "mm": 1e3}
"""Stiffness of a translation in N/m per unit of the file; mm stands for mm, t, s, N."""


@dataclass(frozen=True, eq=False)
class Matrices(Component):
    """H = Φ (K − ω²M + jωC)⁻¹ Φᵀ of sparse symmetric matrices, known at the rows that are named.

    More than 200 rows are reduced to the named ones by Craig and Bampton's method up to ``up_to``; the error of that,
    measured against the full matrices, is among the `remarks`.

    Parameters
    ----------
    dofs, rows
        Names, as ``nose.x``, and the row (from 0) in the matrices that each stands for.
    mass, stiffness, damping
        kg, N/m, N s/m; without damping it is ``mass_damping`` (1/s) times the mass plus ``stiffness_damping`` (s)
        times the stiffness, plus ``damping_ratio`` in every mode.
    up_to
        Highest frequency in Hz that a reduced model is made for.
    nodes
        Where the named rows lie; None where that is not known.
    units
        "SI", or "mm" for matrices in mm, t, s, N; angles are in rad in both.
    axes
        Machine axis 0, 1 or 2 along which every row of the matrices moves, −1 for all others; None where that is not
        known. It is needed for the weight of a part that its matrices tie to the ground.
    """

    name: str
    dofs: tuple[str, ...]
    rows: tuple[int, ...]
    mass: scipy.sparse.csc_matrix
    stiffness: scipy.sparse.csc_matrix
    damping: scipy.sparse.csc_matrix | None = None
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    damping_ratio: float = 0.0
    up_to: float | None = None
    nodes: Nodes | None = None
    units: str = "SI"
    axes: tuple[int, ...] | None = None

    kind: ClassVar[str] = "matrices"

    def __post_init__(self) -> None:
        where = self._where
        object.__setattr__(self, "dofs", checked_dofs(where, self.dofs))
        size = self.mass.shape[0]
        for key in ("mass", "stiffness", "damping"):
            matrix = getattr(self, key)
            if matrix is not None:
                object.__setattr__(self, key, _checked(where, key, scipy.sparse.csc_matrix(matrix), size))
        for dof, row in zip(self.dofs, self.rows, strict=True):
            if not 0 <= row < size:
                raise InputError(f"{where}: dof {dof!r} is row {row + 1}, expected 1 to {size}")
            if self.rows.count(row) > 1:
                raise InputError(f"{where}: row {row + 1} has two names, expected one")
        if self.units not in _UNITS:
            raise InputError(f"{where}: units is {self.units!r}, {nearest(self.units, _UNITS)}")
        for key in ("mass_damping", "stiffness_damping", "damping_ratio"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"{where}: {key} is {value!r}, expected at least 0")
            if value and self.damping is not None:
                raise InputError(f"{where}: both damping and {key}, expected one of them")
        if self.up_to is None and size > SMALL:
            raise InputError(
                f"{where}: up_to is missing; matrices of {size} rows are reduced to the named ones up to that frequency"
            )
        if self.up_to is not None and not (np.isfinite(self.up_to) and self.up_to > 0):
            raise InputError(f"{where}: up_to is {self.up_to!r} Hz, expected more than 0")

    @property
    def _where(self) -> str:
        return f"component {self.name!r}"

    @classmethod
    def from_section(cls, section: Section) -> Matrices:
        name = section.text("name")
        files = {key: matrix_file(section, key) for key in ("mass", "stiffness", "damping") if section.has(key)}
        for key in ("mass", "stiffness"):
            if key not in files:
                section.take(key)
        matrices, labels = aligned(section.where, files)
        dofs, rows, names, places = named_rows(section, labels)
        tolerance = section.number("tolerance", "m", TOLERANCE)
        found = cls(
            name,
            dofs,
            rows,
            matrices["mass"],
            matrices["stiffness"],
            matrices.get("damping"),
            section.number("mass_damping", "1/s", 0.0),
            section.number("stiffness_damping", "s", 0.0),
            section.number("damping_ratio", "1", 0.0),
            section.number("up_to", "Hz", None),
            checked_nodes(section.where, names, np.array(places), tolerance) if names else None,
            section.text("units", "SI"),
            # Components 1 to 3 of a grid point are its translations.
            None if labels is None else tuple(c - 1 if 1 <= c <= 3 else -1 for _, c in labels),
        )
        found.second_order()  # so that what is wrong with the matrices is said where they are read
        return found

    @cached_property
    def _reduced(self) -> tuple[Reduction | None, SecondOrder]:
        interface = np.array(self.rows)
        size = self.mass.shape[0]
        if size <= SMALL:
            found, T = None, np.eye(size)
            shapes = T[interface]
        else:
            assert self.up_to is not None
            found = craig_bampton(self.mass, self.stiffness, interface, self.up_to, _ERROR, self._where)
            T = found.basis
            shapes = np.eye(len(interface), T.shape[1])
        M, K = (_small(T, matrix) for matrix in (self.mass, self.stiffness))
        for key, matrix in (("mass", M), ("stiffness", K)):
            checked_square(self._where, key, matrix, len(M))
        own = np.sqrt(np.maximum(np.diag(M), 0.0))
        if not np.all(own > 0) or not np.linalg.eigvalsh(M / own / own[:, None])[0] > 1e-13:
            raise InputError(f"{self._where}: mass is singular, expected every row to carry a mass")
        if self.damping is not None:
            C = _small(T, self.damping)
            checked_square(self._where, "damping", C, len(C))
        else:
            C = self.mass_damping * M + self.stiffness_damping * K
        # x in m and rad and N and N m from x and f in the units of the file: K and M of a translation change by the
        # factor, of a rotation by its inverse, between them not at all.
        factor = np.sqrt(_UNITS[self.units])
        rotations = np.array([turns(dof) for dof in self.dofs])
        shapes = np.where(rotations, factor, 1 / factor)[:, None] * shapes
        return found, in_modes(SecondOrder(M, C, K, shapes), 2 * self.damping_ratio * K)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        return receptance_of(self.second_order(), omega, rows, columns)

    def second_order(self) -> SecondOrder:
        return self._reduced[1]

    def weight(self, gravity: Array) -> Array:
        """Ψᵀ M r with the static shapes Ψ of the named rows and r the translation of all rows along gravity.

        Displacements of the named rows under it are exact. Without `axes` a free body moves as its named rows do,
        r = Ψ r_named, which its stiffness confirms by K r = 0.
        """
        shapes = self._static_shapes
        if shapes is None:
            raise InputError(
                f"{self._where}: with its named rows held it can still move, so its weight does not come down to them; "
                "name more rows, or leave gravity out and give the weights as forces"
            )
        if self.axes is None:
            r = shapes @ _along(gravity, [axis_of(dof.rpartition(".")[2]) for dof in self.dofs])
            strain, size = np.abs(self.stiffness @ r), abs(self.stiffness) @ np.abs(r)
            if np.max(strain) > _STRAINED * np.max(size, initial=1e-300):
                raise InputError(
                    f"{self._where}: its stiffness ties it to the ground and its rows do not name their directions "
                    "(those of a DMIG file do), so its weight is not known; leave gravity out and give the weights as "
                    "forces"
                )
        else:
            r = _along(gravity, self.axes)
        # In t and mm/s² a mass matrix gives N and N mm.
        unit = _UNITS[self.units]
        turns = np.array([axis_of(dof.rpartition(".")[2]) is None for dof in self.dofs])
        return np.asarray(np.where(turns, 1.0, unit) * (shapes.T @ (self.mass @ r)))

    @cached_property
    def _static_shapes(self) -> Array | None:
        found = self._reduced[0]
        if found is None:
            return static_shapes(self.stiffness, np.array(self.rows))
        return found.basis[:, : len(self.rows)] if found.held else None

    def remarks(self) -> tuple[str, ...]:
        found, size = self._reduced[0], self.mass.shape[0]
        said = []
        if found is not None:
            said.append(
                f"{self.name}: {size} rows reduced to {found.basis.shape[1]} coordinates ({len(self.rows)} named rows, "
                f"{found.modes} modes up to {2 * (self.up_to or 0):g} Hz, {found.corrections} blocks of corrections); "
                f"largest error in norm against the full matrices {found.error:.1g} at "
                f"{', '.join(f'{f:.4g}' for f in found.checked)} Hz."
            )
        if self.damping is None and not (self.mass_damping or self.stiffness_damping or self.damping_ratio):
            said.append(f"{self.name}: neither a damping matrix nor any damping is given; it is undamped.")
        return tuple(said)

    def motion_at(self, point: Array, direction: Array) -> Array | None:
        """Motion of the node that lies there; None where no positions are given."""
        return None if self.nodes is None else self.nodes.motion(self._where, self.dofs, point, direction)

    def drawn(self) -> Drawn | None:
        """Its nodes; motions that a node has no row for are drawn as zero."""
        if self.nodes is None:
            return None
        return Drawn(self.nodes.frames(self.dofs), self.nodes.names, len(self.nodes.names), dots=True)

    def rotation_at(self, point: Array, direction: Array) -> Array | None:
        """Rotation of the node that lies there; None where it has none, as in models of solids."""
        return None if self.nodes is None else self.nodes.rotation(self._where, self.dofs, point, direction)


def _small(T: Array, matrix: scipy.sparse.csc_matrix) -> Array:
    small = np.asarray(T.T @ (matrix @ T))
    return np.asarray((small + small.T) / 2)


def _along(gravity: Array, axes: Sequence[int | None]) -> Array:
    """The acceleration along every row."""
    return np.array([gravity[axis] if axis in (0, 1, 2) else 0.0 for axis in axes])


def _checked(where: str, key: str, matrix: scipy.sparse.csc_matrix, size: int) -> scipy.sparse.csc_matrix:
    if matrix.shape != (size, size):
        raise InputError(f"{where}: {key} has shape {matrix.shape}, expected {(size, size)} like the mass")
    if not np.all(np.isfinite(matrix.data)):
        raise InputError(f"{where}: {key} holds values that are not finite")
    apart = abs(matrix - matrix.T)
    if apart.nnz and apart.max() > 1e-9 * abs(matrix).max():
        i, j = (int(k[np.argmax(apart.tocoo().data)]) for k in apart.tocoo().coords)
        raise InputError(
            f"{where}: {key} has {matrix[i, j]:g} in row {i + 1}, column {j + 1} and {matrix[j, i]:g} across, "
            "expected a symmetric matrix"
        )
    return scipy.sparse.csc_matrix((matrix + matrix.T) / 2)
