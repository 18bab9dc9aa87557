"""A rig whose stiffness follows a temperature: named, with its size, and left alone where nothing follows it."""

from __future__ import annotations

from pathlib import Path

import pytest
from cells import cells_of, grid
from followed_table import cells
from measure import simulate, write
from several_table import all_named, wrong
from table import run

from jointlib import read_joint, read_measurement, trace


def test_the_tables_cells_are_all_there_are() -> None:
    names = [c.name for c in cells(range(2))]
    assert len(names) == len(set(names)) == 48
    with pytest.raises(SystemExit, match="no cells begin with 'followed"):
        cells_of(["followed"])


def test_a_stiffness_that_follows_a_temperature_is_named_with_its_size(tmp_path: Path) -> None:
    (cell,) = grid("followed", ["stiffness-by-temperature"], ["MS"], [40.0], [1])
    test = simulate(cell.effect, cell.makers, cell.signal, cell.seed)
    measurement, joint = write(test, tmp_path, cell.decibel, cell.effect, cell.seed)
    report = trace(read_measurement(measurement), read_joint(joint))
    assert "that the stiffness follows the temperature" in report.sentence
    (found,) = report.mended.modulations
    chosen = report.chosen
    assert chosen is not None
    (size,) = chosen.parameters.values()
    (low, at_low), (high, at_high) = found.table
    true = [1 + test.truth.values["rise"] * (u - 303.0) for u in (low, high, found.reference)]
    wanted = (true[1] - true[0]) / true[2]
    assert at_high - at_low == pytest.approx(size.value)
    assert abs(size.value - wanted) < 3 * size.standard_error + 1e-5
    assert abs(size.value - wanted) < 0.01 * abs(wanted)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stiffness-by-temperature+cubic", "warming-stiffness", "cubic+idle-temperature"])
def test_it_is_told_from_another_effect_and_along_a_record(name: str) -> None:
    (cell,) = grid("followed", [name], ["MS"], [60.0], [0])
    row = run(cell)
    assert all_named(row), row
    assert not wrong(row), row


@pytest.mark.slow
def test_an_input_that_nothing_follows_is_left_alone() -> None:
    (cell,) = grid("followed", ["idle-temperature"], ["MS"], [60.0], [1])
    assert run(cell)["verdict"] == "nothing_missing"
