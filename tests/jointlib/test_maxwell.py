"""The Maxwell element against its differential equation and its limits; relaxation named on a rig and along a path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_samples import PERIOD, RATE, measurement
from scipy.integrate import quad, solve_ivp

from jointlib.arrays import Array
from jointlib.effect import Scale
from jointlib.effects.relaxation import Relaxation
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.laws.linear import Linear
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import TraceReport, Verdict
from jointlib.loop.balance.steady import steady_force
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Mass, Measurement, RecordSource

K, TAU = 4e7, 3e-4
"""N/m and s: a corner at 531 Hz."""
LAW = Maxwell(K, K * TAU)
A, OMEGA = 3e-6, 2 * np.pi * 700.0


def wandering(t: Array) -> tuple[Array, Array]:
    """Two tones from rest at zero, m and m/s."""
    z = A * (np.sin(OMEGA * t) + 0.6 * np.sin(2.7 * OMEGA * t))
    return z, A * OMEGA * (np.cos(OMEGA * t) + 1.62 * np.cos(2.7 * OMEGA * t))


def test_it_follows_its_differential_equation_to_second_order() -> None:
    t = np.linspace(0, 5 * TAU, 4097)

    def slope(time: float, f: Array) -> Array:
        return np.asarray(K * wandering(np.array(time))[1] - f / TAU)

    expected = solve_ivp(slope, (0, t[-1]), [0.0], "DOP853", t, rtol=1e-11, atol=1e-12 * K * A).y[0]
    peak = np.max(np.abs(expected))
    errors = []
    for every in (32, 2):
        z, v = wandering(t[::every])
        found = Joint((LAW,)).force_along(z, v, t[every])
        errors.append(np.max(np.abs(found - expected[::every])) / peak)
    # A chord for the path: (ωh)²/8 of the faster tone at most in the middle, with h = 2·τ·5/4096.
    assert errors[1] < (2.7 * OMEGA * t[2]) ** 2 / 8
    # Four halvings at second order.
    assert errors[0] / errors[1] == pytest.approx(256, rel=0.05)


@pytest.mark.parametrize("steps", [1, 7, 300])
def test_it_is_exact_on_an_even_motion_however_it_is_cut(steps: int) -> None:
    speed, duration = 0.02, 2.3 * TAU
    z = speed * duration * np.linspace(0, 1, steps + 1)
    pulled = Joint((LAW,)).force_along(z, speed, duration / steps)[-1]
    assert pulled == pytest.approx(K * TAU * speed * -np.expm1(-2.3), rel=1e-12)
    # A push and a wait: the force relaxes by e for every τ that it is held.
    state = LAW.step(Motion(np.array(A), np.zeros(())), LAW.initial_state(np.zeros(())))[1]
    for _ in range(steps):
        held, state = LAW.step(Motion(np.array(A), np.zeros(()), duration / steps), state)
    assert float(held) == pytest.approx(K * A * np.exp(-2.3), rel=1e-12)


def test_a_step_without_duration_is_the_spring_and_one_without_end_the_damper() -> None:
    state = LAW.initial_state(np.zeros(()))
    assert LAW.step(Motion(np.array(A), np.array(1.0)), state)[0] == K * A
    # Over 1000 τ at an even speed nothing is left of the start.
    speed = 0.01
    force, _ = LAW.step(Motion(np.array(speed * 1000 * TAU), np.array(speed), 1000 * TAU), state)
    assert float(force) == pytest.approx(K * TAU * speed, rel=1e-12)


def test_far_below_the_corner_it_damps_far_above_it_is_a_spring_and_in_between_it_loses_most() -> None:
    low, corner, high = LAW.describing_function(A, np.array([1e-5, 1.0, 1e5]) / TAU)
    assert low == pytest.approx(1e-5j * K, rel=2e-5)
    assert corner == pytest.approx(K * (0.5 + 0.5j), rel=1e-14)
    assert high == pytest.approx(K, rel=2e-5)
    around = LAW.describing_function(A, np.geomspace(0.1, 10, 201) / TAU)
    assert np.max(around.imag) == pytest.approx(K / 2, rel=1e-12)


def test_its_spring_is_what_its_loss_demands() -> None:
    """Kramers-Kronig for exp(+jωt), nothing being left at rest: Re G(a) = −(2a²/π) P∫ Im G(x)/(x(x² − a²)) dx."""
    a = 0.7

    def loss(x: float) -> float:
        return float(LAW.describing_function(A, x / TAU).imag) / K

    # From 1e-9 on: below it the integrand is of order one.
    near = quad(lambda x: loss(x) / (x * (x + a)), 1e-9, 2 * a, weight="cauchy", wvar=a)[0]
    far = quad(lambda x: loss(x) / (x * (x * x - a * a)), 2 * a, np.inf)[0]
    assert LAW.describing_function(A, a / TAU).real / K == pytest.approx(-2 * a * a / np.pi * (near + far), rel=1e-7)


def test_the_loss_of_a_settled_cycle_is_that_of_its_gain() -> None:
    n = 2000
    angle = 2 * np.pi * np.arange(12 * n + 1) / n
    z, v = A * np.cos(angle), -A * OMEGA * np.sin(angle)
    force = Joint((LAW,)).force_along(z, v, 2 * np.pi / n / OMEGA)[-n - 1 :]
    work = float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(z[-n - 1 :])))
    # Chord and trapezoid are off by (2π/n)²/12 and /6 of the gain: 2.5e-6.
    assert work == pytest.approx(np.pi * A**2 * LAW.describing_function(A, OMEGA).imag, rel=5e-6)


def test_a_steady_state_line_by_line_is_what_steps_settle_to() -> None:
    n, periods = 512, 6
    turn = 2 * np.pi * np.arange(n) / n
    z = A * (np.cos(turn) + 0.4 * np.sin(3 * turn))
    v = A * OMEGA * (-np.sin(turn) + 1.2 * np.cos(3 * turn))
    h = 2 * np.pi / n / OMEGA
    times = np.array([0.2, 1.0, 3.0]) / OMEGA
    grid = Maxwell(K, K * times[:, None])
    both = np.stack([z, -0.5 * z], axis=-1)[:, None, :] * np.ones((1, 3, 1))
    found = steady_force(grid, both, np.stack([v, -0.5 * v], axis=-1)[:, None, :], h)
    for i, tau in enumerate(times):
        law = Maxwell(K, K * float(tau))
        stepped = Joint((law,)).force_along(np.tile(z, periods), np.tile(v, periods), h)[-n:]
        # Chords of both tones, (kωh)²/12 of each, and what is left of the virgin start.
        off = K * A * ((1 + 0.4 * 9) * (2 * np.pi / n) ** 2 / 12 + np.exp(-(periods - 1) * n * h / tau))
        np.testing.assert_allclose(found[:, i, 0], stepped, rtol=0, atol=off)
        np.testing.assert_allclose(found[:, i, 1], -0.5 * found[:, i, 0], rtol=0, atol=1e-12 * K * A)


def test_a_relaxing_part_needs_a_spring_and_a_damper() -> None:
    with pytest.raises(InputError, match=r"maxwell: damping is 0\.0 N s/m, expected above 0 N s/m"):
        Maxwell(K, 0.0)


def test_corners_are_tried_from_below_a_tone_to_above_a_multisine() -> None:
    """For a tone rms velocity over peak displacement is ω/√2; a multisine peaks at four times its rms."""
    for ratio in (1 / np.sqrt(2), 1 / 4):
        shapes = Relaxation().shapes(Scale(A, ratio * A * OMEGA, 6e8), Joint((Linear(6e8),)))
        corners = np.array([1 / s["relaxation_time"] for s in shapes]) / OMEGA
        assert corners.min() < 0.5
        assert corners.max() > 2.0
        # Neighbours differ by less than the width of the loss peak, a factor 2 + √3 to either side of its half height.
        assert np.max(corners[1:] / corners[:-1]) < 2 + np.sqrt(3)


def rig_with(corners: Array, stiffness: float, folder: Path) -> TraceReport:
    """Trace of a linear rig, in closed form, with equal Maxwell elements of these corners in Hz; 50 dB of noise."""
    rng, f = np.random.default_rng(11), np.fft.rfftfreq(PERIOD, 1 / RATE)
    m1, M, w = 0.942, 2.2, 2 * np.pi * f
    film = stiffness * np.mean([1j * f / (c + 1j * f) for c in corners], axis=0)
    D = 6e8 + 500j * w + film
    records = []
    for i, level in enumerate((0.4, 0.7, 1.0, 1.0)):
        P = np.where((f >= 2e3) & (f <= 2e4), level * np.exp(2j * np.pi * rng.random(len(f))), 0)
        Z = P / m1 / ((1 / m1 + 1 / M) * D - w**2)
        spectra = {"a1": (P - D * Z) / m1, "a2": D * Z / M, "a3": D * Z / M, "P": P}
        shown = {}
        for name, X in spectra.items():
            x = np.tile(np.fft.irfft(X, PERIOD) * PERIOD, 4)
            shown[name] = x + 10**-2.5 * np.std(x) / level * rng.standard_normal(len(x))
        np.savez(folder / f"r{i}.npz", allow_pickle=False, **shown)
        records.append(RecordSource(folder / f"r{i}.npz", "fit", condition=f"level {level}"))
    test = measurement(records=tuple(records), settle=0)
    return trace(test, Joint((Linear(5.9e8), Viscous(400.0))))


def families(report: TraceReport) -> list[str]:
    """The chosen family, then its rivals."""
    assert report.chosen is not None
    return [report.chosen.family, *(r.family for r in report.rivals)]


@pytest.mark.thorough
def test_a_film_that_relaxes_is_named_on_a_rig_with_its_stiffness_and_time(tmp_path: Path) -> None:
    report = rig_with(np.array([4500.0]), 6e7, tmp_path)
    assert report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    assert families(report)[0] == "relaxation"
    found = report.chosen.parameters if report.chosen else {}
    for name, true in (("maxwell.stiffness", 6e7), ("maxwell.damping", 6e7 / (2 * np.pi * 4500))):
        assert abs(found[name].value - true) < 4 * found[name].standard_error < true


@pytest.mark.slow
def test_relaxation_stands_beside_a_material_with_many_relaxation_times(tmp_path: Path) -> None:
    """Eight corners over four decades: a loss that is level over the band."""
    report = rig_with(np.geomspace(60, 6e5, 8), 3e8, tmp_path)
    assert "structural-damping" in families(report)


@pytest.mark.slow
def test_a_part_that_relaxes_is_named_along_a_path(tmp_path: Path) -> None:
    """Four tones at three speeds, in closed form: mass, spring, damper, and a part that yields within 0.1 s.

    Each speed alone must tell five parameters, as the others are left out in turn; a tone tells two.
    """
    rate, tau, stiffness = 200.0, 0.1, 800.0
    t, rng, records = np.arange(0, 12, 1 / rate), np.random.default_rng(2), []
    for i, pace in enumerate((0.6, 1.0, 1.7)):
        z, force = np.zeros_like(t), 0.05 * rng.standard_normal(len(t))
        for frequency, size in ((0.37, 0.02), (0.93, 0.012), (1.7, 0.007), (3.1, 0.004)):
            s = 2j * np.pi * frequency * pace
            motion = size * np.exp(s * t)
            z += motion.imag
            force += ((30 + 20 * s + 2 * s * s + stiffness * s * tau / (1 + s * tau)) * motion).imag
        np.savez(tmp_path / f"p{i}.npz", allow_pickle=False, z=z, F=force)
        records.append(RecordSource(tmp_path / f"p{i}.npz", "fit", condition=f"pace {pace}"))
    channels = Channel("z", "position", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0)
    source = tmp_path / "m.toml"
    test = Measurement(source, "path", channels, tuple(records), sample_rate=rate, carriage=Mass(None))
    report = trace(test, Joint((Linear(30.0), Viscous(10.0))))
    assert families(report)[0] == "relaxation"
    found = report.mended.parameters
    assert found["maxwell.stiffness"] == pytest.approx(stiffness, rel=0.02)
    assert found["maxwell.damping"] / found["maxwell.stiffness"] == pytest.approx(tau, rel=0.02)
