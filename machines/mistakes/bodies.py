"""Rigid bodies and lumped masses that no body can be: too heavy for their size, inertia of nothing, far from all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from jointlib.arrays import Array

from ..components.lumped import Lumped
from ..components.rigid import Rigid
from ..model.machine import Machine
from .elements import Element
from .scale import outside

_DENSITY = (15.0, 25e3)
"""kg/m³ of the block that has a body's mass and inertia: hollow sheet metal has 100, cast parts 1000 to 4000, tungsten
19 300."""
_THIN = 0.05
"""Least thickness of that block as a share of its length: plates and rods are taken as so thick."""
_TRIANGLE = 1e-3
_FAR = 8.0
_NEAR = 1.5
"""A contact further from the centre than so many lengths of the block, and so many m, belongs to another body."""
_MASS = (1e-6, 3e5)
"""kg of a lumped mass."""


def wrong_bodies(machine: Machine) -> Iterator[str]:
    """Rigid bodies and lumped masses out of scale."""
    for body in machine.components:
        if isinstance(body, Lumped):
            for dof, mass in zip(body.dofs, np.diag(body.mass), strict=True):
                if not dof.rpartition(".")[2].startswith("r"):
                    said = outside(float(mass), *_MASS, f"{body.name}: the mass of {dof}", "kg")
                    yield from filter(None, [said])
        if isinstance(body, Rigid):
            yield from filter(None, [_unlike(body)])


def _unlike(body: Rigid) -> str:
    """What no body has of its mass and inertia."""
    J = np.linalg.eigvalsh(body.inertia)
    if J[2] > (1 + _TRIANGLE) * (J[0] + J[1]):
        return (
            f"{body.name}: no body has the inertia {', '.join(f'{value:.4g}' for value in J)} kg m^2: the largest "
            "exceeds the sum of the two others; is a value off, or its unit?"
        )
    size = block(body)
    said = outside(
        float(body.mass / np.prod(size)),
        *_DENSITY,
        f"{body.name}: the density of the block of {' x '.join(f'{1e3 * a:.3g}' for a in size)} mm that has its mass "
        f"of {body.mass:g} kg and its inertia",
        "kg/m^3",
    )
    said = said.partition(";")[0].removesuffix(", is its unit right?")
    return f"{said}; is its mass or its inertia off?" if said else ""


def far_centres(machine: Machine, found: Sequence[Element]) -> Iterator[str]:
    """Rigid bodies, of a size that bodies have, whose centre lies far from all that holds them."""
    for body in machine.components:
        if not isinstance(body, Rigid) or _unlike(body):
            continue
        assert body.centre is not None
        size = block(body)
        at = [e.at for e in found if e.at is not None and body.name in e.words]
        if at:
            nearest = float(np.min(np.linalg.norm(np.concatenate(at) - body.centre, axis=1)))
            if nearest > max(_FAR * size[2], _NEAR):
                yield (
                    f"{body.name}: its centre lies {nearest:.4g} m from the nearest of its contacts, a body of about "
                    f"{size[2]:.3g} m; were mm read as m, or is a point off?"
                )


def block(body: Rigid) -> Array:
    """Sides in m, ascending, of the even block with a body's mass and inertia: a² = 6 (J_b + J_c − J_a)/m."""
    J = np.linalg.eigvalsh(body.inertia)
    squared = 6 * (np.sum(J) - 2 * J) / body.mass
    sides = np.sqrt(np.maximum(squared, 0.0))
    return np.sort(np.maximum(sides, _THIN * np.max(sides)))
