"""Depth over amplitude: its turning points, the zone where a knock starts chatter, and the inverse map."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from turning_lathe import CUBIC, DAMPING, MASS, SPEED, STIFFNESS, lathe

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, lobes_at_amplitude
from machines.cutting.amplitude import frozen_lobes
from machines.cutting.amplitude.fate import fate_at
from machines.cutting.amplitude.words import of_fate, reach_words, told, told_so_far
from machines.cutting.process.lost_contact import milling_contact
from machines.deadline import OutOfTime, within
from machines.lobes import AmplitudeLimits, Cutting, amplitude_limits, depth_ratio

SIZES = np.geomspace(1e-6, 2e-4, 31)


def told_at(limits: AmplitudeLimits, depth: float, multiplier: float | None = None, forced: float = 0.0) -> str:
    return of_fate(fate_at(limits, depth, multiplier=multiplier), reach_words(limits), forced)


@pytest.mark.slow
def test_hardening_turns_at_the_published_depth_and_returns_on_its_upper_branch() -> None:
    limits = amplitude_limits(lathe(Cubic(CUBIC)), [SPEED], SIZES)
    turn, peak = limits.turns()
    assert turn.lowest
    assert not peak.lowest  # where the chatter passes from the second lobe to the third
    assert set(limits.lobe[limits.amplitude > peak.amplitude, 0]) == {3}
    assert turn.amplitude == pytest.approx(91.6e-6, rel=2e-3)
    assert turn.depth == pytest.approx(0.64514e-3, rel=1e-4)
    np.testing.assert_allclose(limits.bistable[0], [0.64514e-3, 0.69920e-3], rtol=1e-4)
    for depth, low, high in ((0.68847e-3, 30e-6, 123.5e-6), (0.66324e-3, 60e-6, 113.7e-6)):
        threshold, chatter = limits.cycles(depth)
        assert (threshold.stable, chatter.stable) == (False, True)
        assert threshold.amplitude == pytest.approx(low, rel=1e-3)
        assert chatter.amplitude == pytest.approx(high, rel=1e-3)
    assert threshold.frequency == pytest.approx(105.894, rel=1e-5)
    assert not limits.starts_by_itself(0.699e-3)
    assert limits.starts_by_itself(0.6995e-3)


@pytest.mark.thorough
def test_softening_on_the_same_flank_gives_a_finite_chatter_and_no_bistable_zone() -> None:
    limits = amplitude_limits(lathe(Cubic(-CUBIC)), [SPEED], SIZES)
    np.testing.assert_array_equal(limits.bistable[0, 0], limits.bistable[0, 1])
    assert limits.safe_amplitude[0] == 0
    for depth, amplitude in ((0.71107e-3, 30e-6), (0.75348e-3, 60e-6)):
        (cycle,) = limits.cycles(depth)
        assert cycle.stable
        assert cycle.amplitude == pytest.approx(amplitude, rel=1e-3)


def test_the_other_flank_exchanges_hardening_and_softening() -> None:
    """The nonlinearity shifts the lobe along the speed: what falls on one side of it rises on the other."""
    speeds, size = [SPEED, 3200.0], [20e-6, 40e-6]
    hard, soft = (amplitude_limits(lathe(Cubic(k)), speeds, size) for k in (CUBIC, -CUBIC))
    for limits, sign in ((hard, -1), (soft, 1)):
        assert np.all(np.sign(limits.depth[:, 0] - limits.onset[0]) == sign)
        assert np.all(np.sign(limits.depth[:, 1] - limits.onset[1]) == -sign)


@pytest.mark.slow
def test_ideal_friction_never_starts_but_is_bistable_down_to_the_limit_without_it() -> None:
    limits = amplitude_limits(lathe(Coulomb(5.0)), [SPEED], np.geomspace(1e-6, 1e-2, 41))
    assert limits.onset[0] == np.inf
    assert not limits.starts_by_itself(10.0)
    assert np.all(np.diff(limits.depth[:, 0]) < 0)
    without = float(lobes_at_amplitude(lathe(), [SPEED]).depth[0])
    assert limits.safe[0] == pytest.approx(without, rel=3e-3)
    assert limits.safe[0] > without
    for depth, amplitude in ((0.89207e-3, 30e-6), (0.79560e-3, 60e-6)):
        (cycle,) = limits.cycles(depth)
        assert not cycle.stable
        assert cycle.amplitude == pytest.approx(amplitude, rel=1e-3)


def test_joint_and_cut_together_satisfy_the_combined_condition() -> None:
    """1 + b·K_s·(N(r)/q)·(1 − e^(−jωτ))·G(ω; A) = 0 with the cubic's closed form of G."""
    feed, q = 1.5e-4, 0.75
    limits = amplitude_limits(lathe(Cubic(CUBIC), feed=feed, exponent=q), [SPEED], [20e-6, 60e-6])
    for A, b, f in zip(limits.amplitude, limits.depth[:, 0], limits.chatter_frequency[:, 0], strict=True):
        omega, tau = 2 * np.pi * f, 60 / SPEED
        G = 1 / (STIFFNESS + 0.75 * CUBIC * A**2 - MASS * omega**2 + 1j * omega * DAMPING)
        turned = 1 - np.exp(-1j * omega * tau)
        ratio = A * abs(turned) / feed
        assert 1 + b * 1e9 / float(depth_ratio(ratio, q)) * turned * G == pytest.approx(0.0, abs=2e-3)
    alone = amplitude_limits(lathe(Cubic(CUBIC)), [SPEED], [20e-6, 60e-6])
    assert np.all(limits.depth < alone.depth)


