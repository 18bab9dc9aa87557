"""Joints: sums of named laws, their files, their refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from samples import KAPPA, LAWS, label

from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint, write_joint
from jointlib.joint import Covariance, Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.polynomial import Polynomial
from jointlib.laws.stribeck import Stribeck
from jointlib.laws.viscous import Viscous
from jointlib.modulation import Modulation
from jointlib.parameter import Role

HEAD = 'schema = "jointlib/joint/1"\nname = "guide"\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "guide.joint.toml"
    path.write_text(HEAD + text)
    return path


def test_parts_of_one_kind_are_numbered() -> None:
    joint = Joint((Jenkins(1e7, 5.0),)) + Viscous(3.0) + Jenkins(2e7, 6.0) + Jenkins(3e7, 7.0)
    assert joint.part_names == ("jenkins", "viscous", "jenkins_2", "jenkins_3")
    assert joint.parameters["jenkins_2.slip_force"] == 6.0


def test_a_law_whose_name_begins_like_another_keeps_its_own_numbering() -> None:
    joint = Joint(tuple(law for law in LAWS if law.kind.startswith("viscous")))
    assert joint.part_names == ("viscous", "viscous_by_direction")


def test_a_sum_stays_flat() -> None:
    joint = Joint((Viscous(1.0),)) + (Joint((Viscous(2.0),)) + Coulomb(3.0))
    assert [law.kind for law in joint.laws] == ["viscous", "viscous", "coulomb"]


def test_parameters_can_be_replaced_by_name_in_tables_too() -> None:
    joint = Joint((next(law for law in LAWS if isinstance(law, Polynomial)), Viscous(3.0)))
    changed = joint.with_parameters({"polynomial.coefficients[1][0]": 7.0, "viscous.damping": 4.0})
    assert changed.parameters["polynomial.coefficients[1][0]"] == 7.0
    assert changed.parameters["viscous.damping"] == 4.0
    with pytest.raises(InputError, match=r"no parameter 'viscous.dampin', did you mean 'viscous.damping'\?"):
        joint.with_parameters({"viscous.dampin": 4.0})


@pytest.mark.parametrize("law", LAWS, ids=label)
def test_a_joint_file_reads_back_bit_for_bit(law: object, tmp_path: Path) -> None:
    joint = Joint(
        (law, Viscous(503.1)),  # type: ignore[arg-type]
        "guide",
        frozenset({"viscous.damping"}),
        {"amplitude": (0.0, 1.0 / 3e5)},
        None,
        {"files": {"a.csv": "00ff"}},
    )
    write_joint(tmp_path / "a.joint.toml", joint)
    assert read_joint(tmp_path / "a.joint.toml") == joint


def test_covariance_travels_with_the_file(tmp_path: Path) -> None:
    matrix = np.array([[4.0, 1e-9], [1e-9, 1e-18]])
    covariance = Covariance(("hertz_guide.preload", "hertz_guide.kappa"), matrix)
    write_joint(tmp_path / "a.joint.toml", Joint((HertzGuide(630.0, KAPPA),), covariance=covariance))
    found = read_joint(tmp_path / "a.joint.toml").covariance
    assert found is not None
    assert found.names == covariance.names
    np.testing.assert_array_equal(found.matrix, matrix)
    assert found.standard_error("hertz_guide.preload") == 2.0


def test_state_of_a_sum_is_carried_part_by_part() -> None:
    z = 3e-6 * np.sin(np.linspace(0, 12, 400))
    one, two = Jenkins(1e7, 5.0), Jenkins(3e7, 20.0)
    together = Joint((one, Viscous(2.0), two)).force_along(z, np.zeros_like(z))
    apart = Joint((one,)).force_along(z, np.zeros_like(z)) + Joint((two,)).force_along(z, np.zeros_like(z))
    np.testing.assert_allclose(together, apart, rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[law]]\nkind = "hertz-guid"\n', "unknown law 'hertz-guid', did you mean 'hertz-guide'?"),
        ('[[law]]\nkind = "viscous"\ndamping = 5\ndampin = 3\n', "unknown key 'dampin', did you mean 'damping'?"),
        ('[[law]]\nkind = "viscous"\n', "key 'damping' is missing"),
        (
            '[[law]]\nkind = "viscous"\ndamping = "5 N/mm"\n',
            "damping: unit 'N/mm' does not fit, expected one like 'N s/m'",
        ),
        ('[[law]]\nkind = "viscous"\ndamping = nan\n', "expected a finite value"),
        ('[[law]]\nkind = "viscous"\ndamping = -5\n', "expected at least 0 N s/m"),
        ('[[law]]\nkind = "hertz-guide"\npreload = 0\nkappa = 1e-8\n', "expected above 0 N"),
        ('[[law]]\nkind = "polynomial"\ncoefficients = [[1, 2], [3]]\n', "expected a list of rows of equal length"),
        ('[[law]]\nkind = "viscous"\ndamping = 5\nfixed = ["dampin"]\n', "did you mean 'damping'?"),
        ("", "no [[law]]"),
        ('[[law]]\nkind = "viscous"\ndamping = 5\n[validity]\namplitude = [2, 1]\n', "expected low before high"),
        (
            '[[law]]\nkind = "viscous"\ndamping = 5\n[covariance]\nnames = ["viscous.c"]\nmatrix = [[1]]\n',
            "viscous.damping",
        ),
        ('[[law]]\nkind = "viscous\n', "not valid TOML"),
        ('[[law]]\nkind = "contact-loss"\nstiffness = 1e6\nclearance = 0\nside = 2\n', "expected 1 or -1"),
    ],
)
def test_a_wrong_joint_file_gets_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refusal:
        read_joint(written(tmp_path, text))
    assert said in str(refusal.value)
    assert str(refusal.value).startswith(str(tmp_path / "guide.joint.toml"))
    assert "\n" not in str(refusal.value)


def test_a_stribeck_bump_points_up() -> None:
    with pytest.raises(InputError, match="static_force"):
        Stribeck(30.0, 20.0, 0.01)


def test_a_file_of_another_kind_is_named(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text('schema = "jointlib/machine/1"\n')
    with pytest.raises(InputError, match='expected "jointlib/joint/1"'):
        read_joint(path)
    with pytest.raises(InputError, match="no such file"):
        read_joint(tmp_path / "absent.toml")


WARM = Modulation(Role.STIFFNESS, "temperature", 293.0, ((293.0, 1.0), (313.0, 0.9), (333.0, 0.7)))
BALLS = Modulation(Role.STIFFNESS, "position", 0.0, ((0.0, 1.0), (2e-3, 1.1), (6e-3, 0.9)), 8e-3)
LOOSE = Modulation(Role.SLIP_FORCE, "preload", 900.0, ((0.0, 0.0), (900.0, 1.0)))


def test_a_factor_runs_straight_between_the_points_and_stays_at_the_ends() -> None:
    assert WARM.factor(303.0) == pytest.approx(0.95)
    assert WARM.factor(323.0) == pytest.approx(0.8)
    assert WARM.factor(400.0) == 0.7
    assert WARM.factor(0.0) == 1.0
    assert [WARM.covers(x) for x in (292.9, 293.0, 333.0, 333.1)] == [False, True, True, False]


def test_a_factor_that_repeats_goes_on_in_both_directions() -> None:
    for x in (0.0, 1e-3, 5e-3, 7e-3):
        for turns in (-3, 1, 100):
            assert BALLS.factor(x + 8e-3 * turns) == pytest.approx(BALLS.factor(x))
    assert BALLS.factor(7e-3) == pytest.approx(0.95)  # half way back from 0.9 at 6 mm to 1 at 8 mm
    assert BALLS.covers(-55.0)


def test_conditions_scale_the_parameters_of_a_role_in_every_part() -> None:
    joint = Joint((Jenkins(4e7, 36.0), Linear(6e8), Viscous(500.0)), modulations=(WARM, BALLS, LOOSE))
    now = joint.at({"temperature": 313.0, "position": 2e-3, "preload": 450.0})
    assert now.modulations == ()
    expected = {
        "jenkins.stiffness": 0.9 * 1.1 * 4e7,
        "linear.stiffness": 0.9 * 1.1 * 6e8,
        "jenkins.slip_force": 18.0,
        "viscous.damping": 500.0,
    }
    for name, value in expected.items():
        assert now.parameters[name] == pytest.approx(value)
    z = np.linspace(-1e-6, 1e-6, 7)
    at_reference = joint.at({"temperature": 293.0, "position": 0.0, "preload": 900.0})
    np.testing.assert_allclose(at_reference.force_along(z, z), joint.force_along(z, z), rtol=1e-15)


def test_a_table_of_entries_is_scaled_entry_by_entry() -> None:
    warm = Modulation(Role.STIFFNESS, "time", 0.0, ((0.0, 1.0), (10.0, 0.5)))
    joint = Joint(tuple(law for law in LAWS if law.kind == "iwan")[:1], modulations=(warm,))
    before, after = joint.parameters, joint.at({"time": 10.0}).parameters
    for name in before:
        assert after[name] == (0.5 if "stiffness" in name else 1.0) * before[name]


def test_modulations_stay_with_a_joint_that_is_added_to_or_refitted() -> None:
    joint = Joint((Linear(6e8),), modulations=(WARM,))
    assert (joint + Viscous(1.0)).modulations == (WARM,)
    assert (joint + Joint((Viscous(1.0),), modulations=(LOOSE,))).modulations == (WARM, LOOSE)
    assert joint.with_parameters({"linear.stiffness": 5e8}).modulations == (WARM,)


def test_a_condition_that_is_needed_must_be_given() -> None:
    joint = Joint((Linear(6e8),), modulations=(WARM,))
    with pytest.raises(InputError, match="its stiffness depends on temperature, which is not given"):
        joint.at({"position": 0.1})
    with pytest.raises(InputError, match="no condition 'temprature', did you mean 'temperature'"):
        joint.at({"temprature": 300.0})


def test_modulations_travel_with_the_file(tmp_path: Path) -> None:
    awkward = Modulation(Role.DAMPING, "time", 1 / 3, ((1 / 3, 1.0), (1.0, 1 / 7)))
    joint = Joint((Linear(6e8),), "guide", modulations=(WARM, BALLS, LOOSE, awkward))
    write_joint(tmp_path / "a.joint.toml", joint)
    assert read_joint(tmp_path / "a.joint.toml") == joint


MODULATED = """[[law]]
kind = "linear"
stiffness = "25 N/um"
[[modulation]]
role = "slip-force"
condition = "position"
reference = "10 mm"
table = [["10 mm", 1], [0.02, 0.8], ["3 cm", 0.9]]
period = "25 mm"
"""


def test_a_modulation_is_read_with_its_units(tmp_path: Path) -> None:
    (found,) = read_joint(written(tmp_path, MODULATED)).modulations
    assert found == Modulation(Role.SLIP_FORCE, "position", 0.01, ((0.01, 1.0), (0.02, 0.8), (0.03, 0.9)), 0.025)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("slip-force", "slip force", "role is 'slip force', did you mean 'slip-force'?"),
        (
            "position",
            "where",
            "condition is 'where', expected one of current, preload, speed, temperature, time or 3 others",
        ),
        ("10 mm", "10 N", "reference: unit 'N' does not fit, expected one like 'm'"),
        ('["10 mm", 1]', '["10 kg", 1]', "table[0][0]: unit 'kg' does not fit"),
        ('["10 mm", 1]', '["10 mm"]', "expected rows [position, factor]"),
        ("0.02", "0.04", "row 2 of the table is not above the one before, expected rising conditions"),
        ("0.8", "-0.8", "a factor is -0.8, expected at least 0"),
        ('["10 mm", 1]', '["10 mm", 0.9]', "the factor at the reference is 0.9, expected 1"),
        ("25 mm", "15 mm", "the table spans 0.02, expected at most the period of 0.015"),
        ("25 mm", "20 mm", "the factor jumps by -0.1 after a period, expected the table to close"),
        ("25 mm", "0 mm", "period is 0, expected more than 0"),
        ("period", "perod", "unknown key 'perod', did you mean 'period'?"),
        ("table = ", "tabel = ", "key 'table' is missing, did you mean it by 'tabel'?"),
        ("[[modulation]]", "[[modulations]]", "unknown key 'modulations', did you mean 'modulation'?"),
        ('[["10 mm", 1], [0.02, 0.8], ["3 cm", 0.9]]', "[]", "the table is empty"),
    ],
)
def test_a_wrong_modulation_gets_one_sentence(old: str, new: str, said: str, tmp_path: Path) -> None:
    assert old in MODULATED
    with pytest.raises(InputError) as refusal:
        read_joint(written(tmp_path, MODULATED.replace(old, new, 1)))
    assert said in str(refusal.value)
    assert str(refusal.value).startswith(str(tmp_path / "guide.joint.toml"))
    assert "\n" not in str(refusal.value)


def test_every_name_that_the_package_offers_is_there() -> None:
    import jointlib

    assert all(getattr(jointlib, name) is not None for name in jointlib.__all__)
