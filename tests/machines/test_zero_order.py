"""Milling lobes by the zero-order approximation, against published cases and a second formulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.optimize import brentq, minimize_scalar

from jointlib.arrays import Array, ComplexArray
from machines import lobes as chosen
from machines.lobes import Cutting, Receptance, StabilityLobes

stability_lobes = partial(chosen.stability_lobes, method="zero-order")
SPEEDS = np.array([6000.0, 9000.0, 12000.0, 15000.0, 20000.0])
LINES = np.arange(5.0, 3000.0, 5.0)
TWO_MODES = {
    "slot": (0.7774358, 626.126, (22383, 8030.0, 4892.6), (1.298472, 0.800725, 2.688795, 1.356948, 0.793286)),
    "up": (1.0868291, 632.978, (24316, 8325.3, 5022.4), (1.945738, 1.116571, 4.033539, 1.957969, 1.134418)),
}


def mode(frequency: float, damping_ratio: float, stiffness: float) -> Callable[[Array], ComplexArray]:
    def receptance(f: Array) -> ComplexArray:
        r = f / frequency
        return np.asarray(1 / (stiffness * (1 - r**2 + 2j * damping_ratio * r)))

    return receptance


def uncoupled(*entries: Callable[[Array], ComplexArray]) -> Receptance:
    def receptance(f: Array) -> ComplexArray:
        out = np.zeros((len(f), len(entries), len(entries)), dtype=complex)
        for i, entry in enumerate(entries):
            out[:, i, i] = entry(f)
        return out

    return receptance


def coupled(seed: int) -> Receptance:
    """Four random modes in random directions: collocated, passive and reciprocal, with cross terms."""
    rng = np.random.default_rng(seed)
    frequency, damping = rng.uniform(300, 900, 4), rng.uniform(0.02, 0.06, 4)
    angle, stiffness = rng.uniform(0, np.pi, 4), rng.uniform(3e6, 3e7, 4)
    shape = np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def receptance(f: Array) -> ComplexArray:
        modal = np.stack(
            [mode(*one)(f) for one in zip(frequency.tolist(), damping.tolist(), stiffness.tolist(), strict=True)]
        )
        return np.asarray(np.einsum("mf,mi,mj->fij", modal, shape, shape))

    return receptance


TOOL = uncoupled(mode(603, 0.039, 5.59e6), mode(666, 0.035, 5.715e6))


def two_mode_cut(mode: str) -> Cutting:
    immersion = None if mode == "slot" else 0.5
    return Cutting("milling", teeth=3, tangential=6e8, normal=0.07 * 6e8, mode=mode, immersion=immersion)


def common_cut(mode: str, immersion: float | None) -> Cutting:
    return Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode=mode, immersion=immersion)


@cache
def mean_by_quadrature(cutting: Cutting) -> Array:
    """(N/2π)∫H₁dφ by adaptive quadrature of the tooth force, without the directional factors."""
    K_t, K_n = cutting.tangential, cutting.normal

    def tooth(angle: float) -> Array:
        s, c = np.sin(angle), np.cos(angle)
        assert K_t is not None
        assert K_n is not None
        force_x, force_y = K_t * c + K_n * s, -K_t * s + K_n * c
        return np.array([[s * force_x, c * force_x], [s * force_y, c * force_y]])

    integral, _ = quad_vec(tooth, cutting.entry_angle, cutting.exit_angle, epsrel=1e-12)
    return np.asarray(cutting.cuts_per_revolution / (2 * np.pi) * integral)


def least_root(receptance: Receptance, cutting: Cutting, speed: float, lines: Array) -> tuple[float, float]:
    """Depth (m) and frequency (Hz) by numpy's eigenvalues of the quadrature mean and brentq, one root at a time."""
    n = receptance(lines[:1]).shape[-1]
    D, tau = mean_by_quadrature(cutting)[:n, :n], 60 / (cutting.cuts_per_revolution * speed)

    def loop(f: Array) -> ComplexArray:
        return np.asarray((1 - np.exp(-2j * np.pi * f * tau))[:, None] * np.linalg.eigvals(D @ receptance(f)))

    def followed(f: float, near: complex) -> complex:
        values = loop(np.array([f]))[0]
        return complex(values[np.argmin(np.abs(values - near))])

    values, best = loop(lines), (np.inf, np.nan)
    for j in range(len(lines) - 1):
        for start in values[j]:
            end = values[j + 1][np.argmin(np.abs(values[j + 1] - start))]
            if start.imag * end.imag >= 0 or (start.real >= 0 and end.real >= 0):
                continue
            chord = np.poly1d(np.polyfit(lines[j : j + 2], [start, end], 1))
            f = brentq(lambda f, chord=chord: followed(f, chord(f)).imag, lines[j], lines[j + 1], xtol=1e-12)
            value = followed(f, chord(f))
            if value.real < 0 and abs(f * tau - round(f * tau)) > 1e-9:
                best = min(best, (-1 / value.real, f))
    return best


