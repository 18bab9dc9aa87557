"""Strong lines of a slow cut: which are kept, and that what they find is what all lines find."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import numpy as np
import pytest

from machines import lobes_at_amplitude, read_machine
from machines.cutting.loops import harmonic_crossing as crossing
from machines.cutting.loops import iterated_loop, loop_samples, multi_frequency
from machines.cutting.loops.critical_depth import first_crossings, near
from machines.cutting.loops.iterated_loop import IteratedLoop
from machines.cutting.loops.multi_frequency import HarmonicLoop
from machines.cutting.loops.strong_lines import StrongLines, strong_lines
from machines.cutting.process.cutting import Cutting
from machines.deadline import OutOfTime
from machines.tool.bounded_band import Shape, shape, spectrum
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import ToolPoint, tool_point

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
CUT = Cutting("milling", teeth=3, tangential=1.8e9, normal=5.4e8, mode="down", immersion=0.6)


def tool(seed: int) -> ToolModel:
    """Five modes in two directions that are not the axes."""
    rng = np.random.default_rng(seed)
    frequency = np.array([130.0, 420.0, 860.0, 2250.0, 4100.0]) * rng.uniform(0.9, 1.1, 5)
    damping, stiffness = rng.uniform(0.008, 0.012, 5), np.array([2e9, 2e9, 2e7, 1e9, 4e7])
    w = 2 * np.pi * frequency
    turned = w * np.sqrt(1 - damping**2)
    angle = rng.uniform(0, np.pi, 5)
    shapes = np.stack([np.cos(angle), np.sin(angle)], axis=1) * (w / np.sqrt(stiffness))[:, None]
    return ToolModel(
        -damping * w + 1j * turned, shapes + 0j, shapes / (2j * turned[:, None]), np.zeros((2, 2)), ("x", "y")
    )


def loop_of(seed: int, speed: float) -> tuple[HarmonicLoop, Shape]:
    """The loop of a tool and its receptance's shape."""
    model = tool(seed)
    point: ToolPoint = tool_point(lambda f: model(f), ("x", "y"), np.geomspace(40.0, 12e3, 1500))
    loop = HarmonicLoop(spectrum(point, 1e5), CUT, (0, 1), CUT.cuts_per_revolution * speed / 60, 0)
    return loop, shape(point)


