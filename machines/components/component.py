"""The contract of a component: named degrees of freedom and their receptance."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.io.toml import Section

from ..shapes.drawn import Drawn
from .mode_sum import ModeSum


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """M q̈ + C q̇ + K q = Φᵀ f, x = Φ q: the equations of motion behind a receptance.

    Mass (kg), damping (N s/m) and stiffness (N/m) have shape (n, n) in the generalised coordinates q; ``shapes`` Φ
    has one row per degree of freedom of the component.
    """

    mass: Array
    damping: Array
    stiffness: Array
    shapes: Array

    @cached_property
    def reciprocal(self) -> bool:
        """Whether a force here moves there as one there moves here; gyroscopic pairs, a skew damping, end that."""
        return bool(np.all(np.abs(self.damping - self.damping.T) <= _SKEW * np.max(np.abs(self.damping), initial=0.0)))

    @cached_property
    def poles(self) -> ModeSum | None:
        """The receptance as a sum over poles, for any number of frequencies."""
        return ModeSum.of(self.mass, self.damping, self.stiffness)


@dataclass(frozen=True, eq=False)
class FirstOrder:
    """ẋ = A x + B f, displacement = C x + D f: states behind a receptance that has no second-order form.

    Forces (N) in and displacements (m) out, one per degree of freedom of the component, in the same order.
    """

    A: Array
    B: Array
    C: Array
    D: Array


_ROUNDING = 1e-15
_SKEW = 1e-12


class Component(ABC):
    """A linear part of a machine, known at its degrees of freedom; nothing holds it but its own stiffness."""

    kind: ClassVar[str]
    """The word for the component in machine files."""
    name: str
    dofs: tuple[str, ...]

    @classmethod
    @abstractmethod
    def from_section(cls, section: Section) -> Component:
        """Build from a ``[[component]]`` table whose ``kind`` has been read."""

    def receptance(self, omega: Array, ports: Array | None = None) -> ComplexArray:
        """P H Pᵀ in m/N at angular frequencies (rad/s, above 0), shape (nf, p, p).

        ``ports`` P has shape (p, number of dofs), one row per force or motion that is of interest; without it
        P is the unit matrix. A component gives this or `between`.
        """
        P = np.eye(len(self.dofs)) if ports is None else ports
        return self.between(omega, P, P)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        """R H Cᵀ in m/N, (nf, rows, columns): motions along ``rows`` for forces along ``columns``, each over the dofs.

        A component that can do without the rest of the matrix overrides this.
        """
        if type(self).receptance is Component.receptance:
            raise NotImplementedError(
                f"{type(self).__name__}: has neither receptance nor between, expected one of them"
            )
        both = self.receptance(omega, np.concatenate([rows, columns]))
        return both[:, : len(rows), len(rows) :]

    @abstractmethod
    def second_order(self) -> SecondOrder | None:
        """The equations of motion, or None where there are none of this form."""

    @property
    def band(self) -> tuple[float, float]:
        """Frequencies in Hz that the receptance is known at: all of them, but for measured ones."""
        return 0.0, np.inf

    @property
    def known_speeds(self) -> tuple[float, float] | None:
        """Spindle speeds in rpm over which it is told how it depends on them; None where it does not."""
        return None

    def at_speed(self, speed: float) -> Component:
        """The component while the spindle turns with ``speed`` in rpm."""
        return self

    def first_order(self) -> FirstOrder | None:
        """The state equations of a component without `second_order`; None where only a receptance is known."""
        return None

    def remarks(self) -> tuple[str, ...]:
        """What a user must be told: reduction and interpolation errors, checks that failed; a sentence each."""
        return ()

    def motion_at(self, point: Array, direction: Array) -> Array | None:
        """Row over the dofs that gives the motion of a point (m, machine axes) along a unit direction.

        None where a component has no shape in space.
        """
        return None

    def drawn(self) -> Drawn | None:
        """How it looks and how what is drawn moves; None where it has no shape in space."""
        return None

    def rotation_at(self, point: Array, direction: Array) -> Array | None:
        """Row over the dofs that gives the rotation, in rad, about a unit direction of what lies at a point.

        None where a component has no shape in space, or nothing there that turns.
        """
        return None

    def weight(self, gravity: Array) -> Array | None:
        """Static force of gravity (acceleration in m/s², machine axes) on every dof in N; None if no mass is known."""
        return None


def checked_dofs(where: str, dofs: Sequence[str]) -> tuple[str, ...]:
    """Names of degrees of freedom, which must differ; one dot may part the node from the direction (``nose.x``)."""
    names = tuple(dofs)
    if not names:
        raise InputError(f"{where}: dofs is empty, expected at least one name")
    for name in names:
        if not isinstance(name, str) or not all(name.split(".")) or name.count(".") > 1:
            raise InputError(f"{where}: dof {name!r}, expected a name like 'x' or, at a node, 'nose.x'")
        if names.count(name) > 1:
            raise InputError(f"{where}: dof {name!r} is named twice, expected different names")
    return names


def checked_square(where: str, key: str, value: ArrayLike, size: int) -> Array:
    """A finite symmetric matrix of ``size`` rows that stores or dissipates energy, never yields it."""
    matrix = np.array(value, dtype=float)
    if matrix.shape != (size, size):
        raise InputError(f"{where}: {key} has shape {matrix.shape}, expected {(size, size)} for {size} dofs")
    if not np.all(np.isfinite(matrix)):
        raise InputError(f"{where}: {key} holds values that are not finite")
    largest = np.max(np.abs(matrix), initial=0.0)
    i, j = np.unravel_index(np.argmax(np.abs(matrix - matrix.T)), matrix.shape)
    if abs(matrix[i, j] - matrix[j, i]) > 1e-9 * largest:
        raise InputError(
            f"{where}: {key}[{i}][{j}] is {matrix[i, j]:g} and {key}[{j}][{i}] is {matrix[j, i]:g}, "
            "expected a symmetric matrix"
        )
    matrix = (matrix + matrix.T) / 2
    if np.linalg.eigvalsh(matrix)[0] < -1e-9 * largest:
        raise InputError(f"{where}: {key} has a negative eigenvalue, expected one that yields no energy")
    return np.asarray(matrix, dtype=float)


def is_positive(mass: Array) -> bool:
    """Whether a mass matrix can be divided by: positive definite beyond rounding, whatever the units of its rows."""
    own = np.sqrt(np.maximum(np.diag(mass), 1e-300))
    return bool(np.linalg.eigvalsh(mass / own / own[:, None])[0] > _ROUNDING * len(mass)) if len(mass) else True
