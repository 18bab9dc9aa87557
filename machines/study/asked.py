"""Whether a machine can be asked what a study asks: said before anything is computed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jointlib.errors import InputError, nearest

from ..files import cutting_table, read_cutting, read_machine
from ..machine import Machine
from .study import BASE, Study

DEPTHS = frozenset({"minimum-depth", "pocket-depth", "pocket-speed", "removal-rate"})
"""Quantities of a cut."""


def check_asked(study: Study) -> None:
    """Refuse, in a sentence, a quantity whose conditions neither the machine nor the study gives."""
    chosen = [str(value) for f in study.factors if f.path == BASE for value in f.choices]
    for file in [study.source.parent / name for name in chosen] or [study.base]:
        machine = read_machine(file)
        _check_axes(study, machine)
        wanted = [q for q in study.quantities if q != "pocket-speed" or len(study.quantities) == 1]
        for quantity in wanted:
            _check(study, machine, file, quantity)
        for case in study.cases:
            cut = {path: value for path, value in case.changes.items() if path.startswith("cutting.")}
            if cut and case.material:
                _check_material(study, file, case.material, cut)


def _check(study: Study, machine: Machine, file: Path, quantity: str) -> None:
    needs = f"{study.source}: {quantity!r}"
    if quantity == "weight":
        return
    if not machine.tool:
        raise InputError(f"{needs} is that of the tool point, but {file} has no [tool]")
    if machine.frequency is None:
        raise InputError(f"{needs} needs the band of the machine, but {file} has no frequency in [response]")
    if quantity not in DEPTHS:
        return
    if machine.cutting is None:
        raise InputError(f"{needs} needs a cut, but {file} has no [cutting]")
    by_factor = {f.path.removeprefix("cutting.") for f in study.factors}
    for case in study.cases:
        given = {*machine.cutting, *by_factor, *(path.removeprefix("cutting.") for path in case.changes)}
        whom = f"{file} has none" + (f" and material {case.material!r} gives none" if case.material else "")
        if "speed" not in given and not len(study.speeds):
            raise InputError(f"{needs} needs speed = [low, high] in [conditions] or [cutting], but {whom}")
        for key in ("feed", "diameter") if quantity == "removal-rate" else ():
            if key not in given:
                raise InputError(f"{needs} needs {key!r} in [cutting], but {whom}")


def _check_axes(study: Study, machine: Machine) -> None:
    axes = {axis.name: axis for axis in machine.axes}
    for case in study.cases:
        for name, at in case.position.items():
            said = f"{study.source}: [conditions]: position"
            if name not in axes:
                known = nearest(name, axes) if axes else "it has none"
                raise InputError(f"{said} of axis {name!r}, which {machine.where} does not have, {known}")
            travel = axes[name].travel
            if travel is not None and not travel[0] <= at <= travel[1]:
                ends = f"{travel[0] * 1e3:g} to {travel[1] * 1e3:g} mm, its travel"
                raise InputError(f"{said} {name} is {at * 1e3:g} mm, expected {ends}")


def _check_material(study: Study, file: Path, material: str, cut: dict[str, Any]) -> None:
    try:
        read_cutting(file, cutting_table(file), cut)
    except InputError as error:
        raise InputError(f"{study.source}: material {material!r}: {error}") from None
