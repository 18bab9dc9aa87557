"""Simulated free decays with a known joint: what is hidden is named, and nothing else."""

from __future__ import annotations

import pytest
from decay_records import Case
from decay_table import in_set, named, run


@pytest.mark.slow
def test_nothing_is_named_in_a_decay_where_nothing_is_hidden() -> None:
    assert run(Case((), 1, 40, 0))["verdict"] == "nothing_missing"


@pytest.mark.slow
def test_quadratic_damping_is_named_from_its_decay() -> None:
    row = run(Case(("quadratic-damping",), 1, 60, 0))
    assert in_set(row), row
    assert row["terms"] == ["quadratic-damping"]
    assert row["after"] < 0.2 * row["before"]


@pytest.mark.slow
@pytest.mark.parametrize("decibel", [60, 40])
def test_an_uneven_spring_under_other_modes_is_not_taken_for_a_cubic_one_alone(decibel: float) -> None:
    row = run(Case(("quadratic",), 3, decibel, 0))
    assert not named(row) or in_set(row), row


@pytest.mark.slow
@pytest.mark.parametrize("decibel", [60, 40])
def test_damping_that_saturates_is_not_named_dry_friction(decibel: float) -> None:
    row = run(Case(("damping-that-saturates",), 1, decibel, 0))
    assert not named(row), row
    assert run(Case(("coulomb",), 1, decibel, 0))["verdict"] in ("identified", "ambiguous")
