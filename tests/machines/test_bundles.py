"""Carriages, screws, bearings, bolted faces and tapers: rows against matrices, closed forms and eq. 14 of the paper."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import dblquad, quad
from scipy.linalg import eigh
from test_statics import KAPPA, written

import machines
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint, write_joint
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Machine, linear_check, read_machine, response, static_point
from machines.bundles.ball_screw import screw_stiffness
from machines.bundles.hertz import groove_contact, point_contact
from machines.coupling.second_order import machine_equations
from machines.harmonic_balance.assembly import Assembly

LIBRARY = Path(machines.__file__).parent / "library"

TWO_BODIES = """
schema = "jointlib/machine/1"
[[component]]
name = "block"
kind = "rigid"
mass = 0.942
inertia = [5.9927e-4, 9.1761e-4, 1e-3]
[[component]]
name = "rail"
kind = "rigid"
mass = 2.2
inertia = [7.6785e-4, 66.867e-4, 7e-3]
"""
ON_GROUND = """
schema = "jointlib/machine/1"
[[component]]
name = "body"
kind = "rigid"
mass = 30
inertia = [0.2, 0.3, 0.25]
centre = [CENTRE]
"""
GUIDE = """
[[bundle]]
name = "guide"
kind = "linear-guide"
between = ["block", "rail"]
axes = [[1, 0, 0], [0, 0, 1]]
preload = "630 N"
stiffness = "600 N/um"
width = "25 mm"
length = 72.74613391789285e-3
"""
CARRIAGE = """
[[bundle]]
name = "guide"
kind = "linear-guide"
between = ["body", "ground"]
axes = [[1, 0, 0], [0, 0, 1]]
preload = "630 N"
kappa = 3.931408125e-8
damping = "2000 N s/m"
width = "25 mm"
height = "14 mm"
length = "70 mm"
"""
BEARINGS = """
[[bundle]]
name = "front"
kind = "bearing-pair"
between = ["body", "ground"]
axes = [[0, 0, 1]]
balls = 20
ball_diameter = "7.9 mm"
pitch_diameter = "62 mm"
contact_angle = "25 deg"
preload = "300 N"
spacing = "18 mm"
arrangement = "O"
"""
FACE = """
[[bundle]]
name = "foot"
kind = "bolted-face"
between = ["body", "ground"]
axes = [[0, 0, 1], [1, 0, 0]]
length = "120 mm"
width = "80 mm"
bolts = 4
bolt_force = "8 kN"
normal_stiffness = 4e12
"""
TAPER = """
[[bundle]]
name = "nose"
kind = "taper"
between = ["body", "ground"]
axes = [[0, 0, 1]]
diameter = "44.45 mm"
length = "60 mm"
drawbar = "10 kN"
normal_stiffness = 5e12
"""
SCREW = """
[[bundle]]
name = "drive"
kind = "ball-screw"
between = ["body", "ground"]
axes = [[1, 0, 0]]
diameter = "34 mm"
position = "400 mm"
length = "1 m"
nut_stiffness = "600 N/um"
bearing_stiffness = "900 N/um"
"""


def on_ground(folder: Path, *bundles: str, centre: str = "0, 0, 0", rest: str = "") -> Machine:
    return written(folder, ON_GROUND.replace("CENTRE", centre) + "".join(bundles) + rest)


def tangents(machine: Machine) -> tuple[Array, Array]:
    """Stiffness and damping of every joint at rest."""
    rest = np.zeros(())
    pairs = [joint.jacobian(Motion(rest, rest), joint.initial_state(rest)) for joint in machine.joints()]
    return np.array([float(k) for k, _ in pairs]), np.array([float(c) for _, c in pairs])


def matrix(machine: Machine) -> Array:
    """Stiffness of all joints at rest over the dofs of the machine."""
    J = machine.rows(machine.flexible)
    return np.asarray(J.T @ (tangents(machine)[0][:, None] * J))


def test_equation_14_of_the_paper_from_the_rows_of_a_carriage(tmp_path: Path) -> None:
    machine = written(tmp_path, TWO_BODIES + GUIDE)
    assert [c.name for c in machine.connections][:2] == ["guide.upper_left_1", "guide.upper_right_1"]
    frequencies = machine_equations(machine).natural_frequencies(tangents(machine)[0])
    # Eq. 14 with four springs k/4 at (±21, ±12.5) mm: heave, roll about X and pitch about Y, relative motion of two
    # free bodies. At 45° the guide is as stiff sideways as in heave, and so it sways and yaws as well.
    k, lx, ly = 600e6, 12.5e-3, 21e-3
    M = np.diag([0.942, 5.9927e-4, 9.1761e-4, 2.2, 7.6785e-4, 66.867e-4])
    K = np.kron([[1, -1], [-1, 1]], np.diag([k, k * lx**2, k * ly**2]))
    paper = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0)) / (2 * np.pi)
    np.testing.assert_allclose(np.sort(paper)[3:], [2656.193, 2882.106, 4800.230], atol=5e-4)
    yaw = np.sqrt(k * ly**2 * (1 / 1e-3 + 1 / 7e-3)) / (2 * np.pi)
    expected = np.sort([*paper[-3:], paper.max(), yaw])
    np.testing.assert_allclose(frequencies[-5:], expected, rtol=1e-9)
    assert np.all(frequencies[:-5] == 0)


def test_a_carriage_is_what_its_matrices_say(tmp_path: Path) -> None:
    machine = on_ground(tmp_path, CARRIAGE, centre="0.01, -0.02, 0.05")
    k = HertzGuide(630.0, KAPPA).stiffness
    # Contact lines at 45° meet the cross-section: heave and sway k each, roll with the lever arm of the O arrangement.
    arm = (25e-3 / 2 + 14e-3 / 2) * np.sqrt(0.5)
    sigma = 70e-3 / np.sqrt(12)
    own = np.diag([0.0, k, k, 2 * k * arm**2, k * sigma**2, k * sigma**2])
    # Twist of the body's centre into that of the carriage: u_c = u − ϑ × r, r the centre in machine axes.
    r = np.array([0.01, -0.02, 0.05])
    cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    T = np.block([[np.eye(3), cross], [np.zeros((3, 3)), np.eye(3)]])
    K = T.T @ own @ T
    M = np.diag([30, 30, 30, 0.2, 0.3, 0.25])
    omega = 2 * np.pi * np.geomspace(20, 3000, 60)
    direct = [np.linalg.inv(K * (1 + 1j * w * 2000.0 / k) - w**2 * M) for w in omega]
    dofs = machine.dofs
    stiffness, damping = tangents(machine)
    coupled = Assembly(machine, dofs, dofs).coupled(omega, stiffness + 1j * omega[:, None] * damping)
    scale = np.sqrt([np.abs(np.outer(np.diag(H), np.diag(H))) for H in direct])
    assert np.max(np.abs(coupled - direct) / scale) < 1e-10
    assert linear_check(machine, frequency=omega / (2 * np.pi)).passed


@pytest.mark.parametrize("arrangement", ["O", "X"])
def test_contact_lines_that_meet_outside_hold_roll_more_stiffly(tmp_path: Path, arrangement: str) -> None:
    text = CARRIAGE + f'arrangement = "{arrangement}"\n'
    machine = on_ground(tmp_path, text)
    k = HertzGuide(630.0, KAPPA).stiffness
    arm = (25e-3 / 2 + (7e-3 if arrangement == "O" else -7e-3)) * np.sqrt(0.5)
    assert matrix(machine)[3, 3] == pytest.approx(2 * k * arm**2, rel=1e-12)


def test_rows_of_a_carriage_give_the_guides_force_past_lift_off_and_couple_directions(tmp_path: Path) -> None:
    machine = on_ground(tmp_path, CARRIAGE)
    J = machine.rows(machine.flexible)
    guide = HertzGuide(630.0, KAPPA)
    sideways = {1e-6: (647.310, 647.310), 3e-6: (591.511, 1886.131), 6e-6: (513.678, 3468.109)}
    for dz, expected in sideways.items():
        for dy, said in ((0.0, None), (1e-6, expected)):
            z = J @ [0.0, dy, dz, 0.0, 0.0, 0.0]
            force = J.T @ [
                float(j.laws[0].step(Motion(x, 0 * x), x)[0]) for j, x in zip(machine.joints(), z, strict=True)
            ]
            if said is None:
                assert force[2] == pytest.approx(float(guide.force(np.array(dz), np.array(0.0))), rel=1e-12)
                assert abs(force[1]) < 1e-9
            else:
                np.testing.assert_allclose(force[1:3], said, atol=5e-4)


def test_a_central_load_leaves_rocking_alone_and_an_off_centre_one_couples_it(tmp_path: Path) -> None:
    lines = np.array([150.0, 300.0, 450.0])

    def rocking(load: str) -> Array:
        machine = on_ground(
            tmp_path, CARRIAGE, rest=f'[static]\ngravity = true\nforce = {{ "body.uz" = -1500{load} }}\n'
        )
        frf = response(machine, 1.0, lines, "body.uz", outputs=("body.uz", "body.rx", "body.ry")).frfs[0].receptance
        return np.asarray(np.abs(frf[:, 1:, 0]) / np.abs(frf[:, :1, 0]))

    assert np.max(rocking("")) < 1e-9
    roll, pitch = rocking(', "body.rx" = 10').T
    # 10 N m at 1500 N: 7 mm beside the middle.
    assert np.all(roll > 0.1)
    assert np.max(pitch) < 1e-9
    assert np.all(rocking(', "body.ry" = 30')[:, 1] > 0.1)


def test_a_mass_beside_the_guide_couples_rocking_without_any_load(tmp_path: Path) -> None:
    machine = on_ground(tmp_path, CARRIAGE, centre="0, 0.03, 0.1")
    frf = response(machine, 1.0, [150.0, 200.0, 300.0], "body.uz", outputs=("body.rx", "body.ry")).frfs[0].receptance
    assert np.all(np.abs(frf[:, 0]) > 1e-9)
    assert np.max(np.abs(frf[:, 1])) < 1e-9 * np.max(np.abs(frf[:, 0]))


def test_a_measured_guide_becomes_the_rows_of_a_carriage(tmp_path: Path) -> None:
    shutil.copy(LIBRARY / "guide.joint.toml", tmp_path)
    text = CARRIAGE.replace(
        'preload = "630 N"\nkappa = 3.931408125e-8\ndamping = "2000 N s/m"', 'joint = "guide.joint.toml"'
    )
    machine = on_ground(tmp_path, text)
    measured = read_joint(LIBRARY / "guide.joint.toml")
    rest = np.zeros(())
    k, c = (float(x) for x in measured.jacobian(Motion(rest, rest), measured.initial_state(rest)))
    J = machine.rows(machine.flexible)
    stiffness, damping = tangents(machine)
    assert (J[:, 2] ** 2 * stiffness).sum() == pytest.approx(k, rel=1e-12)
    assert (J[:, 2] ** 2 * damping).sum() == pytest.approx(c, rel=1e-12)
    ranged = replace(measured, validity={"amplitude": (0.0, 4e-6), "frequency": (10.0, 8e3)})
    write_joint(tmp_path / "guide.joint.toml", ranged)
    row = read_machine(tmp_path / "m.toml").joints()[0]
    # Along its contact line a row moves by sin 45° of what the guide moves.
    assert row.validity["amplitude"][1] == pytest.approx(4e-6 * np.sqrt(0.5))
    assert row.validity["frequency"] == (10.0, 8e3)
    write_joint(tmp_path / "guide.joint.toml", Joint((Linear(1e8), Coulomb(3.0))))
    with pytest.raises(InputError, match=r"joint .* is linear \+ coulomb, expected hertz-guide"):
        read_machine(tmp_path / "m.toml")


def test_stiffness_of_a_bearing_pair_is_the_sum_over_its_balls(tmp_path: Path) -> None:
    r, s, alpha, Z = 31e-3, 9e-3, np.deg2rad(25), 20
    C, S = np.cos(alpha), np.sin(alpha)
    gamma = 7.9e-3 * C / 62e-3
    kappa = sum(groove_contact(7.9e-3, 0.52, 2 / 7.9e-3 * x) for x in (gamma / (1 - gamma), -gamma / (1 + gamma)))
    k = 1.5 * np.cbrt(300 / (Z * S)) / kappa
    for arrangement, arm in (("O", s * C + r * S), ("X", s * C - r * S)):
        for points in (3, 6, 20):
            text = BEARINGS.replace('"O"', f'"{arrangement}"') + f"points = {points}\n"
            K = matrix(on_ground(tmp_path, text))
            radial, tilting = Z * k * C**2, Z * k * arm**2
            expected = np.diag([radial, radial, 2 * Z * k * S**2, tilting, tilting, 0.0])
            np.testing.assert_allclose(K, expected, rtol=1e-10, atol=1e-12 * radial)
    tandem = matrix(on_ground(tmp_path, BEARINGS.replace('"O"', '"tandem"')))
    # Radial motion tilts it: contact lines all point the same way.
    assert abs(tandem[0, 4]) == pytest.approx(Z * k * C * r * S, rel=1e-9)
    assert len(on_ground(tmp_path, BEARINGS).connections) == 12


def test_an_axially_loaded_pair_unloads_one_row_and_then_is_one_bearing(tmp_path: Path) -> None:
    alpha, Z = np.deg2rad(25), 20
    for load in (200.0, 3000.0):
        rest = f'[static]\nforce = {{ "body.uz" = {load} }}\n'
        machine = on_ground(tmp_path, BEARINGS, rest=rest)
        point = static_point(machine)
        forces = dict(zip(point.connections, point.force, strict=True))
        pressed, eased = forces["front.a1"], forces["front.b1"]
        assert 6 * np.sin(alpha) * (pressed - eased) == pytest.approx(load, rel=1e-9)
        if load == 3000.0:
            # Past 2.83 times the preload the second row is free, as lift-off of eq. 9 says.
            assert eased == pytest.approx(-300 / (Z * np.sin(alpha)) * Z / 6, rel=1e-12)


def test_hertz_contact_of_a_groove_is_boussinesqs_integral() -> None:
    modulus, A, B = 208e9, 60.0, 300.0
    kappa = point_contact(2 * A, 2 * B, modulus)
    reduced = modulus / (2 * (1 - 0.09))
    assert point_contact(2 * B, 2 * A, modulus) == kappa
    assert point_contact(100.0, 100.0, modulus) == pytest.approx(np.cbrt(9 * 100 / (16 * reduced**2)), rel=1e-12)
    assert point_contact(100.0, 100.0 + 1e-5, modulus) == pytest.approx(point_contact(100.0, 100.0, modulus), rel=1e-6)

    # Confocal form of the same surface displacement (Johnson 1985, eq. 3.69): A, B and δ from integrals over w.
    def integral(b: float, over: str) -> float:
        powers = {"A": (1.5, 0.5), "B": (0.5, 1.5), "d": (0.5, 0.5)}[over]

        # w = t²/(1 − t)² keeps both ends smooth.
        def value(t: float) -> float:
            w = (t / (1 - t)) ** 2
            return 2 / (1 - t) ** 2 / ((1 + w) ** powers[0] * (b**2 + w) ** powers[1])

        return float(quad(value, 0.0, 1.0, epsabs=1e-13, epsrel=1e-12)[0])

    low, high = 1e-3, 1.0
    for _ in range(60):
        b = (low + high) / 2
        low, high = (b, high) if integral(b, "B") / integral(b, "A") > B / A else (low, b)
    # With the long semi-axis 1 m: the load that makes it, and the approach under that load.
    Q = A * 4 * np.pi * reduced / (3 * integral(b, "A"))
    delta = 3 * Q / (4 * np.pi * reduced) * integral(b, "d")
    assert kappa == pytest.approx(delta / Q ** (2 / 3), rel=1e-9)


def test_a_bolted_face_is_as_stiff_as_its_integrals(tmp_path: Path) -> None:
    a, b, k = 0.12, 0.08, 4e12
    t = 0.82 * k

    def over(f: object) -> float:
        assert callable(f)
        return float(dblquad(f, -b / 2, b / 2, -a / 2, a / 2)[0])

    expected = np.diag(
        [
            t * a * b,
            t * a * b,
            k * a * b,
            k * over(lambda x, y: y * y),
            k * over(lambda x, y: x * x),
            t * over(lambda x, y: x * x + y * y),
        ]
    )
    for grid in ("[2, 2]", "[3, 4]"):
        K = matrix(on_ground(tmp_path, FACE + f"grid = {grid}\n"))
        np.testing.assert_allclose(np.sort(np.diag(K)[:3]), np.sort(np.diag(expected)[:3]), rtol=1e-10)
        rotations = sorted([expected[3, 3], expected[4, 4]])
        np.testing.assert_allclose(sorted(np.diag(K)[3:5]), rotations, rtol=1e-8)
        assert K[5, 5] == pytest.approx(expected[5, 5], rel=1e-8)
        np.testing.assert_allclose(K - np.diag(np.diag(K)), 0, atol=1e-10 * expected[2, 2])


def test_a_bolted_face_opens_where_its_bolts_are_outpulled_and_slips_at_friction(tmp_path: Path) -> None:
    def under(load: str, extra: str = "") -> Machine:
        return on_ground(tmp_path, FACE + extra, rest=f"[static]\nforce = {{ {load} }}\n")

    k, area = 4e12, 0.12 * 0.08
    for load in (33e3, -10e3, -31e3):
        point = static_point(under(f'"body.uz" = {load}'))
        assert point.dofs[2] == pytest.approx(load / (k * area), rel=1e-10)
        assert point.warnings == ()
    with pytest.raises(InputError, match="no equilibrium"):
        static_point(under('"body.uz" = -33e3'))
    with pytest.raises(InputError, match="no equilibrium"):
        static_point(under('"body.ux" = 4900'))
    sliding = static_point(under('"body.ux" = 4700'))
    assert sliding.dofs[0] == pytest.approx(4700 / (0.82 * k * area), rel=1e-9)
    # Several sliders give way bit by bit: softer before all of them slip at the same 0.15·32 kN.
    soft = static_point(under('"body.ux" = 4700', "sliders = 8\n"))
    assert soft.dofs[0] > 1.5 * sliding.dofs[0]
    with pytest.raises(InputError, match="no equilibrium"):
        static_point(under('"body.ux" = 4900', "sliders = 8\n"))


def test_a_face_stiffens_with_its_pressure(tmp_path: Path) -> None:
    base, pressed = (
        tangents(on_ground(tmp_path, FACE.replace("8 kN", load) + "reference_pressure = 1e6\n"))[0]
        for load in ("8 kN", "32 kN")
    )
    # Twice the stiffness at four times the pressure, exponent ½ assumed.
    np.testing.assert_allclose(pressed / base, 2.0, rtol=1e-12)


def test_a_taper_is_as_stiff_as_the_integrals_over_its_cone(tmp_path: Path) -> None:
    machine = on_ground(tmp_path, TAPER)
    K = matrix(machine)
    k, t, half, D, L = 5e12, 0.82 * 5e12, np.arctan(7 / 48), 44.45e-3, 60e-3
    C, S = np.cos(half), np.sin(half)

    def over(f: object) -> float:
        assert callable(f)
        return float(
            quad(lambda x: f(x, D / 2 - x * np.tan(half)) * 2 * np.pi * (D / 2 - x * np.tan(half)) / C, 0, L)[0]
        )

    area = over(lambda x, r: 1.0)
    assert K[2, 2] == pytest.approx((k * S**2 + t * C**2) * area, rel=1e-9)
    assert K[0, 0] == pytest.approx((k * C**2 + t * S**2 + t) / 2 * area, rel=1e-9)
    assert K[5, 5] == pytest.approx(t * over(lambda x, r: r * r), rel=1e-3)
    arm = over(lambda x, r: k * (x * C - r * S) ** 2 + t * (x * S + r * C) ** 2 + t * x * x) / 2
    assert K[3, 3] == pytest.approx(arm, rel=1e-3)
    # The slip forces along the cone hold what the pull leaves: p·μ·area, with p sin β + μ p cos β over the area = pull.
    slip = sum(
        j.laws[0].slip_force for c, j in zip(machine.connections, machine.joints(), strict=True) if "axial" in c.name
    )  # type: ignore[attr-defined]
    assert slip == pytest.approx(10e3 * 0.15 / (S + 0.15 * C), rel=1e-9)


def test_a_screw_is_a_chain_of_springs_by_the_nuts_position(tmp_path: Path) -> None:
    shaft = 206e9 * np.pi * 34e-3**2 / 4
    series = 1 / (1 / 600e6 + 1 / 900e6 + 0.4 / shaft)
    assert tangents(on_ground(tmp_path, SCREW))[0] == pytest.approx([series], rel=1e-12)
    both = on_ground(tmp_path, SCREW + 'mounting = "fixed-fixed"\n')
    sides = 1 / (0.4 / shaft + 1 / 900e6) + 1 / (0.6 / shaft + 1 / 900e6)
    assert tangents(both)[0] == pytest.approx([1 / (1 / 600e6 + 1 / sides)], rel=1e-12)
    place = np.linspace(0.05, 0.95, 19)
    held = [screw_stiffness(34e-3, x, 1.0, 600e6, 900e6, "fixed-fixed") for x in place]
    free = [screw_stiffness(34e-3, x, 1.0, 600e6, 900e6) for x in place]
    assert int(np.argmin(held)) == 9
    assert np.all(np.diff(free) < 0)
    twisted = tangents(on_ground(tmp_path, SCREW + 'lead = "10 mm"\n'))[0][0]
    polar = np.pi * 34e-3**4 / 32
    assert 1 / twisted - 1 / series == pytest.approx(0.4 / (79e9 * polar) * (0.01 / (2 * np.pi)) ** 2, rel=1e-6)
    preloaded = SCREW + 'nut_preload = "8 kN"\nreference_preload = "1 kN"\n'
    assert tangents(on_ground(tmp_path, preloaded))[0] == pytest.approx([1 / (1 / series - 1 / 600e6 + 1 / 1200e6)])


def test_a_screw_may_drive_one_dof_and_may_have_been_measured(tmp_path: Path) -> None:
    write_joint(tmp_path / "drive.joint.toml", Joint((Linear(2e8), Viscous(5e3))))
    text = """
