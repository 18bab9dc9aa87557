"""Receptances at the door of the lobe solvers: sampled or exact, what is refused and what is said."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from jointlib.frf import FRF
from machines.lobes import Cutting, Receptance, stability_lobes, tool_point

SLOT = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="slot")
TURNING = Cutting("turning", specific=1e9)
ROTATION = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])


def tool(f: Array) -> ComplexArray:
    """The 922 Hz tool in one direction, half-power bandwidth 20.3 Hz."""
    return np.asarray((1 / (1.34005e6 * (1 - (f / 922) ** 2 + 2j * 0.011 * f / 922)))[:, None, None])


def turned_tool(f: Array) -> ComplexArray:
    """Two principal modes at 23° to the feed, so with cross terms."""
    stiffness = np.array([5.59e6, 5.715e6]), np.array([603.0, 666.0]), np.array([0.039, 0.035])
    k, fn, zeta = stiffness
    r = f[:, None] / fn
    principal = 1 / (k * (1 - r**2 + 2j * zeta * r))
    return np.asarray(np.einsum("ij,fj,kj->fik", ROTATION, principal, ROTATION))


def sampled(receptance: Receptance, f: Array, names: tuple[str, ...]) -> FRF:
    return FRF(f, receptance(f), names, names)


@pytest.mark.parametrize(("spacing", "tolerance"), [(5.1, 6e-5), (10.2, 2.5e-4)])
def test_sampled_tool_agrees_with_the_exact_one(spacing: float, tolerance: float) -> None:
    """Four and two lines in the half-power bandwidth; 1/G is off by (Δf/f_n)²/(8ζ) at the very most."""
    f = np.arange(spacing, 3000.0, spacing)
    speeds = np.array([5000.0, 10000.0, 18000.0])
    exact = stability_lobes(tool, SLOT, speeds, frequency=f)
    measured = stability_lobes(sampled(tool, f, ("cutter.x",)), SLOT, speeds)
    assert measured.depth == pytest.approx(exact.depth, rel=tolerance)
    assert not np.array_equal(measured.depth, exact.depth)


@pytest.mark.slow
def test_sampled_tool_with_cross_terms_agrees_with_the_exact_one() -> None:
    f, speeds = np.arange(0.0, 3000.0, 2.0), np.linspace(5000.0, 20000.0, 31)
    exact = stability_lobes(turned_tool, SLOT, speeds, frequency=f)
    measured = stability_lobes(sampled(turned_tool, f, ("cutter.x", "cutter.y")), SLOT, speeds)
    assert measured.depth == pytest.approx(exact.depth, rel=1e-4)


def test_interpolation_passes_through_the_lines() -> None:
    f = np.arange(10.0, 2000.0, 10.0)
    point = tool_point(sampled(turned_tool, f, ("t.x", "t.y")))
    assert point(f) == pytest.approx(turned_tool(f), rel=1e-9)


@pytest.mark.thorough
def test_search_lines_do_not_decide_the_depth_of_an_exact_receptance() -> None:
    speeds = np.linspace(4000.0, 20000.0, 17)
    coarse, fine = (stability_lobes(turned_tool, SLOT, speeds, frequency=np.arange(d, 3000.0, d)) for d in (30.0, 1.7))
    assert coarse.depth == pytest.approx(fine.depth, rel=1e-9)
    assert coarse.minimum_depth == pytest.approx(fine.minimum_depth, rel=1e-9)


def test_lobes_are_solved_speed_by_speed() -> None:
    speeds = np.array([[5000.0, 7000.0, 9000.0], [11000.0, 13000.0, 15000.0]])
    lines = np.arange(5.0, 3000.0, 5.0)
    together = stability_lobes(turned_tool, SLOT, speeds, frequency=lines)
    alone = [float(stability_lobes(turned_tool, SLOT, s, frequency=lines).depth) for s in speeds.ravel()]
    assert together.depth.shape == together.lobe.shape == together.kind.shape == speeds.shape
    assert together.depth.ravel() == pytest.approx(np.array(alone), rel=1e-11)


def test_narrower_band_of_a_measurement_keeps_the_lobes_inside_it() -> None:
    frf = sampled(tool, np.arange(2.0, 3000.0, 2.0), ("cutter.x",))
    whole = stability_lobes(frf, SLOT, 5000.0, "zero-order")
    part = stability_lobes(frf, SLOT, 5000.0, "zero-order", frequency=[701.0, 900.0, 1501.0])
    assert float(part.depth) == pytest.approx(float(whole.depth), rel=1e-12)
    assert part.branches[0].frequency[-1] == 1501.0


@pytest.mark.thorough
def test_noisy_measurement_gives_lobes_near_the_clean_ones() -> None:
    f, rng = np.arange(2.0, 3000.0, 2.0), np.random.default_rng(7)
    clean = sampled(tool, f, ("cutter.x",))
    noise = rng.normal(size=(2, len(f), 1, 1)) @ np.ones((1, 1))
    noisy = FRF(f, clean.receptance + 2e-10 * (noise[0] + 1j * noise[1]), clean.outputs, clean.inputs)
    speeds = np.linspace(5000.0, 20000.0, 16)
    first, second = (stability_lobes(frf, SLOT, speeds) for frf in (clean, noisy))
    assert second.minimum_depth == pytest.approx(first.minimum_depth, rel=2e-2)
    assert np.all(second.depth < 1.05 * first.depth)


def test_names_say_which_direction_is_the_feed() -> None:
    f = np.arange(2.0, 3000.0, 2.0)
    down = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.5)
    by_name = stability_lobes(sampled(tool, f, ("cutter.y",)), down, 5000.0)
    by_word = stability_lobes(sampled(tool, f, ("spindle.q1",)), down, 5000.0, axes=("y",))
    along_x = stability_lobes(sampled(tool, f, ("cutter.x",)), down, 5000.0)
    assert float(by_name.depth) == float(by_word.depth)
    assert float(by_name.depth) != pytest.approx(float(along_x.depth), rel=0.1)
    with pytest.raises(InputError, match=r"spindle\.q1 do not say which is the feed"):
        stability_lobes(sampled(tool, f, ("spindle.q1",)), down, 5000.0)
    with pytest.raises(InputError, match="x and y in this order"):
        stability_lobes(sampled(turned_tool, f, ("t.y", "t.x")), down, 5000.0)


def test_conjugate_data_are_refused_and_stray_signs_reported() -> None:
    f = np.arange(2.0, 3000.0, 2.0)
    with pytest.raises(InputError, match="complex conjugate"):
        stability_lobes(lambda f: tool(f).conj(), SLOT, 5000.0, frequency=f)
    values = tool(f)
    values[:5] = values[:5].real + 0.01j * np.abs(values[:5])
    lobes = stability_lobes(FRF(f, values, ("c.x",), ("c.x",)), SLOT, 5000.0)
    assert any("positive on 5 of 1499 lines" in sentence for sentence in lobes.warnings)


def test_wide_lines_are_reported() -> None:
    def warned(spacing: float) -> bool:
        f = np.arange(spacing, 3000.0, spacing)
        lobes = stability_lobes(sampled(tool, f, ("cutter.x",)), SLOT, 5000.0)
        return any("half-power bandwidth" in sentence for sentence in lobes.warnings)

    assert warned(23.0)
    assert not warned(4.0)


def test_measured_band_that_ends_inside_a_lobe_is_reported() -> None:
    lobes = stability_lobes(
        sampled(tool, np.arange(2.0, 925.0, 2.0), ("cutter.x",)), SLOT, [5000.0, 9000.0], "zero-order"
    )
    assert lobes.outcome is Outcome.FRF_TOO_SHORT
    assert any("ends at 924 Hz inside a lobe" in sentence for sentence in lobes.warnings)


def test_band_that_starts_inside_a_lobe_is_reported() -> None:
    exact = stability_lobes(tool, SLOT, 5400.0, "zero-order", frequency=np.arange(2.0, 3000.0, 2.0))
    start = float(exact.chatter_frequency) + 1.0
    lobes = stability_lobes(tool, SLOT, 5400.0, "zero-order", frequency=np.arange(start, 3000.0, 2.0))
    assert lobes.outcome is Outcome.FRF_TOO_SHORT
    assert any("starts at" in sentence for sentence in lobes.warnings)


def test_result_says_what_it_does_not_cover() -> None:
    lobes = stability_lobes(tool, SLOT, 5000.0, "zero-order", frequency=np.arange(2.0, 3000.0, 2.0))
    assert any("flip lobes" in note and "absent" in note for note in lobes.notes)
    assert any("helix" in note and "process damping" in note for note in lobes.notes)
    kicked = Cutting("turning", specific=1e9, exponent=0.75)
    turned = stability_lobes(tool, kicked, 5000.0, frequency=np.arange(2.0, 3000.0, 2.0))
    assert any("a knock can start chatter" in sentence for sentence in turned.warnings)


def test_unknown_or_unsuited_methods_are_refused() -> None:
    f = np.arange(2.0, 3000.0, 2.0)
    with pytest.raises(InputError, match=r"did you mean 'zero-order'\?"):
        stability_lobes(tool, SLOT, 5000.0, method="zeroorder", frequency=f)
    with pytest.raises(InputError, match="expected one of collocation, multi-frequency, turning, zero-order"):
        stability_lobes(tool, SLOT, 5000.0, method="by hand", frequency=f)
    with pytest.raises(InputError, match="the process is milling, expected turning"):
        stability_lobes(tool, SLOT, 5000.0, method="turning", frequency=f)
    with pytest.raises(InputError, match="the process is turning, expected milling"):
        stability_lobes(tool, TURNING, 5000.0, method="zero-order", frequency=f)


def test_receptances_that_cannot_be_used_are_refused() -> None:
    f = np.arange(2.0, 3000.0, 2.0)
    with pytest.raises(InputError, match="needs the frequencies"):
        stability_lobes(tool, SLOT, 5000.0)
    with pytest.raises(InputError, match="expected an FRF or a function"):
        stability_lobes(tool(f), SLOT, 5000.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="not finite"):
        stability_lobes(lambda f: np.where(f < 500, np.nan, 1)[:, None, None] * tool(f), SLOT, 5000.0, frequency=f)
    with pytest.raises(InputError, match=r"shape \(1499, 1, 1\), expected \(1499, 2, 2\)"):
        stability_lobes(tool, SLOT, 5000.0, frequency=f, axes=("x", "y"))
    with pytest.raises(InputError, match="the same ones in the same order"):
        stability_lobes(FRF(f, tool(f), ("a.x",), ("b.x",)), SLOT, 5000.0)
    with pytest.raises(InputError, match="too few"):
        stability_lobes(tool, SLOT, 5000.0, frequency=[1.0, 2.0])
    with pytest.raises(InputError, match="ascending"):
        stability_lobes(tool, SLOT, 5000.0, frequency=f[::-1])
    with pytest.raises(InputError, match="no axis along the chip thickness"):
        stability_lobes(tool, TURNING, 5000.0, frequency=f, axes=("y",))
    with pytest.raises(InputError, match="have 2 to 2998 Hz"):
        stability_lobes(sampled(tool, f, ("c.x",)), SLOT, 5000.0, frequency=[1.0, 50.0, 4000.0])


@pytest.mark.parametrize("speed", [0.0, -100.0, np.nan, [], [5000.0, np.inf]])
def test_speeds_that_cannot_be_are_refused(speed: float | list[float]) -> None:
    with pytest.raises(InputError, match="spindle speed"):
        stability_lobes(tool, SLOT, speed, frequency=np.arange(2.0, 3000.0, 2.0))
