"""Turning lobes against closed forms, and against published joints held at an amplitude."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from machines.lobes import Cutting, Receptance, StabilityLobes, minimum_depth_of_mode, notch_delays, stability_lobes

CASES = ((1e7, 0.02, 1e9, 0.408e-3), (2.26e8, 0.012, 1.1e9, 4.99008e-3), (5.59e6, 0.039, 6e8, 0.7550413e-3))


def single(inverse: Callable[[Array], NDArray[Any]]) -> Receptance:
    """Receptance function of one direction from its dynamic stiffness over ω."""
    return lambda f: np.asarray(1 / inverse(2 * np.pi * f), dtype=complex)[:, None, None]


def mode(frequency: float, damping_ratio: float, stiffness: float) -> Receptance:
    omega_n = 2 * np.pi * frequency
    return single(lambda w: stiffness * (1 - (w / omega_n) ** 2 + 2j * damping_ratio * w / omega_n))


def turned(receptance: Receptance, specific: float, speed: float | Array, top: float = 1000.0) -> StabilityLobes:
    cutting = Cutting(process="turning", specific=specific)
    return stability_lobes(receptance, cutting, speed, frequency=np.arange(1.0, top, 2.0))


@pytest.mark.parametrize(("stiffness", "damping_ratio", "specific", "depth"), CASES)
def test_minimum_depth_of_one_mode_three_ways(
    stiffness: float, damping_ratio: float, specific: float, depth: float
) -> None:
    closed = float(minimum_depth_of_mode(stiffness, damping_ratio, specific))
    assert closed == pytest.approx(depth, rel=5e-8)  # the figure has seven digits
    r = np.sqrt(1 + 2 * damping_ratio)
    numeric = minimize_scalar(
        lambda x: (1 / (stiffness * (1 - x**2 + 2j * damping_ratio * x))).real,
        bounds=(0.98 * r, 1.02 * r),
        method="bounded",
        options={"xatol": 1e-9},
    )
    assert closed == pytest.approx(-1 / (2 * specific * numeric.fun), rel=1e-9)
    lobes = turned(mode(100.0, damping_ratio, stiffness), specific, 3000.0)
    assert lobes.minimum_depth == pytest.approx(closed, rel=1e-9)
    assert lobes.minimum_frequency == pytest.approx(100 * r, rel=1e-6)


@pytest.mark.parametrize(
    ("damping_ratio", "speeds"),
    [(0.01, (1.343777, 0.576595, 0.367044)), (0.1, (1.432912, 0.620829, 0.396256))],
)
def test_lobes_touch_the_minimum_at_the_notch_delays(damping_ratio: float, speeds: tuple[float, ...]) -> None:
    delays = notch_delays(1 / (2 * np.pi), damping_ratio, 3)
    assert 2 * np.pi / delays == pytest.approx(np.array(speeds), abs=6e-7)
    rpm = 60 / notch_delays(100.0, damping_ratio, 3)
    lobes = turned(mode(100.0, damping_ratio, 1e7), 1e9, rpm)
    assert lobes.depth == pytest.approx(float(minimum_depth_of_mode(1e7, damping_ratio, 1e9)), rel=1e-9)
    assert lobes.lobe.tolist() == [0, 1, 2]
    assert lobes.minimum_speed(range(3)) == pytest.approx(rpm, rel=1e-6)


def test_depth_at_a_speed_is_the_least_root_of_the_loop() -> None:
    """Im[(1 − e^(−jωτ))·G] changes sign at the tooth frequency too; those places are no roots."""
    G, specific = mode(100.0, 0.03, 1e7), 1e9
    speeds = np.linspace(900.0, 9000.0, 23)
    lobes = turned(G, specific, speeds, top=3000.0)
    for speed, depth, frequency in zip(speeds, lobes.depth, lobes.chatter_frequency, strict=True):
        tau = 60 / speed

        def loop(f: float, tau: float = tau) -> complex:
            return complex((1 - np.exp(-2j * np.pi * f * tau)) * specific * G(np.array([f]))[0, 0, 0])

        lines = np.arange(0.37, 3000, 0.5)
        imaginary = ((1 - np.exp(-2j * np.pi * lines * tau)) * G(lines)[:, 0, 0]).imag
        roots = [
            brentq(lambda f: loop(f).imag, lines[j], lines[j + 1], xtol=1e-12)
            for j in np.flatnonzero(imaginary[1:] * imaginary[:-1] < 0)
        ]
        roots = [f for f in roots if abs(f * tau - round(f * tau)) > 1e-9 and loop(f).real < 0]
        best = min(roots, key=lambda f: -1 / loop(f).real)
        assert depth == pytest.approx(-1 / loop(best).real, rel=1e-9)
        assert frequency == pytest.approx(best, rel=1e-9)


def test_no_speed_is_limited_below_the_minimum_depth() -> None:
    lobes = turned(mode(100.0, 0.03, 1e7), 1e9, np.linspace(800.0, 8000.0, 301))
    assert np.all(lobes.depth >= lobes.minimum_depth * (1 - 1e-9))
    assert np.min(lobes.depth) < 1.01 * lobes.minimum_depth


def test_drawn_lobe_passes_through_the_solved_depths() -> None:
    speeds = np.linspace(2200.0, 4500.0, 40)
    lobes = turned(mode(100.0, 0.03, 1e7), 1e9, speeds)
    in_first = lobes.lobe == 1
    assert np.count_nonzero(in_first) > 10
    (curve,) = lobes.curves(1)
    drawn = np.interp(speeds[in_first], curve[0], 1 / curve[1])
    assert 1 / drawn == pytest.approx(lobes.depth[in_first], rel=1e-2)


def test_stiffer_and_softer_tools_scale_the_depth() -> None:
    soft, stiff = (turned(mode(100.0, 0.03, k), 1e9, np.array([2350.0, 3100.0])) for k in (1e7, 3e7))
    assert stiff.depth == pytest.approx(3 * soft.depth, rel=1e-10)
    assert stiff.chatter_frequency == pytest.approx(soft.chatter_frequency, rel=1e-10)


# A mass on a joint held at amplitude A: m = 25.33 kg, 100 Hz, ζ = 0.03, turned at 2350 rpm with K_s = 1e9 N/m².
MASS, OMEGA = 25.33, 2 * np.pi * 100.0
STIFFNESS, DAMPING = MASS * OMEGA**2, 2 * 0.03 * MASS * OMEGA
CUBIC = 0.1 * STIFFNESS / (0.75 * 1e-4**2)


def held(joint: str, amplitude: float) -> Receptance:
    """Receptance with the describing function of the joint: ¾·k₃·A² in stiffness, 4·F_c/(πωA) in damping."""
    sign = {"linear": 0.0, "hardening": 1.0, "softening": -1.0, "coulomb": 0.0}[joint]
    k = STIFFNESS + sign * 0.75 * CUBIC * amplitude**2
    friction = 4 * 5.0 / (np.pi * amplitude) if joint == "coulomb" else 0.0
    return single(lambda w: k - MASS * w**2 + 1j * (DAMPING * w + friction))


@pytest.mark.parametrize(
    ("joint", "amplitude", "depth", "frequency"),
    [
        ("linear", 30e-6, 0.69920, None),
        ("hardening", 30e-6, 0.68847, 105.139),
        ("hardening", 60e-6, 0.66324, 105.894),
        ("hardening", 123.5e-6, 0.68847, None),
        ("softening", 30e-6, 0.71107, 104.665),
        ("softening", 60e-6, 0.75348, 103.999),
        ("coulomb", 30e-6, 0.89207, 105.706),
        ("coulomb", 60e-6, 0.79560, 105.322),
    ],
)
def test_depth_follows_the_vibration_amplitude_of_the_joint(
    joint: str, amplitude: float, depth: float, frequency: float | None
) -> None:
    receptance, tau = held(joint, amplitude), 60 / 2350.0
    lobes = turned(receptance, 1e9, 2350.0)
    # the upper hardening amplitude is known to 0.1 µm, which is worth 2e-4 of the depth
    assert float(lobes.depth) * 1e3 == pytest.approx(depth, rel=3e-4 if amplitude > 1e-4 else 2e-5)
    if frequency is not None:
        assert float(lobes.chatter_frequency) == pytest.approx(frequency, abs=6e-4)

    def loop(f: float) -> complex:
        return complex((1 - np.exp(-2j * np.pi * f * tau)) * receptance(np.array([f]))[0, 0, 0])

    root = brentq(lambda f: loop(f).imag, 103.0, 112.0, xtol=1e-12)
    assert float(lobes.depth) == pytest.approx(-1 / (1e9 * loop(root).real), rel=1e-9)


def test_hardening_joint_has_its_shallowest_limit_where_the_depth_turns_back() -> None:
    def depth(amplitude: float) -> float:
        return float(turned(held("hardening", amplitude), 1e9, 2350.0).depth)

    lowest = minimize_scalar(depth, bounds=(60e-6, 120e-6), method="bounded", options={"xatol": 1e-9})
    assert lowest.fun * 1e3 == pytest.approx(0.64514, rel=5e-5)
    assert lowest.x * 1e6 == pytest.approx(91.6, abs=0.1)


def test_turning_uses_the_feed_direction_of_a_tool_that_moves_both_ways() -> None:
    G = mode(100.0, 0.03, 1e7)

    def both(f: Array) -> ComplexArray:
        out = np.zeros((len(f), 2, 2), dtype=complex)
        out[:, 0, 0], out[:, 1, 1] = G(f)[:, 0, 0], mode(50.0, 0.03, 1e5)(f)[:, 0, 0]
        return out

    assert float(turned(both, 1e9, 2350.0).depth) == pytest.approx(float(turned(G, 1e9, 2350.0).depth), rel=1e-12)


def test_band_that_ends_inside_a_lobe_is_reported() -> None:
    full, short = (turned(mode(100.0, 0.03, 1e7), 1e9, 9000.0, top=top) for top in (1000.0, 104.0))
    assert full.outcome is Outcome.CONVERGED
    assert full.warnings == ()
    assert np.isfinite(full.depth)
    assert short.outcome is Outcome.FRF_TOO_SHORT
    assert any("ends at 103 Hz inside a lobe" in sentence for sentence in short.warnings)


def test_minimum_at_the_end_of_the_band_is_reported() -> None:
    lobes = turned(mode(100.0, 0.03, 1e7), 1e9, 2900.0, top=102.0)
    assert any("minimum depth lies at the edge" in sentence for sentence in lobes.warnings)


def test_tool_that_never_moves_against_the_force_is_stable_at_any_depth() -> None:
    lobes = turned(single(lambda w: 1e7 + 1e3j * w), 1e9, np.array([1000.0, 2000.0]))
    assert np.all(np.isinf(lobes.depth))
    assert np.isinf(lobes.minimum_depth)
    assert np.all(np.isnan(lobes.chatter_frequency))
    assert lobes.kind.tolist() == ["", ""]
    assert lobes.lobe.tolist() == [-1, -1]
    assert lobes.branches == ()


def test_closed_forms_refuse_what_has_no_meaning() -> None:
    with pytest.raises(InputError, match="damping_ratio"):
        minimum_depth_of_mode(1e7, -0.02, 1e9)
    with pytest.raises(InputError, match="natural_frequency"):
        notch_delays(0.0, 0.02, 3)
