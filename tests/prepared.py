"""Records of a path as its trace has them."""

from __future__ import annotations

from pathlib import Path

from jointlib.io.measurement_file import read_measurement, read_records
from jointlib.loop.path.preparation import Run, choose_preparation, prepare


def prepared(file: Path) -> tuple[Run, ...]:
    """All records of a measurement file, filtered and thinned."""
    measured = read_measurement(file)
    records = read_records(measured, measured.records)
    chosen = choose_preparation(measured, records)
    return tuple(prepare(measured, record, chosen) for record in records)
