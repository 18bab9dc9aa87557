"""Nodes of free finite-element parts that do not move as their matrices do: rows, places or units that are off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..components.matrices import Matrices
from ..model.machine import Machine
from ..model.unstrained import Unstrained, rigid

_OFF = 0.02
"""Share of a rigid motion that the motions without strain may miss: of nodes 300 mm apart some 5 mm."""
_RIGID = 6
_RANK = 1e-6


def strained_nodes(machine: Machine) -> Iterator[str]:
    """A sentence for every part that would be strained if its nodes moved as one rigid body.

    A part with six motions without strain is free in space, and these six are translations and rotations.
    """
    for part in machine.components:
        if isinstance(part, Matrices):
            yield from _strained(part)


def _strained(part: Matrices) -> Iterator[str]:
    moved, free = rigid(part), Unstrained.of(part)
    if moved is None or free is None or free.shapes.shape[1] != _RIGID or part.nodes is None:
        return
    known = ~np.isnan(moved[:, 0])
    moved, shapes = moved[known], free.shapes[known]
    names = [dof.rpartition(".")[0] for dof, placed in zip(part.dofs, known, strict=True) if placed]
    middle = np.mean(part.nodes.positions, axis=0)
    size = float(np.max(np.linalg.norm(part.nodes.positions - middle, axis=1)))
    if size == 0:
        return
    # About the middle of the nodes, and angles as what they move in that distance.
    moved[:, 3:] -= moved[:, :3] @ np.cross(np.eye(3), middle).T
    turns = np.array([dof.rpartition(".")[2].startswith("r") for dof in np.array(part.dofs)[known]])
    weight = np.where(turns, size, 1.0)[:, None]
    U, singular, _ = np.linalg.svd(weight * shapes, full_matrices=False)
    span = U[:, singular > _RANK * singular[0]]
    wanted = weight * moved
    missed = wanted - span @ (span.T @ wanted)
    share = np.linalg.norm(missed, axis=0) / np.maximum(np.linalg.norm(wanted, axis=0), 1e-300)
    worst = int(np.argmax(share))
    if share[worst] > _OFF:
        how = f"shifts along {'xyz'[worst]}" if worst < 3 else f"turns about {'xyz'[worst - 3]}"
        node = names[int(np.argmax(np.abs(missed[:, worst])))]
        yield (
            f"{part.name}: nothing holds it, but its matrices are strained where it {how} as one body by the places of "
            f"its nodes, which miss {100 * share[worst]:.2g} % of that, most at {node}: are rows and at of its nodes "
            "right, and the units of its matrices?"
        )
