"""Simulated paths with known effects: what is hidden is named, and nothing else."""

from __future__ import annotations

import pytest
from path_records import Case
from path_table import all_named, cases, named, run, wrong
from repeats import repeats

FEW = [
    Case(("coulomb", "viscous-by-direction"), "pulses", 40, 0),
    Case(("quadratic", "lag"), "random", 60, 0),
]
NULLS = [c for c in cases(range(3)) if not c.effects]


@pytest.mark.slow
@pytest.mark.parametrize("case", FEW, ids=lambda case: case.name)
def test_two_effects_of_like_size_are_named_together(case: Case) -> None:
    row = run(case)
    assert all_named(row), row
    assert not wrong(row), row
    assert row["after"] < 0.2 * row["before"]


@pytest.mark.parametrize("case", repeats(NULLS, lambda case: case.seed == 0), ids=lambda case: case.name)
def test_nothing_is_named_along_a_path_where_nothing_is_hidden(case: Case) -> None:
    assert not named(run(case))


@pytest.mark.slow
def test_a_lag_beside_dry_friction_is_not_taken_for_elastic_slip() -> None:
    """Slip over 10 µm of strokes of 20 mm turns the friction as late as the record is."""
    row = run(Case(("coulomb", "lag"), "pulses", 40, 9))
    assert all_named(row), row
    assert not wrong(row), row


@pytest.mark.slow
def test_a_lag_alone_gets_no_second_effect_in_exchange_for_one_that_it_does_not_need() -> None:
    assert run(Case(("lag",), "random", 60, 8))["terms"] == ["lag"]


@pytest.mark.slow
def test_what_is_of_no_family_is_not_named_beside_what_is() -> None:
    assert not named(run(Case(("slow-force", "coulomb"), "random", 40, 0)))
