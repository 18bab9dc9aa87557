"""Joints that were measured as a whole, shared among the contacts of bearings and faces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from samples import LAWS, label
from scipy.linalg import eigh
from test_bundles import BEARINGS, FACE, ON_GROUND, SCREW, matrix, on_ground, tangents
from test_statics import written

from jointlib.errors import InputError
from jointlib.io.joint_file import write_joint
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import linear_check, response, static_point
from machines.bundles.shared import shared

PRELOAD, KAPPA, ANGLE = 900.0, 4e-8, np.deg2rad(25)
GUIDE = Joint((HertzGuide(PRELOAD, KAPPA, ANGLE), Viscous(700.0)))
PAIR = BEARINGS[: BEARINGS.index("balls")] + 'joint = "pair.joint.toml"\npitch_diameter = "62 mm"\n'
PAIR += 'spacing = "18 mm"\narrangement = "O"\n'
BARE = FACE[: FACE.index("bolts")]
SLIDING = Joint((Iwan((3e8, 2e8), (900.0, 2500.0)), Viscous(400.0)), validity={"amplitude": (0.0, 2e-5)})
PRESSED = Joint((Linear(8e9), Viscous(900.0)))


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS, ids=label)
def test_a_share_of_a_joint_has_that_share_of_its_force(law: JointLaw) -> None:
    """At any motion, through all its memory, or as a describing function where there is no time."""
    whole, part = Joint((law,)), shared(Joint((law,)), 0.3)
    A, w = np.geomspace(1e-7, 1e-4, 7), 900.0
    gain = whole.first_harmonic(A, w).gain
    assert np.max(np.abs(part.first_harmonic(A, w).gain - 0.3 * gain)) <= 1e-9 * np.max(np.abs(gain))
    if not law.in_time:
        return
    t = np.linspace(0, 0.02, 400)
    z = 3e-6 * (np.sin(w * t) + 0.4 * np.sin(2.7 * w * t))
    v, forces = np.gradient(z, t), []
    for joint in (whole, part):
        state, out = joint.initial_state(z[0]), []
        for i in range(len(t)):
            f, state = joint.step(Motion(z[i], v[i], t[1]), state)
            out.append(float(f))
        forces.append(np.array(out))
    assert np.max(np.abs(forces[1] - 0.3 * forces[0])) < 1e-9 * np.max(np.abs(forces[0]))


@pytest.mark.parametrize("points", [3, 6])
@pytest.mark.parametrize("arrangement", ["O", "X"])
def test_a_pair_measured_along_its_axis_is_that_guide_again(arrangement: str, points: int, tmp_path: Path) -> None:
    write_joint(tmp_path / "pair.joint.toml", GUIDE)
    text = PAIR.replace('"O"', f'"{arrangement}"') + f"points = {points}\n"
    machine = on_ground(tmp_path, text)
    assert len(machine.connections) == 2 * points
    J, (k, c), rest = machine.rows(machine.flexible), tangents(machine), np.zeros(())
    stiffness, damping = (float(x) for x in GUIDE.jacobian(Motion(rest, rest), GUIDE.initial_state(rest)))
    assert (J[:, 2] ** 2 * k).sum() == pytest.approx(stiffness, rel=1e-12)
    assert (J[:, 2] ** 2 * c).sum() == pytest.approx(damping, rel=1e-12)
    # Radially cos²/2 over sin² of it, as contact lines lie.
    assert (J[:, 0] ** 2 * k).sum() == pytest.approx(stiffness / 2 / np.tan(ANGLE) ** 2, rel=1e-12)
    # Loaded until one bearing is free, and past that.
    for z in (2e-6, -8e-6, 2 * KAPPA * PRELOAD ** (2 / 3) / np.sin(ANGLE)):
        axial = sum(
            float(row[2]) * float(joint.step(Motion(np.array(row[2] * z), rest), joint.initial_state(rest))[0])
            for row, joint in zip(J, machine.joints(), strict=True)
        )
        force = float(GUIDE.step(Motion(np.array(z), rest), GUIDE.initial_state(rest))[0])
        assert axial == pytest.approx(force, rel=1e-10)


def test_a_pair_takes_the_range_of_its_joint_and_no_other_law(tmp_path: Path) -> None:
    write_joint(tmp_path / "pair.joint.toml", replace(GUIDE, validity={"amplitude": (0.0, 4e-6)}))
    machine = on_ground(tmp_path, PAIR)
    assert machine.joints()[0].validity["amplitude"][1] == pytest.approx(4e-6 * np.sin(ANGLE))
    with pytest.raises(InputError, match="joint is given for a tandem"):
        on_ground(tmp_path, PAIR.replace('"O"', '"tandem"'))
    with pytest.raises(InputError, match="unknown key 'balls'"):
        on_ground(tmp_path, PAIR + "balls = 20\n")
    write_joint(tmp_path / "pair.joint.toml", PRESSED)
    with pytest.raises(InputError, match=r"bearing-pair: joint .* is linear \+ viscous, expected hertz-guide"):
        on_ground(tmp_path, PAIR)


def test_a_face_shares_the_joints_that_were_measured_on_the_whole_of_it(tmp_path: Path) -> None:
    write_joint(tmp_path / "slide.joint.toml", SLIDING)
    write_joint(tmp_path / "press.joint.toml", PRESSED)
    text = BARE + 'tangential_joint = "slide.joint.toml"\nnormal_joint = "press.joint.toml"\ngrid = [2, 3]\n'
    machine = on_ground(tmp_path, text)
    K = matrix(machine)
    np.testing.assert_allclose(np.diag(K)[:3], [5e8, 5e8, 8e9], rtol=1e-12)
    # Evenly spread over 120 × 80 mm: rocking is normal stiffness times the second moment, twist that of the plane.
    np.testing.assert_allclose(sorted(np.diag(K)[3:5]), [8e9 * 0.08**2 / 12, 8e9 * 0.12**2 / 12], rtol=1e-10)
    assert K[5, 5] == pytest.approx(5e8 * (0.08**2 + 0.12**2) / 12, rel=1e-10)
    assert not any("assumed" in warning for warning in response(machine, 1.0, [50.0, 60.0, 70.0], "body.ux").warnings)
    assert machine.joints()[1].validity == SLIDING.validity
    # Under a slow load in the plane the face creeps along the measured curve, its patches together.
    loaded = on_ground(tmp_path, text, rest='[static]\nforce = { "body.ux" = 1500 }\n')
    z = static_point(loaded).dofs[0]
    assert z == pytest.approx(900 / 3e8 + (1500 - 900 - 2e8 * 900 / 3e8) / 2e8, rel=1e-6)
    with pytest.raises(InputError, match="no equilibrium"):
        static_point(on_ground(tmp_path, text, rest='[static]\nforce = { "body.ux" = 3500 }\n'))


def test_a_face_may_be_measured_one_way_only(tmp_path: Path) -> None:
    write_joint(tmp_path / "slide.joint.toml", Joint((Jenkins(5e8, 3400.0),)))
    write_joint(tmp_path / "press.joint.toml", PRESSED)
    across = on_ground(tmp_path, FACE + 'tangential_joint = "slide.joint.toml"\n')
    np.testing.assert_allclose(np.diag(matrix(across))[:3], [5e8, 5e8, 4e12 * 0.12 * 0.08], rtol=1e-12)
    assert "assumed" not in " ".join(response(across, 1.0, [50.0, 60.0, 70.0], "body.uz").warnings)
    along = BARE + 'normal_joint = "press.joint.toml"\npreload = "30 kN"\ntangential_stiffness = 1e11\n'
    machine = on_ground(tmp_path, along)
    np.testing.assert_allclose(np.diag(matrix(machine))[:3], [9.6e8, 9.6e8, 8e9], rtol=1e-12)
    assert sum(j.parameters.get("jenkins.slip_force", 0.0) for j in machine.joints()) == pytest.approx(2 * 0.15 * 30e3)
    with pytest.raises(InputError, match="key 'tangential_stiffness' is missing"):
        on_ground(tmp_path, along.replace("tangential_stiffness = 1e11\n", ""))
    with pytest.raises(InputError, match="unknown key 'normal_stiffness'"):
        on_ground(tmp_path, along + "normal_stiffness = 4e12\n")


@pytest.mark.slow
def test_a_nut_of_its_own_stands_in_series_with_shaft_and_bearings(tmp_path: Path) -> None:
    """Screw of 8 kg between; with a stiff linear nut the chain is that of the bundle with it."""
    screw = '[[component]]\nname = "screw"\nkind = "lumped"\ndofs = ["x"]\nmass = [[8.0]]\n'
    nut = '[[connection]]\nname = "nut"\nbetween = ["body.ux", "screw.x"]\njoint = "nut.joint.toml"\n'
    drive = SCREW.replace('["body", "ground"]', '["screw.x", "ground"]').replace('nut_stiffness = "600 N/um"\n', "")
    write_joint(tmp_path / "nut.joint.toml", Joint((Linear(6e8),)))
    text = ON_GROUND.replace("CENTRE", "0, 0, 0") + screw + nut + drive + "without_nut = true\n"
    machine = written(tmp_path, text)
    k = tangents(machine)[0]
    together = tangents(on_ground(tmp_path, SCREW))[0][0]
    assert 1 / (1 / k[0] + 1 / k[1]) == pytest.approx(together, rel=1e-12)
    # A preloaded nut that is not linear: about where one side is unloaded it is softest.
    law = HertzGuide(400.0, 3e-8, np.deg2rad(45))
    write_joint(tmp_path / "nut.joint.toml", Joint((law, Viscous(900.0))))
    machine = written(tmp_path, text)
    assert linear_check(machine, frequency=np.linspace(50, 2000, 40)).passed
    found = response(machine, [0.02, 2.0], [300.0, 500.0], "body.ux", points=80)
    small, large = (found.peaks_of("nut", force)[0] for force in (0.02, 2.0))
    for peak in (small, large):
        nut = float(law.describing_function(peak.amplitude).real)
        chain = eigh([[k[1] + nut, -nut], [-nut, nut]], np.diag([8.0, 30.0]), eigvals_only=True)
        assert peak.frequency == pytest.approx(np.sqrt(chain[0]) / (2 * np.pi), rel=1e-3)
    assert large.frequency < small.frequency
    with pytest.raises(InputError, match="key 'nut_stiffness' is missing"):
        on_ground(tmp_path, SCREW.replace('nut_stiffness = "600 N/um"\n', ""))
