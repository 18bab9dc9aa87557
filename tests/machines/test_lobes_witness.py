"""The cut simulated in time: order of the method, boundaries of linear machines, amplitudes of nonlinear ones."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from turning_lathe import CUBIC, DAMPING, MASS, SPEED, STIFFNESS, lathe

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.structural_damping import StructuralDamping
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Modal, lobes_at_amplitude
from machines.cutting.in_time.witness import vibrate
from machines.lobes import amplitude_limits, witness

CHATTER = 104.9


def mill(axes: tuple[str, ...], **cut: Any) -> Machine:
    """The 922 Hz tool, the same in each of its directions."""
    n = len(axes)
    tool = Modal("tool", axes, np.full(n, 922.0), np.full(n, 0.011), np.eye(n), np.full(n, 0.03993))
    return Machine(
        (tool,),
        tool={axis: f"tool.{axis}" for axis in axes},
        frequency=(100.0, 4000.0),
        cutting={"process": "milling", "teeth": 2, "tangential": 6e8, "normal": 2e8, **cut},
    )


def boundary(machine: Machine, speed: float, depth: float, chatter: float) -> float:
    """Depth in m at which small vibrations neither grow nor die, from four depths around ``depth``."""
    depths = depth * (1 + np.array([-2e-3, -1e-3, 1e-3, 2e-3]))
    batch = vibrate(machine, speed, depths, np.full(4, 1e-6), chatter)
    return float(np.polyfit(batch.rate, depths, 2)[-1])


@pytest.mark.slow
def test_steps_are_of_fourth_order() -> None:
    machine, counts, ends = lathe(Cubic(CUBIC)), [], []
    for steps in (48, 96, 384):
        batch = vibrate(machine, SPEED, 7e-4, np.array([1e-4]), CHATTER, waves=30, steps=steps)
        counts.append(batch.run.motion.shape[1])
        ends.append(batch.run.motion[-1, 0, 0, 0])
    first, second = (abs(end - ends[-1]) for end in ends[:2])
    assert np.log(first / second) / np.log(counts[1] / counts[0]) == pytest.approx(4.0, abs=0.3)
    assert second < 1e-6 * 1e-4


@pytest.mark.thorough
@pytest.mark.parametrize("feed", [None, 2e-5])
def test_motion_is_that_of_a_plain_runge_kutta_method(feed: float | None) -> None:
    """With a small feed the edge leaves the cut; the surface is then the highest that any earlier pass left."""
    machine = lathe(Cubic(CUBIC)) if feed is None else lathe(Cubic(CUBIC), feed=feed)
    depth, start, fine = 9e-4, 4e-5, 4000
    batch = vibrate(machine, SPEED, depth, np.array([start]), CHATTER, waves=12, steps=200)
    tau = 60 / SPEED
    h, omega = tau / fine, 2 * np.pi * CHATTER
    old = start * np.cos(omega * h * np.arange(-fine, 1))
    x, v, revolutions = start, 0.0, []
    bite = 1e9 * depth

    def rate(x: float, v: float, met: float) -> tuple[float, float]:
        chip = x - met if feed is None else max(x - met + feed, 0.0) - feed
        return v, -(STIFFNESS * x + CUBIC * x**3 + DAMPING * v + bite * chip) / MASS

    for _ in range(len(batch.run.motion)):
        path = [x]
        for k in range(fine):
            met = old[k], (old[k] + old[k + 1]) / 2, old[k + 1]
            a1, b1 = rate(x, v, met[0])
            a2, b2 = rate(x + h / 2 * a1, v + h / 2 * b1, met[1])
            a3, b3 = rate(x + h / 2 * a2, v + h / 2 * b2, met[1])
            a4, b4 = rate(x + h * a3, v + h * b3, met[2])
            x, v = x + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), v + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
            path.append(x)
        revolutions.append(path[0])
        old = np.array(path) if feed is None else np.maximum(path, old - feed)
    np.testing.assert_allclose(batch.run.motion[:, 0, 0, 0], revolutions, atol=2e-4 * start)
    assert np.any(batch.run.lost) == (feed is not None)


@pytest.mark.thorough
@pytest.mark.parametrize("speed", [SPEED, 3000.0])
def test_small_vibrations_in_turning_grow_above_the_linear_limit(speed: float) -> None:
    chart = lobes_at_amplitude(lathe(), [speed])
    found = boundary(lathe(), speed, float(chart.depth[0]), float(chart.chatter_frequency[0]))
    assert found == pytest.approx(float(chart.depth[0]), rel=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("axes", "cut", "speed", "depth"),
    [
        (("x",), {"mode": "slot"}, 5000.0, 0.4086278e-3),
        (("x",), {"mode": "down", "immersion": 0.5}, 10000.0, 2.104690e-3),
        (("x",), {"mode": "down", "immersion": 0.5}, 18000.0, 1.619698e-3),
        (("x",), {"mode": "down", "immersion": 0.1}, 18000.0, 0.8156572e-3),
        (("x", "y"), {"mode": "slot"}, 5000.0, 0.04750654e-3),
    ],
)
def test_small_vibrations_in_milling_grow_above_the_published_limit(
    axes: tuple[str, ...], cut: dict[str, Any], speed: float, depth: float
) -> None:
    """Hopf and flip boundaries that multi-frequency and collocation methods give."""
    assert boundary(mill(axes, **cut), speed, depth, 900.0) == pytest.approx(depth, rel=2e-5)


@pytest.mark.slow
def test_near_a_flip_the_vibration_starts_in_the_better_of_two_phases() -> None:
    """A flip stands still against the teeth: of a start only the part in its phase lasts, cos of the angle between."""
    machine, size = mill(("x",), mode="down", immersion=0.1), np.array([1e-6])
    phases = np.pi * np.arange(8) / 8
    lasting = [
        float(vibrate(machine, 18000.0, 0.8156572e-3, size, 900.0, waves=120, phase=phase).end[0]) for phase in phases
    ]
    second = np.abs(np.fft.fft(np.square(lasting)))
    assert second[1] == pytest.approx(second[0] / 2, rel=1e-2)
    assert min(lasting) < 0.25 * max(lasting)
    found = witness(machine, 18000.0, 0.8156572e-3, size, waves=120, frequency=900.0)
    assert found.end[0] == pytest.approx(max(lasting[0], lasting[4]), rel=1e-9)
    assert found.end[0] > 0.7 * max(lasting)


@pytest.mark.thorough
def test_forced_vibration_in_milling_is_no_chatter() -> None:
    """Half-way to the limit the tool shakes with the teeth for ever, and chatter dies out."""
    machine = mill(("x", "y"), mode="down", immersion=0.5, feed=1e-4)
    batch = vibrate(machine, 10000.0, 0.09e-3, np.array([1e-6]), 900.0)
    shaking = np.ptp(batch.run.motion[-1, :, 0, 0])
    assert shaking > 1e-6
    assert batch.end[0] < 1e-3 * shaking
    assert not batch.grows[0]
    assert not batch.lost[0]


@pytest.mark.slow
def test_after_a_lost_contact_the_tool_shakes_as_the_teeth_force_it_again() -> None:
    """A knock lets the edges leave the cut for some teeth; then the chip is the feed's alone, and a Fourier series of
    its force through the receptance gives the motion. Where the tooth leaves the arc the feed moves no surface away.
    """
    machine = mill(("x", "y"), mode="down", immersion=0.5, feed=1e-5)
    depth, speed, teeth = 0.05e-3, 10000.0, 2
    batch = vibrate(machine, speed, depth, np.array([2e-5]), 900.0, waves=400)
    assert np.any(batch.run.lost[:20])
    assert not np.any(batch.run.lost[-30:])
    count = 4096
    angle = (np.arange(count) + 0.5) * np.pi / count
    arc = np.where(angle > np.pi / 2, 1e-5 * np.sin(angle), 0.0) * depth
    push = -np.stack([6e8 * np.cos(angle) + 2e8 * np.sin(angle), -6e8 * np.sin(angle) + 2e8 * np.cos(angle)]) * arc
    force = np.fft.rfft(push, axis=1)[:, :200] / count
    omega = 2 * np.pi * teeth * speed / 60 * np.arange(1, 200)
    natural = 2 * np.pi * 922
    G = 1 / (0.03993 * (natural**2 - omega**2 + 2j * 0.011 * natural * omega))
    node = 2 * np.pi * (batch.run.time / batch.run.period)[:, None] - 2 * angle[0]
    forced = 2 * np.real(np.exp(1j * node * np.arange(1, 200)) @ (force[:, 1:] * G).T)
    moved = batch.run.motion[-1, :, :, 0] - np.mean(batch.run.motion[-1, :, :, 0], axis=0)
    np.testing.assert_allclose(moved, forced - forced.mean(axis=0), atol=2e-3 * np.max(np.abs(forced)))


def around(amplitude: float) -> Array:
    return amplitude * np.array([0.98, 0.99, 1.01, 1.02])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "depth", "amplitude", "stable"),
    [(Cubic(CUBIC), 0.66324e-3, 60.0e-6, False), (Cubic(-CUBIC), 0.75348e-3, 60.0e-6, True)],
)
def test_vibrations_persist_at_the_published_amplitude(
    law: JointLaw, depth: float, amplitude: float, stable: bool
) -> None:
    found = witness(lathe(law), SPEED, depth, around(amplitude), rounds=1).cycles
    assert [c.stable for c in found] == [stable]
    assert found[0].amplitude == pytest.approx(amplitude, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "depth", "low", "high", "cycles"),
    [
        (Cubic(CUBIC), 0.68847e-3, 10e-6, 200e-6, ((30.017e-6, False), (123.5e-6, True))),
        (Cubic(CUBIC), 0.66324e-3, 30e-6, 200e-6, ((60.038e-6, False), (113.7e-6, True))),
        (Cubic(-CUBIC), 0.71107e-3, 10e-6, 100e-6, ((29.985e-6, True),)),
        (Cubic(-CUBIC), 0.75348e-3, 30e-6, 100e-6, ((59.952e-6, True),)),
        (Coulomb(5.0), 0.89207e-3, 10e-6, 100e-6, ((30.025e-6, False),)),
        (Coulomb(5.0), 0.79560e-3, 30e-6, 150e-6, ((60.027e-6, False),)),
    ],
)
def test_published_thresholds_and_cycles_are_found_without_knowing_them(
    law: JointLaw, depth: float, low: float, high: float, cycles: tuple[tuple[float, bool], ...]
) -> None:
    """Thresholds and small cycles of another simulation; the large cycles as harmonic balance has them."""
    found = witness(lathe(law), SPEED, depth, np.geomspace(low, high, 8))
    assert [c.stable for c in found.cycles] == [stable for _, stable in cycles]
    for cycle, (amplitude, _) in zip(found.cycles, cycles, strict=True):
        assert cycle.amplitude == pytest.approx(amplitude, rel=2e-3 if amplitude < 1e-4 else 5e-3)


LAWS = (Cubic(CUBIC), Cubic(-CUBIC), Coulomb(5.0))


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("speed", [2100.0, 2600.0, 3200.0, 4000.0])
def test_frozen_joints_predict_simulated_amplitudes_on_both_flanks(law: JointLaw, speed: float) -> None:
    """At the depth that b_lim(A) gives for 50 µm, a vibration of 50 µm persists to 0.5 %, stable or not as told."""
    amplitude = 50e-6
    limits = amplitude_limits(lathe(law), [speed], np.geomspace(0.7, 1.4, 9) * amplitude)
    depth = float(limits.at(amplitude)[0][0])
    predicted = [c for c in limits.cycles(depth) if abs(c.amplitude / amplitude - 1) < 1e-3]
    assert len(predicted) == 1
    found = witness(lathe(law), speed, depth, around(amplitude), rounds=2, frequency=float(limits.at(amplitude)[1][0]))
    assert found.cycles[0].stable == predicted[0].stable
    assert found.cycles[0].amplitude == pytest.approx(amplitude, rel=5e-3)


@pytest.mark.slow
def test_a_joint_with_memory_slips_in_time_as_its_describing_function_says() -> None:
    """Elastic slip: damping rises, then falls with amplitude, so one depth has a finite chatter and a threshold."""
    machine = lathe(Jenkins(1e6, 20.0))
    limits = amplitude_limits(machine, [SPEED], np.geomspace(5e-6, 3e-4, 25))
    depth = 0.97 * float(np.max(limits.depth))
    predicted = limits.cycles(depth)
    assert [c.stable for c in predicted] == [True, False]
    for cycle in predicted:
        found = witness(machine, SPEED, depth, cycle.amplitude * np.array([0.9, 0.96, 1.04, 1.1]), rounds=2)
        assert [c.stable for c in found.cycles] == [cycle.stable]
        assert found.cycles[0].amplitude == pytest.approx(cycle.amplitude, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("sign", "stable"), [(1.0, False), (-1.0, True)])
def test_milling_with_frozen_joints_comes_near_the_simulation(sign: float, stable: bool) -> None:
    """A slot at 5000 rpm, a cubic joint that changes its stiffness by 2.5 % at 10 µm; the depth is by collocation."""
    mass, amplitude = 0.03993, 10e-6
    k = mass * (2 * np.pi * 922) ** 2
    cubic = sign * 0.025 * k / (0.75 * amplitude**2)
    joint = Joint((Linear(k), Viscous(2 * 0.011 * np.sqrt(k * mass)), Cubic(cubic)))
    machine = Machine(
        (Lumped("tool", ("x",), np.array([[mass]])),),
        (Connection("taper", ("tool.x", "ground"), joint),),
        tool={"x": "tool.x"},
        frequency=(300.0, 3000.0),
        cutting={"process": "milling", "teeth": 2, "tangential": 6e8, "normal": 2e8, "mode": "slot"},
    )
    limits = amplitude_limits(machine, [5000.0], np.array([0.7, 1.4]) * amplitude)
    depth, chatter = (float(values[0]) for values in limits.at(amplitude))
    found = witness(machine, 5000.0, depth, np.geomspace(0.6, 1.6, 6) * amplitude, rounds=4, frequency=chatter)
    assert found.cycles[0].stable == stable
    assert found.cycles[0].amplitude == pytest.approx(amplitude, rel=0.01)


def test_a_law_that_is_not_known_in_time_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"'guide': structural_damping exists in the frequency domain only"):
        witness(lathe(StructuralDamping(1e5)), SPEED, 1e-4)


@pytest.mark.parametrize(
    ("machine", "speed", "depth", "amplitude", "said"),
    [
        (replace(lathe(), cutting=None), SPEED, 1e-4, None, r"no \[cutting\]"),
        (lathe(), 0.0, 1e-4, None, "expected a speed and a depth above 0"),
        (lathe(), SPEED, np.nan, None, "expected a speed and a depth above 0"),
        (lathe(), SPEED, 1e-4, [2e-6, 1e-6], "above 0 and ascending"),
    ],
)
def test_what_a_simulation_needs_is_asked_for(
    machine: Machine, speed: float, depth: float, amplitude: Any, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        witness(machine, speed, depth, amplitude)


def test_the_simulation_is_told_in_words() -> None:
    said = str(witness(lathe(), SPEED, 5e-4, [1e-5, 2e-5], waves=60))
    assert said == "In time, at 2350 rpm and 0.5 mm, vibrations of 10 µm to 20 µm at the tool die out."
    assert "grow" in str(witness(lathe(), SPEED, 9e-4, [1e-5, 2e-5], waves=60))
