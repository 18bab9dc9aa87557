"""What is told of a cut and what the cut in time shows: where they part, time has the last word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cut_in_time import Body, Case, cut_in_time
from test_lobes_threshold import CUBIC, SIZES, SPEED, lathe

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine
from machines.cutting.amplitude.amplitude_limits import Cycle
from machines.cutting.amplitude.fate import Fate, fate_at
from machines.cutting.forced.beside_cut import told_cuts
from machines.cutting.in_time.beginning import vibrating
from machines.cutting.in_time.confirmation import denied, in_time, seen
from machines.cutting.in_time.witness import Witness
from machines.lobes import Cutting, amplitude_limits

BISTABLE = Fate(2350.0, 1e-3, False, (Cycle(20e-6, 109.0, False), Cycle(60e-6, 109.0, True)), 2e-4, 109.0, False)


def ended(start: Array, end: Array, trend: Array) -> Witness:
    """Simulated vibrations with these ends and changes of the logarithm over a second."""
    grows = np.asarray(end > start)
    return Witness(2350.0, 1e-3, start, end, trend, grows, np.zeros(len(start), dtype=bool), 109.0, (), 1.0)


def test_a_fate_turns_round_at_every_cycle() -> None:
    assert [BISTABLE.end(size) for size in (1e-6, 19e-6, 21e-6, 59e-6, 150e-6)] == [0, 0, 60e-6, 60e-6, 60e-6]
    grows = Fate(2350.0, 1e-3, True, (Cycle(60e-6, 109.0, True), Cycle(90e-6, 109.0, False)), 2e-4, 109.0, False)
    assert [grows.end(size) for size in (1e-6, 70e-6, 100e-6)] == [60e-6, 60e-6, np.inf]
    assert np.all(np.abs(np.log(BISTABLE.starts / 20e-6)) > 0.08)
    assert BISTABLE.starts[-1] * 1.08 == pytest.approx(BISTABLE.reach)


def test_an_end_elsewhere_or_a_trend_away_from_it_denies() -> None:
    start = np.array([5e-6, 30e-6, 150e-6])
    dying, settled = np.array([-1.0, 0.0, 0.0]), np.array([1e-9, 60e-6, 61e-6])
    assert not denied(BISTABLE, ended(start, settled, dying))
    assert denied(BISTABLE, ended(start, np.array([5e-6, 60e-6, 61e-6]), np.zeros(3)))  # the smallest stays
    assert denied(BISTABLE, ended(start, np.array([1e-9, 40e-6, 61e-6]), np.array([-1.0, -0.5, 0.0])))
    assert not denied(BISTABLE, ended(start, np.array([1e-9, 40e-6, 61e-6]), np.array([-1.0, 0.5, 0.0])))  # on its way
    assert denied(BISTABLE, ended(start, np.array([1e-9, np.inf, 61e-6]), np.array([-1.0, np.inf, 0.0])))


def test_what_was_seen_is_told_from_the_smallest_to_the_largest() -> None:
    start = np.geomspace(1e-6, 1e-4, 5)
    end = np.array([1e-10, 1e-10, 42e-6, 60e-6, 1.0])
    found = seen(ended(start, end, np.array([-1.0, -1.0, 0.3, 0.0, np.inf])), 1e-4)
    assert str(found) == (
        "In time, at 2350 rpm and 1 mm, knocks of up to 3.16 µm at the tool die out, those of 10 µm to 31.6 µm "
        "settle at about 60 µm, those of 100 µm and more grow beyond 100 µm."
    )
    assert [cycle.stable for cycle in found.cycles] == [False, True]
    assert found.cycles[0].amplitude == pytest.approx(np.sqrt(start[1] * start[2]))
    one = seen(ended(start, np.array([1e-10, 60e-6, 1.0, 1.0, 1.0]), np.array([-1.0, 0.0, 1.0, 1.0, 1.0])), 1e-4)
    assert "those of 3.16 µm settle at about 60 µm, those of 10 µm and more grow" in str(one)
    beats = seen(ended(start, np.array([2e-5, 4e-5, 3e-5, 2e-5, 4e-5]), np.zeros(5)), 1e-4)
    assert str(beats).endswith("knocks of 1 µm to 100 µm at the tool stay between 20 µm and 40 µm.")
    # One of two beginnings lasts.
    start, rate = np.repeat(start, 2), np.tile([0.0, -1.0], 5)
    mixed = seen(ended(start, np.tile([8e-6, 0.0], 5), rate), 1e-4)
    assert str(mixed).endswith("knocks of 1 µm to 100 µm at the tool die out or last, at up to 8 µm, as they begin.")
    # In no order of size.
    wild = seen(ended(start, np.array([8e-6, 8e-6, 0, 0, 8e-6, 8e-6, 0, 0, 8e-6, 8e-6]), 0 * rate), 1e-4)
    assert str(wild).endswith("knocks of 1 µm to 100 µm at the tool die out or last, at up to 8 µm, as they begin.")
    # Another mode still dies down in one of those that grow: no place where they stay.
    odd = seen(ended(start[:5], np.array([2, 2.1, 2.05, 2.2, 1e3]) * 1e-6, np.array([1, 1, -0.5, 1, 1])), 1e-4)
    assert str(odd).endswith("knocks of 1 µm to 100 µm at the tool grow beyond 100 µm.")
    # What grows and what shrinks meet between.
    near = seen(ended(start[:4], np.array([2e-6, 2e-6, 2.5e-6, 2.5e-6]), np.array([0.5, 0.5, -0.5, -0.5])), 1e-4)
    assert str(near).endswith("knocks of 1 µm to 100 µm at the tool stay between 2 µm and 2.5 µm.")


def test_a_knock_that_is_let_go_may_become_a_chatter_of_any_smaller_size() -> None:
    start, still = np.array([5e-6, 30e-6, 150e-6]), np.zeros(3)
    found = ended(start, np.array([1e-9, 1e-9, 60e-6]), np.array([-1.0, -1.0, 0.0]))
    assert denied(BISTABLE, replace(found, least=start))
    assert not denied(BISTABLE, replace(found, least=still))
    # But it does not outgrow what nothing outgrows, nor last where everything dies.
    assert denied(BISTABLE, replace(found, end=np.array([1e-9, 1e-9, np.inf]), least=still))
    assert denied(replace(BISTABLE, cycles=()), replace(found, least=still))


def two_chatters() -> tuple[Machine, Cutting]:
    """A slide that carries a softer tip, turning: one chatter at 885 Hz, and a larger one at its first mode, 220 Hz."""
    mass, k, tip = np.diag([4.8, 0.96]), 21.83e6, np.array([[1.0, -1.0], [-1.0, 1.0]])
    guide = Joint((Linear(10.92e6), Viscous(510.0), Jenkins(1.532e6, 5.987)))
    cutting = {"process": "turning", "specific": 1.5e9, "feed": 25e-6, "exponent": 0.778}
    machine = Machine(
        (Lumped("slide", ("x", "tip"), mass, 322.5 * tip, k * tip),),
        (Connection("guide", ("slide.x", "ground"), guide),),
        tool={"x": "slide.tip"},
        frequency=(96.0, 960.0),
        cutting=cutting,
    )
    return machine, Cutting(**cutting)


def test_a_machine_bent_aside_is_held_by_a_force_at_the_tool_alone() -> None:
    machine, cutting = two_chatters()
    aside = np.array([False, True])
    parts, state, joints, tool = vibrating(machine, cutting, 885.0, np.full(2, 20e-6), 0.0, aside)
    j = len(parts.rest)
    assert abs(tool[0]) == pytest.approx(20e-6)
    x, v = (parts.P @ state)[:j], (parts.P @ state)[j : 2 * j]
    # Bent by a force of a thousandth of the chatter frequency: as slow, and no slower.
    assert abs(v[0, 1]) < 1e-3 * 2 * np.pi * 885.0 * 20e-6 * 1e-3
    # Springs in series: the slide moves by its share of the compliance; micro-slip lies between stuck and slid.
    shares = [1 / held / (1 / held + 1 / 21.83e6) for held in (10.92e6 + 1.532e6, 10.92e6)]
    assert shares[0] < x[0, 1] / 20e-6 < shares[1]
    assert joints[0, 1] == pytest.approx(x[0, 1])


@pytest.mark.slow
def test_a_knock_of_another_mode_that_ends_in_a_larger_chatter_is_told() -> None:
    machine, cutting = two_chatters()
    speed, depth = 14381.0, 1.93e-3
    said, _ = told_cuts(machine, amplitude_limits(machine, [speed], np.geomspace(1e-6, 50e-6, 10)), [depth])
    small, large = 8e-6, 45e-6
    case = Case(Body.of(machine), cutting, speed, depth, [small, large], 885.5)
    course = cut_in_time([case], 10, 20, 111)
    assert course.chatter[-1, 0] * 1e6 == pytest.approx([18.9, 146.5], rel=0.02)
    assert "settle at about 19 µm" in said[-1]
    assert said[-1].endswith("and more stay at 18.9 µm or grow beyond 50 µm, as they begin.")


@pytest.mark.slow
def test_a_true_fate_stands_and_a_false_one_is_replaced_by_what_is_seen() -> None:
    machine = lathe(Cubic(CUBIC))
    limits = amplitude_limits(machine, [SPEED], SIZES[::3])
    true = fate_at(limits, 0.68e-3)
    assert in_time(machine, true) is None
    found = in_time(machine, replace(true, cycles=()))  # "all of them die out"
    assert found is not None
    assert 0 < found.cycles[0].amplitude < true.reach
    low, high = (cycle.amplitude for cycle in true.cycles[:2])
    assert found.cycles[0].amplitude == pytest.approx(low, rel=0.1)
    assert found.cycles[1].amplitude == pytest.approx(high, rel=0.1)


@pytest.mark.thorough
def test_ideal_friction_is_not_stepped() -> None:
    machine = lathe(Coulomb(50.0))
    limits = amplitude_limits(machine, [SPEED], SIZES[::3])
    said, _ = told_cuts(machine, limits, [0.6e-3])
    assert said[-1] == "At 2350 rpm and 0.6 mm vibrations of up to 200 µm at the tool die out."
    assert in_time(machine, replace(fate_at(limits, 0.6e-3), grows=True)) is None