@pytest.mark.thorough
def test_past_its_identified_range_a_joint_says_nothing() -> None:
    machine = lathe(Cubic(CUBIC))
    narrow = replace(machine.joints()[0], validity={"amplitude": (0.0, 70e-6)})
    limits = amplitude_limits(machine.with_joint("guide", narrow), [SPEED], SIZES)
    assert limits.largest[0] == np.max(SIZES[SIZES <= 70e-6])
    beyond = limits.amplitude > 70e-6
    assert np.all(np.isnan(limits.depth[beyond]))
    assert limits.safe[0] == float(limits.depth[~beyond][-1, 0])
    assert len(limits.cycles(0.66324e-3)) == 1


def test_in_milling_the_onset_and_the_vibration_are_computed_by_one_method() -> None:
    """A linear machine has no zone between the two; one of the exact methods against another would leave one."""
    column = Lumped("column", ("x",), np.array([[20.0]]), np.array([[400.0]]), np.array([[2e7]]))
    spindle = Lumped("spindle", ("x",), np.array([[1.0]]))
    joint = Joint((Linear(4e7), Viscous(300.0), Cubic(1e12)), validity={"amplitude": (0.0, 2e-6)})
    machine = Machine(
        (column, spindle),
        (Connection("nose", ("spindle.x", "column.x"), joint),),
        tool={"x": "spindle.x"},
        frequency=(50.0, 2500.0),
        cutting={"process": "milling", "teeth": 4, "tangential": 7e8, "normal": 2e8, "mode": "down", "immersion": 0.5},
    )
    limits = amplitude_limits(machine, [4000.0], [1e-8, 1e-7, 1e-4])
    assert limits.depth[:2, 0] == pytest.approx(float(limits.onset[0]), rel=1e-4)
    # The tool moves further than the joint, but not ten times.
    assert np.isnan(limits.depth[-1, 0])


@pytest.mark.slow
def test_few_amplitudes_miss_no_chatter_on_the_flank_of_a_peak_between_lobes() -> None:
    """A joint that hardens through three lobes, at twice its onset: in time chatter settles at 39.1 and at 78.3 µm."""
    joint = Joint((Linear(240752.11230746587), Viscous(10.509284919073526), Cubic(70329700383237.46)))
    machine = Machine(
        components=(Lumped("slide", ("x",), np.array([[0.4726]])),),
        connections=(Connection("guide", ("slide.x", "ground"), joint),),
        tool={"x": "slide.x"},
        frequency=(45.4393, 454.393),
        cutting={"process": "turning", "specific": 1.5e9},
    )
    few, many = (amplitude_limits(machine, [2683.85], np.geomspace(2e-6, 1e-4, n)) for n in (10, 60))
    cycles = few.cycles(0.016977e-3)
    assert [c.stable for c in cycles] == [True, False, True, False]
    assert [c.amplitude for c in cycles] == [pytest.approx(c.amplitude, rel=1e-3) for c in many.cycles(0.016977e-3)]
    assert [c.amplitude for c in cycles if c.stable] == pytest.approx([39.07e-6, 78.27e-6], rel=0.02)


