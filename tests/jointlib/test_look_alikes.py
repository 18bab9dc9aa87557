"""Effects that are declared to look alike: one is the other at the edge of its range, and the reader is told."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.effects.coulomb import CoulombFriction
from jointlib.effects.gap import Play
from jointlib.effects.jenkins_play import SlipWithPlay
from jointlib.effects.stribeck import StribeckFriction
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.loop.answer.catalogue import catalogue
from jointlib.loop.answer.naming import Effect, experiment, is_declared_pair
from jointlib.planning.told import advised

TIME = np.linspace(0.0, 1.0, 4001)
PATH = Path(
    1e-6 * np.sin(2 * np.pi * 3 * TIME) * (1 + TIME),
    np.gradient(1e-6 * np.sin(2 * np.pi * 3 * TIME) * (1 + TIME), TIME),
    TIME[1],
)
JOINT = Joint((Linear(5e8),))


def force(effect: JointEffect, coefficients: list[float], shape: dict[str, float]) -> Array:
    """Of the joint with the effect, along the path."""
    mended = effect.apply(np.array(coefficients), shape, JOINT)
    assert mended is not None
    return mended.force_along(PATH.displacement, PATH.velocity, PATH.time_step)


def test_stribeck_friction_without_its_bump_is_coulomb_friction() -> None:
    shape = {"smoothing_velocity": 1e-7, "stribeck_velocity": 1e-6}
    sliding = StribeckFriction().columns(PATH, shape, JOINT)[0]
    np.testing.assert_allclose(sliding, CoulombFriction().columns(PATH, shape, JOINT)[0], rtol=1e-12)
    assert is_declared_pair(CoulombFriction(), StribeckFriction())


def test_slip_with_play_is_play_alone_as_long_as_nothing_slips() -> None:
    """The spring of the joint, interrupted by play of 2 c, against the spring of the element behind that play."""
    clearance, stuck = 0.4e-6, {"slip_distance": 10e-6, "clearance": 0.4e-6}
    played = force(Play(), [2e8], {"clearance": clearance})
    slipped = force(SlipWithPlay(), [2e8], stuck)
    np.testing.assert_allclose(slipped, played + 2e8 * PATH.displacement, atol=1e-9 * np.abs(played).max())
    slipping = force(SlipWithPlay(), [2e8], {"slip_distance": 0.5e-6, "clearance": clearance})
    assert np.abs(slipping - played - 2e8 * PATH.displacement).max() > 0.1 * np.abs(played).max()
    assert is_declared_pair(Play(), SlipWithPlay())


def test_every_declared_pair_names_the_experiment_that_separates_it() -> None:
    found = catalogue()
    everything: tuple[Effect, ...] = (*found.joint, *found.rig, *found.path)
    for effect in everything:
        assert effect.declared_pairs <= effect.look_alikes.keys(), effect.family
        for family in effect.declared_pairs:
            others = [other for other in everything if other.family == family]
            assert others, family
            assert all(is_declared_pair(other, effect) for other in others)
            assert experiment(effect, others[0]) == effect.look_alikes[family]


def test_a_plan_advises_no_levels_that_it_plays() -> None:
    assert advised("cubic", "gap") == "Repeat at three or more levels: a gap loses weight as the amplitude grows."
    assert advised("gap", "cubic", (0.5, 1.0, 1.0)) == advised("gap", "cubic")
    effects = catalogue().joint
    pairs = [(e.family, other) for e in effects for other, said in e.look_alikes.items() if "or more levels" in said]
    assert ("gap", "cubic") in pairs
    assert {advised(e, other, (0.3, 0.6, 1.0, 1.0)) for e, other in pairs} == {""}
    assert advised("gap", "hysteresis", (0.3, 0.6, 1.0, 1.0)) == advised("gap", "hysteresis")
