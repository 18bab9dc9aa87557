"""Modes from npz, mat, CSV and universal files (data set 55)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.foreign.door import foreign
from jointlib.io.finite_elements.matrix_files import read_arrays
from jointlib.io.readers import read_csv
from jointlib.io.universal import AXES, NO_UNITS, place, read_sets, units

SUFFIXES = (".npz", ".mat", ".csv", ".uff", ".unv")
_NORMAL = 2


@dataclass(frozen=True, eq=False)
class Modes:
    """Natural frequencies in Hz, damping ratios, modal masses in kg and shapes, a row per dof, a column per mode."""

    frequency: Array
    damping_ratio: Array | None
    modal_mass: Array | None
    shapes: Array
    notes: tuple[str, ...] = ()


def read_modes(path: Path, dofs: Sequence[str], at: Sequence[str] | None) -> Modes:
    """The modes at these dofs; ``at`` gives node and direction of each (``12+X``) in a universal file."""
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}, expected modes")
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: no reader for modes in {path.suffix!r} files, expected {', '.join(SUFFIXES)}")
    if (at is not None) != (suffix in (".uff", ".unv")):
        raise InputError(f"{path}: expected at, node and direction of every dof, for a universal file and for no other")
    return foreign(path, "modes", lambda: _read(path, dofs, at))


def _read(path: Path, dofs: Sequence[str], at: Sequence[str] | None) -> Modes:
    if at is not None:
        return _universal(path, dofs, at)
    if path.suffix.lower() == ".csv":
        return _csv(path, dofs)
    arrays = read_arrays(path)
    for key in ("frequency", "shapes"):
        if key not in arrays:
            raise InputError(f"{path}: holds {', '.join(arrays) or 'no arrays'}, expected frequency and shapes")
    if any(value.dtype.kind == "c" for value in arrays.values()):
        raise InputError(f"{path}: holds complex values, expected real normal modes")
    ratio, mass = (
        arrays[key].astype(float).ravel() if key in arrays else None for key in ("damping_ratio", "modal_mass")
    )
    return Modes(arrays["frequency"].astype(float).ravel(), ratio, mass, np.atleast_2d(arrays["shapes"].astype(float)))


def _csv(path: Path, dofs: Sequence[str]) -> Modes:
    columns = read_csv(path)
    for key in ("frequency", *dofs):
        if key not in columns:
            raise InputError(f"{path}: no column {key!r}, {nearest(key, columns)}")
    shapes = np.array([columns[dof] for dof in dofs])
    return Modes(columns["frequency"], columns.get("damping_ratio"), columns.get("modal_mass"), shapes)


def _universal(path: Path, dofs: Sequence[str], at: Sequence[str]) -> Modes:
    if len(at) != len(dofs):
        raise InputError(f"{path}: at names {len(at)} places for {len(dofs)} dofs, expected one each")
    factor, note, modes = 1.0, NO_UNITS, list[dict[str, Any]]()
    for s in read_sets(path):
        if s.get("type") == 164:
            factor, note = units(path, s)
        elif s.get("type") == 55:
            if s.get("analysis_type") != _NORMAL or np.iscomplexobj(s["r1"]):
                raise InputError(
                    f"{path}: set 55 holds complex or other modes, expected normal modes (analysis type 2)"
                )
            modes.append(s)
    if not modes:
        raise InputError(f"{path}: holds no mode (data set 55 of normal modes)")
    shapes = np.array([[_shape(path, s, label) for s in modes] for label in at])
    frequency, mass, viscous, hysteretic = (
        np.array([float(s.get(key) or 0.0) for s in modes])
        for key in ("freq", "modal_m", "modal_damp_vis", "modal_damp_his")
    )
    ratio = np.where(viscous > 0, viscous, hysteretic / 2)
    notes = [note]
    if not np.all(mass > 0):
        notes.append("the file gives no modal masses, its shapes are taken as mass-normalised.")
    return Modes(
        frequency,
        ratio if np.any(ratio > 0) else None,
        mass / factor if np.all(mass > 0) else np.full(len(modes), 1 / factor),
        shapes,
        tuple(notes),
    )


def _shape(path: Path, s: dict[str, Any], label: str) -> float:
    try:
        key, sign = place(label)
    except ValueError as error:
        raise InputError(f"{path}: at is {error}") from None
    for axis in range(1, len(AXES)):
        if key.endswith(AXES[axis]) and key.removesuffix(AXES[axis]).isdecimal():
            node, nodes = int(key.removesuffix(AXES[axis])), np.asarray(s["node_nums"], dtype=int)
            values = s.get(f"r{axis}")
            if node in nodes and values is not None:
                return sign * float(np.asarray(values)[int(np.flatnonzero(nodes == node)[0])])
    raise InputError(
        f"{path}: no motion {label!r} in mode {s.get('mode_n')}, expected a node of the file and X, Y or Z"
    )
