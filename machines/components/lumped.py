"""Lumped component: mass, damping and stiffness matrices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.toml import Section

from .component import Component, SecondOrder, checked_dofs, checked_square
from .static_load import axis_of

_BLOCK = 2**22
"""Matrix entries that are solved at a time; bounds the memory to about 64 MB."""


@dataclass(frozen=True, eq=False)
class Lumped(Component):
    """H = (K − ω²M + jωC)⁻¹; without stiffness a free body, H = −M⁻¹/ω².

    Mass in kg, damping in N s/m, stiffness in N/m, each symmetric with one row per degree of freedom; damping and
    stiffness left out are zero. What they tie to the ground is grounded.
    """

    name: str
    dofs: tuple[str, ...]
    mass: Array
    damping: Array | None = None
    stiffness: Array | None = None

    kind: ClassVar[str] = "lumped"

    def __post_init__(self) -> None:
        where = f"component {self.name!r}"
        dofs = checked_dofs(where, self.dofs)
        object.__setattr__(self, "dofs", dofs)
        for key in ("mass", "damping", "stiffness"):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, checked_square(where, key, value, len(dofs)))
        values = np.linalg.eigvalsh(self.mass)
        if not values[0] > 1e-14 * values[-1]:
            raise InputError(f"{where}: mass is singular, expected every dof to carry a mass")

    @classmethod
    def from_section(cls, section: Section) -> Lumped:
        name, dofs = section.text("name"), section.words("dofs")
        mass = np.array(section.matrix("mass", "kg"))
        damping, stiffness = (
            None if rows is None else np.array(rows)
            for rows in (section.matrix("damping", "N s/m", None), section.matrix("stiffness", "N/m", None))
        )
        return cls(name, dofs, mass, damping, stiffness)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        return receptance_of(self._equations, omega, rows, columns)

    def second_order(self) -> SecondOrder:
        return self._equations

    @cached_property
    def _equations(self) -> SecondOrder:
        n = len(self.dofs)
        zero = np.zeros((n, n))
        damping = zero if self.damping is None else self.damping
        stiffness = zero if self.stiffness is None else self.stiffness
        return SecondOrder(self.mass, damping, stiffness, np.eye(n))

    def weight(self, gravity: Array) -> Array:
        """M a, a the acceleration along each dof, whose axis its name tells (x, uy, z_2); others carry none."""
        axes = [axis_of(dof) for dof in self.dofs]
        return np.asarray(self.mass @ [0.0 if axis is None else gravity[axis] for axis in axes])


def receptance_of(model: SecondOrder, omega: Array, rows: Array, columns: Array) -> ComplexArray:
    """R Φ (K − ω²M + jωC)⁻¹ Φᵀ Cᵀ in m/N, R and C over the dofs.

    A sum over the poles; where that would lose accuracy, a solve per line.
    """
    left, right = rows @ model.shapes, columns @ model.shapes
    if model.poles is not None:
        return model.poles.receptance(omega, left, right)
    out = np.empty((len(omega), len(left), len(right)), dtype=complex)
    step = max(1, _BLOCK // len(model.mass) ** 2)
    for start in range(0, len(omega), step):
        w = omega[start : start + step, None, None]
        dynamic = model.stiffness - w**2 * model.mass + 1j * w * model.damping
        out[start : start + step] = left @ np.linalg.solve(dynamic, right.T.astype(complex))
    return out
