"""Parameters of a joint on a rig that follow an input: forces against the law by hand, and their slopes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from integrated_rig import PEAK, C, K
from prescribed_motion import FINER, PERIODS, moved, observed
from rig_samples import PERIOD, RATE, measurement, record

from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.import_checks import without_dead_channels
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.inputs import Inputs, inputs_of, ranges_of
from jointlib.loop.balance.tangents import followed_slopes
from jointlib.loop.periodic.readings import idle_inputs
from jointlib.measurement import Channel, Record, RecordSource
from jointlib.modulation import Modulation
from jointlib.parameter import Role

SAMPLES = PERIODS * PERIOD
SLIP = Coulomb(0.02 * K * PEAK, 0.1)
COURSE = 300 + 10 * np.sin(2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
"""K, once up and down along the record."""


def following(role: Role, change: float) -> Modulation:
    return Modulation(role, "temperature", 300.0, ((290.0, 1 - change), (310.0, 1 + change)))


def with_input(o: Observed, course: np.ndarray) -> Observed:
    return replace(o, inputs=Inputs({"temperature": np.asarray(course)}, 1 / RATE))


def force(law: JointLaw) -> np.ndarray:
    z, v = moved()
    return np.asarray(law.step(Motion(z, v), np.empty((len(z), 0)))[0])


@pytest.mark.parametrize(
    ("role", "parts"),
    [(Role.STIFFNESS, (K, C, 0.0)), (Role.SLIP_FORCE, (K, C, 1.0))],
    ids=["stiffness", "slip force"],
)
def test_a_factor_that_changes_along_a_record_multiplies_the_force(role: Role, parts: tuple[float, ...]) -> None:
    z, v = moved()
    fine = np.interp(np.arange(SAMPLES * FINER) / FINER, np.arange(SAMPLES), 1 + 0.2 * (COURSE - 300) / 10)
    factor = {r: fine if r is role else 1.0 for r in (Role.STIFFNESS, Role.SLIP_FORCE)}
    friction = parts[2] * force(SLIP)
    true = factor[Role.STIFFNESS] * K * z + C * v + factor[Role.SLIP_FORCE] * friction
    o = with_input(observed(true), COURSE)
    joint = Joint((Linear(K), Viscous(C), SLIP) if parts[2] else (Linear(K), Viscous(C)))
    modulated = replace(joint, modulations=(following(role, 0.2),))
    inside = (o.frequency >= 2e3) & (o.frequency <= 20e3)
    wanted = np.fft.rfft(true)[o.lines] / FINER
    left, before = (np.linalg.norm((wanted - o.model_force(j))[inside]) for j in (modulated, joint))
    moving = wanted - np.fft.rfft(K * z + C * v + friction)[o.lines] / FINER
    assert before == pytest.approx(np.linalg.norm(moving[inside]), rel=0.05)
    assert left < 0.02 * before


@pytest.mark.parametrize(
    "law", [Jenkins(0.1 * K, 0.01 * K * PEAK), HertzGuide(100.0, 5e9, np.pi / 4)], ids=lambda law: str(law.kind)
)
def test_of_an_input_that_stands_still_the_force_is_that_of_the_joint_there(law: JointLaw) -> None:
    z, v = moved()
    o = with_input(observed(K * z + C * v), np.array([306.0]))
    roles = (Role.STIFFNESS, Role.SLIP_FORCE, Role.PRELOAD)
    joint = Joint((Linear(K), law), modulations=tuple(following(r, 0.3) for r in roles))
    there = joint.at({"temperature": 306.0})
    assert there.parameters != joint.parameters
    np.testing.assert_allclose(o.model_force(joint), o.model_force(there), rtol=1e-12)


@pytest.mark.parametrize("course", [np.array([306.0]), COURSE], ids=["still", "moving"])
@pytest.mark.parametrize("role", [Role.STIFFNESS, Role.SLIP_FORCE])
def test_slopes_over_a_modulation_are_differences_of_the_force(role: Role, course: np.ndarray) -> None:
    z, v = moved()
    o = with_input(observed(K * z + C * v), course)
    laws = (Linear(K), SLIP, Jenkins(0.1 * K, 0.01 * K * PEAK))
    at = following(role, 0.1)
    (slope,) = followed_slopes([o], Joint(laws, modulations=(at,)), at)
    h = 1e-3  # Of the rise from end to end.
    up, down = (o.model_force(Joint(laws, modulations=(following(role, 0.1 + s * h / 2),))) for s in (1, -1))
    inside = o.stray | o.on_period
    difference = ((up - down) / (2 * h))[inside]
    assert np.linalg.norm(slope[0][inside] - difference) < 0.02 * np.linalg.norm(difference)


def test_an_input_is_known_without_its_noise_and_held_where_it_hardly_moves() -> None:
    period, rate = 1000, 1e4
    t = np.arange(8 * period) / rate
    test = measurement()
    logged = replace(test, channels=(*test.channels, Channel("T", "temperature", "K", "K", 1.0, is_input=True)))
    rng = np.random.default_rng(0)

    def read(u: np.ndarray) -> Inputs:
        noisy = u + 0.5 * rng.standard_normal(len(u))
        source = RecordSource(test.source, "fit")
        made = Record(source, {"T": noisy}, rate, period, "")
        return inputs_of(logged, made, slice(0, len(u)), period)

    course = 300 + 10 * np.sin(2 * np.pi * t / t[-1])
    moving, cold = read(course), read(np.full(len(t), 280.0))
    assert np.std(moving.along["temperature"] - course) < 0.1
    ranges = ranges_of([moving, cold])
    assert ranges["temperature"] == pytest.approx((280, 310), abs=0.2)
    assert cold.held(ranges).along["temperature"] == pytest.approx([280], abs=0.05)
    assert len(moving.held(ranges).along["temperature"]) == len(t)


def test_a_preload_that_is_held_is_no_dead_channel() -> None:
    moving = np.sin(np.arange(float(PERIOD)))
    test, held = measurement(), Channel("N", "force", "N", "N", 1.0, is_input=True)
    read = record({**{c.name: moving for c in test.channels}, "N": np.full(PERIOD, 300.0)})
    with_input = replace(test, channels=(*test.channels, held))
    assert without_dead_channels(with_input, [read]) == (with_input, ())
    alive, said = without_dead_channels(replace(test, channels=(*test.channels, replace(held, is_input=False))), [read])
    assert len(said) == 1
    assert alive.channels == test.channels


def test_of_what_repeats_with_an_input_the_records_are_fitted_one_by_one() -> None:
    waves = Modulation(Role.STIFFNESS, "temperature", 0.0, ((0.0, 1.0), (2.0, 1.1), (4.0, 1.0)), 4.0)
    assert Inputs({"temperature": np.array([1.0])}).active([waves, following(Role.DAMPING, 0.1)]) == (
        following(Role.DAMPING, 0.1),
    )


def test_an_input_that_nothing_can_follow_is_told() -> None:
    def channel(quantity: str, is_input: bool = True) -> Channel:
        return Channel("U", quantity, "-", "-", 1.0, is_input=is_input)

    ranges = {"temperature": (290.0, 310.0), "voltage": (2.0, 2.0)}
    given = [channel("temperature"), channel("voltage"), channel("acceleration"), channel("current", is_input=False)]
    told = idle_inputs([*given, channel("position", is_input=False)], ranges)
    assert told == [
        "Channel U (voltage) is the same in all records to fit: whether parameters follow it they cannot tell.",
        "Channel U (acceleration) takes no part: parameters do not follow this quantity.",
        "Channel U (current) takes no part; with input = true in its [[channel]] parameters may follow it.",
    ]
