"""A rig whose relative motion is prescribed, so that any force along it is a record of the tracer. Simulated."""

from __future__ import annotations

from functools import cache

import numpy as np
from integrated_rig import FREQUENCY, M1, M2, M3, PEAK, Array, C, K
from rig_samples import PERIOD, RATE, measurement, record

from jointlib.loop.balance.bodies import rig_of
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.floor import excited_band, noise_floor
from jointlib.loop.balance.spectra import spectra_of

PERIODS, FINER = 16, 8
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
