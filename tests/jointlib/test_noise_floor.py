"""The noise of a rig's channels where more lies between the lines than in a quiet record."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.loop.balance.floor import Floor, noise_floor
from jointlib.loop.balance.spectra import Spectra

M1, M2, M3 = 0.9, 1.1, 1.2
SIZES = {"P": 0.5, "a1": 0.4, "a2": 0.3, "a3": 0.35}
CLOSURES = [{"P": 1.0, "a1": -M1, "a2": -M2, "a3": -M3}, {"a2": 1.0, "a3": -1.0}]
PERIODS, LENGTH = 6, 4096


def record(rng: np.random.Generator, growth: float, motion: float, drive: float) -> Spectra:
    """Noise ``growth`` times that at rest, and a motion that does not repeat, P = m1 a1 + (m2 + m3) a2."""
    n = PERIODS * LENGTH
    a1, a2 = (motion * rng.standard_normal(n) for _ in range(2))
    moved = {"P": M1 * a1 + (M2 + M3) * a2, "a1": a1, "a2": a2, "a3": a2}
    shaken: Array = np.tile(rng.standard_normal(LENGTH), PERIODS) * drive
    channels = {
        name: np.fft.rfft(moved[name] + shaken + growth * size * rng.standard_normal(n)) for name, size in SIZES.items()
    }
    return Spectra("r", "r", "", 1e4, PERIODS, LENGTH, channels)


def over_truth(floor: Floor, growth: float) -> dict[str, float]:
    """Mean floor over the power of the noise that was added."""
    n = PERIODS * LENGTH
    return {name: float(np.mean(floor.power[name])) / (n * (growth * size) ** 2) for name, size in SIZES.items()}


@pytest.mark.parametrize("growth", [1.7, 3.0])
def test_noise_that_grows_while_the_shaker_runs_is_noise(growth: float) -> None:
    rng = np.random.default_rng(3)
    floor = noise_floor(record(rng, growth, 0.0, 20.0), [record(rng, 1.0, 0.0, 0.0)], CLOSURES)
    assert floor.source == "between_lines"
    # A tenth of a decibel for each of sixty blocks, and what the share is off by.
    assert over_truth(floor, growth) == pytest.approx(dict.fromkeys(SIZES, 1.0), abs=0.08)


def test_a_motion_that_does_not_repeat_is_no_noise() -> None:
    rng = np.random.default_rng(4)
    floor = noise_floor(record(rng, 1.0, 1.5, 20.0), [record(rng, 1.0, 0.0, 0.0)], CLOSURES)
    assert floor.source == "quiet"
    assert over_truth(floor, 1.0) == pytest.approx(dict.fromkeys(SIZES, 1.0), abs=0.15)


def test_without_a_sum_that_closes_the_quiet_record_tells() -> None:
    rng = np.random.default_rng(5)
    floor = noise_floor(record(rng, 1.7, 0.0, 20.0), [record(rng, 1.0, 0.0, 0.0)])
    assert floor.source == "quiet"
    assert over_truth(floor, 1.0) == pytest.approx(dict.fromkeys(SIZES, 1.0), abs=0.08)
