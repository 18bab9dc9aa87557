"""A study as a table for other programs, Parquet or CSV: a row per configuration, written a part at a time."""

from __future__ import annotations

import csv
import importlib
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.atomic import write

from .factors import Factor
from .store import Store
from .study import QUANTITIES, Study

_GROUP = 65536
"""Rows held at a time, and in a row group."""
FORMATS = (".parquet", ".csv")


@dataclass(frozen=True)
class Column:
    """A column; its unit stands in its name."""

    name: str
    unit: str = ""
    kind: str = "float64"
    """``float64``, ``int64`` or ``string``, as Arrow calls them."""

    @property
    def title(self) -> str:
        """Name and unit as in ``preload [N]``."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def write_table(study: Study, store: Store, path: Path) -> None:
    """Write every configuration of a finished study: design, case, sample, factors as people set them, and results.

    Entries of lists are written in their words, numbers in the unit of the study file. Parquet needs pyarrow.
    """
    path = Path(path)
    if path.suffix not in FORMATS:
        raise InputError(f"{path}: {path.suffix or 'no ending'!r}, expected a name that ends in {' or '.join(FORMATS)}")
    store.checked()
    fill = _parquet if path.suffix == ".parquet" else _csv
    columns = _columns(study)
    write(path, lambda file: fill(file, columns, _parts(study, store, columns)))


def _columns(study: Study) -> list[Column]:
    found = [Column("design", kind="int64"), Column("case", kind="string"), Column("sample", kind="int64")]
    found += [Column(f.name, "" if f.choices else f.unit, _kind(f)) for f in study.factors]
    return found + [Column(name, QUANTITIES[name][0]) for name in study.quantities]


def _kind(factor: Factor) -> str:
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in factor.choices)
    return "float64" if not factor.choices or (numbers and not factor.labels) else "string"


def _parts(study: Study, store: Store, columns: list[Column]) -> Iterator[list[Any]]:
    """Columns of up to so many rows at a time, in order."""
    numbers, samples = study.numbers(), study.repeats // len(study.cases)
    for first, results in _gathered(store):
        rows = np.arange(first, first + len(next(iter(results.values()))))
        names = [study.cases[i].name for i in rows // samples % len(study.cases)]
        entries = [_entries(f, numbers[rows, i]) for i, f in enumerate(study.factors)]
        yield [rows // study.repeats, names, rows % samples, *entries, *(results[name] for name in study.quantities)]


def _gathered(store: Store) -> Iterator[tuple[int, dict[str, Array]]]:
    """Shards joined to groups of rows, with the first row of each group."""
    held: list[Mapping[str, Array]] = []
    first = size = 0
    for rows, results in store.shards():
        held.append(results)
        size += rows.stop - rows.start
        if size >= _GROUP or rows.stop == store.total:
            yield first, {name: np.concatenate([part[name] for part in held]) for name in held[0]}
            held, first, size = [], rows.stop, 0


def _entries(factor: Factor, numbers: Array) -> Any:
    if not factor.choices:
        return numbers
    words = [factor.words(float(i)) for i in range(len(factor.choices))]
    values = factor.choices if _kind(factor) == "float64" else words
    return [values[int(i)] for i in numbers]


def _csv(file: IO[bytes], columns: list[Column], parts: Iterator[list[Any]]) -> None:
    text = io.TextIOWrapper(file, "utf-8", newline="", write_through=True)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([column.title for column in columns])
    for part in parts:
        plain = [values.tolist() if isinstance(values, np.ndarray) else values for values in part]
        writer.writerows(zip(*plain, strict=True))
    text.detach()


def _parquet(file: IO[bytes], columns: list[Column], parts: Iterator[list[Any]]) -> None:
    try:
        arrow, parquet = importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    except ModuleNotFoundError:
        raise InputError(
            "a .parquet table: pyarrow is not installed, expected pip install 'jointlib[tables]'"
        ) from None
    schema = arrow.schema(
        [arrow.field(c.title, getattr(arrow, c.kind)(), False, {"name": c.name, "unit": c.unit}) for c in columns]
    )
    with parquet.ParquetWriter(file, schema) as writer:
        for part in parts:
            writer.write_table(arrow.table([arrow.array(v, f.type) for v, f in zip(part, schema, strict=True)], schema))
