"""Modes of simulated frequency responses: poles, shapes, errors, and nothing that is not there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from repeats import repeats

from jointlib.modal_fit.basis import Ends, modal
from jointlib.modal_fit.fit import fit_modes
from jointlib.modal_fit.fitted_modes import FittedModes
from jointlib.modal_fit.lscf import poles_by_order
from jointlib.modal_fit.poles import fit_poles
from jointlib.modal_fit.responses import Responses
from jointlib.modal_fit.stabilisation import chart_of
from machines import stability_lobes
from machines.components.modal import Modal
from machines.cutting.process.cutting import Cutting
from machines.measured_modes.modal_component import component_of
from machines.tool.tool_model import ToolModel

MACHINES = range(40)


@dataclass(frozen=True)
class Modes:
    """What made the responses."""

    frequency: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray

    def receptance(self, f: np.ndarray, pairs: tuple[tuple[int, int], ...]) -> np.ndarray:
        s, w = 2j * np.pi * f[:, None], 2 * np.pi * self.frequency
        below = s**2 + 2 * self.damping_ratio * w * s + w**2
        return np.array([np.sum(self.shapes[o] * self.shapes[i] / below, axis=1) for o, i in pairs])


def measured(
    modes: Modes, f: np.ndarray, pairs: tuple[tuple[int, int], ...], decibels: float, rng: np.random.Generator
) -> Responses:
    """Responses with noise so many decibels below the rms of each."""
    H = modes.receptance(f, pairs)
    sigma = np.sqrt(np.mean(np.abs(H) ** 2, axis=1, keepdims=True)) * 10 ** (-decibels / 20) * np.ones(H.shape)
    noise = sigma * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    return Responses(f, H + noise, sigma, pairs, tuple(f"p{k}" for k in range(len(modes.shapes))))


def random_machine(seed: int) -> tuple[Modes, Responses]:
    """2 to 12 modes, 1 to 8 responses in one column, 30 to 60 dB."""
    rng = np.random.default_rng(seed)
    m, places, decibels = int(rng.integers(2, 13)), int(rng.integers(1, 9)), rng.uniform(30, 60)
    f = np.sort(rng.uniform(100, 1900, m))
    while m > 1 and np.min(np.diff(f) / f[1:]) < 0.012:
        f = np.sort(rng.uniform(100, 1900, m))
    zeta = rng.uniform(0.005, 0.04, m)
    shapes = rng.normal(size=(places, m)) * (f / 500) ** rng.uniform(0, 1)
    shapes[0] = np.sign(shapes[0]) * np.maximum(np.abs(shapes[0]), 0.3 * np.sqrt(np.mean(shapes[0] ** 2)))
    modes = Modes(f, zeta, shapes)
    pairs = tuple((o, 0) for o in range(places))
    return modes, measured(modes, np.arange(40.0, 2000.0), pairs, decibels, rng)


def match(modes: Modes, found: FittedModes) -> list[tuple[int, int]]:
    """True and fitted modes that belong together: nearest, within a percent, each once."""
    out: list[tuple[int, int]] = []
    for k, f in enumerate(found.frequency):
        r = int(np.argmin(np.abs(modes.frequency - f)))
        if abs(modes.frequency[r] / f - 1) < 0.01 and r not in [one for one, _ in out]:
            out.append((r, k))
    return out


def judged(modes: Modes, found: FittedModes) -> tuple[int, int, int, int]:
    """How many modes were found; with a right frequency; with a right damping; that are none."""
    pairs = match(modes, found)
    good_f = sum(abs(found.frequency[k] / modes.frequency[r] - 1) < 1e-3 for r, k in pairs)
    off = [(abs(found.damping_ratio[k] - modes.damping_ratio[r]), r, k) for r, k in pairs]
    good_z = sum(d < max(0.05 * modes.damping_ratio[r], 1.96 * found.damping_ratio_error[k]) for d, r, k in off)
    return len(pairs), good_f, good_z, len(found.frequency) - len(pairs)


@pytest.mark.parametrize("seed", repeats([14, 20, 22, 34], lambda seed: seed in (14, 34)))
def test_modes_of_a_random_machine_are_found_and_no_others(seed: int) -> None:
    modes, responses = random_machine(seed)
    found = fit_modes(responses)
    count, good_f, good_z, none = judged(modes, found)
    assert (count, none) == (len(modes.frequency), 0)
    assert good_f == count
    assert good_z >= 0.9 * count
    assert found.is_proportional
    assert 0.9 < found.scatter < 1.2


def depths(frequency: np.ndarray, zeta: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Limits of turning at the driven place over the speeds."""
    tool = ToolModel.from_modes(frequency, zeta, np.ones(len(zeta)), shape[None], ("x",))
    return stability_lobes(tool, Cutting("turning", specific=1e9), np.linspace(2000.0, 20000.0, 24), "turning").depth


