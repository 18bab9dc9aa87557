"""Measurement files: ``schema = "jointlib/measurement/1"``, and the records they point to."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.corrections import without_faults
from jointlib.errors import InputError, nearest
from jointlib.estimation.settings import EXCITED, Settings
from jointlib.frf import Quantity
from jointlib.io.atomic import sha256
from jointlib.io.channel_table import channel_of
from jointlib.io.estimate_table import settings_of
from jointlib.io.key_places import OF_FILE, OF_RECORD, refuse_elsewhere
from jointlib.io.measurement_checks import check
from jointlib.io.mistakes import Lost, Mistakes, all_at_once
from jointlib.io.readers import rate_of_sound, read_columns
from jointlib.io.tables.correction_table import carriage, correction_of, mended
from jointlib.io.tables.cut_table import cut_of, operation_of
from jointlib.io.tables.cuts_table import records_of, tried_cut
from jointlib.io.text_dialect import dialect_of
from jointlib.io.toml import Section
from jointlib.io.toml_file import read_toml
from jointlib.lab.sampling import refuse_gap
from jointlib.measurement import (
    CUTS,
    FORCES,
    KINDS,
    RINGDOWN,
    ROLES,
    Mass,
    Measurement,
    Record,
    RecordSource,
    Sweep,
)

_HELD = {"force": "N", "amplitude": "m", "acceleration": "m/s^2"}
"""What a harmonic test may hold, and its unit."""


def read_measurement(path: Path) -> Measurement:
    """The declaration alone; no record is opened."""

    def read(mistakes: Mistakes) -> Measurement:
        section = read_toml(Path(path), "measurement", mistakes)
        found = section.read(lambda table: _measurement(Path(path), table))
        if found is None:
            raise Lost
        return found

    return all_at_once(read)


def _measurement(path: Path, section: Section) -> Measurement:
    """The declaration in a table."""
    kind = section.text("kind", choices=KINDS)
    rate = section.number("sample_rate", "Hz", None)
    if rate is not None and rate <= 0:
        section.fault(f"sample_rate is {rate:g} Hz, expected a positive one")
    if rate is None and kind in ("rig", "path", *EXCITED, FORCES, RINGDOWN):
        section.fault(f"sample_rate is missing, expected one for a {kind} measurement")
    band = section.numbers("band", "Hz", None, length=2)
    if band is not None and not 0 <= band[0] < band[1]:
        section.fault(f"band runs from {band[0]:g} to {band[1]:g} Hz, expected low before high")
    elif band is not None and rate is not None and 0 < rate < 2 * band[1]:
        section.fault(f"band ends at {band[1]:g} Hz, expected at most half the sample_rate")
    told = dialect_of(section.section("text"))
    masses = section.section("bodies")
    bodies = {name: _mass(masses, name, may_be_held=kind == "rig") for name in masses.keys()}  # noqa: SIM118
    channels, faulty = section.each("channel", lambda part: channel_of(part, kind))
    channels += [each.likeness for each in faulty if each.likeness is not None]
    corrections, _ = section.each("correction", lambda part: correction_of(part, kind, channels, faulty, bodies))
    operation = section.section("cutting") if kind in (FORCES, CUTS) else None
    acts_on, shared = ("tool", {}) if operation is None else operation_of(operation, kind)
    cuts, unread = section.each("cut", lambda part: tried_cut(part, shared), needed=True) if kind == CUTS else ([], [])
    of_record = _sweep if kind == "frf" else partial(_record, kind=kind, shared=shared)
    records, lost = section.each("record", of_record, needed=kind != CUTS)
    records = [*records_of(cuts), *records]
    asked = section.section("estimate")
    estimate = asked.read(lambda part: settings_of(part, kind)) if kind in EXCITED else None
    found = Measurement(
        source=path,
        kind=kind,
        sample_rate=rate,
        period=section.integer("period", None, lower=2),
        settle=section.integer("settle", 0),
        band=None if band is None else (band[0], band[1]),
        driven=section.text("driven", None),
        bodies=mended(bodies, corrections, kind, section.where),
        carriage=carriage(_moving(section, kind), corrections, kind),
        simulated=section.flag("simulated"),
        channels=tuple(channels),
        records=tuple(records),
        corrections=tuple(corrections),
        text=told,
        acts_on=acts_on,
        cuts=tuple(cuts),
        estimate=estimate or Settings(),
    )
    refuse_elsewhere(section, kind, OF_FILE)
    section.section("provenance")
    section.done()
    check(found, channels=not faulty, records=not lost and not unread)
    return found


def _moving(section: Section, kind: str) -> Mass | None:
    """What moves with a path, or the modal mass of a ringdown; None where the file does not say it."""
    if kind == RINGDOWN:
        return _mass(section, "modal_mass") if section.has("modal_mass") else None
    return _mass(section, "carriage") if section.has("carriage") else None


def _mass(section: Section, name: str, *, may_be_held: bool = False) -> Mass:
    """A mass; of a body of a rig with the suspension that holds it to ground."""
    value = section.take(name)
    if value == "unknown":
        return Mass(None)
    if isinstance(value, dict):
        inner = section.within(value, name)
        mass = Mass(inner.number("mass", "kg"), inner.number("u", "kg", 0.0))
        if may_be_held:
            held = inner.number("stiffness", "N/m", 0.0), inner.number("damping", "N s/m", 0.0)
            mass = replace(mass, stiffness=held[0], damping=held[1])
            if min(held) < 0:
                inner.fault(f"{name} is held to ground by {held[0]:g} N/m and {held[1]:g} N s/m, expected 0 or more")
        inner.done()
    else:
        mass = Mass(section.within({name: value}).number(name, "kg"))
    if mass.uncertainty < 0:
        section.fault(f"{name} has u = {mass.uncertainty:g} kg, expected a standard uncertainty")
    if mass.value is not None and mass.value <= 0:
        section.fault(f"{name} is {mass.value:g} kg, expected a positive mass")
    return mass


def _record(section: Section, kind: str, shared: Mapping[str, Any]) -> RecordSource:
    refuse_elsewhere(section, kind, OF_RECORD)
    rows = section.take("rows", None)
    whole = isinstance(rows, list) and len(rows) == 2 and all(type(r) is int for r in rows)
    if rows is not None and not (whole and 0 <= rows[0] < rows[1]):
        section.fault(f"rows is {rows!r}, expected [first, end) with 0 <= first < end")
        rows = None
    role = section.text("role", "fit", choices=ROLES)
    if kind == CUTS and role != "quiet":
        section.fault(f"role is {role!r}, expected 'quiet', the spindle turning without a cut: cuts stand in [[cut]]")
    record = RecordSource(
        file=section.path("file"),
        role=role,
        rows=None if rows is None else (rows[0], rows[1]),
        condition=section.text("condition", None),
        start=section.number("start", "s", None),
        period=section.integer("period", None, lower=2),
        sample_rate=section.number("sample_rate", "Hz", None),
        drive=section.text("drive", None),
        group=section.text("group", None),
        cut=cut_of(section, shared) if kind == FORCES and role != "quiet" else None,
    )
    section.done()
    return record


def _sweep(section: Section) -> RecordSource:
    """A record of kind ``frf``: one frequency response at one size of the force, or of the response."""
    instead = [key for key in ("amplitude", "acceleration") if section.has(key)]
    held = {key: section.number(key, _HELD[key], 0.0) for key in ("amplitude", "acceleration")}
    held["force"] = section.number("force", "N", 0.0) if instead else section.number("force", "N")
    for key in instead or ["force"]:
        if not 0 < held[key] < math.inf:
            what = "force" if key == "force" else "response"
            section.fault(f"{key} is {held[key]:g} {_HELD[key]}, expected the peak of the {what}, more than 0")
    if len([key for key, value in held.items() if value]) > 1:
        told = " and ".join(key for key, value in held.items() if value)
        section.fault(f"{told} are given, expected the one that was held")
    sweep = Sweep(
        drive=section.text("drive"),
        response=section.text("response"),
        **held,
        quantity=section.text("quantity", None, choices=tuple(q.word for q in Quantity)),
        unit=section.text("unit", None),
        response_at=section.text("response_at", None),
        drive_at=section.text("drive_at", None),
        conjugate=section.flag("conjugate"),
    )
    record = RecordSource(
        file=section.path("file"),
        role=section.text("role", "fit", choices=("fit", "sealed")),
        condition=section.text("condition", None),
        sweep=sweep,
    )
    section.done()
    return record


def read_records(m: Measurement, sources: Iterable[RecordSource]) -> tuple[Record, ...]:
    """Read records, convert to SI, refuse samples that are missing or not finite, and undo the corrections."""
    cache: dict[Path, tuple[dict[str, Array], str, float]] = {}
    out = []
    for source in sources:
        if source.file not in cache:
            columns = read_columns(source.file, m.text)
            cache[source.file] = columns, sha256(source.file), _rate(m, source.file)
        out.append(_read(m, source, *cache[source.file]))
    return tuple(out)


def _of_group(source: RecordSource, columns: dict[str, Array]) -> dict[str, Array]:
    """The columns of the group of a record, without its name."""
    if source.group is None:
        return columns
    inside = {name.partition("/")[2]: x for name, x in columns.items() if name.startswith(f"{source.group}/")}
    if not inside:
        groups = {name.partition("/")[0] for name in columns if "/" in name}
        raise InputError(f"{source.file}: no group {source.group!r}, {nearest(source.group, groups)}")
    return inside


def _rate(m: Measurement, file: Path) -> float:
    """Hz of a record, which a WAV file tells too; 0 where nobody does."""
    said, own = m.sample_rate, rate_of_sound(file)
    if said is not None and own is not None and abs(own / said - 1) > 1e-3:
        raise InputError(f"{file}: was recorded at {own:g} Hz, sample_rate says {said:g} Hz")
    return said or own or 0.0


def _read(m: Measurement, source: RecordSource, columns: dict[str, Array], digest: str, rate: float) -> Record:
    columns, data = _of_group(source, columns), {}
    for channel in m.channels:
        heading = channel.column or channel.name
        if heading not in columns:
            raise InputError(f"{source.file}: no column {heading!r}, {nearest(heading, columns)}")
        column = columns[heading]
        if source.rows is not None:
            if source.rows[1] > len(column):
                raise InputError(f"{source.file}: rows {list(source.rows)}, the file has {len(column)}")
            column = column[slice(*source.rows)]
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            row = int(bad[0]) + (source.rows[0] if source.rows else 0)
            raise InputError(f"{source.file}: column {heading!r} row {row} is {column[bad[0]]}, expected a number")
        value = column * channel.factor + channel.offset
        data[channel.name] = value - value.mean() if channel.remove_mean else value
    lengths = {name: len(value) for name, value in data.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} {n}" for name, n in lengths.items())
        raise InputError(f"{source.file}: channels of different length ({listed}), expected one length")
    for channel in m.of("time"):
        _check_clock(source, data[channel.name], rate)
    used = {channel.column or channel.name for channel in m.channels}
    ignored = tuple(name for name in columns if name not in used)
    period = source.period or m.period
    return Record(source, without_faults(m, source, data, period), rate, period, digest, ignored)


def _check_clock(source: RecordSource, time: Array, rate: float) -> None:
    steps = np.diff(time)
    if len(steps) and np.any(steps <= 0):
        raise InputError(f"{source.file}: time goes backwards at row {int(np.argmax(steps <= 0)) + 1}")
    if rate:
        refuse_gap(time, f"{source.file}: the time")
    if rate and len(steps) and abs(float(np.mean(steps)) * rate - 1) > 1e-3:
        found = 1 / float(np.mean(steps))
        raise InputError(f"{source.file}: the time column runs at {found:.6g} Hz, sample_rate says {rate:g} Hz")
