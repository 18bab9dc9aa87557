"""Whether a machine can be asked what a study asks: said before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError, nearest

from ..cutting.amplitude.pocket import best_pocket
from ..cutting.process.cutting import Cutting
from ..files.machine_file import cutting_table, read_cutting, read_machine
from ..files.named_tools import USE
from ..model.machine import Machine
from .conditions import Case
from .study import BASE, Study
from .variants import Variant

DEPTHS = frozenset({"minimum-depth", "pocket-depth", "pocket-speed", "removal-rate"})
"""Quantities of a cut."""
_ENOUGH = 5000
"""Speeds beyond which more do not help."""


def check_asked(study: Study) -> None:
    """Refuse, in a sentence, a quantity whose conditions neither the machine nor the study gives."""
    chosen = [str(value) for f in study.factors if f.path == BASE for value in f.choices]
    for file in [study.source.parent / name for name in chosen] or [study.base]:
        for tool in study.with_tools:
            machine = read_machine(file, dict(tool))
            _check_axes(study, machine)
            wanted = [q for q in study.quantities if q != "pocket-speed" or len(study.quantities) == 1]
            for quantity in wanted:
                _check(study, machine, file, quantity)
        for case in study.cases:
            cut = {path: value for path, value in case.changes.items() if path.startswith("cutting.")}
            if cut and case.material:
                _check_material(study, file, case, cut)


def _check(study: Study, machine: Machine, file: Path, quantity: str) -> None:
    needs = f"{study.source}: {quantity!r}"
    if quantity == "weight":
        if not Variant(machine).weight:
            raise InputError(f"{needs} is that of the components, but none of {file} tells its mass")
        return
    if not machine.tool:
        raise InputError(f"{needs} is that of the tool point, but {file} has no [tool]")
    if quantity not in DEPTHS:
        return
    if machine.cutting is None:
        raise InputError(f"{needs} needs a cut, but {file} has no [cutting]")
    by_factor = {path.removeprefix("cutting.") for f in study.factors for path in f.paths}
    process = machine.cutting["process"]
    if study.lobes is not None and "process" not in by_factor and (study.lobes == "turning") == (process == "milling"):
        raise InputError(f"{study.source}: [conditions]: lobes is {study.lobes!r}, but {file} is about {process}")
    for case in study.cases:
        given = {*machine.cutting, *by_factor, *(path.removeprefix("cutting.") for path in case.changes)}
        whom = f"{file} has none" + (f" and material {case.material!r} gives none" if case.material else "")
        if "speed" not in given and not len(study.speeds):
            raise InputError(f"{needs} needs speed = [low, high] in [conditions] or [cutting], but {whom}")
        for key in ("feed", "diameter") if quantity == "removal-rate" else ():
            if key not in given:
                raise InputError(f"{needs} needs {key!r} in [cutting], but {whom}")
        if quantity != "minimum-depth" and "speed" not in by_factor:
            _check_speeds(study, needs, case.changes.get("cutting.speed"), machine.cutting)


def _check_speeds(study: Study, needs: str, of_case: list[float] | None, cutting: Mapping[str, Any]) -> None:
    """Refuse speeds among which no pocket can be seen."""
    of_study = (float(study.speeds[0]), float(study.speeds[-1])) if len(study.speeds) else None
    low, high = of_case or of_study or cutting["speed"]

    def seen(count: int) -> bool:
        speeds = np.linspace(low, high, count)
        return best_pocket(speeds, np.ones(count), Cutting(**cutting)) is not None

    if not seen(study.speed_count):
        enough = next((n for n in range(study.speed_count, _ENOUGH) if seen(n)), None)
        raise InputError(
            f"{needs} needs speeds at most 2 % apart to see a pocket, but there are {study.speed_count} "
            f"from {low:g} to {high:g} rpm, expected "
            + (f"speeds = {enough} or more in [conditions]" if enough else "a wider range of speeds")
        )


def _check_axes(study: Study, machine: Machine) -> None:
    axes = {axis.name: axis for axis in machine.axes}
    for case in study.cases:
        for name, at in case.position.items():
            said = f"{study.source}: [conditions]: position"
            if name not in axes:
                raise InputError(f"{said} of axis {name!r}, which {machine.where} does not have, {nearest(name, axes)}")
            travel = axes[name].travel
            if travel is not None and not travel[0] <= at <= travel[1]:
                ends = f"{travel[0] * 1e3:g} to {travel[1] * 1e3:g} mm, its travel"
                raise InputError(f"{said} {name} is {at * 1e3:g} mm, expected {ends}")


def _check_material(study: Study, file: Path, case: Case, cut: dict[str, Any]) -> None:
    try:
        read_cutting(file, cutting_table(file, {USE: case.tool} if case.tool else None), cut)
    except InputError as error:
        raise InputError(f"{study.source}: material {case.material!r}: {error}") from None
