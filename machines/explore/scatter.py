"""The designs of a finished study beside the controls: where each lies, what it is worth, how it is set."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.units import number_and_unit

from ..files.machine_file import read_machine
from ..files.named_tools import USE
from ..indices import Mask
from ..study.factors import Factor
from ..study.findings.verdict import judge, over_samples
from ..study.run import begin, planned, tools_asked
from ..study.study import QUANTITIES, Study
from ..study.study_file import read_study
from ..study.words import named
from .controls import Control
from .knobs import pretty

_SHOWN: Mapping[str, tuple[float, str]] = {"m": (1e3, "mm"), "m^3/s": (6e7, "cm³/min"), "m/N": (1e6, "µm/N")}
"""Size and name of the units in which quantities are read."""


@dataclass(frozen=True, eq=False)
class Scatter:
    """Designs of a study, a row each: the factors that were chosen, then the quantities.

    A quantity is that of the worst case, averaged over what is uncertain.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Array
    """(designs, names); of a factor without numbers the place in its list."""
    words: tuple[Mapping[str, str], ...]
    """Factors of every design as people read them."""
    feasible: Mask
    """Whether a design meets the constraints, (designs,)."""
    front: Mask
    """Whether no other design beats it in every objective, (designs,); all False with a single objective."""
    values: tuple[Mapping[str, float], ...]
    """Values of the controls that a design sets, by key."""
    unset: tuple[str, ...]
    """Factors that the controls do not move, or not wholly."""


def study_of(path: Path, results: Path, machine: Path, tool: str | None = None) -> Study:
    """A study that starts from this machine file, with the designs that a search has proposed so far.

    ``tool`` is the one that is in the machine, of several with names; the study has to be of it.
    """
    study = read_study(path, tools_asked(results))
    if study.base.resolve() != machine.resolve():
        raise InputError(f"{path}: its base is {study.base}, expected {machine}, the machine that is explored")
    if not (results / "study.json").is_file():
        raise InputError(f"{results}: holds no study, expected the folder of 'jointlib study run'")
    named = {case.tool for case in study.cases} | {str(v) for f in study.factors if f.path == USE for v in f.choices}
    own = read_machine(machine).tool_name if tool is not None else None
    known = sorted(named - {""}) or [str(own)]
    if tool is not None and tool not in known:
        raise InputError(f"{results}: is a study of the tool {', '.join(known)}, expected one of {tool!r}, or --tool")
    return planned(study, results)


def widened(controls: Sequence[Control], study: Study) -> Iterator[Control]:
    """The controls, reaching to all that the designs of a study may set."""
    by_key = {control.key: control for control in controls}
    reach: dict[str, list[float]] = {}
    for row in np.unique(study.numbers(), axis=0):
        for key, value in _settings(study, by_key, row):
            reach.setdefault(key, []).append(value)
    for c in controls:
        found = reach.get(c.key, ())
        yield replace(c, low=min(c.low, *found), high=max(c.high, *found)) if found else c


def designs(study: Study, results: Path, controls: Mapping[str, Control]) -> Scatter:
    """The designs of a study, all computed, with the values of the controls that each sets."""
    found = begin(study, results).results()
    verdict = judge(study, found)
    ranking = verdict.ranking
    chosen = [(i, f) for i, f in enumerate(study.factors) if not f.uncertain]
    quantities = list(ranking.worst)
    units = [_SHOWN.get(QUANTITIES[name][0], (1.0, QUANTITIES[name][0])) for name in quantities]
    drawn = [_drawn(f) for _, f in chosen]
    columns = [
        np.asarray(taken, dtype=float)[ranking.numbers[:, i].astype(int)] if taken else ranking.numbers[:, i]
        for (i, _), (taken, _) in zip(chosen, drawn, strict=True)
    ]
    told = [over_samples(study, name, ranking.worst[name]) for name in quantities]
    columns += [size * values for values, (size, _) in zip(told, units, strict=True)]
    front = np.zeros(len(ranking.allowed), dtype=bool)
    front[[design.number for design in verdict.front]] = True
    return Scatter(
        names=(*(f.name for _, f in chosen), *map(named, quantities)),
        units=(*(pretty(unit) for _, unit in drawn), *(unit for _, unit in units)),
        rows=np.stack(columns, axis=1),
        words=tuple({f.name: f.words(float(row[i])) for i, f in chosen} for row in ranking.numbers),
        feasible=np.asarray(ranking.allowed, dtype=bool),
        front=front,
        values=tuple(dict(_settings(study, controls, row)) for row in ranking.numbers),
        unset=tuple(f.name for i, f in chosen if not _moved(f, ranking.numbers[:, i]) <= controls.keys()),
    )


def _settings(study: Study, controls: Mapping[str, Control], row: Array) -> Iterator[tuple[str, float]]:
    """What the design factors of a row set, by control."""
    for factor, number in zip(study.factors, row, strict=True):
        for path, entry in () if factor.uncertain else _entries(factor, float(number)):
            value = _set(controls[path], entry) if path in controls else None
            if value is not None:
                yield path, value


def _entries(factor: Factor, number: float) -> Iterator[tuple[str, Any]]:
    """Paths and values that a number of a factor stands for; a table changes what belongs together."""
    value = factor.value(number)
    if isinstance(value, Mapping):
        yield from ((f"{factor.path}.{key}", entry) for key, entry in value.items())
    else:
        yield factor.path, value


def _moved(factor: Factor, numbers: Array) -> set[str]:
    return {path for number in np.unique(numbers) for path, _ in _entries(factor, float(number))}


def _set(control: Control, value: Any) -> float | None:
    """Where a control stands for a value of a machine file: a number in SI, or one with its unit."""
    anywhere = replace(control, low=-np.inf, high=np.inf)
    with contextlib.suppress(InputError):
        if control.choices:
            return control.checked(value)
        if isinstance(value, str):
            parts = number_and_unit(value)
            if parts is not None and parts[1]:
                return anywhere.checked(value)
            value = None if parts is None else parts[0]
        if isinstance(value, int | float) and not isinstance(value, bool):
            return anywhere.checked(value / control.scale)
    return None


def _drawn(factor: Factor) -> tuple[Sequence[float], str]:
    """What a factor's numbers of the plan are drawn as, and its unit: a list of one unit by value, others by place."""
    if not factor.choices:
        return (), factor.unit
    pairs = [_number(value) for value in factor.choices]
    units = {unit for _, unit in pairs}
    if len(units) > 1 or any(number is None for number, _ in pairs):
        return range(len(pairs)), ""
    return [number for number, _ in pairs if number is not None], units.pop()


def _number(value: Any) -> tuple[float | None, str]:
    if isinstance(value, str):
        return number_and_unit(value) or (None, "")
    return (float(value), "") if isinstance(value, int | float) and not isinstance(value, bool) else (None, "")
