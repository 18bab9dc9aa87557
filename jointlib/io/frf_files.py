"""Measured frequency response functions from universal files (data set 58), CSV, npz, mat and CutPro's .frf."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.foreign.door import LARGEST, foreign, usable
from jointlib.frf import Quantity
from jointlib.io import cutpro
from jointlib.io.readers import named_columns
from jointlib.io.universal import AXES, NO_UNITS, place, read_sets, units
from jointlib.lab.dialect import Told
from jointlib.lab.response_arrays import VALUES, response_arrays
from jointlib.lab.response_columns import response_of, role_of
from jointlib.lab.text_table import read_table
from jointlib.units import scale

ARRAYS = (".npz", ".mat", ".h5", ".hdf5")
SUFFIXES = (".uff", ".unv", ".csv", ".txt", ".tsv", ".asc", ".dat", *ARRAYS, cutpro.SUFFIX)
_MOTION = {8: Quantity.RECEPTANCE, 11: Quantity.MOBILITY, 12: Quantity.ACCELERANCE}
_FORCE = (13, 9)
_FRF = 4


@dataclass(frozen=True, eq=False)
class FrfRecord:
    """Motion over force at lines in Hz; a value per line, or a matrix [line, response, drive]."""

    frequency: Array
    value: ComplexArray
    variance: Array | None = None
    """E|error|² of ``value``, same shape."""
    quantity: Quantity | None = None
    """As the file says it; None where it says nothing."""
    response: str | None = None
    """Node and direction, as ``12+X``."""
    drive: str | None = None
    units: str = ""
    """What the file says of its units."""
    unit: str = ""
    """Unit of the values in a heading, from which they were converted; empty where there was none."""
    alike: Array | None = None
    """Lines that err together with each, where the file says so; so many tell no more than one does."""
    force: Array | None = None
    """N, peak of the force on each line, where the file says so."""


def read_frfs(path: Path, told: Told | None = None) -> list[FrfRecord]:
    """Every frequency response of a file, values in SI where the file says its units."""
    return foreign(path, "frequency responses", lambda: _read(path, told))


def _read(path: Path, told: Told | None) -> list[FrfRecord]:
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}, expected frequency responses")
    suffix = path.suffix.lower()
    if suffix in (".uff", ".unv"):
        return _universal(path)
    if suffix in (".csv", ".txt", ".tsv", ".asc", ".dat"):
        return [_csv(path, told)]
    if suffix in ARRAYS:
        return [_arrays(path)]
    if suffix == cutpro.SUFFIX:
        return [_checked(path, FrfRecord(*cutpro.read_cutpro(path), quantity=Quantity.RECEPTANCE, units="m/N"))]
    raise InputError(f"{path}: no reader for {path.suffix!r} frequency responses, expected {', '.join(SUFFIXES)}")


def read_frf(
    path: Path,
    *,
    where: str,
    response_at: str | None = None,
    drive_at: str | None = None,
    quantity: str | None = None,
    unit: str | None = None,
    told: Told | None = None,
) -> FrfRecord:
    """The one frequency response (or matrix of them) of a file that is asked for, in SI, its quantity known.

    Parameters
    ----------
    response_at, drive_at
        Node and direction in a universal file with several, as ``12+X``; opposite directions change the sign.
    quantity, unit
        What the file does not say itself: receptance, mobility or accelerance, and its unit, default SI.
    told
        How a text file is written, as far as it is known.
    """
    try:
        found, sign = _chosen(path, read_frfs(path, told), (response_at, drive_at))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    held = found.quantity if quantity is None else Quantity[quantity.upper()]
    if held is None:
        raise InputError(
            f"{where}: {path} does not say what it holds, expected quantity = receptance, mobility or accelerance"
        )
    if found.quantity not in (None, held):
        raise InputError(f"{where}: quantity is {quantity!r}, but {path} holds {found.quantity.word}")
    if unit is not None and found.unit:
        raise InputError(
            f"{where}: unit is {unit!r}, but the headings of {path} say {found.unit!r}, expected one of them"
        )
    factor = sign * (1.0 if unit is None else scale(unit, held.value, f"{where}: unit"))
    with np.errstate(over="ignore", invalid="ignore"):
        value = found.value * factor
        variance = None if found.variance is None else found.variance * factor**2
    usable(path, "a value in SI", value)
    return replace(found, value=value, variance=variance, quantity=held)


def _chosen(path: Path, records: Sequence[FrfRecord], at: Sequence[str | None]) -> tuple[FrfRecord, int]:
    """The record between the places that are asked for, and the sign that their directions give."""
    held = ", ".join(f"{r.response} from {r.drive}" for r in records[:6]) + ", …" * (len(records) > 6)
    if all(label is None for label in at):
        if len(records) > 1:
            raise InputError(f"{path}: holds {held}; expected response_at and drive_at")
        return records[0], 1
    if None in at:
        raise InputError(f"{path}: expected response_at and drive_at together")
    try:
        (response, up), (drive, along) = (place(str(label)) for label in at)
    except ValueError as error:
        raise InputError(f"{path}: response_at or drive_at is {error}") from None
    fit = []
    for record in records:
        if record.response is not None and record.drive is not None:
            (a, p), (b, q) = place(record.response), place(record.drive)
            if (a, b) == (response, drive):
                fit.append((record, up * along * p * q))
    if len(fit) != 1:
        raise InputError(
            f"{path}: holds {len(fit) or 'no'} responses at {at[0]} to a force at {at[1]}, expected one; it has {held}"
        )
    return fit[0]


def _csv(path: Path, told: Told | None) -> FrfRecord:
    table = read_table(path, told)
    named = named_columns(path, table, told)
    found = response_of(path, named, table.units)
    if found is not None:
        record = FrfRecord(
            found.frequency,
            found.value,
            found.variance,
            found.quantity,
            unit=found.unit,
            alike=found.alike,
            force=found.force,
        )
        return _checked(path, record)
    columns = list(named.values())
    if len(columns) not in (3, 4):
        raise InputError(
            f"{path}: has {len(columns)} columns ({', '.join(named)}), expected f, Re, Im and, where known, the "
            "variance, or "
            "headings that say frequency and real and imaginary, or magnitude and phase"
        )
    roles = [role_of(heading) for heading in named]
    if roles[3:] and roles[3] not in (None, "variance", "deviation"):
        raise InputError(
            f"{path}: the headings {', '.join(map(repr, list(named)[1:3]))} do not say which column is real and which "
            f"imaginary, and {list(named)[3]!r} is no variance; expected headings as 'real [g/N]' and 'imag [g/N]'"
        )
    variance = columns[3] if len(columns) == 4 else None
    if variance is not None and list(named)[3].lower() == "deviation":
        variance = _squared(path, variance)
    return _checked(path, FrfRecord(columns[0], columns[1] + 1j * columns[2], variance))


def _squared(path: Path, deviation: Array) -> Array:
    """Variance from a deviation, √(E|error|²)."""
    if not np.all(deviation >= 0):
        raise InputError(f"{path}: a deviation is {np.min(deviation):g}, expected at least 0")
    return deviation**2


def _arrays(path: Path) -> FrfRecord:
    held = response_arrays(path)
    (found,) = (name for name in VALUES if name in held)
    quantity = None if found == "H" else Quantity[found.upper()]
    value = held[found]
    value = value.ravel() if value.size == max(value.shape, default=0) else value
    variance = held.get("variance")
    if variance is None and "deviation" in held:
        variance = _squared(path, held["deviation"].astype(float))
    variance = (
        None if variance is None else variance.astype(float).reshape(value.shape if variance.size == value.size else -1)
    )
    frequency = held["frequency"].astype(float).ravel()
    force = held["force"].astype(float).ravel() if "force" in held else None
    return _checked(path, FrfRecord(frequency, value.astype(complex), variance, quantity, force=force))


def _universal(path: Path) -> list[FrfRecord]:
    factor, note, out = 1.0, NO_UNITS, []
    for s in read_sets(path):
        if s.get("type") == 164:
            factor, note = units(path, s)
        elif s.get("type") == 58 and s.get("func_type") == _FRF:
            out.append(_checked(path, _set(path, s, factor, note)))
    if not out:
        raise InputError(f"{path}: holds no frequency response (data set 58 of function type 4)")
    return out


def _set(path: Path, s: dict[str, Any], factor: float, note: str) -> FrfRecord:
    motion, force = (int(s.get(key) or 0) for key in ("ordinate_spec_data_type", "orddenom_spec_data_type"))
    where = f"{path}: set 58 ({str(s.get('id1', '')).strip()})"
    if motion and motion not in _MOTION:
        raise InputError(
            f"{where} has ordinate type {motion}, expected 8, 11 or 12: displacement, velocity, acceleration"
        )
    if force and force not in _FORCE:
        raise InputError(f"{where} has denominator type {force}, expected 13: excitation force")
    labels = []
    for side in ("rsp", "ref"):
        node, direction = int(s.get(f"{side}_node") or 0), int(s.get(f"{side}_dir") or 0)
        if abs(direction) >= len(AXES):
            raise InputError(f"{where} has direction {direction}, expected -6 to 6")
        labels.append(f"{node}{'-' if direction < 0 else '+'}{AXES[abs(direction)]}")
    value = np.asarray(s["data"], dtype=np.complex128) * np.complex128(factor)
    return FrfRecord(np.asarray(s["x"], dtype=float), value, None, _MOTION.get(motion), labels[0], labels[1], note)


def _checked(path: Path, record: FrfRecord) -> FrfRecord:
    f, shape = record.frequency, record.value.shape
    if f.ndim != 1 or shape[:1] != f.shape or len(shape) not in (1, 3) or not len(f):
        raise InputError(
            f"{path}: {f.size} frequencies and values of shape {shape}, expected a value or matrix per line"
        )
    if not np.all(np.isfinite(f)) or np.any(np.diff(f) <= 0) or f[0] < 0:
        raise InputError(f"{path}: frequencies must be finite, not negative and ascending")
    with np.errstate(over="ignore", invalid="ignore"):
        good = np.all(np.abs(record.value.reshape(len(f), -1)) <= LARGEST, axis=1)
    if not np.all(good):
        raise InputError(f"{path}: the value at {f[~good][0]:g} Hz is not finite, or above {LARGEST:g}")
    usable(path, "frequency", f)
    v = record.variance
    if v is not None and (v.shape != shape or not np.all(np.isfinite(v)) or np.any(v < 0)):
        raise InputError(f"{path}: the variance must be finite, not negative and of the shape of the values {shape}")
    if record.force is not None:
        usable(path, "force", record.force)
        if record.force.shape != f.shape or not np.all(record.force > 0):
            raise InputError(f"{path}: the force must be finite, more than 0 and one value per line, its peak in N")
    return record
