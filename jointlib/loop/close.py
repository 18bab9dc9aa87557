"""What a trace leaves behind: the report as JSON, the mended joint, the mended measurement."""

from __future__ import annotations

import json
from pathlib import Path

from jointlib.io.atomic import write_npz, write_text
from jointlib.io.joint_file import write_joint
from jointlib.io.measurement_write import write_measurement
from jointlib.loop.answer.report import TraceReport


def write_trace(report: TraceReport, folder: Path) -> tuple[Path, ...]:
    """Write ``trace.json``, ``trace.npz`` (the arrays of the pictures) and ``joint.toml`` into a folder.

    The joint is unchanged where nothing is named. Where faults of sensors, masses or the rig were named,
    ``measurement.toml`` stands beside it: the measurement with these undone on reading.
    """
    paths = [folder / "trace.json", folder / "joint.toml", folder / "trace.npz"]
    if report.corrections and report.measurement is not None:
        paths.append(folder / "measurement.toml")
        write_measurement(paths[-1], report.measurement, report.corrections)
    write_text(paths[0], json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n")
    write_joint(paths[1], report.mended)
    write_npz(paths[2], report.plots)
    return tuple(paths)
