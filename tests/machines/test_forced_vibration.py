"""The motion that the teeth force on the tool: its forces, and its size against the cut stepped in time by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, read_machine
from machines.cutting.forced.forced_vibration import forced_vibration
from machines.cutting.forced.pattern_forces import PatternForces
from machines.lobes import Cutting

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
MASS, STIFFNESS, DAMPING = 0.5, 1.2e7, 150.0
ACROSS, NORMAL = 1.5e6, 9e6
CUT = {"process": "milling", "teeth": 3, "tangential": 8e8, "normal": 2.5e8, "mode": "down", "immersion": 0.4}
FEED, SPEED, DEPTH = 1e-4, 9000.0, 1.2e-3


def mill(*more: JointLaw) -> Machine:
    """A tool on one joint in x and a spring in y, with a spring across that couples them."""
    tool = Lumped(
        "tool",
        ("x", "y"),
        MASS * np.eye(2),
        np.diag([0.0, DAMPING]),
        np.array([[ACROSS, -ACROSS], [-ACROSS, ACROSS + NORMAL]]),
    )
    joint = Joint((Linear(STIFFNESS), Viscous(DAMPING), *more), validity={"amplitude": (0.0, 5e-6)})
    return Machine(
        (tool,),
        (Connection("taper", ("tool.x", "ground"), joint),),
        tool={"x": "tool.x", "y": "tool.y"},
        frequency=(100.0, 3000.0),
        cutting={**CUT, "feed": FEED},
    )


def in_time(cubic: float, slip: tuple[float, float] | None, depth: float, steps: int = 160, teeth: int = 60) -> Array:
    """The same tool by Runge and Kutta with the delayed chip: x and y over the last tooth period, (steps, 2).

    Everything is written out: the force law, the slider, the angles. Without the mean of the steady cutting force.
    """
    N, entry, leave = 3, math.acos(2 * 0.4 - 1), math.pi
    turning = 2 * math.pi * SPEED / 60
    h = 2 * math.pi / N / turning / steps

    def push(time: float, x: float, y: float, old_x: float, old_y: float) -> tuple[float, float]:
        fx = fy = 0.0
        for j in range(N):
            phi = (turning * time + 2 * math.pi * j / N) % (2 * math.pi)
            if entry < phi < leave:
                s, c = math.sin(phi), math.cos(phi)
                chip = FEED * s + s * (x - old_x) + c * (y - old_y)
                fx -= depth * chip * (8e8 * c + 2.5e8 * s)
                fy -= depth * chip * (-8e8 * s + 2.5e8 * c)
        return fx, fy

    fine = 4000
    mean = np.mean([push((i + 0.5) / fine * steps * h, 0, 0, 0, 0) for i in range(fine)], axis=0)
    slider, path = 0.0, [(0.0, 0.0)] * (2 * steps + 1)  # a period of half steps

    def friction(x: float) -> float:
        return 0.0 if slip is None else max(-slip[1], min(slip[1], slip[0] * (x - slider)))

    def rate(s: Array, time: float, old: tuple[float, float]) -> Array:
        x, y, v, w = s
        fx, fy = push(time, x, y, *old)
        fx -= mean[0] + STIFFNESS * x + DAMPING * v + cubic * x**3 + friction(x) + ACROSS * (x - y)
        fy -= mean[1] + DAMPING * w + NORMAL * y + ACROSS * (y - x)
        return np.array([v, w, fx / MASS, fy / MASS])

    state = np.zeros(4)
    for i in range(steps * teeth):
        t, late = i * h, path[-2 * steps - 1 :]
        a = rate(state, t, late[0])
        b = rate(state + h / 2 * a, t + h / 2, late[1])
        c = rate(state + h / 2 * b, t + h / 2, late[1])
        d = rate(state + h * c, t + h, late[2])
        new = state + h / 6 * (a + 2 * b + 2 * c + d)
        middle = (state[:2] + new[:2]) / 2 + h / 8 * (state[2:] - new[2:])
        path += [tuple(middle), tuple(new[:2])]
        state = new
        if slip is not None:
            slider = state[0] - friction(float(state[0])) / slip[0]
    return np.array(path[-2 * steps :: 2])


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("laws", "cubic", "slip", "within"),
    [
        ((), 0.0, None, 2e-3),
        ((Cubic(1e17),), 1e17, None, 5e-3),
        ((Jenkins(4e6, 15.0),), 0.0, (4e6, 15.0), 1e-2),
    ],
    ids=["linear", "hardening", "elastic slip"],
)
def test_the_forced_motion_is_that_of_the_cut_in_time(
    laws: tuple[JointLaw, ...], cubic: float, slip: tuple[float, float] | None, within: float
) -> None:
    found = forced_vibration(mill(*laws), SPEED, DEPTH)
    path = in_time(cubic, slip, DEPTH)
    linear = forced_vibration(mill(), SPEED, DEPTH)
    assert found.settled.all()
    np.testing.assert_allclose(found.peak_to_peak[0], np.ptp(path, axis=0), rtol=within)
    np.testing.assert_allclose(found.rms[0], np.std(path, axis=0), rtol=within)
    if laws:
        assert abs(found.peak_to_peak[0, 0] / linear.peak_to_peak[0, 0] - 1) > 5 * within


def test_harmonics_of_the_tooth_force_sum_to_the_force() -> None:
    cutting = Cutting(**{**CUT, "feed": FEED})  # type: ignore[arg-type]
    k = np.arange(400.0)
    theta = np.array([0.2, 0.5, 1.0])
    found = PatternForces(cutting, ("x", "y"), 399).feeds(1e-3)
    found[1:] *= 2
    summed = (np.exp(1j * k * 3 * theta[:, None]) @ found).real
    expected = np.zeros((3, 2))
    for j in range(3):
        phi = theta + 2 * np.pi * j / 3
        inside = (phi > cutting.entry_angle) & (phi < np.pi)
        expected -= cutting.tooth(phi)[0] * (inside * FEED * np.sin(phi))[:, None]
    np.testing.assert_allclose(summed, expected, atol=4e-3 * np.max(np.abs(expected)))


def test_forced_vibration_of_the_guide_mill() -> None:
    """7.5 µm at 3 mm and 10 to 14 µm at 4 to 5.5 mm at 10455 rpm, 19 µm at 11727 rpm and 5.98 mm: a cut in time."""
    guide = Joint((Linear(6.4e8), Viscous(480.0)), validity={"amplitude": (0.0, 4.6e-6)})
    machine = read_machine(LIBRARY / "guide_mill.toml").with_joint("guide", guide)
    found = forced_vibration(machine, [10455, 10455, 10455, 11727], [3e-3, 4e-3, 5.5e-3, 5.98e-3])
    np.testing.assert_allclose(found.amplitude * 1e6, [7.52, 10.02, 13.78, 19.4], rtol=3e-3)
    assert not found.beyond.any()
    slow = forced_vibration(machine, 4800, 3e-3)
    i = slow.connections.index("guide")
    assert slow.beyond[0, i] == pytest.approx(slow.joint_amplitude[0, i] / 4.6e-6 - 1)
    assert slow.beyond[0, i] > 0.1


def test_what_has_no_forced_vibration_is_refused() -> None:
    bare = mill()
    with pytest.raises(InputError, match="with a feed per tooth"):
        forced_vibration(replace(bare, cutting=CUT), SPEED, DEPTH)
    with pytest.raises(InputError, match="milling with a feed"):
        forced_vibration(replace(bare, cutting={"process": "turning", "specific": 1e9, "feed": 1e-4}), SPEED, DEPTH)
    with pytest.raises(InputError, match="smoothing_velocity"):
        forced_vibration(mill(Coulomb(5.0)), SPEED, DEPTH)
