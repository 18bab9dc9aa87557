"""Turning past loss of contact: the harmonic of the chip by two routes, and the cycles that a simulation settles on."""

from __future__ import annotations

import numpy as np
import pytest
from cut_in_time import Body, Case, cut_in_time
from test_lobes_witness import CUBIC, SPEED, lathe

from jointlib.laws.cubic import Cubic
from machines.cutting.process.lost_contact import chip_gain
from machines.cutting.process.power_law import first_harmonic
from machines.lobes import Cutting, amplitude_limits


@pytest.mark.parametrize("exponent", [1.0, 0.75])
def test_an_edge_that_stays_in_the_cut_feels_the_power_law(exponent: float) -> None:
    turned = np.array([0.7, 1.5, 2.5, 3.1, 4.0, 5.5])
    once = 1 - np.exp(-1j * turned)
    known = first_harmonic(0.8, exponent) / exponent * once
    np.testing.assert_allclose(chip_gain(0.8 / np.abs(once), turned, exponent), known, rtol=1e-12)


def test_what_an_edge_cuts_in_the_end_is_the_feed_whatever_it_left_standing() -> None:
    """Pass by pass: the surface is the deepest so far, and the harmonic of the chip that is cut from it agrees."""
    size, turned, count = 1.7, 2 * np.pi * 34 / 89, 89
    theta = 2 * np.pi * np.arange(count) / count
    motion, surface = size * np.cos(theta), np.full(count, -50.0)
    for _ in range(200):
        met = np.roll(surface, 34) - 1
        chip, surface = np.maximum(motion - met, 0.0), np.maximum(motion, met)
    assert np.mean(chip) == pytest.approx(1.0, rel=1e-9)
    found = complex(2 * np.mean(chip * np.exp(-1j * theta)) / size)
    known = complex(chip_gain(np.array([size]), np.array([turned]), 1.0)[0])
    assert abs(found - known) < 2e-3 * abs(known)


@pytest.mark.slow
def test_knocks_of_any_size_settle_where_the_surface_of_earlier_turns_lets_them() -> None:
    cases, told = [], []
    for feed, depth in ((1e-4, 0.75e-3), (1.5e-4, 0.66e-3)):
        machine = lathe(Cubic(CUBIC), feed=feed)
        limits = amplitude_limits(machine, [SPEED], np.geomspace(1e-5, 2.5 * feed, 14))
        told.append(limits.cycles(depth)[-1])
        cut = Cutting(**dict(machine.cutting or {}))
        cases.append(Case(Body.of(machine), cut, SPEED, depth, [9e-5, 2e-4, 5e-4], float(limits.onset_frequency[0])))
    found = cut_in_time(cases, 4, 22, 90)
    for i, cycle in enumerate(told):
        assert cycle.stable
        np.testing.assert_allclose(found.chatter[-1, i], cycle.amplitude, rtol=2e-2)
        np.testing.assert_allclose(found.frequency[i], cycle.frequency, rtol=1e-2)
    assert np.all(found.lost[-1, 0])
