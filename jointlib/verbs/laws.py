"""The joint laws that are installed, with their fields and units."""

from __future__ import annotations

from typing import Any

import click

from jointlib.cli.arguments import Verb, json_option
from jointlib.cli.output import emit


@click.command("laws", cls=Verb)
@json_option
def command(as_json: bool) -> None:
    """Every installed law: its word in files, its fields with their units, what it is; then effects and readers.

    \b
    Example:
      jointlib laws
    """
    import inspect

    from jointlib.parameter import parameters_of
    from jointlib.registry import GROUPS, installed, laws

    table: list[dict[str, Any]] = []
    for kind, law in sorted(laws().items()):
        summary = (inspect.getdoc(law) or "").split("\n")[0]
        fields = {p.name: p.unit for p in parameters_of(law)}
        table.append({"kind": kind, "fields": fields, "states": law.states, "in_time": law.in_time, "force": summary})
    lines = []
    for row in table:
        listed = ", ".join(f"{name} [{unit}]" for name, unit in row["fields"].items())
        lines += [f"{row['kind']}", f"    {row['force']}", f"    {listed}"]
    failed = {}
    others = {}
    for group in GROUPS:
        have = installed(group)
        failed.update({f"{group}: {name}": why for name, why in have.failed.items()})
        if group != "jointlib.laws":
            others[group.removeprefix("jointlib.")] = sorted(have.found)
    lines += [f"{what}: {', '.join(names)}" for what, names in others.items() if names]
    lines += [f"failed to load: {name} ({why})" for name, why in failed.items()]
    emit(as_json, {"laws": table, **others, "failed": failed}, lines)
