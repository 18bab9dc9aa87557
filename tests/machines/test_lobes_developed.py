"""Milling at an amplitude: joints held as the chatter makes them, by two methods, and against the cut in time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, lobes_at_amplitude, read_machine
from machines.cutting.amplitude.chattering_tool import wide_receptance
from machines.cutting.amplitude.held_joints import Constant
from machines.cutting.amplitude.milling_at_amplitude import developed_chatter
from machines.cutting.loops.critical_depth import first_crossings
from machines.cutting.loops.loop_branches import Crossing
from machines.lobes import Cutting, witness

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
MASS, SIZE = 0.03993, 10e-6
STIFFNESS = MASS * (2 * np.pi * 922) ** 2
DAMPING = 2 * 0.011 * np.sqrt(STIFFNESS * MASS)
CUBIC = 0.025 * STIFFNESS / (0.75 * SIZE**2)
CUT = {"process": "milling", "teeth": 2, "tangential": 6e8, "normal": 2e8, "mode": "down", "immersion": 0.5}
LAWS = {
    "hardening": Cubic(CUBIC),
    "softening": Cubic(-CUBIC),
    "elastic slip": Jenkins(0.1 * STIFFNESS, 0.05 * STIFFNESS * SIZE),
    "friction": Coulomb(0.15),
    "contact": HertzContact(6.0, 6e-6),
}


def one_direction(law: JointLaw) -> Machine:
    """The 922 Hz tool on one joint."""
    joint = Joint((Linear(STIFFNESS), Viscous(DAMPING), law))
    return Machine(
        (Lumped("tool", ("x",), np.array([[MASS]])),),
        (Connection("taper", ("tool.x", "ground"), joint),),
        tool={"x": "tool.x"},
        frequency=(300.0, 3000.0),
        cutting=CUT,
    )


def two_directions(law: JointLaw) -> Machine:
    """A joint in x, none in y, and a spring across that couples them."""
    joint = Joint((Linear(STIFFNESS), Viscous(DAMPING), law))
    across = 0.1 * STIFFNESS
    tool = Lumped(
        "tool",
        ("x", "y"),
        MASS * np.eye(2),
        np.diag([0.0, DAMPING]),
        np.array([[across, -across], [-across, 1.3 * STIFFNESS]]),
    )
    return Machine(
        (tool,),
        (Connection("taper", ("tool.x", "ground"), joint),),
        tool={"x": "tool.x", "y": "tool.y"},
        frequency=(300.0, 3000.0),
        cutting=CUT,
    )


def guide_mill() -> Machine:
    guide = Joint((Linear(6e8), Viscous(480.0), Jenkins(4e7, 36.0)))
    return read_machine(LIBRARY / "guide_mill.toml").with_joint("guide", guide)


@pytest.mark.thorough
@pytest.mark.parametrize("make", [one_direction, two_directions])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_harmonics_and_collocation_agree_at_an_amplitude(make: object, law: JointLaw) -> None:
    """Two solvers that share no discretisation follow the joints to the same vibration.

    The harmonics are settled to 1e-4 with the joints held; that the joints follow may double it.
    """
    assert callable(make)
    machine, speeds = make(law), [18000.0]
    nodes, lines = (lobes_at_amplitude(machine, speeds, SIZE, m) for m in ("collocation", "multi-frequency"))
    np.testing.assert_allclose(lines.depth, nodes.depth, rtol=2e-4)
    np.testing.assert_allclose(lines.chatter_frequency, nodes.chatter_frequency, rtol=1e-4)
    np.testing.assert_array_equal(lines.kind, nodes.kind)
    assert np.all(np.isfinite(nodes.depth))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("amplitude", "speeds"),
    [(20e-6, [3473.0]), pytest.param(6e-6, [3000.0, 3473.0, 4000.0, 9000.0], marks=pytest.mark.slow)],
)
def test_both_methods_follow_the_same_mode_of_a_machine_with_several(amplitude: float, speeds: list[float]) -> None:
    nodes, lines = (lobes_at_amplitude(guide_mill(), speeds, amplitude, m) for m in ("collocation", "multi-frequency"))
    np.testing.assert_allclose(lines.depth, nodes.depth, rtol=2e-4)
    np.testing.assert_allclose(lines.chatter_frequency, nodes.chatter_frequency, rtol=1e-4)


def test_the_joint_is_moved_by_the_force_that_the_crossing_has() -> None:
    """Force, frequency and joint of the crossing that was found give that crossing again."""
    machine = guide_mill()
    cutting, tooth = Cutting(**dict(machine.cutting or {})), 4 * 4000.0 / 60
    chatter = developed_chatter(machine, cutting, 6e-6, wide_receptance(machine, 6e-6), "collocation", modes=True)
    found = next(chatter.persistent([4000.0]))
    assert found.gain is not None
    loop = chatter.method.loop(4000.0, 1, Constant(found.line * tooth, found.gain))
    order, direction = loop.strongest(found.crossing)
    assert order == found.order
    again = chatter.joints(np.array([found.line * tooth]), direction[None])
    np.testing.assert_allclose(again.gain[0], found.gain, rtol=1e-7)
    value = np.linalg.eigvals(loop(np.array([found.crossing.fraction]))[0])
    turned = value * (1 - np.exp(-2j * np.pi * found.crossing.fraction))
    assert np.min(np.abs(1 + found.crossing.depth * turned)) < 1e-6


@pytest.mark.parametrize("speed", [4000.0, 5300.0, 9000.0])
def test_a_ceiling_leaves_the_crossings_below_it_as_they_are(speed: float) -> None:
    machine = guide_mill()
    cutting, tooth = Cutting(**dict(machine.cutting or {})), 4 * speed / 60
    chatter = developed_chatter(machine, cutting, 6e-6, wide_receptance(machine, 6e-6), "collocation", modes=True)
    frequency, gain = chatter.starts[0]
    loop = chatter.search.loop(speed, 0, Constant(frequency, gain), coarse=True)
    nu = chatter.search.resolved(frequency, gain).folded(tooth)
    found = first_crossings(loop, nu)
    below = first_crossings(loop, nu, ceiling=1.2 * found[0].depth)
    np.testing.assert_allclose([one.depth for one in below], [one.depth for one in found], rtol=1e-9)
    assert not first_crossings(loop, nu, ceiling=0.8 * found[0].depth)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "depth", "sizes", "chatter", "stable", "share"),
    [
        (4000.0, 2.0e-3, (2e-6, 8e-6), 333.0, True, 0.02),
        (4000.0, 2.6e-3, (10e-6, 40e-6), 327.0, False, 0.01),
        (3473.0, 4.5e-3, (2e-6, 10e-6), 330.0, True, 0.04),
        (3473.0, 5.0e-3, (15e-6, 30e-6), 323.0, False, 0.03),
        (3473.0, 5.5e-3, (9e-6, 36e-6), 322.0, False, 0.08),
    ],
)
def test_the_cut_of_a_machine_with_modes_in_time_is_near_the_held_joints(
    speed: float, depth: float, sizes: tuple[float, float], chatter: float, stable: bool, share: float
) -> None:
    """Elastic slip in the guide: the depth predicted at the amplitude that the simulation settles on, or parts at."""
    machine = guide_mill()
    cut = {key: value for key, value in (machine.cutting or {}).items() if key != "feed"}
    machine = replace(machine, cutting=cut)
    found = witness(machine, speed, depth, np.geomspace(*sizes, 4), rounds=3, waves=150, steps=40, frequency=chatter)
    (cycle,) = found.cycles
    assert cycle.stable == stable
    assert lobes_at_amplitude(machine, [speed], cycle.amplitude).depth[0] == pytest.approx(depth, rel=share)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [3000.0, 3473.0, 4000.0, 6000.0, 9000.0])
@pytest.mark.parametrize("amplitude", [6e-6, 20e-6])
def test_no_other_line_of_the_band_chatters_at_a_lower_depth(speed: float, amplitude: float) -> None:
    """Every hundredth of the band is tried as the chatter line, with the joints as they are there."""
    machine = guide_mill()
    cutting, tooth = Cutting(**dict(machine.cutting or {})), 4 * speed / 60
    table = wide_receptance(machine, amplitude)
    chatter = developed_chatter(machine, cutting, amplitude, table, "collocation", modes=True)
    found = next(chatter.persistent([speed]))
    lowest = found.crossing.depth
    for frequency in np.geomspace(120.0, 1700.0, 260).tolist():
        gain = table.gain[np.argmin(np.abs(table.frf.frequency - frequency))]
        loop = chatter.search.loop(speed, 0, Constant(frequency, gain), coarse=True)

        def own(crossing: Crossing, loop=loop, frequency=frequency) -> bool:  # type: ignore[no-untyped-def]
            line = abs(loop.strongest(crossing)[0] + crossing.fraction) * tooth
            return bool(abs(line / frequency - 1) < 0.006)

        nu = chatter.search.resolved(frequency, gain).folded(tooth)
        for other in first_crossings(loop, nu, own, found.crossing.depth):
            lowest = min(lowest, other.depth)
    assert lowest > 0.95 * found.crossing.depth
