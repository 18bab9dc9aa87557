"""Rocking modes of the paper's rig, and what other readings of its eq. 14 would give."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.identification import RigBody, rig_modes
from jointlib.identification.modal_check import natural_frequencies

BLOCK = RigBody(0.942, 5.9927e-4, 9.1761e-4)
RAIL = RigBody(2.2, 7.6785e-4, 66.867e-4)


def test_rig_has_three_rigid_and_three_relative_modes() -> None:
    modes = rig_modes(BLOCK, RAIL, stiffness=600e6, arm_x=12.5e-3, arm_y=21e-3)
    assert modes.frequencies == pytest.approx([0, 0, 0, 2656.193, 2882.106, 4800.230], abs=1e-3)


def test_each_mode_is_a_pair_on_one_spring() -> None:
    modes = rig_modes(BLOCK, RAIL, stiffness=600e6, arm_x=12.5e-3, arm_y=21e-3)
    pairs = ((600e6, 0.942, 2.2), (600e6 * 12.5e-3**2, 5.9927e-4, 7.6785e-4), (600e6 * 21e-3**2, 9.1761e-4, 66.867e-4))
    closed = sorted(np.sqrt(k * (1 / a + 1 / b)) / (2 * np.pi) for k, a, b in pairs)
    assert modes.frequencies[3:] == pytest.approx(closed)


def test_stiffness_as_printed_makes_a_spurious_mode() -> None:
    modes = rig_modes(BLOCK, RAIL, stiffness=600e6, arm_x=12.5e-3, arm_y=21e-3)
    printed = modes.stiffness.copy()
    printed[3, 0] = -600e6 / 4
    found = natural_frequencies(modes.mass, printed)
    assert found[2:] == pytest.approx([2124, 2656.2, 2882.1, 4305], abs=1)
    assert np.count_nonzero(found) == 4


def test_equal_masses_reading_misses_the_printed_frequencies() -> None:
    twice = RigBody(2 * RAIL.mass, 2 * RAIL.inertia_x, 2 * RAIL.inertia_y)
    modes = rig_modes(BLOCK, twice, stiffness=600e6, arm_x=12.5e-3, arm_y=21e-3)
    assert modes.frequencies[3:] == pytest.approx([2347, 2794, 4426], abs=1)


def test_half_arms_reading_misses_the_printed_frequencies() -> None:
    modes = rig_modes(BLOCK, RAIL, stiffness=600e6, arm_x=6.25e-3, arm_y=10.5e-3)
    assert modes.frequencies[3:5] == pytest.approx([1328, 1441], abs=1)
