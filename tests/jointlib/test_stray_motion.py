"""What does not repeat moves a law that is not linear as what does: by hand, on a prescribed motion."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from integrated_rig import FREQUENCY, LINEAR, M1, M2, M3, PEAK, Array, C, K
from rig_samples import PERIOD, RATE, measurement, record

from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.loop.balance.bodies import rig_of
from jointlib.loop.balance.equations import Observed, forces_of_law
from jointlib.loop.balance.floor import excited_band, noise_floor
from jointlib.loop.balance.spectra import spectra_of
from jointlib.loop.balance.tangents import tangents

PERIODS, FINER = 16, 8
CUBIC = Cubic(0.2 * K / PEAK**2)
SWELL = 0.3


@cache
def moved() -> tuple[Array, Array]:
    """z and ż at eight points a sample: lines from 2.5 to 5 kHz that swell and sink once over sixteen periods."""
    n = PERIODS * PERIOD * FINER
    t = np.arange(n) / (RATE * FINER)
    inside = np.flatnonzero((FREQUENCY >= 2.5e3) & (FREQUENCY <= 5e3))
    w = 2 * np.pi * FREQUENCY[inside, None]
    phase = np.random.default_rng(4).uniform(0, 2 * np.pi, (len(inside), 1))
    z = np.sum(np.cos(w * t + phase), axis=0) * (1 + SWELL * np.cos(2 * np.pi * t / t[-1] * (1 - 1 / n)))
    z *= PEAK / np.abs(z).max()
    rate = 2j * np.pi * np.fft.rfftfreq(n, t[1])
    return z, np.fft.irfft(rate * np.fft.rfft(z), n)


def observed(force: Array) -> Observed:
    """The record of a rig in which that motion meets a force."""
    z, _ = moved()
    n = PERIODS * PERIOD

    def sampled(x: Array, power: int = 0) -> Array:
        X = np.fft.rfft(x)[: n // 2 + 1] / FINER
        return np.fft.irfft((2j * np.pi * np.fft.rfftfreq(n, 1 / RATE)) ** power * X, n)

    f = sampled(force)
    a2 = f / (M2 + M3)
    a1 = sampled(z, 2) + a2
    rng, test = np.random.default_rng(0), measurement(settle=0)
    clean = {"a1": a1, "a2": a2, "a3": a2, "P": M1 * a1 + f}
    noisy = {c: x + 1e-6 * np.std(x) * rng.standard_normal(n) for c, x in clean.items()}
    spectra, _ = spectra_of(record(noisy), test)
    floor = noise_floor(spectra)
    return Observed(spectra, rig_of(test), floor, excited_band([spectra], [floor], test.band), K, C)


@pytest.mark.parametrize("law", [CUBIC, Coulomb(0.02 * K * PEAK, 0.1)], ids=lambda law: str(law.kind))
def test_the_force_between_the_lines_of_the_period_is_that_of_the_law_itself(law: JointLaw) -> None:
    z, v = moved()
    force = np.asarray(law.step(Motion(z, v), np.empty((len(z), 0)))[0])
    o = observed(K * z + C * v + force)
    true = np.fft.rfft(force)[o.lines] / FINER
    inside = o.stray & (o.frequency >= 2e3) & (o.frequency <= 20e3)
    left = true - forces_of_law([o], law)[0]
    through_linear_part = true - o.with_stray(np.where(o.on_period, true, 0))
    size = [np.linalg.norm(x[inside]) for x in (left, through_linear_part, true)]
    assert size[0] < 1e-3 * size[2]
    assert size[1] > 0.05 * size[2]


def test_the_true_joint_leaves_the_noise_of_the_sensors() -> None:
    z, v = moved()
    o = observed(K * z + C * v + CUBIC.stiffness3 * z**3)
    r = o.whitened(Joint((*LINEAR, CUBIC)))[o.valid[:, 2], 2]
    assert float(np.mean(np.abs(r) ** 2)) < 1.5


def test_slopes_are_those_of_that_force() -> None:
    z, v = moved()
    o = observed(K * z + C * v)
    joint = Joint((*LINEAR, CUBIC))
    found = tangents([o], joint, ["cubic.stiffness3"])["cubic.stiffness3"][0]
    unit = forces_of_law([o], CUBIC)[0] / CUBIC.stiffness3
    assert np.linalg.norm(found - unit) < 1e-9 * np.linalg.norm(unit)
    assert np.linalg.norm(unit[o.stray]) > 0.1 * np.linalg.norm(unit)