@pytest.mark.slow
@pytest.mark.parametrize("machines", [MACHINES, range(100, 180)])
def test_modes_and_depths_of_many_random_machines(machines: range) -> None:
    """Depths where they are least: between lobes they rise so steeply that a thousandth of a frequency moves them."""
    total = np.zeros(4, dtype=int)
    true, off = 0, []
    for seed in machines:
        modes, responses = random_machine(seed)
        found = fit_modes(responses)
        total += judged(modes, found)
        true += len(modes.frequency)
        part = component_of(found, "part")
        assert isinstance(part, Modal)
        ours = depths(part.frequency, part.damping_ratio, part.shapes[0])
        truth = depths(modes.frequency, modes.damping_ratio, modes.shapes[0])
        off.append((np.max(np.abs(ours / truth - 1)), abs(np.min(ours) / np.min(truth) - 1)))
    every, least = np.transpose(off)
    assert np.mean(every < 0.03) >= 0.98
    assert np.max(least) < 0.03
    count, good_f, good_z, none = total
    assert none <= 1  # of two modes a third of their half-power widths apart one remains, between them
    assert count >= 0.98 * true  # what noise hides cannot be found
    assert good_f >= 0.95 * count
    assert good_z >= 0.9 * count


@pytest.mark.slow
def test_the_errors_of_frequency_and_damping_are_those_of_repeated_fits() -> None:
    modes = Modes(np.array([300.0, 340.0]), np.array([0.02, 0.015]), np.array([[1.0, 0.7], [0.4, -0.9]]))
    pairs = ((0, 0), (1, 0))
    scores = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        found = fit_modes(measured(modes, np.arange(150.0, 600.0, 3.0), pairs, 40, rng), share=0.0)
        assert len(found.frequency) == 2
        scores += [*(found.frequency - modes.frequency) / found.frequency_error]
        scores += [*(found.damping_ratio - modes.damping_ratio) / found.damping_ratio_error]
    assert np.std(scores) == pytest.approx(1.0, abs=0.25)
    assert abs(np.mean(scores)) < 0.3


@pytest.mark.thorough
def test_the_residual_modes_carry_what_lies_beyond_the_band() -> None:
    """Of five modes three lie in the band; the fit is as good as the noise, and the three are right."""
    f = np.array([60.0, 300.0, 450.0, 700.0, 2200.0])
    modes = Modes(f, np.full(5, 0.02), np.array([[0.8, 1.0, 0.7, 0.9, 6.0], [0.8, 0.3, -0.9, 0.5, -5.0]]))
    found = fit_modes(measured(modes, np.arange(200.0, 900.0, 1.0), ((0, 0), (1, 0)), 55, np.random.default_rng(3)))
    np.testing.assert_allclose(found.frequency, f[1:4], rtol=3e-4)
    np.testing.assert_allclose(found.damping_ratio, 0.02, rtol=0.02)
    assert found.shape_fit is not None
    assert len(found.shape_fit.ends) == 2
    assert found.scatter < 1.3


def test_a_free_body_keeps_its_mass_at_zero_hertz() -> None:
    mass = 4.0
    modes = Modes(np.array([1e-3, 500.0, 900.0]), np.full(3, 0.01), np.array([[mass**-0.5, 0.4, 0.5]]))
    responses = measured(modes, np.arange(60.0, 1200.0, 1.0), ((0, 0),), 50, np.random.default_rng(6))
    found = fit_modes(responses, free=True)
    part = component_of(found, "body")
    assert isinstance(part, Modal)
    np.testing.assert_allclose(part.frequency, [500.0, 900.0, 0.0], rtol=1e-3)
    assert 1 / part.shapes[0, 2] ** 2 == pytest.approx(mass, rel=0.01)


def test_two_columns_tell_two_modes_at_one_frequency_apart() -> None:
    shapes = np.array([[1.0, 0.3, 0.6], [-0.3, 1.0, 0.5], [0.5, 0.6, -0.8]])
    modes = Modes(np.array([400.0, 400.0, 620.0]), np.array([0.02, 0.02, 0.015]), shapes)
    pairs = tuple((o, i) for o in range(3) for i in (0, 1))
    found = fit_modes(measured(modes, np.arange(200.0, 900.0, 1.0), pairs, 45, np.random.default_rng(4)))
    np.testing.assert_allclose(found.frequency, modes.frequency, rtol=2e-3)
    assert found.shapes is not None
    H = modes.receptance(found.responses.frequency, pairs)
    assert np.linalg.norm(found.fitted - H) < 0.003 * np.linalg.norm(H)


