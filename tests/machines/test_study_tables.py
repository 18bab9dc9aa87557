"""Tables of a study: what a reader of Parquet or CSV finds is what was computed."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from machines.study import tables
from machines.study.engine import compute
from machines.study.store import Store
from machines.study.study import Study
from machines.study.study_file import read_study
from machines.study.tables import write_table

STUDY = """
schema = "jointlib/study/1"
base = "none.toml"
[[factor]]
name = "preload"
path = "a"
range = ["300 N", "900 N"]
[[factor]]
name = "cutter"
path = "b"
values = [[[1.0]], [[2.0]], [[3.0]]]
words = ["short", "medium", "long"]
[[factor]]
path = "teeth"
values = [2, 4]
[[factor]]
path = "damping"
role = "uncertain"
distribution = { kind = "log-normal", median = "780 N s/m", deviation = 0.2 }
[conditions]
material = [{ name = "steel, hard", tangential = 2e9 }, { name = "brass", tangential = 1e9 }]
[[objective]]
quantity = "removal-rate"
goal = "max"
[[constraint]]
quantity = "weight"
at_most = 9.0
[sampling]
method = "latin-hypercube"
count = 11
samples = 3
"""


def worth(first: int, end: int) -> dict[str, Array]:
    rows = np.arange(first, end, dtype=float)
    rate = np.where(rows % 7 == 3, np.nan, 1e-6 * np.sin(rows))
    return {"removal-rate": rate, "weight": np.sqrt(rows), "pocket-speed": np.where(rows % 5 == 0, np.inf, rows)}


@pytest.fixture
def study(tmp_path: Path) -> Study:
    (tmp_path / "t.study.toml").write_text(STUDY)
    return read_study(tmp_path / "t.study.toml")


@pytest.fixture
def store(tmp_path: Path, study: Study) -> Store:
    found = Store.begin(tmp_path / "r", {}, study.total, 5)
    compute(found, worth)
    return found


def expected(study: Study) -> dict[str, list[object]]:
    numbers, rows = study.numbers(), range(66)
    return {
        "design": [i // 6 for i in rows],
        "case": [("steel, hard", "brass")[i // 3 % 2] for i in rows],
        "sample": [i % 3 for i in rows],
        "preload [N]": numbers[:, 0].tolist(),
        "cutter": [("short", "medium", "long")[int(i)] for i in numbers[:, 1]],
        "teeth": [(2.0, 4.0)[int(i)] for i in numbers[:, 2]],
        "damping [N s/m]": numbers[:, 3].tolist(),
        "pocket-speed [rpm]": worth(0, 66)["pocket-speed"].tolist(),
        "removal-rate [m^3/s]": worth(0, 66)["removal-rate"].tolist(),
        "weight [kg]": worth(0, 66)["weight"].tolist(),
    }


def test_a_reader_of_parquet_finds_every_configuration_in_its_units(
    study: Study, store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed (extra tables)")
    monkeypatch.setattr(tables, "_GROUP", 20)
    write_table(study, store, tmp_path / "t.parquet")
    with parquet.ParquetFile(tmp_path / "t.parquet") as file:
        table = file.read()
        groups = [file.metadata.row_group(i).num_rows for i in range(file.num_row_groups)]
    wanted = expected(study)
    assert table.column_names == list(wanted)
    for name, values in wanted.items():
        np.testing.assert_array_equal(table.column(name).to_pylist(), values)
    assert table.schema.field("preload [N]").metadata == {b"name": b"preload", b"unit": b"N"}
    assert sum(groups) == 66
    assert max(groups) < 66, "shards are held one group at a time"


def test_a_csv_says_the_same_without_pyarrow(
    study: Study, store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    write_table(study, store, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    wanted = expected(study)
    assert header == list(wanted)
    for column, values in zip(zip(*rows, strict=True), wanted.values(), strict=True):
        found = list(column) if isinstance(values[0], str) else [float(word) for word in column]
        np.testing.assert_array_equal(found, values)
    with pytest.raises(InputError, match=r"pyarrow is not installed, expected pip install 'jointlib\[tables\]'"):
        write_table(study, store, tmp_path / "t.parquet")
    assert not (tmp_path / "t.parquet").exists()


def test_rows_of_shards_that_overlap_stand_once(study: Study, store: Store, tmp_path: Path) -> None:
    """Two processes that computed parts of different size may both have kept a block."""
    write_table(study, store, tmp_path / "before.csv")
    first, last = store.held()[0][0], store.held()[1][1]
    rows = store.rows(first, last)
    store.keep(first, last, worth(rows.start, rows.stop))
    write_table(study, store, tmp_path / "after.csv")
    assert (tmp_path / "after.csv").read_bytes() == (tmp_path / "before.csv").read_bytes()


@pytest.mark.parametrize(("name", "said"), [("t.xlsx", "expected a name that ends in .parquet or .csv"), ("t", "no")])
def test_a_table_without_sense_is_refused(name: str, said: str, study: Study, store: Store, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        write_table(study, store, tmp_path / name)
    next(iter((store.folder / "shards").iterdir())).unlink()
    with pytest.raises(InputError, match="blocks, expected all; resume the study"):
        write_table(study, store, tmp_path / "t.csv")


def test_the_designs_of_a_search_stand_in_its_table(tmp_path: Path, study: Study) -> None:
    found = np.random.default_rng(0).random((11, 3))
    study = replace(study, method="pareto", found=found)
    store = Store.begin(tmp_path / "r", {}, study.total, 6)
    compute(store, worth)
    write_table(study, store, tmp_path / "t.csv")
    preload = np.genfromtxt(tmp_path / "t.csv", delimiter=",", skip_header=1, usecols=-7)
    np.testing.assert_array_equal(preload[::6], 300 + 600 * found[:, 0])