schema = "jointlib/machine/1"
[[component]]
name = "table"
kind = "lumped"
dofs = ["x"]
mass = [[100.0]]
[[bundle]]
name = "drive"
kind = "ball-screw"
between = ["table.x", "ground"]
joint = "drive.joint.toml"
"""
    machine = written(tmp_path, text)
    (connection,) = machine.connections
    assert (connection.name, connection.at) == ("drive.axial", None)
    assert machine_equations(machine).natural_frequencies(tangents(machine)[0])[0] == pytest.approx(
        np.sqrt(2e8 / 100) / (2 * np.pi)
    )


def test_whatever_is_assumed_is_said(tmp_path: Path) -> None:
    machine = on_ground(tmp_path, CARRIAGE.replace('height = "14 mm"\n', ""), BEARINGS, SCREW)
    said = response(machine, 1.0, [100.0, 200.0, 300.0], "body.uz").warnings
    assert "guide (linear-guide): assumed height = 0 m, contact_angle = 45 deg." in said
    assert "front (bearing-pair): assumed rings and balls of steel (208 GPa), conformity = 0.52." in said
    assert "drive (ball-screw): assumed mounting = fixed-free, modulus = 206 GPa." in said


def test_damping_is_stated_along_the_main_direction(tmp_path: Path) -> None:
    machine = on_ground(tmp_path, BEARINGS + "damping = 900\n")
    J, c = machine.rows(machine.flexible), tangents(machine)[1]
    assert (J[:, 2] ** 2 * c).sum() == pytest.approx(900.0, rel=1e-12)


@pytest.mark.parametrize(
    ("bundle", "old", "new", "said"),
    [
        (CARRIAGE, '"linear-guide"', '"linear-gide"', "unknown bundle 'linear-gide', did you mean 'linear-guide'"),
        (CARRIAGE, "kappa", "kapa", "unknown key 'kapa', did you mean 'kappa'"),
        (CARRIAGE, 'width = "25 mm"', 'width = "-25 mm"', "width is -0.025, expected more than 0"),
        (CARRIAGE, "[0, 0, 1]]", "[1, 0, 1]]", "axes are not perpendicular"),
        (CARRIAGE, '"ground"]', '"base"]', "no component 'base'"),
        (CARRIAGE, '["body", "ground"]', '["body.uz", "ground"]', "expected rigid bodies"),
        (CARRIAGE, 'preload = "630 N"', 'preload = "630 mm"', "preload.*does not fit"),
        (BEARINGS, '"O"', '"Y"', "arrangement is 'Y'"),
        (BEARINGS, '"62 mm"', '"6 mm"', "the balls do not fit"),
        (BEARINGS, "balls = 20", "balls = 2", "at least 3"),
        (BEARINGS, 'preload = "', 'preload = "9999999', "presses its contacts in by .* mm, expected hund"),
        (FACE, "bolts = 4\n", "bolts = 4\nfriction = -1\n", "friction is -1"),
        (FACE, "bolts = 4\n", "bolts = 4\ngrid = [0, 2]\n", "grid is .0, 2., expected two whole numbers"),
        (TAPER, '"60 mm"', '"600 mm"', "diameter at the inner end"),
        (SCREW, '"400 mm"', '"1400 mm"', "position is 1.4 m, expected the nut between the bearings"),
        (SCREW, "length", "lenght", "key 'length' is missing, did you mean it by 'lenght'"),
    ],
)
def test_what_is_wrong_in_a_bundle_is_said(tmp_path: Path, bundle: str, old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        on_ground(tmp_path, bundle.replace(old, new))
    assert "\n" not in str(caught.value)


def test_loaded_balls_of_a_row_share_its_preload(tmp_path: Path) -> None:
    balls = CARRIAGE.replace("kappa = 3.931408125e-8", 'balls = 14\nball_diameter = "4 mm"')
    machine = on_ground(tmp_path, balls)
    law = machine.joints()[0].laws[0]
    assert isinstance(law, HertzContact)
    # One ball of 14 carries 45 N, through two grooves one after the other.
    assert law.indentation == pytest.approx(2 * groove_contact(4e-3, 0.53, 0.0) * 45.0 ** (2 / 3), rel=1e-12)
