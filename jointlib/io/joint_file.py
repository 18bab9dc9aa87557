"""Joint files: ``schema = "jointlib/joint/1"``."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section, read_toml, write_toml
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw
from jointlib.modulation import CONDITIONS, Modulation
from jointlib.parameter import Role, parameters_of
from jointlib.registry import law
from jointlib.units import quantity

_VALIDITY = {"amplitude": "m", "velocity": "m/s", "frequency": "Hz", "preload": "N"}


def read_joint(path: Path) -> Joint:
    """The joint in a file."""
    section = read_toml(path, "joint")
    name = Path(path).name.removesuffix(".toml").removesuffix(".joint")
    return joint_from(section, section.text("name", name))


def joint_from(section: Section, name: str) -> Joint:
    """The joint in a table with ``[[law]]``, and optionally validity, covariance and provenance."""
    laws: list[JointLaw] = []
    fixed: list[tuple[int, str]] = []
    for number, part in enumerate(section.sections("law")):
        built, held = _law(part)
        laws.append(built)
        fixed += [(number, key) for key in held]
    if not laws:
        raise InputError(f"{section.where}: no [[law]], expected at least one")
    joint = Joint(tuple(laws), name)
    ranges = section.section("validity")
    validity = {
        key: ranges.numbers(key, ranges_unit, length=2) for key, ranges_unit in _VALIDITY.items() if ranges.has(key)
    }
    ranges.done()
    for key, (low, high) in validity.items():
        if low > high:
            raise InputError(f"{ranges.where}: {key} runs from {low:g} to {high:g}, expected low before high")
    covariance = _covariance(section.section("covariance"), joint)
    modulations = tuple(_modulation(m) for m in section.sections("modulation"))
    provenance = section.take("provenance", {})
    section.done()
    names = joint.part_names
    return dataclasses.replace(
        joint,
        fixed=frozenset(f"{names[i]}.{key}" for i, key in fixed),
        validity={key: (low, high) for key, (low, high) in validity.items()},
        covariance=covariance,
        provenance=provenance,
        modulations=modulations,
    )


def _law(part: Section) -> tuple[JointLaw, tuple[str, ...]]:
    kind = part.text("kind")
    cls = law(kind, part.where)
    values: dict[str, Any] = {}
    required = {f.name for f in dataclasses.fields(cls) if f.default is dataclasses.MISSING}  # type: ignore[arg-type]
    for p in parameters_of(cls):
        if p.name not in required and not part.has(p.name):
            continue
        read = part.matrix if p.table else part.numbers if p.listed else part.number
        values[p.name] = read(p.name, p.unit)
    held = part.words("fixed", ())
    known = [p.name for p in parameters_of(cls)]
    for key in held:
        if key not in known:
            raise InputError(f"{part.where}: fixed names {key!r}, {nearest(key, known)}")
    part.done()
    try:
        return cls(**values), held
    except InputError as error:
        raise InputError(f"{part.where}: {error}") from None


def _modulation(section: Section) -> Modulation:
    roles = {_word(role): role for role in Role}
    role = roles[section.text("role", choices=tuple(roles))]
    condition = section.text("condition", choices=tuple(CONDITIONS))
    unit = CONDITIONS[condition]
    reference, period = section.number("reference", unit), section.number("period", unit, None)
    rows = section.take("table")
    if not isinstance(rows, list) or not all(isinstance(row, list) and len(row) == 2 for row in rows):
        raise InputError(f"{section.where}: table is {rows!r}, expected rows [{condition}, factor]")
    spot = f"{section.where}: table"
    table = tuple(
        (quantity(value, unit, f"{spot}[{i}][0]"), quantity(factor, "1", f"{spot}[{i}][1]"))
        for i, (value, factor) in enumerate(rows)
    )
    section.done()
    try:
        return Modulation(role, condition, reference, table, period)
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
            raise InputError(f"{section.where}: names has {name!r}, {nearest(name, joint.parameters)}")
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
    return table if m.period is None else {**table, "period": float(m.period)}


def write_joint(path: Path, joint: Joint) -> None:
    """Write a joint file; read back it is the same joint, bit for bit."""
    write_toml(path, "joint", joint_table(joint))
