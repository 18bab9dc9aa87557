"""The exact methods, two equations of the same cut each, agree on its lowest depth, slow spindles included."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from random_machines import random_machine
from repeats import repeats

from jointlib import read_joint
from machines import Machine, lobes_at_amplitude, read_machine

ROOT = Path(__file__).parents[2]
LIBRARY = ROOT / "machines" / "library"
BED_MILL = ROOT / "docs" / "bed_mill.toml"
TURNING = (111, 117, 119, 120, 131, 132, 134, 135, 141, 156, 166)
"""Seeds of machines that turn."""
CLOSE = 1e-4
"""Each method proves its depth to better than this."""


def agreed(machine: Machine, speed: float) -> None:
    """The two depths at a speed in rpm."""
    turning = dict(machine.cutting or {})["process"] != "milling"
    methods = ("turning" if turning else "multi-frequency", "collocation")
    one, other = (float(lobes_at_amplitude(machine, [speed], method=method).depth[0]) for method in methods)
    assert np.isfinite(one) == np.isfinite(other)
    if np.isfinite(one):
        assert one == pytest.approx(other, rel=CLOSE)


def agreed_at_random(seed: int) -> None:
    """A random machine of 5 to 200 contacts, at a speed of its own from 500 rpm on."""
    agreed(random_machine(seed), float(np.exp(np.random.default_rng(seed).uniform(np.log(500), np.log(12000)))))


def of_library(name: str) -> Machine:
    """With the joint of its folder where the file leaves it open."""
    machine = read_machine(LIBRARY / f"{name}.toml")
    return (
        machine.with_joint("guide", read_joint(LIBRARY / name / "start.joint.toml"))
        if name == "guide_mill"
        else machine
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("file", "speed"),
    [
        ("guide_mill", 10460.0),
        ("two_mode_tool", 500.0),
        ("two_mode_tool", 9000.0),
        ("column_mill_a", 8000.0),
        ("column_mill_b", 8000.0),
    ],
)
def test_library_machines(file: str, speed: float) -> None:
    agreed(of_library(file), speed)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [500.0, 1000.0, 2500.0])
@pytest.mark.parametrize("file", ["guide_mill", "column_mill_a", "column_mill_b"])
def test_slow_spindles_of_library_machines(file: str, speed: float) -> None:
    agreed(of_library(file), speed)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [500.0, 1000.0, 2500.0, 8000.0])
def test_a_mill_of_two_hundred_lines(speed: float) -> None:
    agreed(read_machine(BED_MILL), speed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", repeats([107, 108, 109, 110, 120], lambda seed: seed != 109))
def test_random_machines(seed: int) -> None:
    """With parts of up to 215 kHz; the flexibility of one at 14 kHz is 6e-4 off if only lines near by are seen."""
    agreed_at_random(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [seed for seed in range(101, 169) if seed not in TURNING])
def test_many_random_machines_that_mill(seed: int) -> None:
    agreed_at_random(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [117, 120, 131, 132, 134])
def test_random_machines_that_turn(seed: int) -> None:
    agreed_at_random(seed)
