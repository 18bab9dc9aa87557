"""Weak lines of a slow cut that follow the strong ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from machines import lobes_at_amplitude, read_machine
from machines.cutting.loops import iterated_loop, loop_samples
from machines.cutting.loops.critical_depth import first_crossings, near
from machines.cutting.loops.folded_lines import folded_eigenvalue
from machines.cutting.loops.iterated_loop import IteratedLoop
from machines.cutting.loops.loop_branches import Crossing, nearest_of
from machines.cutting.loops.multi_frequency import HarmonicLoop
from machines.cutting.loops.strong_lines import folded, strong_lines
from machines.cutting.process.cutting import Cutting
from machines.tool.at_rest import kept_tool
from machines.tool.bounded_band import shape, spectrum
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import tool_point

MILL = Path(__file__).parents[2] / "machines" / "library" / "column_mill_a.toml"
SLOT = Cutting("milling", teeth=3, tangential=1.8e9, normal=5.4e8, mode="slot")
TOOL = ToolModel.from_modes(
    [130.0, 420.0, 860.0, 2250.0],
    [0.02, 0.03, 0.02, 0.02],
    [400.0, 60.0, 4.0, 6.0],
    [[1.0, 0.1, 0.9, 0.4], [0.2, 1.0, -0.5, 1.0]],
)


def loop_of(harmonics: int) -> HarmonicLoop:
    point = tool_point(TOOL, TOOL.axes, TOOL.lines)
    return HarmonicLoop(spectrum(point, 1e5), SLOT, (0, 1), 50.0, harmonics)


def crossing_of(many: HarmonicLoop) -> Crossing:
    """The lowest one, looked for on the strong lines."""
    resolved = shape(tool_point(TOOL, TOOL.axes, TOOL.lines))
    strong = strong_lines(many, resolved, 0.05 * resolved.largest)
    return near(many, first_crossings(strong, resolved.folded(many.tooth_frequency))[0])


def test_harmonics_of_the_cut_are_its_fourier_coefficients() -> None:
    """Of a tooth in the cut, by a rule of equal steps that ends on both edges."""
    angle = np.linspace(0.0, np.pi, 20001)
    u, v = SLOT.tooth(angle)
    step = np.pi / 20000
    for r, found in zip(range(-4, 5), loop_of(3).of_cut(4), strict=True):
        value = u[:, :, None] * v[:, None, :] * np.exp(-3j * r * angle)[:, None, None]
        integral = step * (np.sum(value, axis=0) - (value[0] + value[-1]) / 2)
        np.testing.assert_allclose(found, 3 / (2 * np.pi) * integral, rtol=0, atol=1e-6 * 1.8e9)


def test_a_folded_eigenvalue_is_that_of_all_lines() -> None:
    many = loop_of(100)
    found = crossing_of(many)
    matrix = many.by_lines(np.array([found.fraction]))[0]
    guess = found.eigenvalue * (1 + 1e-4j)
    value, vector = IteratedLoop(many).nearest(found.fraction, guess)
    assert value == pytest.approx(nearest_of(matrix, guess)[0], rel=1e-12)
    assert np.linalg.norm(matrix @ vector - value * vector) <= 1e-10 * abs(value)


def test_a_followed_crossing_closes_all_lines() -> None:
    """1 + depth·λ·(1 − e^(−2πjν)) = 0 to the last digits, from a guess a percent off; and it is that of the search."""
    many = loop_of(100)
    found = crossing_of(many)
    guess = Crossing(1.01 * found.depth, found.fraction * (1 - 1e-3), found.eigenvalue)
    crossing = IteratedLoop(many).crossing(guess)
    assert crossing is not None
    assert crossing.carried is not None
    assert crossing.depth == pytest.approx(found.depth, rel=1e-9)
    assert crossing.fraction == pytest.approx(found.fraction, rel=1e-9)
    matrix = many.by_lines(np.array([crossing.fraction]))[0]
    turn = 1 - np.exp(-2j * np.pi * crossing.fraction)
    left = crossing.carried + crossing.depth * turn * (matrix @ crossing.carried)
    assert np.linalg.norm(left) < 1e-10 * np.linalg.norm(crossing.carried)


def test_the_strongest_branches_of_many_lines_are_those_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    many, resolved = loop_of(40), shape(tool_point(TOOL, TOOL.axes, TOOL.lines))
    lines = strong_lines(many, resolved, 0.01 * resolved.largest)
    assert lines.size >= loop_samples._LARGE
    fraction = resolved.folded(many.tooth_frequency)
    some = first_crossings(lines, fraction)
    monkeypatch.setattr(loop_samples, "_LARGE", 10**6)
    every = first_crossings(lines, fraction)
    assert [one.depth for one in some] == pytest.approx([one.depth for one in every], rel=1e-9)


def test_lines_that_drive_themselves_are_followed_to_the_same_eigenvalue() -> None:
    """With the strongest line left out mixed rounds still settle; and a guess far off may mean another eigenvalue."""
    many = loop_of(100)
    found = crossing_of(many)
    matrix = many.by_lines(np.array([found.fraction]))[0]
    size = np.linalg.norm(many.lines(np.array([found.fraction]))[0], axis=(1, 2))
    strong = np.repeat((size >= 0.1 * np.max(size)) & (size < np.max(size)), 2)
    among = matrix[strong][:, strong]
    led = folded_eigenvalue(lambda x: np.asarray(matrix @ x), among, strong, found.eigenvalue)
    assert led is not None
    assert led[0] == pytest.approx(found.eigenvalue, rel=1e-9)
    strong = np.repeat(size >= 0.1 * np.max(size), 2)
    among = matrix[strong][:, strong]
    assert folded_eigenvalue(lambda x: np.asarray(matrix @ x), among, strong, found.eigenvalue) is not None
    assert folded_eigenvalue(lambda x: np.asarray(matrix @ x), among, strong, 1.05 * found.eigenvalue) is None


def test_weak_lines_move_a_crossing_as_in_the_whole_loop() -> None:
    """What they do to each other is a share of what they do, so that less than a quarter of the change is left
    where the gain round their loop is below 1."""
    many, resolved = loop_of(60), shape(tool_point(TOOL, TOOL.axes, TOOL.lines))
    whole = crossing_of(many)
    strong = strong_lines(many, resolved, 0.08 * resolved.largest)
    every = strong_lines(many, resolved, 1e-3 * resolved.largest)
    few = folded(every, resolved, 0.08 * resolved.largest, whole.depth)
    assert few.size == strong.size
    left_out, moved = (abs(near(loop, whole).depth / whole.depth - 1) for loop in (strong, few))
    assert moved < 0.25 * left_out


def test_two_flips_close_to_each_other_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 3887.4 rpm the second flip needs 2.6 % more depth than the first."""
    machine = read_machine(MILL)
    found = lobes_at_amplitude(machine, [3887.437185929648], method="multi-frequency")
    monkeypatch.setattr(iterated_loop, "_SMALL", 10**6)
    by_all = lobes_at_amplitude(machine, [3887.437185929648], method="multi-frequency")
    assert found.kind.tolist() == by_all.kind.tolist() == ["flip"]
    assert found.depth == pytest.approx(by_all.depth, rel=1e-9)