@pytest.mark.parametrize("sizes", [[1e-5], [2e-5, 1e-5], [0.0, 1e-5], [1e-5, np.inf]])
def test_amplitudes_that_are_no_ascending_list_are_refused(sizes: list[float]) -> None:
    with pytest.raises(InputError, match="above 0 and ascending"):
        amplitude_limits(lathe(), [SPEED], sizes)


@pytest.mark.thorough
def test_nothing_starts_by_itself_where_the_multiplier_at_rest_is_below_one() -> None:
    limits = amplitude_limits(lathe(Cubic(CUBIC)), [SPEED], SIZES)
    assert "chatter starts by itself and settles at" in told_at(limits, 0.75e-3, multiplier=1.02)
    said = told_at(limits, 0.75e-3, multiplier=0.97)
    assert "by itself" not in said
    assert "above a lens, the smallest vibrations die out; what becomes of larger ones is not computed" in said


@pytest.mark.slow
def test_sentences_about_milling_end_where_edges_leave_the_cut() -> None:
    """Along x the chip varies with sin φ as the feed does: contact is lost at A·|1 − e^(−jωτ)| = h₀, and soon after
    5 % of the chip, N(1.2) = 0.960 and N(1.25) = 0.948.
    """
    cut = Cutting(process="milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.5)
    size = milling_contact(cut, ("x",), np.array([1.0 + 0j]), 1.6)
    assert 1.24 < 1.6 * size < 1.31
    limits = amplitude_limits(lathe(Cubic(-CUBIC)), [SPEED], SIZES)
    limits = replace(limits, touching=lambda: np.array([40e-6]))
    assert told_at(limits, 0.75e-3) == (
        "At 2350 rpm and 0.75 mm chatter starts by itself and grows beyond 40 µm, where edges begin to leave the cut."
    )
    assert "up to 40 µm at the tool" in told(limits)[0]
    assert "settles at 32.4 µm" in told(limits)[-1]


@pytest.mark.thorough
def test_what_is_told_beside_the_teeth_says_so() -> None:
    limits = amplitude_limits(lathe(Cubic(CUBIC)), [SPEED], SIZES)
    assert told_at(limits, 0.6e-3, forced=10e-6) == (
        "At 2350 rpm and 0.6 mm, beside the 10 µm that the teeth force, vibrations of up to 200 µm at the tool die out."
    )
    assert told_at(limits, 0.8e-3, multiplier=0.97, forced=10e-6).startswith(
        "At 2350 rpm and 0.8 mm, beside the 10 µm that the teeth force, above a lens, the smallest vibrations die out;"
    )
    said = told(limits, teeth=(0.7e-3, 10e-6))
    beside = "At 2350 rpm, beside the 10 µm that the teeth of a cut of 0.7 mm force, "
    assert said[0] == f"{beside}every vibration of up to 200 µm at the tool dies out below 0.645 mm."
    assert said[2].startswith("Just above 0.699 mm it chatters by itself at 104.9 Hz")
    assert said[2].endswith("(deeper, the teeth may quench it: --depth).")
    assert said[1] == told(limits)[1]


@pytest.mark.thorough
def test_limits_are_known_up_to_where_a_chart_does_not_settle(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = frozen_lobes.frozen_lobes

    def unsettled(machine: Machine, speed: Array, size: float, *more: Any) -> Any:
        if size > 2e-5:
            raise CheckFailed("multi-frequency: the depth still changes with the resolution")
        return whole(machine, speed, size, *more)

    machine = lathe(Cubic(CUBIC))
    sizes = np.geomspace(1e-6, 1e-4, 8)
    before = amplitude_limits(machine, [3000.0], sizes)
    monkeypatch.setattr("machines.cutting.amplitude.amplitude_limits.frozen_lobes", unsettled)
    limits = amplitude_limits(machine, [3000.0], sizes)
    below = sizes <= 2e-5
    assert limits.largest[0] == pytest.approx(sizes[below][-1])
    assert np.all(np.isnan(limits.depth[limits.amplitude > 2e-5]))
    first, same = (one.depth[np.isin(one.amplitude, sizes[below])] for one in (before, limits))
    np.testing.assert_array_equal(first, same)
    (said,) = [w for w in limits.warnings if w.startswith("Limits are known below")]
    assert "26.8 µm only: multi-frequency" in said


def test_limits_end_with_the_amplitudes_that_are_known_when_time_is_up(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, asked = frozen_lobes.frozen_lobes, list[float]()

    def timed(machine: Machine, speed: Array, size: float, *more: Any) -> Any:
        asked.append(size)
        if len(asked) > count:
            raise OutOfTime("not done after 5 minutes")
        return whole(machine, speed, size, *more)

    machine, sizes = lathe(Cubic(CUBIC)), np.geomspace(1e-6, 1e-4, 9)
    before = amplitude_limits(machine, [3000.0], sizes, rounds=0)
    monkeypatch.setattr("machines.cutting.amplitude.amplitude_limits.frozen_lobes", timed)
    count = 4
    limits = amplitude_limits(machine, [3000.0], sizes)
    assert before.whole
    assert not limits.whole
    np.testing.assert_array_equal(limits.amplitude, sizes[[0, 4, 8]])
    np.testing.assert_array_equal(limits.depth, before.depth[np.isin(before.amplitude, limits.amplitude)])
    first, second = told_so_far(limits, 300.0)
    assert first.startswith("Time was up after 300 s: limits over amplitude are known at 3 amplitudes from 1 µm to 100")
    assert second == f"At 3000 rpm the lowest of them is {limits.safe[0] * 1e3:.3g} mm, at 100 µm."
    count, asked = 2, []
    with pytest.raises(OutOfTime):
        amplitude_limits(machine, [3000.0], sizes)


def test_no_amplitude_is_begun_where_fewer_than_three_are_in_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, asked, clock = frozen_lobes.frozen_lobes, list[float](), [0.0]

    def slow(machine: Machine, speed: Array, size: float, *more: Any) -> Any:
        asked.append(size)
        clock[0] += 40.0 if size else 0.0
        return whole(machine, speed, size, *more)

    monkeypatch.setattr("machines.cutting.amplitude.amplitude_limits.frozen_lobes", slow)
    monkeypatch.setattr("time.monotonic", lambda: clock[0])
    machine, sizes = lathe(Cubic(CUBIC)), np.geomspace(1e-6, 1e-4, 9)
    with within(100.0), pytest.raises(OutOfTime, match="2 amplitudes are in reach, each takes about 40 s"):
        amplitude_limits(machine, [3000.0], sizes)
    assert asked == [0.0, sizes[0]]
    asked.clear()
    with within(150.0):  # a fourth would not be done
        limits = amplitude_limits(machine, [3000.0], sizes)
    assert len(asked) == 1 + 3
    assert len(limits.amplitude) == 3
    assert not limits.whole


@pytest.mark.thorough
def test_a_cycle_is_told_as_near_as_charts_settle(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = frozen_lobes.frozen_lobes
    sizes = np.geomspace(1e-6, 1e-4, 8)
    before = amplitude_limits(lathe(Cubic(CUBIC)), [3000.0], sizes, rounds=0)
    depth = float(np.mean(before.depth[3:5, 0]))
    (cycle,) = before.cycles(depth)

    def unsettled(machine: Machine, speed: Array, size: float, *more: Any) -> Any:
        if 0.97 < size / cycle.amplitude < 1.02:
            raise CheckFailed("multi-frequency: the depth still changes with the resolution")
        return whole(machine, speed, size, *more)

    monkeypatch.setattr("machines.cutting.amplitude.amplitude_limits.frozen_lobes", unsettled)
    (near,) = amplitude_limits(lathe(Cubic(CUBIC)), [3000.0], sizes, rounds=0).cycles(depth)
    assert near.stable == cycle.stable
    assert near.amplitude != cycle.amplitude
    assert near.amplitude == pytest.approx(cycle.amplitude, rel=0.05)
