"""Writing a measurement file that a trace has mended: the declaration as it was, with corrections."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jointlib.corrections import joined
from jointlib.errors import InputError
from jointlib.io.atomic import sha256
from jointlib.io.toml_file import parsed, write_toml
from jointlib.measurement import Correction, Measurement

_PROGRAM = "jointlib"


def write_measurement(path: Path, measurement: Measurement, corrections: Sequence[Correction]) -> None:
    """Write the file that ``measurement`` was read from with further corrections; what is read back has them undone.

    Record files stay where they are; their paths are rewritten relative to the new folder. The provenance holds the
    program and the hashes of the file and of all records.
    """
    source = measurement.source
    if not source.is_file():
        raise InputError(f"{source}: no such file, expected the measurement file that corrections are added to")
    table = parsed(source)[1]
    table.pop("schema")
    files = {"file": source.name, "sha256": sha256(source)}, *_hashes(measurement)
    noted = {**table.pop("provenance", {}), "program": f"{_PROGRAM} {version(_PROGRAM)}", "files": list(files)}
    if path.exists() and path.samefile(source) and not is_written_by_a_program(source):
        raise InputError(f"{path}: would be replaced by its mended self, expected another output folder")
    for record in table["record"]:
        record["file"] = from_folder(path.parent, source.parent, record["file"])
    together = joined(measurement.kind, measurement.corrections, corrections)
    table["correction"] = [correction_table(c) for c in together]
    write_toml(path, "measurement", {**table, "provenance": noted})


def is_written_by_a_program(path: Path) -> bool:
    """True for a measurement file that a trace wrote: it may be replaced by the next one."""
    noted = parsed(path)[1].get("provenance", {})
    return str(noted.get("program", "")).startswith(_PROGRAM)


def correction_table(correction: Correction) -> dict[str, Any]:
    """A correction as the table of a measurement file, values in SI."""
    sites = {"channel": correction.channel, "body": correction.body, "record": correction.record}
    return {
        "family": correction.family,
        **{key: value for key, value in sites.items() if value is not None},
        **{name: float(value) for name, value in correction.parameters.items()},
    }


def _hashes(measurement: Measurement) -> list[dict[str, str]]:
    files = dict.fromkeys(record.file for record in measurement.records)
    return [{"file": file.name, "sha256": sha256(file)} for file in files]


def from_folder(folder: Path, old: Path, file: str) -> str:
    """A file name that was relative to one folder, seen from another."""
    if Path(file).is_absolute():
        return file
    target = (old / file).resolve()
    try:
        return Path(os.path.relpath(target, folder.resolve())).as_posix()
    except ValueError:  # another drive
        return target.as_posix()
