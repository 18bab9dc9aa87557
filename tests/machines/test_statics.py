"""The static working point: forces in balance, found a second way by energy, by settling in time or in closed form."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.cubic import Cubic
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Modal, Rigid, StaticLoad, linear_check, read_machine, static_point

KAPPA = 3.931408125e-8
CARRIAGE = """
schema = "jointlib/machine/1"
[[component]]
name = "slide"
kind = "rigid"
mass = 40
inertia = [0.2, 0.3, 0.4]
centre = [0.0, 0.002, 0.08]
[[bundle]]
name = "guide"
kind = "linear-guide"
between = ["slide", "ground"]
axes = [[1, 0, 0], [0, 0, 1]]
preload = "630 N"
kappa = 3.931408125e-8
width = "25 mm"
height = "12 mm"
length = "70 mm"
points = 3
[static]
gravity = true
force = { "slide.uz" = "LOAD N", "slide.ry" = 5 }
"""


def hung(load: float, *laws: JointLaw, mass: float = 60.0) -> Machine:
    """One mass on one joint, a constant force on it."""
    part = Lumped("slide", ("z",), np.array([[mass]]))
    connection = Connection("guide", ("slide.z", "ground"), Joint(laws))
    return Machine((part,), (connection,), drive="slide.z", static=StaticLoad(force={"slide.z": load}))


def written(folder: Path, text: str) -> Machine:
    path = folder / "m.toml"
    path.write_text(text, encoding="utf-8")
    return read_machine(path)


def test_a_part_far_stiffer_than_what_holds_it_stands_at_rest() -> None:
    # Its springs of 1e14 N/m round off more of the forces than what is else taken for balanced.
    links = 1e14 * (2 * np.eye(40) - np.eye(40, k=1) - np.eye(40, k=-1))
    links[0, 0] = links[-1, -1] = 1e14
    bar = Lumped("bar", tuple(f"z{i}" for i in range(40)), 0.3 * np.eye(40), stiffness=links)
    bed = Lumped("bed", ("z",), np.array([[3000.0]]))
    feet = [Connection(f"foot{i}", (f"bar.z{i}", "bed.z"), Joint((Linear(1.5e8), Cubic(1e18)))) for i in (0, 20, 39)]
    mount = Connection("mount", ("bed.z", "ground"), Joint((Linear(1e8),)))
    load = StaticLoad(force={f"bar.z{i}": 3.0 for i in range(40)} | {"bed.z": 3e4})
    point = static_point(Machine((bar, bed), (*feet, mount), static=load))
    assert point.force == pytest.approx([40.0, 40.0, 40.0, 30120.0], rel=1e-4)


@pytest.mark.parametrize("load", [0.0, 300.0, -1500.0, 2520.0, 4000.0, 40000.0])
def test_a_guide_yields_to_a_load_as_its_inverse_law_says(load: float) -> None:
    guide = HertzGuide(630.0, KAPPA)
    z, force = static_point(hung(load, guide, Viscous(500.0))).of("guide")
    assert force == pytest.approx(load, rel=1e-11, abs=1e-9)
    assert guide.force(np.array(z), np.array(0.0)) == pytest.approx(load, rel=1e-11, abs=1e-9)
    if load == 4000.0:
        # By the lower row alone: 4000 N = 2 sin φ P0 (1 + u)^1.5.
        assert z == pytest.approx(7.033779e-6, rel=1e-6)


def test_a_lever_beyond_all_machines_still_settles(tmp_path: Path) -> None:
    """At a joint a thousand kilometres off rounding leaves more of the forces than balance asks for elsewhere."""
    library = Path(__file__).parents[2] / "machines" / "library"
    near = '["bed", "ground"], at = [-0.35, 0.0, -0.3], direction = [0, 0, 1], joint = "mount.joint.toml"'
    text = (library / "lathe.toml").read_text("utf-8")
    assert near in text
    for joint in library.glob("*.joint.toml"):
        shutil.copy(joint, tmp_path)
    point = static_point(written(tmp_path, text.replace(near, near.replace("0.0", "1e6", 1), 1)))
    balance, y = point.balance, np.linalg.lstsq(point.balance.transform, point.coordinates, rcond=None)[0]
    left = balance.stiffness @ y + balance.rows.T @ point.force - balance.load
    assert np.linalg.norm(left) < 1e-5 * np.linalg.norm(balance.load)


@pytest.mark.parametrize("load", ["-500", "-8000", "6000"])
def test_a_carriage_settles_where_its_energy_is_least(tmp_path: Path, load: str) -> None:
    machine = written(tmp_path, CARRIAGE.replace("LOAD", load))
    point = static_point(machine)
    lost = np.array(
        ["lost contact" in "".join(w for w in point.warnings if w.startswith(n)) for n in point.connections]
    )
    assert np.any(lost) == (load != "-500")
    J = machine.rows(machine.flexible)[:, 1:] * 1e-6
    laws = [joint.laws[0] for joint in machine.joints()]
    contacts = [law for law in laws if isinstance(law, HertzContact)]
    P, d = (np.array([getattr(c, key) for c in contacts]) for key in ("preload", "indentation"))
    # In micrometres and microradians; travel, which nothing holds, is left out.
    F = np.array([0.0, float(load) - 40 * 9.80665, 0.0, 5.0, 0.0]) * 1e-6

    def energy(q: np.ndarray) -> float:
        z = J @ q
        return float(np.sum(P * (0.4 * d * np.maximum(1 + z / d, 0) ** 2.5 - z)) - F @ q) * 1e6

    def slope(q: np.ndarray) -> np.ndarray:
        z = J @ q
        return np.asarray((J.T @ (P * (np.maximum(1 + z / d, 0) ** 1.5 - 1)) - F) * 1e6)

    found = minimize(energy, np.zeros(5), jac=slope, method="BFGS", options={"gtol": 1e-9, "maxiter": 2000})
    # BFGS ends where the gradient is lost in the rounding of the energy.
    np.testing.assert_allclose(found.x, point.dofs[1:] * 1e6, rtol=0, atol=1e-5 * np.max(np.abs(found.x)))
    balance = J.T @ point.force
    np.testing.assert_allclose(balance, F, rtol=0, atol=1e-11 * np.sum(np.abs(point.force)) * 1e-6)


def test_two_masses_settle_in_time_where_the_balance_puts_them() -> None:
    guide, stop = HertzGuide(630.0, KAPPA), ContactLoss(-4e8, 1e-6, 1.0)
    upper = Lumped("upper", ("z",), np.array([[60.0]]))
    base = Lumped("base", ("z",), np.array([[100.0]]), np.array([[2e5]]), np.array([[3e8]]))
    connections = (
        Connection("guide", ("upper.z", "base.z"), Joint((guide, Viscous(1e5)))),
        Connection("foot", ("base.z", "ground"), Joint((stop,))),
    )
    load = StaticLoad((0.0, 0.0, -9.81), {"upper.z": -3000.0, "base.z": 8000.0}, {"guide": 2e-6, "foot": 0.5e-6})
    point = static_point(Machine((upper, base), connections, static=load))

    def motion(_: float, x: np.ndarray) -> list[float]:
        at, rest = np.array(x[0] - x[1] + 2e-6), np.array(x[2] - x[3])
        joint = float(guide.force(at, rest)) + 1e5 * float(rest)
        foot = 3e8 * x[1] + 2e5 * x[3] + float(stop.force(np.array(x[1] + 0.5e-6), np.array(0.0)))
        return [x[2], x[3], (-3000 - 60 * 9.81 - joint) / 60, (8000 - 100 * 9.81 + joint - foot) / 100]

    end = solve_ivp(motion, (0.0, 0.2), np.zeros(4), rtol=1e-10, atol=1e-13, method="LSODA").y[:, -1]
    np.testing.assert_allclose(end[:2], point.dofs, rtol=1e-6)
    assert point.of("foot")[0] > 1e-6
    assert point.of("guide")[0] == pytest.approx(point.dofs[0] - point.dofs[1] + 2e-6, rel=1e-12)


def test_friction_carries_its_share_until_it_slips() -> None:
    k, kt, slip = 2e8, 1e8, 30.0
    for load in (50.0, 89.0, 91.0, 300.0):
        z, _ = static_point(hung(load, Linear(k), Jenkins(kt, slip))).of("guide")
        assert z == pytest.approx(load / (k + kt) if load < 90 else (load - slip) / k, rel=1e-12)
    several = static_point(hung(100.0, Linear(k), Iwan((6e7, 4e7), (6.0, 400.0)))).of("guide")[0]
    assert several == pytest.approx((100.0 - 6.0) / (k + 4e7), rel=1e-12)


def test_weight_acts_along_the_axes_that_dofs_are_named_after() -> None:
    lumped = Lumped("a", ("x", "uz_2", "other"), np.array([[2.0, 0.0, 0.0], [0.0, 3.0, 0.5], [0.0, 0.5, 4.0]]))
    np.testing.assert_allclose(lumped.weight(np.array([1.0, 7.0, -10.0])), [2.0, -30.0, -5.0])
    shapes = np.ones((3, 1))
    modal = Modal("b", ("z_1", "z_2", "y"), np.array([50.0]), np.array([0.01]), shapes, mass=12.0, carries=("z_2",))
    weight = modal.weight(np.array([0.0, 0.0, -10.0]))
    assert weight is not None
    np.testing.assert_allclose(weight, [0.0, -120.0, 0.0])
    body = Rigid("c", 5.0, np.ones(3), np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(body.weight(np.array([0.0, -2.0, 0.0])), [0, -10, 0, 0, 0, 0])
    with pytest.raises(InputError, match="several dofs move along z, expected carries"):
        Modal("b", ("z_1", "z_2"), np.array([50.0]), np.array([0.01]), shapes[:2], mass=1.0).weight(np.ones(3))


def test_a_spring_mass_sags_under_its_weight_with_or_without_joints() -> None:
    part = Lumped("slide", ("z",), np.array([[60.0]]), None, np.array([[1e6]]))
    point = static_point(Machine((part,), static=StaticLoad((0.0, 0.0, -9.81))))
    np.testing.assert_allclose(point.dofs, -60 * 9.81 / 1e6, rtol=1e-12)
    assert point.force.shape == (0,)


def test_the_linear_check_holds_at_the_working_point_and_its_resonance_is_that_of_the_tangent() -> None:
    guide = HertzGuide(630.0, KAPPA)
    machine = hung(1500.0, guide, Viscous(500.0))
    check = linear_check(machine)
    z = static_point(machine).of("guide")[0]
    tangent = float(guide.slopes(np.array(z), np.array(0.0))[0])
    assert check.passed
    assert check.stiffness[0] == pytest.approx(tangent, rel=1e-12)
    assert tangent < 0.98 * guide.stiffness
    assert check.resonance == pytest.approx(np.sqrt(tangent / 60) / (2 * np.pi), rel=1e-9)


@pytest.mark.parametrize(
    ("machine", "said"),
    [
        (lambda: hung(-700.0, HertzContact(630.0, KAPPA)), "no equilibrium.*'guide' gives way.*-630 N"),
        (lambda: hung(6000.0, Linear(654.164e6), Cubic(-1.7083e18)), "no equilibrium.*'guide' gives way"),
        (lambda: hung(50.0, Jenkins(1e8, 40.0)), "no equilibrium.*stays at 40 N"),
        (lambda: hung(50.0, Linear(-1e6)), "no equilibrium.*'guide' pushes away what moves, by -1e.06 N/m"),
        (lambda: hung(1.0, Viscous(500.0)), "nothing holds slide.z against the static load"),
    ],
)
def test_without_an_equilibrium_one_sentence_says_why(machine: object, said: str) -> None:
    assert callable(machine)
    with pytest.raises(InputError, match=said) as caught:
        static_point(machine())
    assert "\n" not in str(caught.value)


def test_a_load_along_a_free_travel_is_refused_and_one_across_it_is_not(tmp_path: Path) -> None:
    text = CARRIAGE.replace("LOAD", "-500")
    assert static_point(written(tmp_path, text)).dofs[0] == pytest.approx(0.0, abs=1e-18)
    with pytest.raises(InputError, match=r"nothing holds slide\.ux"):
        static_point(written(tmp_path, text.replace('"slide.ry" = 5', '"slide.ux" = 1')))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"slide.ry" = 5', '"slide.rq" = 30', "did you mean 'slide.r"),
        ("gravity = true", 'gravity = ["1 g", 0]', "gravity.*list of 3"),
        ("gravity = true", "gravity = true\noffset = { guid = 1e-6 }", "offset names 'guid', expected a connection"),
        ("gravity = true", "gravit = true", "did you mean 'gravity'"),
        ('"LOAD N"', '"5 mm"', "unit 'mm' does not fit"),
    ],
)
def test_what_is_wrong_in_the_static_section_is_said(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = CARRIAGE.replace(old, new, 1).replace("LOAD", "-500")
    with pytest.raises(InputError, match=said):
        written(tmp_path, text)


def test_the_weight_of_a_part_without_a_mass_is_asked_for() -> None:
    part = Modal("head", ("z",), np.array([50.0]), np.array([0.01]), np.ones((1, 1)))
    with pytest.raises(InputError, match="the weight of component 'head' is not known; give its mass"):
        static_point(Machine((part,), static=StaticLoad((0.0, 0.0, -9.81))))


def test_a_joint_past_its_identified_range_is_named() -> None:
    machine = hung(1500.0, HertzGuide(630.0, KAPPA))
    joint = Joint((HertzGuide(630.0, KAPPA),), validity={"amplitude": (0.0, 1e-6)})
    (warning,) = static_point(machine.with_joint("guide", joint)).warnings
    assert "guide: stands at 2.327 um under the static load, identified up to 1 um" in warning


def test_slow_loading_is_the_limit_of_a_path_in_small_steps() -> None:
    law = Iwan((2e7, 1.5e7, 5e6), (8.0, 15.0, 13.0))
    z, state = np.linspace(0, 2e-6, 500), law.initial_state(np.array(0.0))
    for at in z:
        force, state = law.step(Motion(np.array(at), np.array(0.0), 1e-3), state)
    total = float(force) + 1e7 * 2e-6
    assert static_point(hung(total, law, Linear(1e7))).of("guide")[0] == pytest.approx(2e-6, rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_held_softly_does_not_make_a_free_motion_loaded(seed: int) -> None:
    """Stiffnesses over eight decades: the free motion is known to rounding over the softest; no force acts on it."""
    turned, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((30, 30)))
    K = (turned * np.concatenate([[0.0], np.geomspace(1.0, 1e8, 29)])) @ turned.T
    dofs = tuple(f"q{i}" for i in range(30))
    force = 1e4 * turned[:, 1:6] @ np.ones(5)
    part = Lumped("part", dofs, np.eye(30), None, (K + K.T) / 2)
    load = StaticLoad(force={f"part.{dof}": float(f) for dof, f in zip(dofs, force, strict=True)})
    point = static_point(Machine((part,), static=load))
    assert np.linalg.norm(K @ point.dofs - force) < 1e-6 * np.linalg.norm(force)
    pushed = StaticLoad(force={f"part.{dof}": float(f) for dof, f in zip(dofs, force + turned[:, 0], strict=True)})
    with pytest.raises(InputError, match="nothing holds"):
        static_point(Machine((part,), static=pushed))
