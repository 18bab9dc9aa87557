"""Forces along a path by short ways round: the same as by the long ones."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.effect import Path
from jointlib.identification.path_record import low_pass
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.lugre import LuGre
from jointlib.laws.stribeck import Stribeck
from jointlib.loop.path.force.kept_low_pass import low_pass_kept
from jointlib.loop.path.force.unit_size import Sizes
from jointlib.loop.path.regression import block_grams, hold_out, with_columns
from jointlib.pieces import chained, dragged, turns

STEP = 1e-2
T = STEP * np.arange(600)
Z = 1e-4 * (np.sin(7.3 * T) + 0.6 * np.sin(17.9 * T + 1))
PATH = Path(Z, np.gradient(Z, STEP), STEP)


@pytest.mark.parametrize(("count", "close"), [(30000, 1e-12), (6000, 1e-10), (1500, 1e-6)])
def test_what_is_kept_of_a_filtered_force_is_that_of_the_whole_one(count: int, close: float) -> None:
    rng, edge = np.random.default_rng(3), min(781, count // 20)
    force = np.cumsum(rng.standard_normal((2, count)), axis=1) + 40 * np.sign(np.sin(0.02 * np.arange(count)))
    keep = slice(edge, count - edge, 15)
    whole = low_pass(force, 4.0, 125.0)[:, keep]
    assert low_pass_kept(force, 4.0, 125.0, keep) == pytest.approx(whole, abs=close * float(np.max(np.abs(whole))))


@pytest.mark.parametrize(
    "law",
    [
        Coulomb(7.0, 1e-4),
        Stribeck(7.0, 9.0, 2e-4, 1e-4),
        Jenkins(2e5, 7.0, 1e-6),
        Iwan((1e5, 2e5), (3.0, 9.0)),
        BoucWen(2e5, 7.0, 1.5, 0.6),
        LuGre(2e5, 30.0, 7.0, 9.0, 2e-4),
    ],
    ids=lambda law: law.kind,
)
def test_a_force_is_its_size_times_that_of_a_law_of_unit_size(law: JointLaw) -> None:
    one, size = Sizes(PATH)(law)
    assert size != 1.0
    along = [x.along(*np.broadcast_arrays(Z, PATH.velocity), STEP) if x.states else _now(x) for x in (one, law)]
    assert size * along[0] == pytest.approx(along[1], rel=1e-9, abs=1e-12)


def test_a_law_with_newtons_in_the_denominator_has_no_size() -> None:
    law = HertzGuide(800.0, 1e-7)
    assert Sizes(PATH)(law) == (law, 1.0)


def _now(law: JointLaw) -> np.ndarray:
    return law.step(Motion(Z, PATH.velocity), np.empty((len(Z), 0)))[0]


def test_a_slider_is_dragged_as_step_by_step() -> None:
    z, reach = Z[:, None], np.array([1e-6, 4e-5, 1.0])
    found, s = dragged(z, reach, np.zeros(3)), np.zeros(3)
    for here, after in zip(z, found, strict=True):
        s = np.clip(s, here - reach, here + reach)
        assert np.array_equal(after, s)


def test_a_recursion_in_pieces_is_that_of_one_step_after_the_other() -> None:
    rng = np.random.default_rng(0)
    a, b, x = rng.uniform(0, 1, (137, 2)), rng.standard_normal((137, 2)), np.array([0.3, -2.0])
    found = chained(a, b, x)
    for i in range(len(a)):
        x = a[i] * x + b[i]
        assert found[i] == pytest.approx(x, rel=1e-12)


def test_every_path_has_its_own_turns() -> None:
    z = np.stack([np.array([0.0, 1, 2, 1, 0, 1]), np.array([0.0, -1, -2, -3, -4, -5])], axis=1)
    found = turns(z)
    assert found.at.T.tolist() == [[0, 2, 4, 5], [0, 5, 5, 5]]
    assert found.since.T.tolist() == [[0, 0, 1, 1, 2, 3], [0, 0, 0, 0, 0, 1]]


def test_turns_of_an_array_that_changes_are_found_anew() -> None:
    z = np.array([0.0, 1.0, 2.0, 3.0])
    assert len(turns(z).at) == 2
    z[2] = -1.0
    assert len(turns(z).at) == 4


def test_products_with_further_columns_are_those_of_all_columns() -> None:
    rng = np.random.default_rng(1)
    columns, added, target = rng.standard_normal((3, 50)), rng.standard_normal((2, 50)), rng.standard_normal(50)
    rows = [np.arange(5, 20), np.arange(20, 41), np.array([42, 45, 49])]
    grams = block_grams(columns, target, rows)
    found = with_columns(grams, np.vstack([columns, target]), added, rows)
    assert found == pytest.approx(block_grams(np.vstack([columns, added]), target, rows), rel=1e-12)


def test_a_column_that_a_fold_does_not_have_gets_no_coefficient_there() -> None:
    """What a filter rings on to, and what rounding leaves of one large block less itself, are no column."""
    rng = np.random.default_rng(2)
    everywhere, here = rng.standard_normal(60), np.zeros(60)
    here[:20], here[20:40] = 1e3 * rng.standard_normal(20), 1e-140 * rng.standard_normal(20)
    target = 2.0 * everywhere + 1e-3 * here
    rows = [np.arange(20), np.arange(20, 40), np.arange(40, 60)]
    held = hold_out(block_grams(np.array([everywhere, here]), target, rows), np.full(3, 20), np.arange(3), np.ones(3))
    assert held.coefficients[0] == pytest.approx([2.0, 0.0], abs=1e-9)
    assert held.blocks[1:] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert held.blocks[0] == pytest.approx(np.mean((1e-3 * here[:20]) ** 2), rel=1e-6)
