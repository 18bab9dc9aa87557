"""Measured parts under several harmonics: as their model where the record reaches, told and never guessed beyond."""

from __future__ import annotations

import numpy as np
import pytest
from test_measured import COLUMN, LINES, truth

from jointlib.errors import Outcome
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import ArcLength, Connection, Lumped, Machine, response
from machines.components.component import Component
from machines.components.measured import Measured

RECORD = Measured("c", ("x", "y"), LINES, truth(), interpolation="rational")
"""50 to 1500 Hz."""


def machine(part: Component) -> Machine:
    slide = Lumped("s", ("x",), np.array([[20.0]]), np.array([[100.0]]), np.array([[2e7]]))
    joint = Joint((Linear(3e7), Viscous(400.0), Cubic(3e17)))
    return Machine((part, slide), (Connection("j", ("c.x", "s.x"), joint),), drive="c.y")


@pytest.mark.slow
@pytest.mark.parametrize("wanted", [(1, 3, 5), "auto"])
def test_record_that_reaches_the_fifth_harmonic_answers_like_its_model(wanted: tuple[int, ...] | str) -> None:
    found, known = (
        response(machine(part), 400.0, [60.0, 300.0], points=40, harmonics=wanted) for part in (RECORD, COLUMN)
    )
    assert [p.harmonics for p in found.peaks] == [3] * len(known.peaks)
    for p, q in zip(found.peaks, known.peaks, strict=True):
        assert (p.amplitude, p.frequency) == pytest.approx((q.amplitude, q.frequency), rel=1e-4)


@pytest.mark.slow
def test_curves_end_on_the_last_line_of_a_record() -> None:
    """Steps that look past the end ask nothing of the record."""
    found, known = (
        response(machine(part), 400.0, [50.0, 1500.0], points=40, method=ArcLength()) for part in (RECORD, COLUMN)
    )
    assert found.outcomes == known.outcomes == (Outcome.CONVERGED,)
    ends = [[[e.name for e in b.ends] for b in f.branches[0]] for f in (found, known)]
    assert ends[0] == ends[1]
    assert min(b.frequency[0] for b in found.branches[0]) == 50.0
    assert max(b.frequency[-1] for b in found.branches[0]) == 1500.0


@pytest.mark.thorough
@pytest.mark.parametrize(("wanted", "highest"), [((1, 3), 500.0), ((1, 3, 5), 300.0)])
def test_several_harmonics_reach_the_last_line_of_a_record(wanted: tuple[int, ...], highest: float) -> None:
    """Up to its end over the highest harmonic, and not a hertz further."""
    found = response(machine(RECORD), 400.0, [60.0, highest], points=40, harmonics=wanted)
    assert {b.harmonics for b in found.branches[0]} == {wanted}
    assert max(b.frequency[-1] for b in found.branches[0]) == highest
    short = response(machine(RECORD), 400.0, [60.0, highest + 1], points=40, harmonics=wanted)
    assert {b.harmonics for b in short.branches[0]} == {(1,)}
    assert short.outcomes == (Outcome.FRF_TOO_SHORT,)


@pytest.mark.parametrize("wanted", [(1, 3, 5), "auto"])
def test_harmonics_past_the_record_are_named_at_every_point(wanted: tuple[int, ...] | str) -> None:
    """Above 300 Hz the fifth harmonic is not measured; below, the error is known and judged."""
    found = response(machine(RECORD), [10.0, 400.0], [200.0, 400.0], points=40, harmonics=wanted)
    assert found.outcomes == (Outcome.FRF_TOO_SHORT,) * 2
    for branch in (b for of_force in found.branches for b in of_force):
        blind = branch.frequency > 300.0 + 1e-9
        assert np.array_equal(np.isnan(branch.error), blind)
        assert len(branch.outcomes) == len(branch.frequency)
        inner = slice(1, -1)  # folds themselves are not judged
        assert [o is Outcome.FRF_TOO_SHORT for o in branch.outcomes[inner]] == blind[inner].tolist()
    (said,) = found.warnings
    assert said.startswith("j: only the first harmonic is solved for: component 'c': asked for 15")
    assert "measured from 50 to 1500 Hz" in said
    assert "measure further, give modal data of the part, or keep the range lower" in said


def test_an_error_that_cannot_be_estimated_is_said_with_one_harmonic_too() -> None:
    found = response(machine(RECORD), 10.0, [200.0, 400.0], points=40)
    assert found.outcomes == (Outcome.CONVERGED,)
    (said,) = found.warnings
    assert said.startswith("how far one harmonic alone is off is not known everywhere: component 'c'")
    assert "harmonic 5 of 30" in said


def test_a_record_without_interpolation_is_short_between_its_lines() -> None:
    """Every third harmonic of a line is a line here, hardly any fifth is."""
    lines = LINES[20:60]
    sparse = np.concatenate([np.union1d(lines, 3 * lines), [1000.0]])
    found = response(machine(Measured("c", ("x", "y"), sparse, truth(sparse))), 400.0, lines, harmonics="auto")
    assert found.outcomes == (Outcome.FRF_TOO_SHORT,)
    assert "which is no measured line" in found.warnings[-1]
