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
from jointlib.laws.stribeck import Stribeck
from jointlib.laws.viscous import Viscous

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
    joint = Joint((LAWS[1], Viscous(3.0)))
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
