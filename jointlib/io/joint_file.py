"""Joint files: ``schema = "jointlib/joint/1"``."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from jointlib.errors import InputError, nearest
from jointlib.io.mistakes import Lost, Mistakes, all_at_once
from jointlib.io.toml import Section
from jointlib.io.toml_file import read_toml, write_toml
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw
from jointlib.modulation import CONDITIONS, Modulation
from jointlib.parameter import Role, parameters_of
from jointlib.registry import law
from jointlib.registry import names as installed_names
from jointlib.units import number_and_unit, quantity, scale

_VALIDITY = {"amplitude": "m", "velocity": "m/s", "frequency": "Hz", "preload": "N"}


def read_joint(path: Path) -> Joint:
    """The joint in a file."""

    def read(mistakes: Mistakes) -> Joint:
        section = read_toml(path, "joint", mistakes)
        name = Path(path).name.removesuffix(".toml").removesuffix(".joint")
        found = section.read(lambda table: joint_from(table, table.text("name", name)))
        if found is None:
            raise Lost
        return found

    return all_at_once(read)


def joint_from(section: Section, name: str, turned: Mapping[str, str] = MappingProxyType({})) -> Joint:
    """The joint in a table with ``[[law]]``, and optionally validity, covariance and provenance.

    ``turned`` has the units that are taken as well, for one between rotations: N m/rad for N/m.
    """
    laws, lost = section.each("law", lambda table: _law(table, turned), needed=True)
    validity = section.section("validity").read(_validity)
    modulations, _ = section.each("modulation", _modulation)
    provenance = section.section("provenance").raw()
    matrix = section.section("covariance")
    section.done()
    if lost:
        raise Lost
    joint = Joint(tuple(built for built, _ in laws), name)
    covariance = matrix.read(lambda table: _covariance(table, joint))
    if validity is None:
        raise Lost
    fixed = [(number, key) for number, (_, held) in enumerate(laws) for key in held]
    names = joint.part_names
    return dataclasses.replace(
        joint,
        fixed=frozenset(f"{names[i]}.{key}" for i, key in fixed),
        validity=validity,
        covariance=covariance,
        provenance=provenance,
        modulations=tuple(modulations),
    )


def _validity(ranges: Section) -> dict[str, tuple[float, float]]:
    found = {}
    for key, unit in _VALIDITY.items():
        if ranges.has(key):
            low, high = ranges.numbers(key, unit, length=2)
            if low > high:
                ranges.fault(f"{key} runs from {low:g} to {high:g}, expected low before high")
            found[key] = low, high
    ranges.done()
    return found


def _law(part: Section, turned: Mapping[str, str]) -> tuple[JointLaw, tuple[str, ...]]:
    cls = part.kind(law, installed_names("jointlib.laws"))
    values: dict[str, Any] = {}
    required = {f.name for f in dataclasses.fields(cls) if f.default is dataclasses.MISSING}  # type: ignore[arg-type]
    for p in parameters_of(cls):
        if p.name not in required and not part.has(p.name):
            continue
        read = part.matrix if p.table else part.numbers if p.listed else part.number
        values[p.name] = read(p.name, _unit_of(part.table.get(p.name), p.unit, turned))
    held = part.words("fixed", ())
    known = [p.name for p in parameters_of(cls)]
    for key in held:
        if key not in known:
            part.fault(f"fixed names {key!r}, {nearest(key, known)}")
    part.done()
    try:
        return cls(**values), held
    except InputError as error:
        raise InputError(f"{part.where}: {error}") from None


def _unit_of(value: Any, unit: str, turned: Mapping[str, str]) -> str:
    """The unit that a value is read in; of a joint between rotations that of a moment, unless it is given in another.

    A number is the same in both.
    """
    angular = turned.get(unit)
    parts = number_and_unit(value) if isinstance(value, str) else None
    if angular is None or parts is None or not parts[1]:
        return unit
    try:
        scale(parts[1], unit, "")
    except InputError:
        return angular
    return unit


def _modulation(section: Section) -> Modulation:
    roles = {_word(role): role for role in Role}
    role = roles[section.text("role", choices=tuple(roles))]
    condition = section.text("condition", choices=tuple(CONDITIONS))
    unit = CONDITIONS[condition]
    reference, period = section.number("reference", unit), section.number("period", unit, None)
    lag = section.number("lag", "s", 0.0)
    rows = section.take("table")
    section.done()
    if not isinstance(rows, list) or not all(isinstance(row, list) and len(row) == 2 for row in rows):
        raise InputError(f"{section.where}: table is {rows!r}, expected rows [{condition}, factor]")
    spot = f"{section.where}: table"
    table = tuple(
        (quantity(value, unit, f"{spot}[{i}][0]"), quantity(factor, "1", f"{spot}[{i}][1]"))
        for i, (value, factor) in enumerate(rows)
    )
    try:
        return Modulation(role, condition, reference, table, period, lag)
    except InputError as error:
        raise InputError(f"{section.where}: {error}") from None


def _word(role: Role) -> str:
    return role.value.replace(" ", "-")


def _covariance(section: Section, joint: Joint) -> Covariance | None:
    if not section.keys():
        return None
    names = section.words("names")
    matrix = np.array(section.matrix("matrix", "1"))
    section.done()
    for name in names:
        if name not in joint.parameters:
            section.fault(f"names has {name!r}, {nearest(name, joint.parameters)}")
    if matrix.shape != (len(names), len(names)):
        raise InputError(f"{section.where}: matrix has shape {matrix.shape}, expected {len(names)} rows and columns")
    if np.any(np.diag(matrix) < 0):
        name = names[int(np.argmin(np.diag(matrix)))]
        raise InputError(f"{section.where}: the variance of {name} is negative, expected at least 0")
    return Covariance(names, matrix)


def joint_table(joint: Joint) -> dict[str, Any]:
    """The joint as the tables of a joint file, all values in SI."""
    laws = []
    for part, item in zip(joint.part_names, joint.laws, strict=True):
        table: dict[str, Any] = {"kind": item.kind}
        for p in parameters_of(item):
            value = getattr(item, p.name)
            table[p.name] = np.asarray(value, dtype=float).tolist()
        held = [p.name for p in parameters_of(item) if f"{part}.{p.name}" in joint.fixed]
        laws.append({**table, "fixed": held} if held else table)
    out: dict[str, Any] = {"name": joint.name, "law": laws}
    if joint.modulations:
        out["modulation"] = [_modulation_table(m) for m in joint.modulations]
    if joint.validity:
        out["validity"] = {key: [float(x) for x in value] for key, value in joint.validity.items()}
    if joint.covariance is not None:
        matrix = [[float(x) for x in row] for row in joint.covariance.matrix]
        out["covariance"] = {"names": list(joint.covariance.names), "matrix": matrix}
    if joint.provenance:
        out["provenance"] = dict(joint.provenance)
    return out


def _modulation_table(m: Modulation) -> dict[str, Any]:
    table: dict[str, Any] = {"role": _word(m.role), "condition": m.condition, "reference": float(m.reference)}
    table["table"] = [[float(value), float(factor)] for value, factor in m.table]
    further = {"period": m.period, "lag": m.lag or None}
    return table | {key: float(value) for key, value in further.items() if value is not None}


def write_joint(path: Path, joint: Joint) -> None:
    """Write a joint file; read back it is the same joint, bit for bit."""
    write_toml(path, "joint", joint_table(joint))