def test_the_depth_of_the_strong_lines_settles_where_that_of_all_lines_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the rows of the loop less than half are kept."""
    machine = read_machine(LIBRARY / "column_mill_a.toml")
    sizes = []

    def watched(loop: HarmonicLoop, resolved: Shape, level: float) -> StrongLines:
        strong = strong_lines(loop, resolved, level)
        sizes.append(strong.size / loop.size)
        return strong

    def every(loop: HarmonicLoop, _resolved: Shape, _level: float) -> StrongLines:
        return StrongLines(loop, np.ones((len(loop.orders), 2), dtype=bool))

    found = []
    for lines in (watched, every):
        monkeypatch.setattr(crossing, "strong_lines", lines)
        found.append(lobes_at_amplitude(machine, [2800.0], method="multi-frequency"))
    assert min(sizes) < 0.5
    assert found[0].kind.tolist() == found[1].kind.tolist() == ["hopf"]
    assert found[0].depth == pytest.approx(found[1].depth, rel=crossing.AGREE)


def test_a_line_is_kept_with_its_mate_and_where_a_resonance_lies_between_its_ends() -> None:
    loop, resolved = loop_of(0, 2000.0)
    many = HarmonicLoop(loop.receptance, CUT, (0, 1), loop.tooth_frequency, 60)
    kept = strong_lines(many, resolved, 0.3 * resolved.largest).kept
    assert np.array_equal(kept, kept[::-1])  # q and −q−1 carry the same frequency at ν = 1/2
    strongest = resolved.lines[np.argmax(resolved.size)]
    assert np.any(kept[list(many.orders).index(np.floor(strongest / loop.tooth_frequency))])
    assert 0 < np.count_nonzero(kept) < 0.3 * kept.size


def test_rows_of_the_strong_lines_are_those_of_the_whole_loop() -> None:
    loop, resolved = loop_of(1, 2000.0)
    many = HarmonicLoop(loop.receptance, CUT, (0, 1), loop.tooth_frequency, 30)
    strong = strong_lines(many, resolved, 0.3 * resolved.largest)
    fraction = np.array([0.1, 0.37, 0.5])
    rows = strong.kept.ravel()
    np.testing.assert_allclose(strong(fraction), many.by_lines(fraction)[:, rows][:, :, rows], rtol=0, atol=1e-9)


def test_a_loop_of_lines_that_are_all_kept_has_the_crossings_of_the_whole() -> None:
    loop, resolved = loop_of(2, 4000.0)
    many = HarmonicLoop(loop.receptance, CUT, (0, 1), loop.tooth_frequency, 24)
    every = StrongLines(many, np.ones((len(many.orders), 2), dtype=bool))
    fraction = resolved.folded(loop.tooth_frequency)
    by_all, by_lines = first_crossings(many, fraction), first_crossings(every, fraction)
    assert [one.depth for one in by_lines] == pytest.approx([one.depth for one in by_all], rel=1e-9)
    assert near(many, by_lines[0]).depth == pytest.approx(by_all[0].depth, rel=1e-11)


def test_a_mode_along_one_axis_keeps_its_lines_for_that_axis() -> None:
    """The modes at 900 Hz along x and at 1500 Hz along y."""
    model = ToolModel.from_modes([900.0, 1500.0], [0.02, 0.02], [4.0, 4.0], [[1.0, 0.0], [0.0, 1.0]])
    point = tool_point(model, model.axes, model.lines)
    loop = HarmonicLoop(spectrum(point, 1e5), CUT, (0, 1), 100.0, 20)
    strong = strong_lines(loop, shape(point), 0.3 * shape(point).largest)
    order, axis = strong.rows
    near_to = np.where(axis == 0, 900.0, 1500.0)
    assert set(axis.tolist()) == {0, 1}
    assert np.all(np.abs(np.abs(order + 0.5) * 100.0 - near_to) <= 150.0)


def test_two_chatters_of_nearly_one_depth_are_not_taken_for_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 2440.3 rpm one at 900 Hz lies 2 % below another at 2273 Hz, onto which Newton's method slips."""
    machine = read_machine(LIBRARY / "column_mill_b.toml")
    speed = [2440.3361344537816]
    found = lobes_at_amplitude(machine, speed, method="multi-frequency")
    monkeypatch.setattr(crossing, "_LARGEST", 10**6)
    monkeypatch.setattr(crossing, "folded", lambda lines, *_: lines)
    whole = lobes_at_amplitude(machine, speed, method="multi-frequency")
    assert found.chatter_frequency == pytest.approx(whole.chatter_frequency, rel=1e-6)
    assert found.chatter_frequency == pytest.approx(899.7, abs=1.0)


@pytest.mark.parametrize("about", [1.2e-3, 2.5e-3])
def test_a_guess_of_the_depth_decides_nothing(about: float) -> None:
    loop, resolved = loop_of(3, 1500.0)
    stiffest = multi_frequency.stiffest_direction(CUT, (0, 1))
    alone, told = (crossing.harmonic_crossing(loop, resolved, stiffest, guess) for guess in (np.inf, about))
    assert told.harmonics > 48
    assert told.crossing.depth == pytest.approx(alone.crossing.depth, rel=crossing.AGREE)
    assert told.line == pytest.approx(alone.line, rel=crossing.AGREE)


@pytest.mark.parametrize("iterated", [False, True])
def test_the_search_of_one_speed_is_left_off_when_its_time_is_up(
    iterated: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop, resolved = loop_of(1, 2000.0)
    looks = count()

    def third() -> None:
        if next(looks) == 2:
            raise OutOfTime("not done")

    for module in (loop_samples, multi_frequency, iterated_loop):
        monkeypatch.setattr(module, "in_time", third)
    monkeypatch.setattr(loop_samples, "_BLOCK", 1)
    many = HarmonicLoop(loop.receptance, CUT, (0, 1), loop.tooth_frequency, 12)
    with pytest.raises(OutOfTime):
        first_crossings(IteratedLoop(many) if iterated else many, resolved.folded(loop.tooth_frequency))
