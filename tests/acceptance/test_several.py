"""Two effects at once on a rig, each too little alone: named together, and nothing that only looks like it."""

from __future__ import annotations

import pytest
from cells import cells_of
from several_table import all_named, wrong
from summary import named
from table import run

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", ["two/coulomb+cubic/MS/40/0", "two/gap+delay-force/MS/60/1"])
def test_two_effects_of_even_weight_are_named_together(name: str) -> None:
    (cell,) = cells_of([name])
    row = run(cell)
    assert row["chosen"]["explained_first"] < 0.97
    assert all_named(row), row
    assert not wrong(row), row


def test_a_stack_that_noise_cannot_tell_from_another_is_not_named() -> None:
    """A gain and a rocking mode leave nothing above the noise of an inner resonance that the catalogue has not."""
    (cell,) = cells_of(["outside/inner-resonance/MS/40/1"])
    assert not named(run(cell))
