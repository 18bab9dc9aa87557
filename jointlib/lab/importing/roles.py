"""What the channels are to their kind of measurement: accelerations of a rig on bodies, inputs of a path, places of an
impact test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointlib.lab.importing.draft import Draft, Noted, Table
from jointlib.modulation import INPUTS

_RIG = ("a1", "a2", "a3")


def rig_roles(draft: Draft, said: Mapping[str, Any]) -> None:
    """Accelerations are a1, a2 and a3 in their order, the force is P, and each acceleration has a body."""
    accelerations = [t for t in draft.channels if t["quantity"].value == "acceleration"]
    forces = [t for t in draft.channels if t["quantity"].value == "force"]
    for tables, roles in ((accelerations, _RIG), (forces, ("P",))):
        taken = {_role(t) for t in tables}
        free = [role for role in roles if role not in taken]
        for table, role in zip([t for t in tables if _role(t) not in roles], free, strict=False):
            name = str(table["name"].value)
            if "role" not in table:
                draft.guess(
                    table,
                    "role",
                    role,
                    "the order of the channels",
                    f"channel.{name}.role={'a2' if role == 'a1' else 'a1' if role != 'P' else 'P'}",
                )
    bodies = list(draft.bodies)
    for number, table in enumerate(sorted((t for t in accelerations if _role(t) in _RIG), key=_role)):
        name = str(table["name"].value)
        if "body" in table:
            draft.bodies.setdefault(str(table["body"].value), Noted("unknown", "guess: weigh it, in kg"))
            continue
        body = bodies[number] if number < len(bodies) else f"body_{number + 1}"
        draft.guess(table, "body", body, f"it is {_role(table)}", f"channel.{name}.body=NAME")
        if body not in draft.bodies:
            draft.guess(draft.bodies, body, "unknown", "no file says a mass", f"bodies.{body}=1.1")
    first = next((t for t in accelerations if _role(t) == "a1"), None)
    if "driven" not in said and first is not None and "body" in first:
        draft.guess(draft.top, "driven", first["body"].value, "body 1 is that of a1", "driven=NAME")


def followed_inputs(draft: Draft) -> None:
    """A voltage, current or temperature beside the force and the motion of a path is one that parameters may follow."""
    quantities = [str(t["quantity"].value) for t in draft.channels]
    if "force" not in quantities or not {"displacement", "position"} & set(quantities):
        return
    for table, quantity in zip(draft.channels, quantities, strict=True):
        if quantity in INPUTS and "input" not in table:
            why = f"parameters may follow a {quantity} beside force and motion"
            draft.guess(table, "input", True, why, f"channel.{table['name'].value}.input=false")


def _role(table: Table) -> str:
    return str(table["role"].value if "role" in table else table["name"].value)


def struck_places(draft: Draft, records: Sequence[Table]) -> None:
    """Where each channel of an impact or shaker test acts: as a place of the machine, which the files do not know."""
    forces = [t for t in draft.channels if t["quantity"].value == "force"]
    for table in draft.channels:
        name = str(table["name"].value)
        if "dof" not in table and table in forces[1:]:  # several at once stand at different places
            place = f"place_{forces.index(table) + 1}.x"
            draft.guess(table, "dof", place, "no file says the place", f"channel.{name}.dof=table.x")
        elif "dof" not in table and (table["quantity"].value == "force" or _moves(table)):
            if table["quantity"].value == "force" and all("drive" in r for r in records):
                continue
            axis = str(table["direction"].value).lstrip("+-") if "direction" in table else _axis(name)
            draft.guess(table, "dof", f"tool.{axis}", "no file says the place", f"channel.{name}.dof=tool.x")


def _moves(table: Table) -> bool:
    return table["quantity"].value in ("acceleration", "velocity", "displacement")


def _axis(name: str) -> str:
    return name[-1] if len(name) > 1 and name[-1] in "xyz" and not name[-2].isalpha() else "x"
