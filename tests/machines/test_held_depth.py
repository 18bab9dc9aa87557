"""The lowest depth at an amplitude and its slopes, against lobes computed again with the joints held."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from jointlib.io.joint_file import read_joint
from jointlib.laws.linear import Linear
from machines import Machine, lobes_at_amplitude, natural_modes, read_machine, stability_lobes
from machines.cutting.amplitude.chattering_tool import on_lines
from machines.cutting.process.cutting import Cutting
from machines.harmonic_balance.assembly import Assembly
from machines.modes.depth_sensitivity import depth_sensitivity
from machines.modes.mode_energy import mode_energies
from machines.modes.mode_words import leading
from machines.statics.working_point import at_working_point

LIBRARY = Path(machines.__file__).parent / "library"


def shipped(name: str) -> Machine:
    machine = read_machine(LIBRARY / f"{name}.toml")
    if name == "guide_mill":
        machine = machine.with_joint("guide", read_joint(LIBRARY / "guide_mill" / "start.joint.toml"))
    return machine


def slopes_are_those_of_lobes(machine: Machine, amplitude: float, least: float = 0.0) -> None:
    """d ln b/d ln K by differences: gains of all joints frozen line by line, one of them stiffer, the lobes anew."""
    assert machine.cutting is not None
    cutting = Cutting(**machine.cutting)
    found = depth_sensitivity(natural_modes(machine, amplitude))
    assert found is not None
    assert found.amplitude == amplitude
    rest = depth_sensitivity(natural_modes(machine))
    assert rest is not None
    assert np.max(np.abs(found.joints - rest.joints)) > least * np.max(np.abs(rest.joints))
    assembly = Assembly(machine, machine.tool_dofs, machine.tool_dofs)
    beside = np.linspace(-1, 1, 121) ** 3  # densest where the depth is lowest
    held = on_lines(machine, cutting, found.frequency * (1 + 0.03 * beside), amplitude)
    K = on_lines(machine, cutting, np.array([found.frequency]), amplitude).gain[0].real

    def depth(joint: int, by: float) -> float:
        gain = held.gain.copy()
        gain[:, joint] += by
        H = assembly.coupled(2 * np.pi * held.frf.frequency, gain)
        frf = replace(held.frf, receptance=H)
        return stability_lobes(frf, cutting, [1000.0], found.method, axes=machine.tool_axes).minimum_depth

    assert found.depth == pytest.approx(depth(0, 0.0), rel=1e-4)
    h = 2e-4
    for joint in np.argsort(-np.abs(found.joints))[:3]:
        difference = (depth(joint, h * K[joint]) - depth(joint, -h * K[joint])) / (2 * h * found.depth)
        assert found.joints[joint] == pytest.approx(difference, rel=1e-3, abs=1e-4)


def test_slopes_of_a_mill_with_its_guide_held_are_those_of_lobes_computed_again() -> None:
    slopes_are_those_of_lobes(shipped("guide_mill"), 2e-6, 0.004)


@pytest.mark.slow
def test_slopes_of_a_lathe_with_its_joints_held_are_those_of_lobes_computed_again() -> None:
    slopes_are_those_of_lobes(shipped("lathe"), 30e-6, 0.1)


@pytest.mark.slow
def test_slopes_of_a_column_mill_with_its_joints_held_are_those_of_lobes_computed_again() -> None:
    slopes_are_those_of_lobes(shipped("column_mill_a"), 5e-6)


def test_the_depth_is_the_minimum_of_the_chart_at_that_amplitude_and_the_words_say_how_joints_are() -> None:
    machine = shipped("guide_mill")
    modes = natural_modes(machine, 2e-6)
    found = depth_sensitivity(modes)
    assert found is not None
    chart = lobes_at_amplitude(machine, [3000.0], 2e-6, "zero-order")
    assert found.depth == pytest.approx(chart.minimum_depth, rel=1e-4)
    said = leading(modes, mode_energies(modes), found)
    assert "with the joints as they are held at a tool-point amplitude of 2 um: " in said[-1]
    assert "at rest" not in " ".join(said)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"helix": 30.0}, "helix"),
        ({"pitch": (70.0, 110.0, 70.0, 110.0), "helix": 30.0}, "unequal pitches and helix"),
        ({"process_damping": 5e3}, "process damping"),
    ],
    ids=["helix", "pitches", "flank"],
)
def test_what_limits_an_unlike_cutter_is_told_of_the_even_one(more: dict[str, object], words: str) -> None:
    """The mean of a cut by a helix is that by straight edges; unequal pitches and flanks leave no depth below it."""
    machine = shipped("guide_mill")
    even = depth_sensitivity(natural_modes(machine))
    modes = natural_modes(replace(machine, cutting={**(machine.cutting or {}), **more}))
    found = depth_sensitivity(modes)
    assert even is not None
    assert found is not None
    assert (found.depth, found.mode, found.instead) == (even.depth, even.mode, words)
    np.testing.assert_array_equal(found.joints, even.joints)
    said = leading(modes, mode_energies(modes), found)
    assert f"without the {words}" in said[-1]
    assert "that limits the depth" in said[0]
    depths = lobes_at_amplitude(modes.machine, np.linspace(3000, 12000, 60), 0.0, "zero-order").depth
    assert np.min(depths) > (1 - 1e-6) * found.depth
    if words == "helix":
        assert np.min(depths) < 1.05 * found.depth


@pytest.mark.thorough
def test_what_more_stiffness_gives_at_an_amplitude_is_the_depth_of_the_stiffer_machine() -> None:
    machine = shipped("guide_mill")
    found = depth_sensitivity(natural_modes(machine, 5e-6))
    assert found is not None
    still = at_working_point(machine)
    joint = still.joints()[0] + Linear(0.1 * float(found.gain[0].real))
    again = depth_sensitivity(natural_modes(still.with_joint(still.flexible[0].name, joint), 5e-6))
    assert again is not None
    assert found.stiffer(np.array([0]), 0.1) == pytest.approx(again.depth, rel=1e-9)
    assert found.stiffer(np.array([0]), 1e-3) / found.depth - 1 == pytest.approx(1e-3 * found.joints[0], rel=0.2)


def test_a_mode_that_limits_at_no_speed_of_the_file_is_told_with_the_one_that_does() -> None:
    """The lobes of the lowest depth at 60 f/(N (k + ψ)) rpm, by the chart itself; between two of them none touches."""
    machine = shipped("guide_mill")
    found = depth_sensitivity(natural_modes(machine))
    assert found is not None
    teeth = (machine.cutting or {})["teeth"]
    first, second = (60 * found.frequency / (teeth * (k + found.wave)) for k in (0, 1))
    touched = lobes_at_amplitude(machine, [first, second], 0.0, "zero-order").depth
    assert touched == pytest.approx(found.depth, rel=1e-6)
    apart = second + np.array([0.1, 0.4]) * (first - second)
    away = replace(machine, cutting={**(machine.cutting or {}), "speed": tuple(apart)})
    modes = natural_modes(away)
    told = depth_sensitivity(modes)
    assert told is not None
    assert (found.missed, told.missed) == (None, tuple(apart))
    lowest = lobes_at_amplitude(away, np.linspace(*apart, 200), 0.0, "zero-order").depth.min()
    assert told.depth == pytest.approx(found.depth, rel=1e-9)
    assert lowest > told.depth
    said = leading(modes, mode_energies(modes), told)
    assert "at no speed of the file, bends" in said[0]
    assert f"at {lowest * 1e3:.4g} mm" in said[1]
