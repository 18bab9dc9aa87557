"""The mill of the walk, written from documented keys alone: what it weighs, stands on and hides beyond its band."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from machines import Machine, frozen_receptance, read_machine, static_point

BED_MILL = Path(__file__).parents[2] / "docs" / "bed_mill.toml"
G = 9.80665


def hollow(width: float, height: float, wall: float, length: float, density: float) -> float:
    """Mass of a box in kg."""
    return density * length * (width * height - (width - 2 * wall) * (height - 2 * wall))


@cache
def bed_mill() -> Machine:
    return read_machine(BED_MILL)


def ring(outer: float, inner: float, length: float, density: float) -> float:
    """Mass of a tube in kg."""
    return density * np.pi / 4 * (outer**2 - inner**2) * length


def test_its_mounts_carry_the_weight_added_up_by_hand_and_its_screw_that_of_the_ram() -> None:
    mill = bed_mill()
    carried = static_point(mill)
    mounts = [c.name for c in mill.flexible if c.name.startswith("mount_") and c.name.endswith("_z")]
    column = hollow(0.56, 0.5, 0.04, 0.4, 7200) + hollow(0.52, 0.46, 0.03, 1.2, 7200)
    tool = ring(0.063, 0, 0.02, 7850) + ring(0.04, 0, 0.04, 7850)
    tool += ring(0.016, 0, 0.025, 14500) + ring(0.0128, 0, 0.042, 14500)
    spindle = ring(0.07, 0.028, 0.4, 7850) + ring(0.089, 0.04, 0.08, 7850)
    hanging = 260 + hollow(0.26, 0.32, 0.025, 1.2, 7200) + ring(0.22, 0.13, 0.5, 7200) + spindle + tool
    whole = 3600 + 450 + 75 + column + hanging
    assert -sum(carried.of(name)[1] for name in mounts) == pytest.approx(whole * G, rel=1e-6)
    assert -carried.of("z_screw.axial")[1] == pytest.approx(hanging * G, rel=2e-2)  # guides tilt with the column


def test_the_modes_of_its_tool_lie_far_beyond_the_band_of_the_file() -> None:
    mill = bed_mill()
    assert mill.frequency is not None
    assert mill.frequency[1] <= 500
    lines = np.linspace(2700, 3100, 41)
    beyond = np.abs(frozen_receptance(mill, lines, 0.0).receptance[:, 0, 0]).max()
    within = np.abs(frozen_receptance(mill, [250.0, 500.0], 0.0).receptance[:, 0, 0]).max()
    assert len(mill.flexible) > 100
    assert beyond > 3 * within
