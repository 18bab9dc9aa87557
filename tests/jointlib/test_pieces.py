"""Long paths of laws with memory, cut into pieces: the force is that of one step after the other."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.dahl import Dahl
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.pieces import in_pieces, turns

STEP = 1e-3
LAWS = (
    Jenkins(2e6, 40.0, clearance=5e-6),
    Dahl(2e6, 40.0),
    BoucWen(2e6, 40.0, 1.5, 0.6),
    Iwan((1e6, 3e6), (10.0, 90.0)),
    LuGre(2e6, 50.0, 30.0, 45.0, 2e-3),
    Maxwell(1e6, 4e4),
)


def wander(count: int) -> Array:
    """A path in m that never repeats and rests for a third of the time."""
    t = STEP * np.arange(count)
    z = 6e-5 * (np.sin(7.3 * t) + 0.6 * np.sin(17.9 * t + 1) + 0.2 * np.cos(40.1 * t))
    return np.asarray(np.where((t > 1.0) & (t < 2.0), z[1000], z))


def one_by_one(law: JointLaw, z: Array, v: Array) -> Array:
    state, force = law.initial_state(z[0]), np.empty(z.shape)
    for i in range(len(z)):
        force[i], state = law.step(Motion(z[i], v[i], STEP), state)
    return force


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.kind)
def test_pieces_side_by_side_give_the_force_of_one_step_after_the_other(law: JointLaw) -> None:
    z = wander(3000)
    v = np.gradient(z, STEP)
    plain = one_by_one(law, z, v)
    assert law.along(z, v, STEP) == pytest.approx(plain, abs=1e-11 * float(np.max(np.abs(plain))))


def test_a_grid_of_elements_on_several_paths_is_cut_like_one() -> None:
    law = Jenkins(1.0, np.array([1e-5, 4e-5, 5e-4]))  # type: ignore[arg-type]
    z = np.stack([wander(2000), -2 * wander(2000)], axis=1)[..., None] * np.ones(3)
    v = np.gradient(z, STEP, axis=0)
    assert law.along(z, v, STEP) == pytest.approx(one_by_one(law, z, v), abs=1e-18)


def test_a_contact_that_never_slips_remembers_its_first_place_through_all_pieces() -> None:
    z = wander(5000)
    law, rounds = Jenkins(1e6, 1e6), []

    def step(z: Array, v: Array, state: Array) -> tuple[Array, Array]:
        rounds.append(len(np.atleast_1d(z)))
        return law.step(Motion(z, v, STEP), state)

    force = in_pieces(law.initial_state(z[0]), law.initial_state, step, z, 0 * z)
    assert force == pytest.approx(1e6 * (z - z[0]), abs=1e-9)
    assert max(rounds) > 1


def test_a_contact_that_slips_is_stepped_in_few_rounds() -> None:
    z, law, steps = wander(20000), Jenkins(1e6, 20.0), []

    def step(z: Array, v: Array, state: Array) -> tuple[Array, Array]:
        steps.append(0)
        return law.step(Motion(z, v, STEP), state)

    in_pieces(law.initial_state(z[0]), law.initial_state, step, z, 0 * z)
    assert len(steps) < 20000 / 10


@pytest.mark.parametrize("law", [law for law in LAWS if law.by_turns], ids=lambda law: law.kind)
def test_between_two_turns_one_step_ends_as_many_do(law: JointLaw) -> None:
    z = np.interp(np.arange(400), [0, 90, 200, 330, 399], [0.0, 7e-5, -6e-5, 2e-5, 2e-5])
    at = turns(z).at
    assert len(at) < 8
    state = law.initial_state(z[0])
    for here in at:
        force, state = law.step(Motion(z[here], np.zeros(()), STEP), state)
    assert force == pytest.approx(float(one_by_one(law, z, 0 * z)[-1]), rel=1e-9)


@pytest.mark.parametrize(
    "law",
    [Jenkins(1e6, 1e6), Dahl(1e6, 1e5), LuGre(1e6, 50.0, 3e4, 4.5e4, 2e-3), BoucWen(1e6, 1e5, 2.0, 0.6)],
    ids=lambda law: law.kind,
)
def test_contacts_that_hardly_forget_are_stepped_in_few_rounds(law: JointLaw) -> None:
    z, steps = wander(8000), []

    def step(z: Array, v: Array, state: Array) -> tuple[Array, Array]:
        steps.append(0)
        return law.step(Motion(z, v, STEP), state)

    v = np.gradient(z, STEP)
    force = in_pieces(law.initial_state(z[0]), law.initial_state, step, z, v)
    plain = one_by_one(law, z, v)
    assert force == pytest.approx(plain, abs=1e-11 * float(np.max(np.abs(plain))))
    # 125 pieces of 64 steps: one after the other in as many rounds, in a handful where ends follow from beginnings.
    assert len(steps) <= 8 * 65


def test_no_law_is_stepped_more_often_than_there_are_pieces() -> None:
    rng = np.random.default_rng(4)
    z, rounds = wander(4000), []
    beginning = np.zeros(2)

    def step(z: Array, v: Array, state: Array) -> tuple[Array, Array]:
        # Ends that jump about with their beginnings, by which no slope tells anything.
        rounds.append(0)
        y = np.cos(1e3 * state[..., 1] + z * 1e5)
        return y, np.stack([z, y], axis=-1)

    def virgin(z: Array) -> Array:
        return np.stack([z, rng.standard_normal(np.shape(z))], axis=-1)

    in_pieces(beginning, virgin, step, z, 0 * z)
    assert len(rounds) <= 62 * 65