def depth_by_quadratic(f: float, cutting: Cutting, Gx: complex, Gy: complex) -> tuple[float, float]:
    """Lowest positive depth (m) and its phase ε from a₀Λ² + a₁Λ + 1 = 0 (Altintas & Budak 1995), no cross terms."""
    (xx, xy), (yx, yy) = cutting.directional_factors
    assert cutting.tangential is not None
    found = []
    for root in np.roots([Gx * Gy * (xx * yy - xy * yx), xx * Gx + yy * Gy, 1]):
        kappa = root.imag / root.real
        depth = -2 * np.pi * root.real * (1 + kappa**2) / (cutting.cuts_per_revolution * cutting.tangential)
        if depth > 0:
            found.append((float(depth), float(np.pi - 2 * np.arctan(kappa))))
    return min(found, default=(np.inf, np.nan))


@pytest.mark.parametrize("name", ["slot", "up"])
def test_minimum_depth_of_the_two_mode_tool(name: str) -> None:
    depth, frequency, speeds, _ = TWO_MODES[name]
    cutting = two_mode_cut(name)
    lobes = stability_lobes(TOOL, cutting, SPEEDS, frequency=LINES)
    assert lobes.minimum_depth * 1e3 == pytest.approx(depth, rel=1e-7)
    assert lobes.minimum_frequency == pytest.approx(frequency, abs=1e-3)
    assert lobes.minimum_speed(range(3)) == pytest.approx(np.array(speeds), abs=1.0)

    def quadratic(f: float) -> tuple[float, float]:
        G = TOOL(np.array([f]))[0]
        return depth_by_quadratic(f, cutting, G[0, 0], G[1, 1])

    second = minimize_scalar(
        lambda f: quadratic(f)[0], bounds=(frequency - 5, frequency + 5), method="bounded", options={"xatol": 1e-7}
    )
    assert lobes.minimum_depth == pytest.approx(second.fun, rel=1e-11)
    waves = quadratic(lobes.minimum_frequency)[1] / (2 * np.pi) + np.arange(3)
    assert lobes.minimum_speed(range(3)) == pytest.approx(60 * lobes.minimum_frequency / (3 * waves), rel=1e-9)


@pytest.mark.parametrize("name", ["slot", "up"])
def test_depths_of_the_two_mode_tool_at_given_speeds(name: str) -> None:
    cutting = two_mode_cut(name)
    lobes = stability_lobes(TOOL, cutting, SPEEDS, frequency=LINES)
    assert lobes.depth * 1e3 == pytest.approx(np.array(TWO_MODES[name][3]), rel=1e-6)
    for i, speed in enumerate(SPEEDS):
        depth, frequency = least_root(TOOL, cutting, speed, np.arange(400.0, 1000.0, 0.7))
        assert lobes.depth[i] == pytest.approx(depth, rel=1e-9)
        assert lobes.chatter_frequency[i] == pytest.approx(frequency, rel=1e-9)
        G = TOOL(lobes.chatter_frequency[i : i + 1])[0]
        depth, phase = depth_by_quadratic(frequency, cutting, G[0, 0], G[1, 1])
        assert lobes.depth[i] == pytest.approx(depth, rel=1e-9)
        assert speed == pytest.approx(60 * frequency / (3 * (phase / (2 * np.pi) + lobes.lobe[i])), rel=1e-9)
    assert lobes.kind.tolist() == ["hopf"] * 5


@pytest.mark.parametrize(
    ("directions", "mode_word", "immersion", "exact", "ratio"),
    [
        (1, "slot", None, (0.4086278, 0.3223790, 0.6895392), (0.905, 0.952, 0.800)),
        (1, "down", 0.5, (0.8472035, 2.104690, 1.619698), (1.088, 1.434, 1.095)),
        (1, "down", 0.1, (1.296263, 2.518412, 0.8156572), (1.109, 1.869, 3.390)),
        (2, "slot", None, (0.04750654, 0.07141078, 0.04787222), (1.010, 1.030, 1.003)),
        (2, "down", 0.5, (0.1271062, 0.1810301, 0.1302299), (1.001, 1.024, 0.981)),
    ],
)
def test_known_distance_from_the_exact_boundary(
    directions: int, mode_word: str, immersion: float | None, exact: Sequence[float], ratio: Sequence[float]
) -> None:
    """The 922 Hz tool common in the literature; the exact depths come from time-periodic theory."""
    tool = uncoupled(*[mode(922, 0.011, 0.03993 * (2 * np.pi * 922) ** 2)] * directions)
    cutting = common_cut(mode_word, immersion)
    lobes = stability_lobes(tool, cutting, [5000, 10000, 18000], frequency=np.arange(2.0, 5000.0, 2.0))
    assert lobes.depth * 1e3 / np.array(exact) == pytest.approx(np.array(ratio), abs=6e-4)
    assert any("flip lobes may lie far below" in sentence for sentence in lobes.warnings) is (mode_word != "slot")


