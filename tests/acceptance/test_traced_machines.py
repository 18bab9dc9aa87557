"""Tracing measured responses to a joint of a machine: a few cases, and with ``-m slow`` all that is demanded."""

from __future__ import annotations

import pytest
from machine_table import Row, figures, first, run

SLOW = 60


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 9])
def test_an_altered_joint_is_named(seed: int) -> None:
    row = run(seed, True)
    assert first(row), row
    assert row["error_after"]["relative"] < 0.5 * row["error_before"]["relative"]


@pytest.mark.thorough
def test_nothing_is_named_where_nothing_is_altered() -> None:
    row = run(2, False)
    assert row["verdict"] == "nothing_missing", row
    assert row["named"] is None


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    """Half an hour."""
    return [run(seed, altered) for altered in (True, False) for seed in range(SLOW)]


@pytest.mark.slow
@pytest.mark.parametrize("index", range(len(figures([]))))
def test_what_is_demanded_of_machines_is_reached(rows: list[Row], index: int) -> None:
    figure = figures(rows)[index]
    assert figure.runs >= 50 or figure.least is figure.most is None, figure
    assert figure.met, figure
