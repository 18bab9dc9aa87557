"""A tool that is told against the ground although the workpiece moves too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ..components.connection import GROUND
from ..model.machine import Machine
from .tool_point import along, place_of

_NEAR = 0.3
"""m within which a point of the part that is left out is where the tool cuts."""


def without_workpiece(machine: Machine) -> Iterator[str]:
    """A part at another end of the machine that seems to carry the workpiece and that no direction of the tool names.

    It travels on an axis that does not move the tool, and one other part holds it; in turning it is a shaft in rolling
    bearings as well. A machine whose workpiece stands still has no such part, and one without a cut needs none: a
    tap test at the tool is against the ground.
    """
    dofs = tuple(machine.tool.values())
    if machine.cutting is None or not dofs or any(" - " in dof for dof in dofs):
        return
    carries = _other_ends(machine, {dof.partition(".")[0] for dof in dofs})
    if not carries:
        return
    here = place_of(machine, dofs[0])
    alike = [dof for dof in machine.dofs if dof.partition(".")[0] in carries and dof == along(dof, dofs[0])]
    places = [(dof, place_of(machine, dof)) for dof in alike]
    near = [(float(np.linalg.norm(at - here)), dof) for dof, at in places if at is not None and here is not None]
    far, beside = min(near, default=(np.inf, ""))
    part = beside.partition(".")[0] if far < _NEAR else [*carries][-1]
    yield (
        f"{machine.tool_table}: {' and '.join(dofs)} {'is' if len(dofs) == 1 else 'are'} taken against the ground, as "
        f"if the workpiece stood still, and {part}, which {carries[part]}, is left out: does it carry the workpiece? "
        f"Then write {dofs[0]} - {beside if far < _NEAR else f'the same of a point on {part}'}"
    )


def _other_ends(machine: Machine, own: set[str]) -> dict[str, str]:
    """Parts that may carry the workpiece, and how they move."""
    beside = _neighbours(machine)
    found = {
        part: f"axis {axis.name} moves"
        for axis in machine.axes
        if own.isdisjoint(axis.moves)
        for part in axis.moves
        if len(beside.get(part, ())) == 1
    }
    if machine.cutting is not None and machine.cutting["process"] == "turning":
        pairs = [bundle.between for bundle in machine.bundles if type(bundle.bundle).kind == "bearing-pair"]
        sides = [[side.partition(".")[0] for side in pair] for pair in pairs]
        for part, by in [*sides, *(side[::-1] for side in sides)]:
            if part not in found and part != GROUND and _ends_there(part, by, beside, own):
                found[part] = "turns in its bearings"
    return found


def _neighbours(machine: Machine) -> dict[str, set[str]]:
    beside: dict[str, set[str]] = {}
    for connection in machine.connections:
        sides = {side.partition(".")[0] for side in connection.between}
        for side in sides:
            beside[side] = beside.get(side, set()) | (sides - {side})
    return beside


def _ends_there(part: str, by: str, beside: Mapping[str, set[str]], own: set[str]) -> bool:
    """Whether the tool is held without this part, and ``by`` alone holds it and what hangs on it."""
    held, todo = {part}, [GROUND]
    while todo:
        one = todo.pop()
        if one not in held:
            held.add(one)
            todo += beside.get(one, set())
    return own <= held - {part} and beside[part] & held == {by}