@pytest.mark.parametrize("speed", [2333.6683417085424, 2333.853309794319])
def test_no_flip_lies_below_a_crossing_that_has_met_half_the_teeth(speed: float) -> None:
    """The Hopf crossing of the strong lines is two flips of all lines; of all eigenvalues there the lowest is told."""
    machine = read_machine(MILL)
    found = lobes_at_amplitude(machine, [speed], method="multi-frequency")
    cut = Cutting(**dict(machine.cutting or {}))
    loop = HarmonicLoop(kept_tool(machine), cut, (0, 1), cut.cuts_per_revolution * speed / 60, 100)
    values = np.linalg.eigvals(loop.by_lines(np.array([0.5]))[0])
    flips = values.real[(np.abs(values.imag) <= 1e-9 * np.abs(values)) & (values.real < 0)]
    assert found.depth[0] == pytest.approx(-0.5 / np.min(flips), rel=1e-5)


def test_a_flip_is_real_to_all_digits_in_a_large_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 2334.04 rpm a Hopf crossing has met half the tooth frequency and become two flips 2 % apart."""
    machine, speed = read_machine(MILL), [2334.0382777735117]
    found = lobes_at_amplitude(machine, speed, method="multi-frequency")
    monkeypatch.setattr(loop_samples, "_LARGE", 10**6)
    by_all = lobes_at_amplitude(machine, speed, method="multi-frequency")
    assert found.kind.tolist() == by_all.kind.tolist() == ["flip"]
    assert found.depth == pytest.approx(by_all.depth, rel=1e-9)
