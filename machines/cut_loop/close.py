"""What a trace of cuts leaves behind: the report as numbers and as a picture, and the mended machine."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.io.atomic import write, write_text
from jointlib.io.measurement_write import from_folder
from jointlib.io.toml_file import write_toml
from jointlib.joint import Joint
from jointlib.shown.pictures import axes_of

from ..files.machine_writer import machine_document
from ..model.named_files import documents_and_data
from .report import CutTrace

MACHINE, CHART = "machine.toml", "chart.svg"


def write_cut_trace(report: CutTrace, folder: Path) -> tuple[Path, ...]:
    """Write ``trace.json``, ``chart.svg`` and ``machine.toml``, mended where the finding is a key of its file."""

    def named(file: Path) -> str:
        return from_folder(folder, file.parent, file.name)

    def held(name: str, joint: Joint) -> Any:
        raise AssertionError("no joint is changed")

    document = machine_document(report.machine, report.changes, {}, named, held)
    paths = folder / "trace.json", folder / CHART, folder / MACHINE
    write_text(paths[0], json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n")
    write(paths[1], lambda file: file.write(_picture(report)))
    write_toml(paths[2], "machine", document)
    return paths


def check_folder(machine: Path, folder: Path) -> None:
    """Refuse a folder in which the mended file would replace the machine file or a file that it uses."""
    if (folder / MACHINE).resolve() in {file.resolve() for file in documents_and_data(machine)}:
        raise InputError(f"-o {folder}: its {MACHINE} belongs to the machine to be traced, expected another folder")


def _picture(report: CutTrace) -> bytes:
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "jointlib"}):
        axes = report.plot(axes_of(None))
        buffer = io.BytesIO()
        axes.figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()