def test_damping_that_couples_the_modes_makes_shapes_complex() -> None:
    M, K = np.eye(2), np.array([[2.2, -1.1], [-1.1, 2.0]]) * 4e6
    C = np.diag([200.0, 4.0])
    f = np.arange(100.0, 800.0, 0.5)
    s = 2j * np.pi * f
    H = np.linalg.inv(s[:, None, None] ** 2 * M + s[:, None, None] * C + K)
    value = np.array([H[:, 0, 0], H[:, 1, 0]])
    sigma = np.full(value.shape, 1e-3 * np.max(np.abs(value)))
    rng = np.random.default_rng(5)
    noise = sigma * (rng.normal(size=sigma.shape) + 1j * rng.normal(size=sigma.shape)) / np.sqrt(2)
    found = fit_modes(Responses(f, value + noise, sigma, ((0, 0), (1, 0)), ("a", "b")))
    poles = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]]))
    true = poles[np.argsort(np.abs(poles))][::2]
    np.testing.assert_allclose(found.frequency, np.abs(true) / (2 * np.pi), rtol=1e-3)
    np.testing.assert_allclose(found.damping_ratio, -true.real / np.abs(true), rtol=0.02)
    assert not found.is_proportional
    assert np.linalg.norm(found.fitted - value) < 3e-3 * np.linalg.norm(value)


def test_poles_on_a_shifted_line_are_those_of_the_structure() -> None:
    modes = Modes(np.array([200.0, 350.0]), np.array([0.004, 0.006]), np.array([[1.0, 0.8]]))
    f, shift = np.arange(100.0, 500.0, 2.0), 25.0
    s = 2j * np.pi * f + shift
    w = 2 * np.pi * modes.frequency
    value = np.sum(modes.shapes**2 / (s[:, None] ** 2 + 2 * modes.damping_ratio * w * s[:, None] + w**2), axis=1)
    responses = Responses(f, value[None], np.full((1, len(f)), 1e-4 * np.max(np.abs(value))), ((0, 0),), ("x",), shift)
    seeds = poles_by_order(responses, 8)[-1]
    near = [seeds[np.argmin(np.abs(np.abs(seeds) - one))] for one in w]
    np.testing.assert_allclose(np.abs(near), w, rtol=1e-4)
    fit = fit_poles(responses, 1.01 * w, 0.02 * w, Ends.of(f))
    np.testing.assert_allclose(fit.decay, modes.damping_ratio * w, rtol=1e-6)


@pytest.mark.parametrize("frequency", [60.0, 250.0, 1000.0, 1700.0, 1900.0, 1980.0])
def test_matrix_fractions_see_a_pole_anywhere_in_the_band(frequency: float) -> None:
    modes = Modes(np.array([frequency]), np.array([0.02]), np.array([[1.0]]))
    responses = measured(modes, np.arange(40.0, 2000.0), ((0, 0),), 60, np.random.default_rng(0))
    w = 2 * np.pi * frequency
    poles = poles_by_order(responses, 8)[-1]
    assert np.min(np.abs(np.abs(poles) - w)) < 2e-3 * w


@pytest.mark.slow
def test_a_mode_that_hardly_moves_the_driven_place_is_found_by_the_others() -> None:
    """Its residue at the driving point is noise, of either sign."""
    shapes = np.array([[1.0, 1e-3, 0.8], [0.7, 1.5, -0.6], [-0.4, 1.2, 0.9]])
    modes = Modes(np.array([300.0, 520.0, 800.0]), np.full(3, 0.02), shapes)
    pairs = ((0, 0), (1, 0), (2, 0), (1, 1))
    for seed in range(4):
        responses = measured(modes, np.arange(100.0, 1000.0, 2.0), pairs, 30, np.random.default_rng(seed))
        assert judged(modes, fit_modes(responses))[::3] == (3, 0)


@pytest.mark.thorough
def test_the_chart_marks_what_stays() -> None:
    modes, responses = random_machine(14)
    chart = chart_of(poles_by_order(responses, 20))
    for f in modes.frequency:
        assert np.sum(chart.stable & (np.abs(chart.frequency / f - 1) < 2e-3)) >= 5
    found = fit_modes(responses)
    _, fit, error = found.plot().figure.axes
    assert "[Hz]" in error.get_xlabel()
    assert all("[µm/N]" in axes.get_ylabel() for axes in (fit, error))
    np.testing.assert_allclose(error.lines[0].get_ydata(), 1e6 * np.abs(responses.value[0] - found.fitted[0]))


def test_the_residual_basis_is_quiet_in_the_band() -> None:
    f = np.linspace(100.0, 1000.0, 10)
    ends = Ends.of(f)
    above, below = (modal(2j * np.pi * f, np.array([w]), np.array([d]))[:, 0] for w, d in (ends.above, ends.below))
    np.testing.assert_allclose(above * ends.above[0] ** 2, 1, atol=0.025)
    np.testing.assert_allclose(below * -((2 * np.pi * f) ** 2), 1, atol=0.15)


@pytest.mark.parametrize("seed", repeats([2, 11], lambda seed: seed == 11))
def test_without_a_driving_point_poles_are_told_all_the_same(seed: int) -> None:
    modes, responses = random_machine(seed)
    keep = slice(1, None)
    other = replace(
        responses,
        value=responses.value[keep],
        deviation=responses.deviation[keep],
        pairs=responses.pairs[keep],
    )
    found = fit_modes(other)
    assert found.shapes is None
    assert "no driving point" in found.notes[0]
    assert judged(modes, found)[1:] == (len(modes.frequency), len(modes.frequency), 0)
