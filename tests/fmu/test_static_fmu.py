"""Machines under a static load as FMUs: rest at the working point, small and large vibrations about it."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from machine_host import Exchange, Stepping, unpacked
from repeats import repeats
from scipy.integrate import solve_ivp
from tools import require

from fmu.members.machine_system import system_of_machine
from fmu.playback.simulation import simulate
from fmu.ssp import export_ssp
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, StaticLoad, frozen_receptance, static_point

KAPPA, CONTACT, SHIM, PUSH = 3.931408125e-8, 2500.0, 1.5e-6, 300.0
STICK, SLIP = 4e7, 100.0
both_versions = pytest.mark.parametrize("fmi", [2, 3])
one_version = pytest.mark.parametrize("fmi", repeats([2, 3], lambda fmi: fmi == 3))
both_kinds = pytest.mark.parametrize("kind", [Stepping, Exchange])


@pytest.fixture(autouse=True)
def _compiler() -> None:
    require("cc")


@functools.cache
def pressed() -> Machine:
    """A slide pressed by its weight onto a one-sided contact on a shim, on a table on a spring with friction."""
    slide = Lumped("slide", ("z",), np.array([[20.0]]))
    table = Lumped("table", ("z",), np.array([[40.0]]), np.array([[2e4]]), np.array([[8e7]]))
    contact = Joint((HertzContact(CONTACT, KAPPA), Viscous(2e4)))
    foot = Joint((Linear(1e8), Jenkins(STICK, SLIP), Viscous(2e4)))
    connections = (
        Connection("contact", ("slide.z", "table.z"), contact),
        Connection("foot", ("table.z", "ground"), foot),
    )
    load = StaticLoad((0.0, 0.0, -9.81), {"slide.z": -PUSH}, {"contact": SHIM})
    return Machine((slide, table), connections, "pressed", tool={"y": "slide.z"}, force=(20.0,), static=load)


def contact_force(z: float, v: float) -> float:
    """Beyond the preload, which is there at z = 0."""
    return CONTACT * (max(1 + z / (KAPPA * CONTACT ** (2 / 3)), 0.0) ** 1.5 - 1) + 2e4 * v


OUTPUTS = ["displacement_y", "contact.displacement", "contact.force", "foot.displacement", "foot.force"]


def at_rest() -> Array:
    """Outputs at the working point, from the forces alone: each joint carries what lies above it."""
    above, below = -PUSH - 20 * 9.81, -PUSH - 60 * 9.81
    pressed_by = KAPPA * CONTACT ** (2 / 3) * ((1 + above / CONTACT) ** (2 / 3) - 1)
    # The friction has let go under this load, so that it carries its slip force upwards.
    down = (below + SLIP) / (1e8 + 8e7)
    assert STICK * abs(down) > SLIP
    return np.array([pressed_by - SHIM + down, pressed_by, above, down, 1e8 * down - SLIP])


@pytest.mark.thorough
@both_versions
@both_kinds
def test_without_a_force_the_machine_stays_where_its_load_puts_it(kind: type[Stepping | Exchange], fmi: int) -> None:
    fmu = kind(unpacked(pressed(), fmi), fmi)
    expected = at_rest()
    np.testing.assert_allclose(fmu.get(OUTPUTS), expected, rtol=1e-9)
    if kind is Exchange:
        rates = fmu.slope(0.0, fmu.get(fmu.states))  # type: ignore[union-attr]
        speeds = np.array([name.endswith(".velocity)") for name in fmu.rates])  # type: ignore[union-attr]
        assert np.max(np.abs(rates[speeds])) < 1e-11 * 9.81
        return
    # Sixty periods of the slowest motion, near 250 Hz.
    found = fmu.run({"force_y": np.zeros(240)}, 1e-3, OUTPUTS)
    assert np.max(np.abs(found / expected - 1)) < 1e-10


@pytest.mark.thorough
def test_the_start_is_the_static_point_of_the_solver() -> None:
    point = static_point(pressed())
    found = Stepping(unpacked(pressed(), 2), 2).get(OUTPUTS)
    contact, foot = point.of("contact"), point.of("foot")
    np.testing.assert_allclose(found, [point.dofs[0], *contact, *foot], rtol=1e-10)


@pytest.mark.thorough
@both_versions
@pytest.mark.parametrize("frequency", [180.0, 260.0])
def test_a_small_force_makes_the_motion_of_the_tangent_receptance(frequency: float, fmi: int) -> None:
    free = pressed().with_joint("foot", Joint((Linear(1.4e8), Viscous(2e4))))
    machine = _KEPT.setdefault("free", free)
    fmu, steps, force = Stepping(unpacked(machine, fmi), fmi), 400, 1e-2
    # The sine's mean over each step, so that held levels carry the whole first harmonic.
    edge = np.cos(2 * np.pi * np.arange(steps + 1) / steps)
    levels = force * (edge[:-1] - edge[1:]) * steps / (2 * np.pi)
    found = fmu.run({"force_y": np.tile(levels, 60)}, 1 / (steps * frequency), ["displacement_y"])[-2 * steps :, 0]
    last, before = found[steps:], found[:steps]
    assert np.max(np.abs(last - before)) < 1e-5 * np.ptp(last)
    turn = np.exp(-2j * np.pi * np.arange(1, steps + 1) / steps)
    receptance = frozen_receptance(machine, [frequency], 0.0).receptance[0, 0, 0]
    answer = 2 * np.mean(last * turn) / force * 1j
    assert abs(answer - receptance) < 1e-4 * abs(receptance)
    assert np.mean(last) == pytest.approx(static_point(machine).dofs[0], rel=1e-6)


_KEPT: dict[str, Machine] = {}


@pytest.mark.thorough
@both_versions
@both_kinds
def test_a_large_force_lifts_the_contact_off_as_the_equations_say(kind: type[Stepping | Exchange], fmi: int) -> None:
    machine = _KEPT.setdefault("sprung", pressed().with_joint("foot", Joint((Linear(1.4e8), Viscous(2e4)))))
    rng = np.random.default_rng(5)
    forces = rng.uniform(-6e3, 6e3, 60)

    def slope(x: Array, held: float) -> Array:
        f = contact_force(x[0] - x[1] + SHIM, x[2] - x[3])
        spring = (8e7 + 1.4e8) * x[1] + 4e4 * x[3]
        return np.array([x[2], x[3], (held - PUSH - f) / 20 - 9.81, (f - spring) / 40 - 9.81])

    above, below = -PUSH - 20 * 9.81, -PUSH - 60 * 9.81
    pressed_by = KAPPA * CONTACT ** (2 / 3) * ((1 + above / CONTACT) ** (2 / 3) - 1)
    down = below / 2.2e8
    x, rows, step = np.array([pressed_by - SHIM + down, down, 0.0, 0.0]), [], 2e-4
    for held in forces:
        x = solve_ivp(lambda _, x, held=held: slope(x, held), (0.0, step), x, method="DOP853", rtol=1e-12, atol=1e-18)
        x = x.y[:, -1]
        rows.append([x[0], x[0] - x[1] + SHIM, contact_force(x[0] - x[1] + SHIM, x[2] - x[3])])
    expected = np.array(rows)
    assert np.any(expected[:, 1] < -KAPPA * CONTACT ** (2 / 3))
    fmu = kind(unpacked(machine, fmi), fmi)
    if kind is Exchange:
        start = fmu.get(fmu.states)  # type: ignore[union-attr]
        found = driven(fmu, start, forces, step)  # type: ignore[arg-type]
    else:
        found = fmu.run({"force_y": forces}, step, OUTPUTS[:3])
    assert np.max(np.max(np.abs(found - expected), axis=0) / np.max(np.abs(expected), axis=0)) < 1e-6


def driven(fmu: Exchange, x: Array, forces: Array, step: float) -> Array:
    """Outputs behind each step, integrated by scipy from x."""
    rows = []
    for held in forces:
        fmu.put({"force_y": float(held)})
        x = solve_ivp(fmu.slope, (0.0, step), x, method="DOP853", rtol=1e-10, atol=1e-16).y[:, -1]
        fmu.at(x)
        rows.append(fmu.get(OUTPUTS[:3]))
    return np.array(rows)


def test_friction_that_was_loaded_slips_on_at_once_to_one_side_and_sticks_to_the_other() -> None:
    system = system_of_machine(pressed())
    rest = simulate(system, np.zeros((3, 1)), 1e-3)
    np.testing.assert_allclose(rest, np.tile(rest[0], (3, 1)), rtol=0, atol=1e-12 * np.max(np.abs(rest)))
    names = [s.name for s in system.outputs]
    z, v, f = (names.index(f"foot.{what}") for what in ("displacement", "velocity", "force"))
    # Before the motion first turns back.
    for sign, sticks in ((-1.0, 0.0), (1.0, STICK)):
        end = simulate(system, np.full((5, 1), sign * 50.0), 1e-4)[1:]
        assert np.all(sign * end[:, v] > 0)
        held = end[:, f] - 1e8 * end[:, z] - 2e4 * end[:, v]
        np.testing.assert_allclose(held, -SLIP + sticks * (end[:, z] - rest[0, z]), rtol=1e-7)


@pytest.mark.thorough
@one_version
def test_fmpy_finds_no_problem_in_it(fmi: int) -> None:
    assert validate_fmu(str(unpacked(pressed(), fmi))) == []


def test_a_system_of_fmus_that_would_not_begin_at_rest_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="static: the parts of a system of FMUs begin without each other's forces"):
        export_ssp(pressed(), tmp_path / "x.ssp")
    assert not list(tmp_path.iterdir())
