"""A force that a slider holds: what it can make of a motion, against the machine stepped in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from jointlib import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.dahl import Dahl
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, response
from machines.forced_response.tool_peaks import tool_peaks
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.held_forces import held_changes, held_force

MASS, SPRING, HARDENING, SLIDER, SLIP, DAMPER = 25.0, 60e6, 3.75e18, 20e6, 40.0, 400.0


BESIDE = 30e6
"""N/m, of a slider beside the first that always sticks."""


def machine(*, hardening: float = HARDENING, apart: bool = False, beside: float = 0.0) -> Machine:
    """A mass on a spring that hardens and on a slider, in one joint or in two beside each other; on another one too."""
    spring = Joint((Linear(stiffness=SPRING), Cubic(stiffness3=hardening), Viscous(damping=DAMPER)))
    slider = Joint((Jenkins(stiffness=SLIDER, slip_force=SLIP),))
    both = {"spring": spring, "slider": slider} if apart else {"both": Joint((*spring.laws, *slider.laws))}
    both |= {"second": Joint((Jenkins(stiffness=beside, slip_force=1e3 * SLIP),))} if beside else {}
    connections = tuple(Connection(name, ("body.x", "ground"), joint) for name, joint in both.items())
    return Machine((Lumped("body", ("x",), np.array([[MASS]])),), connections, tool={"x": "body.x"})


def in_time(force: float, frequency: float, share: float, beside: float = 0.0) -> complex:
    """First harmonic in m after 250 cycles by RK4, from rest with a slider that holds a share of its slip force."""
    spring = SPRING + beside
    omega, n, cycles = 2 * np.pi * frequency, 200, 250
    x = float(brentq(lambda x: spring * x + HARDENING * x**3 + share * SLIP, -1e-5, 1e-5))
    v, place, dt, path = 0.0, x - share * SLIP / SLIDER, 2 * np.pi / omega / n, []

    def acceleration(t: float, x: float, v: float) -> float:
        drive = force * min(1.0, t * frequency / 50) * np.cos(omega * t)
        return float(drive - DAMPER * v - spring * x - HARDENING * x**3 - held(x)) / MASS

    def held(x: float) -> float:
        return min(max(SLIDER * (x - place), -SLIP), SLIP)

    for step in range(cycles * n):
        t = step * dt
        a = acceleration(t, x, v)
        v2 = v + dt / 2 * a
        b = acceleration(t + dt / 2, x + dt / 2 * v, v2)
        v3 = v + dt / 2 * b
        c = acceleration(t + dt / 2, x + dt / 2 * v2, v3)
        v4 = v + dt * c
        d = acceleration(t + dt, x + dt * v3, v4)
        x, v = x + dt / 6 * (v + 2 * v2 + 2 * v3 + v4), v + dt / 6 * (a + 2 * b + 2 * c + d)
        place = x - held(x) / SLIDER
        path.append(x)
    last = np.array(path[-4 * n :])
    return complex(2 * np.mean(last * np.exp(-2j * np.pi * np.arange(1, 4 * n + 1) / n)))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("force", "frequency", "least"),
    # Near to slipping the second harmonic makes the slider lose part of what it holds.
    [(4.0, 280.0, 0.75), pytest.param(2.0, 282.0, 0.75, marks=pytest.mark.thorough), (4.0, 290.0, 0.0)],
)
def test_what_a_slider_holds_changes_a_motion_by_as_much_as_is_told(
    force: float, frequency: float, least: float
) -> None:
    found = response(machine(), [force], np.array([frequency - 1, frequency, frequency + 1]))
    (branch,) = found.branches[0]
    told = branch.held[1]
    fresh = in_time(force, frequency, 0.0)
    assert abs(fresh) == pytest.approx(abs(branch.joint[1, 0]), rel=2e-3)
    # What it can hold while it vibrates by so much; it vibrates by less then, so it could hold a little more.
    after = in_time(force, frequency, 1 - SLIDER * abs(fresh) / SLIP)
    true = abs(after - fresh) / abs(fresh)
    assert least * told < true < 1.02 * told


def test_a_slider_beside_the_spring_does_what_one_in_its_joint_does() -> None:
    lines = np.array([279.0, 280.0, 281.0])
    one, two = (response(machine(apart=apart), [4.0], lines) for apart in (False, True))
    assert two.branches[0][0].held == pytest.approx(one.branches[0][0].held, rel=1e-6)


@pytest.mark.slow
def test_another_slider_that_sticks_is_a_spring_to_what_one_holds() -> None:
    """Without it the mean would move half as far again, and further with every slider that a machine has."""
    stiffened = machine(apart=True, beside=BESIDE)
    (branch,) = response(stiffened, [0.3], np.array([324.0, 325.0, 326.0])).branches[0]
    fresh = in_time(0.3, 325.0, 0.0, BESIDE)
    assert abs(fresh) == pytest.approx(abs(branch.joint[1, 0]), rel=2e-3)
    assembly, z = Assembly(stiffened, ("body.x",), ("body.x",)), branch.joint[1:2, None]
    told = held_changes(assembly, 2 * np.pi * branch.frequency[1:2], np.array([0.3]), z, (1,))
    after = in_time(0.3, 325.0, 1 - SLIDER * abs(fresh) / SLIP, BESIDE)
    assert abs(after - fresh) / abs(fresh) == pytest.approx(told[0, 0], rel=0.02)


@pytest.mark.thorough
def test_it_is_said_beside_the_peak_and_as_a_warning() -> None:
    found = response(machine(), [1.0], [250.0, 320.0])
    (peak,) = tool_peaks(found)
    assert peak.held > 0.01
    (said,) = [warning for warning in found.warnings if "may hold a force" in warning]
    assert "at 1 N on body.x" in said


def test_nothing_is_said_where_all_else_is_linear_or_the_slider_slips() -> None:
    straight = response(machine(hardening=0.0), [1.0], [250.0, 320.0])
    assert not any(branch.held.size and np.any(branch.held > 1e-12) for branch in straight.branches[0])
    slipping = response(machine(), [200.0], np.array([285.0, 286.0, 287.0]))
    assert np.all(slipping.branches[0][0].held < 1e-9)
    assert not any("may hold" in warning for warning in (*straight.warnings, *slipping.warnings))


def test_held_forces_of_an_elastic_slider_and_of_dahl_friction() -> None:
    A = np.array([1e-8, 5e-7, 1.9e-6, 2.1e-6])
    slider = held_force(Joint((Jenkins(stiffness=SLIDER, slip_force=SLIP),)), A, 1e3)
    assert slider == pytest.approx(np.maximum(SLIP - SLIDER * A, 0.0), abs=1e-2 * SLIP)
    dahl = held_force(Joint((Dahl(stiffness=SLIDER, slip_force=SLIP),)), A, 1e3)
    assert np.all(dahl < SLIP)
    assert np.all(np.diff(dahl) < 0)
