"""Writing estimated frequency responses as a measurement of kind "frf" and a CSV for each."""

from __future__ import annotations

import re
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jointlib.estimation.result import Estimate, EstimatedFRF
from jointlib.io.atomic import sha256, write_text
from jointlib.io.toml_file import write_toml
from jointlib.measurement import Measurement


def write_frfs(path: Path, estimate: Estimate, measurement: Measurement) -> tuple[Path, ...]:
    """The measurement file, which appears last, and its CSV files.

    Those hold f in Hz, Re, Im, the variance, the bound of the error at 95 % and how many lines err together.

    ``tip.measurement.toml`` gets ``tip_x_from_y.csv`` and so on. Read back, values and variances are the same.
    """
    stem = path.name.removesuffix(".toml").removesuffix(".measurement")
    written, rows = [], []
    for frf in estimate.frfs:
        target = path.with_name(f"{stem}_{_word(frf)}.csv")
        while target in written:
            target = target.with_stem(f"{target.stem}_2")
        _write_csv(target, frf)
        written.append(target)
        row: dict[str, Any] = {
            "file": target.name,
            "drive": frf.drive,
            "response": frf.response,
            "quantity": frf.quantity.word,
            "force": float(f"{frf.force:.6g}"),
        }
        rows.append(row | ({"condition": frf.condition} if frf.condition else {}))
    sources = dict.fromkeys([measurement.source, *(r.file for r in measurement.with_role("fit"))])
    noted = {
        "program": f"jointlib {version('jointlib')}",
        "estimator": measurement.estimate.estimator,
        "averages": [float(f"{frf.averages:.4g}") for frf in estimate.frfs],
        "left_out": list(estimate.left_out),
        "notes": [
            "force: peak of the harmonic force that would move the response as far at its highest resonance",
            *estimate.notes,
        ],
        "files": [{"file": file.name, "sha256": sha256(file)} for file in sources],
    }
    head: dict[str, Any] = {"kind": "frf"} | ({"simulated": True} if estimate.simulated else {})
    write_toml(path, "measurement", {**head, "record": rows, "provenance": noted})
    return path, *written


def _word(frf: EstimatedFRF) -> str:
    words = f"{frf.response}_from_{frf.drive}" + (f"_{frf.condition}" if frf.condition else "")
    return re.sub(r"[^\w.+-]+", "_", words)


def _write_csv(path: Path, frf: EstimatedFRF) -> None:
    head = "frequency,real,imaginary"
    columns = [frf.frequency, frf.value.real, frf.value.imag]
    if frf.variance is not None:
        head += ",variance"
        columns.append(frf.variance)
    if frf.radius is not None:
        head += ",bound95"
        columns.append(frf.radius)
    if frf.alike is not None:
        head += ",alike"
        columns.append(frf.alike)
    rows = zip(*(c.tolist() for c in columns), strict=True)
    write_text(path, head + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
