"""Files of a laboratory into one measurement file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jointlib.errors import InputError, nearest
from jointlib.lab.dialect import Told
from jointlib.lab.importing.channels import channels_of
from jointlib.lab.importing.clock import Clock, clock_of
from jointlib.lab.importing.cut_rows import fill_cuts
from jointlib.lab.importing.cut_table import CutTable, cut_tables
from jointlib.lab.importing.draft import Draft, Noted, Table
from jointlib.lab.importing.forces import force_roles, refuse_unsaid_cut
from jointlib.lab.importing.kinds import Seen, likely_kind
from jointlib.lab.importing.preamble import units_above
from jointlib.lab.importing.responses import holds_responses, response_records
from jointlib.lab.importing.roles import followed_inputs, rig_roles, struck_places
from jointlib.lab.importing.settings import Settings
from jointlib.lab.lab_file import LabFile
from jointlib.lab.open_file import FORMATS, TEXT, open_lab_file
from jointlib.lab.separator import TOLD
from jointlib.measurement import CUTS, FORCES, KINDS

_SUFFIXES = {f".{suffix}" for suffix in (*TEXT, *FORMATS, "lvm")}
_ELSE = {"path": "static", "impact": "ringdown", "shaker": "impact", "rig": "shaker"}
"""What the same signals may be of instead, by the kind that is guessed."""
_AGREE = 1e-3


@dataclass(frozen=True)
class Brought:
    """What the import made of the files."""

    draft: Draft
    files: tuple[LabFile, ...]
    tables: tuple[Path, ...] = ()
    """Tables whose rows are cuts."""

    @property
    def kind(self) -> str:
        return str(self.draft.top["kind"].value)


def bring(paths: Sequence[Path], output: Path, kind: str | None, settings: Settings) -> Brought:
    """Look at every file and draft the measurement; nothing is written."""
    draft = Draft()
    found = _expanded(paths, draft)
    told = _told(settings.text)
    kind = kind or settings.top.get("kind")
    tables = cut_tables(found, told) if kind in (None, CUTS) else []
    if tables:
        return _of_cuts(draft, tables, output, settings, told)
    files = tuple(file for path in found for file in _opened(path, told).groups())
    draft.guesses += dict.fromkeys(f"{f.path.name}: {note}" for f in files for note in f.notes)
    if kind is not None and kind not in KINDS:
        raise InputError(f"--kind: {kind!r}, {nearest(kind, KINDS)}")
    written = [Path(os.path.relpath(f.path, output.parent)).as_posix() for f in files]
    if kind == "frf" or (kind is None and all(holds_responses(f) and not _has_times(f) for f in files)):
        draft.top["kind"] = Noted("frf")
        response_records(draft, list(zip(written, files, strict=True)))
    else:
        _in_time(draft, files, kind, settings)
        draft.records = [
            {"file": Noted(name)} | ({"group": Noted(f.group)} if f.group else {})
            for name, f in zip(written, files, strict=True)
        ]
        if draft.top["kind"].value in ("impact", "shaker"):
            struck_places(draft, draft.records)
    _dialect(draft, files, settings)
    _settled(draft, settings, found)
    if kind == FORCES:
        refuse_unsaid_cut(output, settings.cutting, draft.records)
    return Brought(draft, files)


def _of_cuts(draft: Draft, tables: Sequence[CutTable], output: Path, settings: Settings, told: Told) -> Brought:
    """The draft of a campaign whose rows are cuts, with the records that they name."""
    shared = dict(settings.cutting)
    for table in tables:
        fill_cuts(draft, table, shared, settings.verdict, os.path.relpath(table.path.parent, output.parent))
    records = dict.fromkeys(output.parent / str(cut["file"].value) for cut in draft.cuts if "file" in cut)
    missing = next((path for path in records if not path.is_file()), None)
    if missing is not None:
        raise InputError(f"{tables[0].path}: names the record {missing}, which does not exist")
    files = tuple(file for path in records for file in _opened(path, told).groups())
    if files:
        _in_time(draft, files, CUTS, settings)
        _dialect(draft, files, settings)
    draft.top["kind"] = Noted(CUTS)
    shared.pop("tool", None)
    draft.override(draft.cutting, shared)
    _settled(draft, settings, [table.path for table in tables])
    return Brought(draft, files, tuple(table.path for table in tables))


def _has_times(file: LabFile) -> bool:
    return bool(file.responses) and bool(file.columns)


def _in_time(draft: Draft, files: Sequence[LabFile], kind: str | None, settings: Settings) -> None:
    """Clock, channels, kind and roles of records of signals."""
    first = files[0]
    if not first.columns:
        raise InputError(f"{first.path}: holds no signals, expected columns of numbers")
    _same_columns(files)
    units = units_above(first.table.above, [c.name for c in first.columns]) if first.table is not None else {}
    rate = _rate(settings)
    clocks = [clock_of(file, units, rate) for file in files]
    clock = _one_clock(files, clocks)
    _same_lengths(files)
    draft.top["kind"] = Noted(kind)
    if clock.rate is not None and kind != "static":
        draft.top["sample_rate"] = Noted(settings.top.get("sample_rate", clock.rate), _of_clock(clock))
    if clock.assumed:
        draft.guesses.append(f"{clock.assumed}; --set sample_rate=… says it otherwise")
    draft.bodies = {name: Noted(value) for name, value in settings.bodies.items()}
    values = channels_of(draft, files, clock.column, units, settings.channel)
    if kind is None:
        quantities = {str(t["name"].value): str(t["quantity"].value) for t in draft.channels}
        seen = [Seen(name, quantities[name], x) for name, x in values.items()]
        left = [said for said in draft.guesses if said.endswith("is left out")]
        kind, why = likely_kind(seen, clock.rate is not None, KINDS, str(first.path), left)
        draft.guess(draft.top, "kind", kind, why, f"kind={_ELSE.get(kind, 'path')}")
    if kind == "static":
        draft.top.pop("sample_rate", None)
    elif clock.rate is None:
        what = "no column of times, no rate in the file"
        wanted = "expected --set sample_rate='51.2 kHz'"
        if kind == "cuts":
            row = "a table of cuts has headings as speed, depth, verdict and chatter frequency"
            raise InputError(f"{first.path}: {what}, {wanted} for the record of a cut; {row}")
        raise InputError(f"{first.path}: {what}, {wanted} for a {kind} measurement")
    if kind == "rig":
        rig_roles(draft, settings.top)
    elif kind == "path":
        followed_inputs(draft)
    elif kind == FORCES:
        force_roles(draft, str(settings.cutting.get("process", "milling")))


def _of_clock(clock: Clock) -> str:
    return clock.told_by if clock.told_by == "as set" else f"from {clock.told_by}"


def _rate(settings: Settings) -> float | None:
    from jointlib.units import quantity

    said = settings.top.get("sample_rate")
    return None if said is None else quantity(said, "Hz", "--set sample_rate")


def _expanded(paths: Sequence[Path], draft: Draft) -> list[Path]:
    """Files, with those of a folder in the order of their names and numbers."""
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = [p for p in path.iterdir() if p.is_file() and not p.name.startswith(".")]
            records = sorted((p for p in inside if p.suffix.lower() in _SUFFIXES), key=_by_number)
            others = sorted(p.name for p in inside if p.suffix.lower() not in (*_SUFFIXES, ".toml"))
            if not records:
                raise InputError(f"{path}: a folder without records, expected {', '.join(sorted(_SUFFIXES))}")
            if others:
                draft.guesses.append(f"{path}: left out, as no records: {', '.join(others)}")
            found += records
        elif not path.is_file():
            raise InputError(f"{path}: no such file, expected a record")
        elif path.suffix.lower() not in _SUFFIXES:
            raise InputError(f"{path}: no reader for {path.suffix!r} files, expected {', '.join(sorted(_SUFFIXES))}")
        else:
            found.append(path)
    return list(dict.fromkeys(found))


def _by_number(path: Path) -> list[Any]:
    import re

    parts = re.split(r"(\d+)", path.name.casefold())
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in parts]


def _told(text: Mapping[str, Any]) -> Told:
    keys = ("separator", "decimal", "thousands", "encoding", "header")
    for key in text:
        if key not in keys:
            raise InputError(f"--set text.{key}: no such key, {nearest(key, keys)}")
    separator = text.get("separator")
    if separator is not None and separator not in TOLD:
        raise InputError(f"--set text.separator: {separator!r}, {nearest(str(separator), TOLD)}")
    header = text.get("header")
    if header is not None and not (isinstance(header, int) and header >= 0):
        raise InputError(f"--set text.header: {header!r}, expected the line of the names, 0 where there are none")
    return Told(
        None if separator is None else TOLD[separator],
        text.get("decimal"),
        text.get("thousands"),
        text.get("encoding"),
        header,
    )


def _opened(path: Path, told: Told) -> LabFile:
    try:
        file = open_lab_file(path, told)
    except InputError as error:
        said = str(error)
        for key in ("separator", "decimal", "thousands", "header"):
            said = said.replace(f"[text] {key} = ", f"--set text.{key}=")
        raise InputError(said) from None
    return file


def _same_columns(files: Sequence[LabFile]) -> None:
    first = files[0]
    for file in files[1:]:
        for one, other in ((first, file), (file, first)):
            missing = [c.name for c in one.columns if c.name not in other.arrays()]
            if missing:
                raise InputError(
                    f"{other.path}: no column {missing[0]!r}, which {one.path.name} has, expected the same in each"
                )


def _one_clock(files: Sequence[LabFile], clocks: Sequence[Clock]) -> Clock:
    for file, clock in zip(files[1:], clocks[1:], strict=True):
        first = clocks[0]
        if (clock.rate is None) != (first.rate is None) or (
            clock.rate and first.rate and abs(clock.rate / first.rate - 1) > _AGREE
        ):
            one, other = (f"{c.rate:g} Hz" if c.rate else "no rate" for c in (first, clock))
            raise InputError(
                f"{file.path}: two sample rates, {one} in {files[0].path.name} and {other} here, expected one"
            )
    return clocks[0]


def _same_lengths(files: Sequence[LabFile]) -> None:
    for file in files:
        lengths = {c.name: len(c.values) for c in file.columns}
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{name} {n}" for name, n in list(lengths.items())[:6])
            raise InputError(
                f"{file.path}: columns of different length ({listed}), expected one length (two sample rates?)"
            )


def _dialect(draft: Draft, files: Sequence[LabFile], settings: Settings) -> None:
    """Pin the dialect in which the records are read, as far as it is one."""
    tables = [f.table for f in files if f.table is not None]
    if not tables:
        return
    dialects = {t.dialect for t in tables}
    one = next(iter(dialects))
    words = {mark: word for word, mark in reversed(TOLD.items())}
    for key, value in (("separator", one.separator), ("decimal", one.decimal), ("thousands", one.thousands)):
        if len({getattr(d, key) for d in dialects}) == 1 and (value or key == "separator"):
            draft.text[key] = Noted(words[str(value)] if key == "separator" else value)
    if one.thousands and "thousands" not in settings.text and "decimal" not in settings.text:
        name = {",": "commas", ".": "points", " ": "blanks", "'": "apostrophes"}[one.thousands]
        draft.guesses.append(f"{name} are read as marks between thousands: 1{one.thousands}234 is 1234")
    if one.encoding not in (None, "utf-8") and len({d.encoding for d in dialects}) == 1:
        draft.text["encoding"] = Noted(one.encoding)
    if one.header == 0 and len({d.header for d in dialects}) == 1:
        draft.text["header"] = Noted(0, "there are no names above the numbers")
    draft.override(draft.text, settings.text)


def _settled(draft: Draft, settings: Settings, found: Sequence[Path]) -> None:
    """What is said on the command line takes the place of what was guessed."""
    for key, value in settings.top.items():
        draft.top[key] = Noted(value, draft.top[key].comment if key == "sample_rate" and key in draft.top else "")
        draft.forget(key)
    draft.override(draft.estimate, settings.estimate)
    if not draft.cuts:
        draft.override(draft.cutting, settings.cutting)
    for name, values in settings.channel.items():
        draft.forget(*(f"channel.{name}.{key}" for key in values))
    for name, values in settings.record.items():
        tables = [t for t in draft.records if name in _words_of(t)]
        if not tables:
            known = {p.stem for p in found} | {str(t["group"].value) for t in draft.records if "group" in t}
            raise InputError(f"--set record.{name}: no such record, {nearest(name, known)}")
        for table in tables:
            draft.override(table, values)
        draft.forget(*(f"record.{name}.{key}" for key in values))


def _words_of(record: Table) -> tuple[str, ...]:
    """What a record may be called: its file in full, by its name or its stem, or its group."""
    file = str(record["file"].value)
    group = (str(record["group"].value),) if "group" in record else ()
    return file, Path(file).name, Path(file).stem, *group
