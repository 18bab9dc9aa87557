"""Laws with memory and structural damping against second routes: differential equations, Masing's rule, energy."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
from collections.abc import Callable
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from repeats import repeats
from scipy.integrate import quad, solve_ivp

from jointlib.arrays import Array
from jointlib.cli.main import cli
from jointlib.effect import JointEffect, Path, Scale
from jointlib.effects.bouc_wen import BoucWenLoop
from jointlib.effects.dahl import DahlFriction
from jointlib.effects.iwan import SLIDERS, GradualSlip
from jointlib.effects.jenkins import ElasticSlip
from jointlib.effects.jenkins_play import SlipWithPlay
from jointlib.effects.lugre import BristleFriction
from jointlib.effects.relaxation import Relaxation
from jointlib.effects.structural_damping import MaterialDamping
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint, write_joint
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.dahl import Dahl
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.lugre import LuGre
from jointlib.laws.structural_damping import StructuralDamping

K, F = 4e7, 36.0
"""N/m and N: slip over 0.9 µm."""
A = 3e-6
MEMBERS = (ElasticSlip(), SlipWithPlay(), DahlFriction(), GradualSlip(), BoucWenLoop(), BristleFriction(), Relaxation())
member = pytest.mark.parametrize("effect", MEMBERS, ids=lambda e: type(e).__name__)


def wandering(t: Array, omega: float) -> tuple[Array, Array]:
    """Displacement and velocity with reversals of many sizes."""
    z = A * (np.sin(omega * t) + 0.6 * np.sin(2.7 * omega * t + 1) - 0.6 * np.sin(1.0))
    v = A * omega * (np.cos(omega * t) + 1.62 * np.cos(2.7 * omega * t + 1))
    return z, v


def integrated(rate: Callable[[float, float, float], float], t: Array, omega: float) -> Array:
    """Solution of dq/dt = rate(q, z, v) along the wandering path, to ten digits."""

    def slope(time: float, q: Array) -> list[float]:
        z, v = wandering(np.array(time), omega)
        return [rate(float(q[0]), float(z), float(v))]

    found = solve_ivp(slope, (t[0], t[-1]), [0.0], t_eval=t, rtol=1e-10, atol=1e-13, max_step=(t[-1] - t[0]) / 4000)
    return np.asarray(found.y[0])


def along(law: JointLaw, t: Array, omega: float) -> Array:
    return Joint((law,)).force_along(*wandering(t, omega), time_step=t[1] - t[0])


@pytest.mark.thorough
def test_dahl_follows_its_differential_equation() -> None:
    t, omega = np.linspace(0, 2.0, 8001), 2 * np.pi
    expected = F * integrated(lambda q, _, v: K / F * (v - q * abs(v)), t, omega)
    # Exact between reversals; the sample in which the motion turns misses a travel of second order in the step.
    assert np.max(np.abs(along(Dahl(K, F), t, omega) - expected)) < 1e-5 * F


@pytest.mark.parametrize(
    ("exponent", "shape"), repeats([(1.0, 0.5), (1.5, 0.2), (2.0, 0.5), (3.0, 0.9)], lambda case: case[0] >= 2.0)
)
def test_bouc_wen_follows_its_differential_equation(exponent: float, shape: float) -> None:
    omega = 2 * np.pi

    def rate(u: float, _: float, v: float) -> float:
        return K / F * v * (1 - abs(u) ** exponent * (shape + (1 - shape) * np.sign(u * v)))

    t = np.linspace(0, 2.0, 8001)
    expected = F * integrated(rate, t, omega)
    errors = [np.max(np.abs(along(BoucWen(K, F, exponent, shape), t[::n], omega) - expected[::n])) for n in (32, 2)]
    assert errors[-1] < 2e-5 * F
    # Four halvings: 256 at second order, which the turning points leave, 16 at first.
    assert errors[0] / errors[-1] > 100


def test_bouc_wen_is_third_order_between_reversals() -> None:
    law, z_end = BoucWen(K, F, 2.0, 0.3), 2 * F / K
    errors = []
    for steps in (8, 16, 32):
        z = np.linspace(0, z_end, steps + 1)
        errors.append(abs(float(Joint((law,)).force_along(z, 1.0)[-1]) - F * np.tanh(2.0)))
    # df/dz = K(1 − (f/F)²) from rest is a tanh.
    assert errors[0] / errors[1] > 6
    assert errors[1] / errors[2] > 6


def test_dahl_is_bouc_wen_of_exponent_one_that_unloads_stiffer() -> None:
    t = np.linspace(0, 2.0, 2001)
    found, expected = (along(law, t, 5.0) for law in (BoucWen(K, F, 1.0, 0.0), Dahl(K, F)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * F)


@pytest.mark.thorough
def test_lugre_follows_its_differential_equation_to_second_order() -> None:
    law, omega = LuGre(K, 300.0, F, 1.6 * F, 2e-4), 40.0

    def g(v: float) -> float:
        return float(F + 0.6 * F * np.exp(-((v / 2e-4) ** 2)))

    t = np.linspace(0, 0.25, 16001)
    y = integrated(lambda q, _, v: K / F * (v - abs(v) * q * F / g(v)), t, omega) * F / K
    v = wandering(t, omega)[1]
    expected = K * y + 300.0 * (v - K * np.abs(v) * y / np.array([g(x) for x in v]))
    errors = [np.max(np.abs(along(law, t[::n], omega) - expected[::n])) for n in (32, 2)]
    assert errors[-1] < 1e-5 * F
    # Four halvings: 256 at second order, 16 at first; a turning point inside a step spoils single ratios.
    assert errors[0] / errors[-1] > 100


def test_lugre_of_constant_friction_is_dahl_with_a_damper_on_the_bristle() -> None:
    t = np.linspace(0, 2.0, 2001)
    lugre, dahl = along(LuGre(K, 0.0, F, F, 1e-3), t, 5.0), along(Dahl(K, F), t, 5.0)
    np.testing.assert_allclose(lugre, dahl, rtol=0, atol=1e-11 * F)


def test_a_step_of_any_length_ends_at_the_sliding_force() -> None:
    for law in (Dahl(K, F), BoucWen(K, F, 2.5, 0.8), BoucWen(K, F, 1.3, 0.1, 2e-7), LuGre(K, 0.0, F, F, 1e-3, 1e-7)):
        state = law.step(Motion(np.array(-1.0), np.array(-1.0), 1.0), law.initial_state(np.array(0.0)))[1]
        force, _ = law.step(Motion(np.array(1.0), np.array(1.0), 1.0), state)
        assert float(force) == pytest.approx(F, rel=1e-12)


def test_iwan_obeys_masing() -> None:
    law = Iwan((2e7, 1.5e7, 5e6), (8.0, 15.0, 13.0))
    down = np.linspace(A, -A, 501)
    loading = Joint((law,)).force_along(np.linspace(0, A, 501), 1.0)
    branch = Joint((law,)).force_along(np.concatenate([np.linspace(0, A, 501), down]), 1.0)[501:]
    # Unloading is the virgin curve, twice as large both ways.
    virgin = np.interp((A - down) / 2, np.linspace(0, A, 501), loading)
    np.testing.assert_allclose(branch, branch[0] - 2 * virgin, atol=1e-12 * F)


def test_iwan_is_the_sum_of_its_elements() -> None:
    stiffness, slip = (2e7, 1.5e7, 5e6), (8.0, 15.0, 13.0)
    t = np.linspace(0, 2.0, 1001)
    for clearance in (0.0, 3e-7):
        parts = sum(along(Jenkins(k, s, clearance), t, 5.0) for k, s in zip(stiffness, slip, strict=True))
        np.testing.assert_allclose(along(Iwan(stiffness, slip, clearance), t, 5.0), parts, atol=1e-12 * F)


def behind_play(element: JointLaw, z: Array, clearance: float) -> Array:
    """The force of an element behind play along a finely sampled path: free travel first, then the element alone."""
    x = gap = 0.0
    state, force, out = element.initial_state(np.array(0.0)), 0.0, []
    for dz in np.diff(z, prepend=z[0]):
        side = np.sign(dz)
        if force * side >= 0 and gap * side < clearance:
            gap += dz
            force = 0.0
        else:
            x += dz
            value, state = element.step(Motion(np.array(x), np.array(dz), 0.0), state)
            force = float(value)
        out.append(force)
    return np.array(out)


@pytest.mark.parametrize(
    "law",
    repeats(
        [Jenkins(K, F), Dahl(K, F), BoucWen(K, F, 1.7, 0.7), BoucWen(K, F, 2.0, 0.2), LuGre(K, 0.0, F, F, 1.0)],
        lambda law: law.kind in ("jenkins", "dahl"),
        lambda law: law.kind == "lugre",
    ),
    ids=lambda law: law.kind,
)
def test_clearance_is_play_that_is_crossed_before_the_element_moves(law: JointLaw) -> None:
    clearance, t = 4e-7, np.linspace(0, 2.0, 40001)
    z = wandering(t, 2 * np.pi)[0]
    expected = behind_play(law, z - z[0], clearance)
    found = Joint((dataclasses.replace(law, clearance=clearance),)).force_along(z - z[0], 0.0)
    # The second route meets the ends of the play one sample late: a step of travel, as a force.
    late = 3 * K * float(np.max(np.abs(np.diff(z))))
    assert late < 0.1 * F
    assert np.max(np.abs(found - expected)) < late
    # It is felt: without play the force differs by far more.
    assert np.max(np.abs(Joint((law,)).force_along(z - z[0], 0.0) - expected)) > 0.3 * F


@pytest.mark.slow
@pytest.mark.parametrize(
    "law",
    [
        Dahl(K, F),
        Dahl(K, F, 5e-7),
        BoucWen(K, F, 2.0, 0.2),
        BoucWen(K, F, 1.5, 0.8, 5e-7),
        Iwan((2e7, 2e7), (10.0, 26.0)),
        LuGre(K, 300.0, F, 1.4 * F, 5e-3),
        LuGre(K, 300.0, F, 1.4 * F, 5e-3, 5e-7),
    ],
    ids=lambda law: law.kind,
)
def test_loss_per_cycle_is_pi_a_squared_times_the_imaginary_gain(law: JointLaw) -> None:
    omega, n = 2000.0, 4000
    angle = 2 * np.pi * np.arange(8 * n + 1) / n
    z, v = A * np.cos(angle), -A * omega * np.sin(angle)
    force = Joint((law,)).force_along(z, v, 2 * np.pi / n / omega)[-n - 1 :]
    work = float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(z[-n - 1 :])))
    harmonic = law.first_harmonic(A, omega)
    # Trapezoidal work of a loop with kinks: second order in 1/n; LuGre's gain carries its own error.
    off = np.pi * A**2 * float(harmonic.error) + 1e-4 * 4 * F * A
    assert np.pi * A**2 * float(harmonic.gain.imag) == pytest.approx(work, abs=off)


@pytest.mark.parametrize(
    "law", [Dahl(K, F), BoucWen(K, F, 1.0, 0.5), BoucWen(K, F, 3.0, 0.9), LuGre(K, 0.0, F, F, 1.0)]
)
def test_small_motion_sticks_and_large_motion_rubs_with_the_slip_force(law: JointLaw) -> None:
    small, large = law.first_harmonic(1e-6 * F / K, 1.0), law.first_harmonic(1e4 * F / K, 1.0)
    assert small.gain.real == pytest.approx(K, rel=1e-5)
    assert abs(small.gain.imag) < 1e-5 * K
    # Of a rectangle, 4F/(πA); the rounded corners take away a share of F/(KA) of it.
    if not (law.kind == "bouc-wen" and getattr(law, "shape", 0) > 0.5):
        assert large.gain.imag == pytest.approx(4 * F / (np.pi * 1e4 * F / K), rel=5e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_that_stands_still_at_the_end_of_its_play_is_loaded(side: float) -> None:
    """A step that ends where it began, while the joint still moves: force and tangents are those without play."""
    c, y, v = 1e-6, side * 3e-7, np.array([0.0, 0.02, -0.02])
    for law in (LuGre(K, 900.0, F, 1.4 * F, 1e-3), Dahl(K, F), BoucWen(K, F, 1.5, 0.6)):
        motion, z = Motion(np.full(3, 1e-5), v, 1e-6), np.full(3, 1e-5)
        state = np.stack([z, np.full(3, y)], axis=-1)
        behind = np.stack([z, np.full(3, y + side * c)], axis=-1)
        with_play = dataclasses.replace(law, clearance=c)
        assert with_play.step(motion, behind)[0] == pytest.approx(law.step(motion, state)[0], rel=1e-9)
        for mine, other in zip(with_play.jacobian(motion, behind), law.jacobian(motion, state), strict=True):
            assert mine == pytest.approx(other, rel=1e-9)
        # Inside the play nothing is felt, however fast it is crossed.
        inside = np.stack([z, np.full(3, 0.4 * side * c)], axis=-1)
        assert np.all(with_play.step(motion, inside)[0] == 0)


def test_below_the_play_nothing_is_felt() -> None:
    for law in (Dahl(K, F, 1e-6), BoucWen(K, F, 2.0, 0.5, 1e-6), LuGre(K, 200.0, F, F, 1.0, 1e-6)):
        assert abs(law.describing_function(0.9e-6, 100.0)) < 1e-9 * K


def test_bouc_wen_of_shape_one_is_elastic_and_loses_nothing() -> None:
    assert abs(BoucWen(K, F, 2.0, 1.0).describing_function(A).imag) < 1e-12 * K


@pytest.mark.slow
def test_what_bouc_wen_gives_back_was_stored_before() -> None:
    """V = ∫ f dz along the unloading line never falls faster than the work that comes out, whatever the shape."""
    z = np.cumsum(np.random.default_rng(3).normal(0, 2e-8, 20000))
    for shape in (0.0, 0.5, 0.8, 0.99):
        law = BoucWen(K, F, 1.5, shape)
        u = Joint((law,)).force_along(z - z[0], 0.0) / F
        grid = np.linspace(0, 1, 20001)
        density = grid / (1 - (2 * shape - 1) * grid**1.5)
        stored = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(grid))]) * F * F / K
        V = np.interp(np.abs(u), grid, stored)
        work = np.concatenate([[0], np.cumsum(F * (u[1:] + u[:-1]) / 2 * np.diff(z))])
        # Steps are 2 % of the slip distance: their work is trapezoidal, so the sum is off by a small share.
        assert np.min(np.diff((work - V)[::100])) > -1e-3 * F * F / K


@pytest.mark.slow
def test_lugre_with_play_answers_every_amplitude_as_it_does_alone() -> None:
    law, A = LuGre(K, 300.0, F, 1.4 * F, 5e-3, 5e-7), np.linspace(1e-7, 3e-6, 5)
    together, alone = law.first_harmonic(A, 300.0), [law.first_harmonic(a, 300.0) for a in A]
    assert together.gain == pytest.approx(np.array([one.gain for one in alone]), rel=1e-9)
    assert together.error == pytest.approx(np.array([one.error for one in alone]), abs=1e-9 * K)


@pytest.mark.thorough
def test_lugre_loses_energy_at_any_speed_if_its_friction_does_not_fall() -> None:
    t = np.linspace(0, 3 * 2 * np.pi, 60001)
    z, v = 5e-6 * (np.cos(t) + 0.4 * np.sin(5 * t)), 5e-6 * 1e6 * (-np.sin(t) + 2 * np.cos(5 * t))
    force = Joint((LuGre(K, 1e4, F, F, 0.01),)).force_along(z, v, (t[1] - t[0]) / 1e6)
    power = force * v
    assert np.sum(power[-20000:]) > 0


def test_lugre_with_falling_friction_can_feed_a_jerk() -> None:
    """Why the law is not called passive: bristles bent in slow motion, then a fast start, give work back."""
    law = LuGre(K, 1e4, F, 2 * F, 1e-3)
    creep = np.linspace(0, 2e-5, 4001)
    state = law.initial_state(np.array(0.0))
    for z in creep:
        state = law.step(Motion(np.array(z), np.array(1e-6), 1.0), state)[1]
    work, speed, dz = 0.0, 5.0, 1e-9
    for i in range(1, 500):
        force, state = law.step(Motion(np.array(creep[-1] + i * dz), np.array(speed), dz / speed), state)
        work += float(force) * dz
    stored = K * (2 * F / K) ** 2 / 2
    assert work < -stored


def test_lugre_jacobian_holds_for_steps_that_last() -> None:
    law = LuGre(K, 300.0, F, 1.6 * F, 2e-2)
    state = law.step(Motion(np.array(-4e-7), np.array(-0.01), 1e-4), law.initial_state(np.array(0.0)))[1]
    dz, dv, h = 1e-13, 1e-8, 5e-5
    z, v = np.array(3e-7), np.array(0.015)

    def force(dz: float, dv: float) -> float:
        return float(law.step(Motion(z + dz, v + dv, h), state)[0])

    stiffness, damping = law.jacobian(Motion(z, v, h), state)
    assert float(stiffness) == pytest.approx((force(dz, 0) - force(-dz, 0)) / (2 * dz), rel=1e-4)
    assert float(damping) == pytest.approx((force(0, dv) - force(0, -dv)) / (2 * dv), rel=1e-4)


def test_structural_damping_loses_the_same_at_any_frequency() -> None:
    law = StructuralDamping(2e7)
    for omega in (1.0, 1e3, 1e6):
        assert law.describing_function(A, omega) == pytest.approx(2e7j)
    # In time, along a period of two harmonics: π·loss·Σ k·A_k², with no factor of the frequency.
    t = 2 * np.pi * np.arange(512) / 512
    for omega in (10.0, 1e4):
        z, v = A * (np.cos(t) + 0.5 * np.sin(3 * t)), A * omega * (-np.sin(t) + 1.5 * np.cos(3 * t))
        (force,) = 2e7 * MaterialDamping().columns(Path(z, v, t[1] / omega), {"reference_frequency": 0.0}, Joint())
        assert np.mean(force * v) * 2 * np.pi / omega == pytest.approx(np.pi * 2e7 * A**2 * (1 + 3 * 0.25), rel=1e-12)


def test_the_spring_of_causal_structural_damping_is_what_its_loss_demands() -> None:
    """Kramers-Kronig with one subtraction, for exp(+jωt)

    Re G(a) − Re G(b) = −(2/π)(a² − b²) P∫ x Im G(x)/((x² − a²)(x² − b²)) dx, from 0 to infinity.
    """
    law, a, b = StructuralDamping(2.0, 0.1), 3.0, 1.0

    def loss(x: float) -> float:
        return float(law.describing_function(1e-6, x).imag) * x

    middle, far = (a + b) / 2, 10 * a
    around_b = quad(lambda x: loss(x) / ((x * x - a * a) * (x + b)), 0, middle, weight="cauchy", wvar=b)[0]
    around_a = quad(lambda x: loss(x) / ((x + a) * (x * x - b * b)), middle, far, weight="cauchy", wvar=a)[0]
    tail = quad(lambda x: loss(x) / ((x * x - a * a) * (x * x - b * b)), far, np.inf)[0]
    demanded = -2 / np.pi * (a * a - b * b) * (around_b + around_a + tail)
    rise = law.describing_function(1e-6, a).real - law.describing_function(1e-6, b).real
    assert rise == pytest.approx(demanded, rel=1e-6)
    assert StructuralDamping(2e7).describing_function(1e-6, a).real == 0.0


def test_a_list_of_elements_travels_through_files_and_names(tmp_path: FilePath) -> None:
    file = tmp_path / "seat.joint.toml"
    text = 'kind = "iwan"\nstiffness = ["10 N/um", 2e7]\nslip_force = [10, "0.03 kN"]\nclearance = 1e-7\n'
    file.write_text(f'schema = "jointlib/joint/1"\n[[law]]\n{text}', encoding="utf-8")
    joint = read_joint(file)
    assert joint.laws == (Iwan((1e7, 2e7), (10.0, 30.0), 1e-7),)
    assert joint.states == ("iwan.slider[0]", "iwan.slider[1]")
    assert joint.parameters["iwan.slip_force[1]"] == 30.0
    moved = joint.with_parameters({"iwan.stiffness[0]": 3e7})
    assert moved.laws == (Iwan((3e7, 2e7), (10.0, 30.0), 1e-7),)
    write_joint(file, moved)
    assert read_joint(file).laws == moved.laws


def test_lists_that_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match="iwan: 1 entries of slip_force, expected 2, as of stiffness"):
        Iwan((1e7, 2e7), (10.0,))
    with pytest.raises(InputError, match=r"iwan: stiffness is 10000000\.0, expected a list of numbers in N/m"):
        Iwan(1e7, 10.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="lugre: static_force is 10"):
        LuGre(K, 0.0, F, 10.0, 1e-3)


def test_a_machine_with_structural_damping_peaks_at_force_over_loss(tmp_path: FilePath) -> None:
    """abs(k − m·ω² + j·loss) is smallest, and exactly the loss, at ω² = k/m."""
    file = tmp_path / "one.toml"
    laws = '{ law = [{ kind = "linear", stiffness = 1e8 }, { kind = "structural-damping", loss_stiffness = 5e6 }] }'
    file.write_text(
        'schema = "jointlib/machine/1"\nname = "one"\n'
        '[[component]]\nname = "mass"\nkind = "lumped"\ndofs = ["x"]\nmass = [[1.0]]\n'
        f'[[connection]]\nname = "seat"\nbetween = ["mass.x", "ground"]\njoint = {laws}\n'
        '[tool]\nx = "mass.x"\n',
        encoding="utf-8",
    )
    common = ["--force", "10", "--frequency", "1000:2200:200", "-o", str(tmp_path / "one.npz"), "--json"]
    (peak,) = spoken(["frf", str(file), *common])["peaks"]
    assert peak["amplitude"] == pytest.approx(10 / 5e6, rel=1e-9)
    assert peak["frequency"] == pytest.approx(1e4 / (2 * np.pi), rel=1e-5)
    checked = spoken(["check", str(file), "--json"])
    assert checked["passed"]
    assert [e["law"] for e in checked["excluded"]] == ["structural_damping"]


def spoken(arguments: list[str]) -> Any:
    """What the command line answers."""
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(io.StringIO()):
        cli.main(arguments, prog_name="jointlib", standalone_mode=False)
    return json.loads(stream.getvalue())


SCALE = Scale(A, 0.02, 6e8)


@member
def test_an_effect_adds_the_force_of_its_columns(effect: JointEffect) -> None:
    t = np.linspace(0, 0.02, 801)
    path = Path(*wandering(t, 2 * np.pi * 100), t[1] - t[0])
    joint = Joint((Linear(6e8),))
    for shape in effect.shapes(SCALE, joint):
        assert all(value > 0 for value in shape.values())
        columns = effect.columns(path, shape, joint)
        coefficients = K * np.arange(1.0, 1.0 + len(columns))
        mended = effect.apply(coefficients, shape, joint)
        assert mended is not None
        added = Joint(mended.laws[1:]).force_along(path.displacement, path.velocity, path.time_step)
        np.testing.assert_allclose(coefficients @ columns, added, rtol=0, atol=1e-10 * np.max(np.abs(added)))


@member
def test_an_effect_of_negative_stiffness_is_refused(effect: JointEffect) -> None:
    shape = effect.shapes(SCALE, Joint())[0]
    count = SLIDERS if effect.member == "iwan" else 1
    assert effect.apply(np.full(count, -1.0), shape, Joint()) is None


@member
def test_columns_of_shapes_are_stepped_at_once(effect: JointEffect) -> None:
    """A trace hands over all shapes of a grid as columns of parameters."""
    shapes = effect.shapes(SCALE, Joint())
    together = {name: np.array([[s[name]] for s in shapes]) for name in shapes[0]}
    count = SLIDERS if effect.member == "iwan" else 1
    t = np.linspace(0, 0.02, 101)
    z, v = (x[:, None, None] * np.ones((1, len(shapes), 2)) for x in wandering(t, 2 * np.pi * 100))
    for unit in np.eye(count):
        mended = effect.apply(unit, together, Joint())  # type: ignore[arg-type]
        assert mended is not None
        force = mended.force_along(z, v, t[1])
        for k, shape in enumerate(shapes):
            single = effect.apply(unit, shape, Joint())
            assert single is not None
            expected = single.force_along(z[:, k, 0], v[:, k, 0], t[1])
            np.testing.assert_allclose(force[:, k, 1], expected, rtol=0, atol=1e-12 * np.max(np.abs(expected)))


def test_iwan_leaves_out_a_slightly_negative_slider_and_refuses_a_negative_one() -> None:
    effect = GradualSlip()
    shape = effect.shapes(SCALE, Joint())[0]
    kept = effect.apply(np.array([2e7, -5e5, 1e7, 5e6]), shape, Joint())
    assert kept is not None
    assert kept.parameters["iwan.stiffness[1]"] == 1e7
    assert "iwan.stiffness[3]" not in kept.parameters
    assert effect.apply(np.array([2e7, -5e6, 1e7, 5e6]), shape, Joint()) is None


def test_structural_damping_adds_loss_only() -> None:
    effect = MaterialDamping()
    assert effect.apply(np.array([-1.0]), {}, Joint()) is None
    assert effect.apply(np.array([2e7]), {"reference_frequency": 0.0}, Joint()) == Joint((StructuralDamping(2e7),))