def solved(
    receptance: Receptance, mode_word: str, immersion: float, axes: Sequence[str] = ("x", "y")
) -> StabilityLobes:
    cutting = Cutting("milling", teeth=4, tangential=7e8, normal=2.5e8, mode=mode_word, immersion=immersion)
    speeds = np.linspace(2500.0, 14000.0, 37)
    return stability_lobes(receptance, cutting, speeds, axes=axes, frequency=np.arange(5.0, 2500.0, 5.0))


@pytest.mark.parametrize("seed", range(4))
def test_tool_with_cross_terms_against_one_root_at_a_time(seed: int) -> None:
    receptance = coupled(seed)
    cutting = Cutting("milling", teeth=4, tangential=7e8, normal=2.5e8, mode="down", immersion=0.3)
    speeds = np.array([3100.0, 7300.0])
    lobes = stability_lobes(receptance, cutting, speeds, frequency=np.arange(5.0, 2500.0, 5.0))
    for speed, depth in zip(speeds, lobes.depth, strict=True):
        assert depth == pytest.approx(
            least_root(receptance, cutting, speed, np.arange(150.0, 2500.0, 2.1))[0], rel=1e-8
        )


@pytest.mark.parametrize("seed", range(3))
def test_no_speed_is_limited_below_the_minimum_depth(seed: int) -> None:
    lobes = solved(coupled(seed), "up", 0.4)
    assert np.all(lobes.depth >= lobes.minimum_depth * (1 - 1e-9))


def test_isotropic_tool_does_not_tell_up_from_down() -> None:
    tool = uncoupled(*[mode(640, 0.03, 8e6)] * 2)
    up, down = solved(tool, "up", 0.3), solved(tool, "down", 0.3)
    assert up.depth == pytest.approx(down.depth, rel=1e-9)
    assert up.minimum_depth == pytest.approx(down.minimum_depth, rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_tool_turned_by_a_right_angle_exchanges_half_up_and_half_down(seed: int) -> None:
    """The half-immersion arcs differ by a quarter turn, which takes (x, y) into (y, −x)."""
    tool, quarter = coupled(seed), np.array([[0.0, -1.0], [1.0, 0.0]])
    up = solved(tool, "up", 0.5)
    down = solved(lambda f: np.asarray(quarter.T @ tool(f) @ quarter), "down", 0.5)
    assert up.depth == pytest.approx(down.depth, rel=1e-9)
    assert up.chatter_frequency == pytest.approx(down.chatter_frequency, rel=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_reciprocal_tool_keeps_its_lobes_when_force_and_motion_are_exchanged(seed: int) -> None:
    tool = coupled(seed)
    there, back = solved(tool, "up", 0.4), solved(lambda f: tool(f).swapaxes(1, 2), "up", 0.4)
    assert there.depth == pytest.approx(back.depth, rel=1e-12)


@pytest.mark.parametrize(("axis", "order"), [("x", 0), ("y", 1)])
def test_very_stiff_direction_leaves_the_lobes_of_the_other(axis: str, order: int) -> None:
    free, rigid = mode(640, 0.03, 8e6), mode(3000, 0.03, 8e15)
    alone = solved(uncoupled(free), "down", 0.6, axes=(axis,))
    both = solved(uncoupled(*((free, rigid) if order == 0 else (rigid, free))), "down", 0.6)
    assert alone.depth == pytest.approx(both.depth, rel=1e-6)
    assert alone.minimum_depth == pytest.approx(both.minimum_depth, rel=1e-6)


def test_one_oblique_mode_has_the_lobes_of_its_projection() -> None:
    """A single mode seen from x and y has a singular receptance; the cut acts on it through uᵀ·D·u."""
    angle, shape_mode = 0.7, mode(640, 0.03, 8e6)
    u = np.array([np.cos(angle), np.sin(angle)])
    cutting = Cutting("milling", teeth=4, tangential=7e8, normal=2.5e8, mode="up", immersion=0.3)
    speeds, lines = np.linspace(4000.0, 12000.0, 11), np.arange(5.0, 2500.0, 5.0)
    milled = stability_lobes(lambda f: shape_mode(f)[:, None, None] * np.outer(u, u), cutting, speeds, frequency=lines)
    projected = float(u @ mean_by_quadrature(cutting) @ u)
    turning = Cutting("turning", specific=projected)
    turned = chosen.stability_lobes(uncoupled(shape_mode), turning, 4 * speeds, frequency=lines)
    assert milled.depth == pytest.approx(turned.depth, rel=1e-9)
    assert milled.lobe.tolist() == turned.lobe.tolist()


def test_more_immersion_never_raises_the_minimum_depth_of_a_cut_along_the_normal() -> None:
    tool = uncoupled(mode(640, 0.03, 8e6))
    depths = [solved(tool, "down", a, axes=("y",)).minimum_depth for a in (0.05, 0.1, 0.2, 0.4)]
    assert depths == sorted(depths, reverse=True)
