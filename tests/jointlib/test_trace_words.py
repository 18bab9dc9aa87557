"""What the sentence of a trace says, and what it does not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from test_trace_path import MASS, cycle, drive, dry, measurement

from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.linear import Linear
from jointlib.loop.answer.following import unfollowed
from jointlib.loop.answer.report import Candidate, Estimate, Status, Verdict
from jointlib.loop.path import words
from jointlib.loop.path.composed.follower import Follower
from jointlib.loop.periodic import verdict
from jointlib.measurement import Channel, Mass
from jointlib.modulation import Modulation, names_of
from jointlib.parameter import Role

BEFORE = {"where": "condition folds", "joint_N": 9.0, "relative": 0.2, "joint_floor_N": 0.1, "chi2": 80.0}
AFTER = {**BEFORE, "joint_N": 0.12, "relative": 0.003, "chi2": 1.1}
FOUND = verdict.Findings({}, 1e4, 10.0, {"joint": 1e4})


def candidate(family: str, parameters: dict[str, Estimate], channel: str | None = None) -> Candidate:
    return Candidate(family, "", parameters, 1e4, (), {}, 0.99, 0.99, 1, Status.ACCEPTED, "", channel)


def test_a_rig_is_told_all_that_entered_its_files_with_sizes() -> None:
    friction = candidate("coulomb", {"coulomb.slip_force": Estimate(12.0, "N", 0.1, (11.8, 12.2))})
    late = candidate("delay", {"delay.delay": Estimate(3.1e-6, "s", 1e-7, (2.9e-6, 3.3e-6))}, "a2")
    alone = verdict.sentence(Verdict.IDENTIFIED, friction, (), (), BEFORE, AFTER, FOUND, Joint())
    both = verdict.sentence(Verdict.IDENTIFIED, friction, (late,), (), BEFORE, AFTER, FOUND, Joint())
    assert "beside it" not in alone
    assert "slip force 12.0" in both
    assert "a2" in both
    assert late.parameters["delay.delay"].words() in both


@pytest.mark.parametrize(
    ("source", "said"), [("cycles", "repeated cycles differ by 0.0013%"), ("band", "the force holds noise of 0.0013%")]
)
def test_noise_is_called_what_it_was_taken_from(source: str, said: str) -> None:
    text = words.sentence(Verdict.NOTHING_MISSING, None, None, (), (), BEFORE, BEFORE, 1.3e-5, source)
    assert said in text


def test_volts_are_told_of_the_channels_that_take_part(tmp_path: Path) -> None:
    m = measurement(tmp_path, Mass(MASS), a=(drive(dry(10.0), cycle((0.05, 0.1), 3)), "fit", None))
    control = Channel("U", "voltage", "V", "V", 1.0, is_input=True)
    assert words.volts(replace(m, channels=(*m.channels, control))) == []
    electric = tuple(replace(c, unit="V") if c.quantity == "force" else c for c in m.channels)
    assert words.volts(replace(m, channels=electric)) == [
        "Channels are in volts: force; parameters are in units of the circuit."
    ]


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (
            {"stiffness_by_temperature[0]": 0.0467, "stiffness_by_temperature[2]": -0.03},
            "4.670 ± 0.098 % at 290 K, -3.000 ± 0.098 % at 300 K, of that at 293 K",
        ),
        ({"stiffness_by_temperature": -0.0767}, "-7.670 ± 0.098 % from 290 to 300 K, of that at 293 K"),
    ],
)
def test_a_modulation_is_told_per_value_of_what_it_follows(points: dict[str, float], said: str) -> None:
    table = ((290.0, 1.0467), (293.0, 1.0), (300.0, 0.97)) if len(points) == 2 else ((290.0, 1.02301), (300.0, 0.94631))
    follower = Follower(Role.STIFFNESS, "temperature", (290.0, 291.0, 293.0, 296.0, 300.0), 293.0)
    modulation = Modulation(Role.STIFFNESS, "temperature", 293.0, table)
    joint = Joint((Linear(1e6),), modulations=(modulation,))
    found = {n: Estimate(v, "1", 5e-4, (v - 1e-3, v + 1e-3)) for n, v in points.items()}
    assert words.named(follower, found, joint) == f"that the stiffness follows the temperature: {said}"


def test_an_input_is_told_to_what_its_range_resolves() -> None:
    modulation = Modulation(Role.SLIP_FORCE, "voltage", 1.56094, ((-4.3e-5, 0.02), (1.56094, 1.0), (3.00052, 1.9)))
    follower = Follower(Role.SLIP_FORCE, "voltage", (0.0, 1.0, 1.5, 2.0, 3.0), 1.5)
    found = {
        n: Estimate(v, "1", 5e-4, (v - 1e-3, v + 1e-3)) for n, v in zip(names_of(modulation), (-0.98, 0.9), strict=True)
    }
    said = words.named(follower, found, Joint((Coulomb(10.0, 1e-3),), modulations=(modulation,)))
    assert said.endswith("% at 0 V, 90.000 ± 0.098 % at 3.0005 V, of that at 1.5609 V")


def test_a_voltage_that_nothing_follows_is_told(tmp_path: Path) -> None:
    m = measurement(tmp_path, Mass(MASS), a=(drive(dry(10.0), cycle((0.05, 0.1), 3)), "fit", None))
    control = Channel("U", "voltage", "V", "V", 1.0)
    (said,) = unfollowed((*m.channels, control))
    assert said.startswith("Channel U (voltage) takes no part")
    assert not unfollowed((*m.channels, replace(control, is_input=True)))


def test_a_number_without_a_unit_is_told_without_one() -> None:
    assert Estimate(0.0467, "1", 3.2e-4, (0.046, 0.047)).words() == "0.04670 ± 0.00063"
