"""Pitches that lift the depth of cut, held against all pairs of pitches by an exact method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_cutters import mill

from jointlib.errors import InputError
from machines import Machine, lobes_at_amplitude
from machines.cutting.amplitude.best_pitch import best_pitch


def least(machine: Machine, pitch: tuple[float, ...], speeds: np.ndarray) -> float:
    cutting = {**(machine.cutting or {}), "pitch": pitch}
    return float(np.min(lobes_at_amplitude(replace(machine, cutting=cutting), speeds).depth))


@pytest.mark.slow
def test_two_flutes_get_the_best_pair_there_is() -> None:
    machine = mill(teeth=2)
    found = best_pitch(machine, 9000.0, 9000.0)
    assert sum(found.pitch) == pytest.approx(360)
    every = [least(machine, (180 + step, 180 - step), np.array([9000.0])) for step in (10.0, 20.0, 35.0, 50.0)]
    assert found.depth >= 0.98 * max(every)
    assert found.depth == pytest.approx(least(machine, found.pitch, found.speed), rel=1e-4)
    assert found.before == pytest.approx(float(lobes_at_amplitude(machine, [9000.0]).depth[0]), rel=1e-4)
    assert f"from {1e3 * found.before:.4g} to" in found.words()


@pytest.mark.slow
def test_four_flutes_over_a_band_are_better_than_any_pairs() -> None:
    machine = mill()
    found = best_pitch(machine, 8500.0, 9500.0)
    speeds = found.speed
    pairs = [least(machine, (90 - s, 90 + s, 90 - s, 90 + s), speeds) for s in (8.0, 14.0, 20.0, 26.0)]
    assert found.depth > max(pairs)
    assert found.depth > 1.5 * found.before
    assert all(60 <= angle <= 120 for angle in found.pitch)


def test_a_lathe_has_no_pitches() -> None:
    with pytest.raises(InputError, match="two teeth or more"):
        best_pitch(mill(teeth=1), 5000.0, 6000.0)
