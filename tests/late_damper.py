"""Simulated records of a damper with dry friction that follows a random voltage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import cont2discrete, lfilter

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.measurement import Channel, Measurement, RecordSource
from jointlib.modulation import lagged

RATE, LATE, FINE = 250.0, 0.01, 4
CHANNELS = (
    Channel("z", "displacement", "m", "m", 1.0),
    Channel("F", "force", "N", "N", 1.0),
    Channel("u", "voltage", "V", "V", 1.0, is_input=True),
)
SPRUNG = Joint((Linear(1000.0), Viscous(100.0)), "damper")


def sines(rng: np.random.Generator, t: Array, low: float, high: float) -> tuple[Array, Array]:
    """A sum of sines of rms 1 and its derivative."""
    omega, phase = 2 * np.pi * rng.uniform(low, high, 40), rng.uniform(0, 2 * np.pi, 40)
    angle, size = np.outer(t, omega) + phase, np.sqrt(2 / 40)
    return size * np.cos(angle).sum(axis=1), -size * np.sin(angle) @ omega


def damper(folder: Path, input_lag: float, late: float) -> Measurement:
    """Two levels of random motion under a random voltage; a yield force of 50 N and 150 N/V turns over with speed."""
    sources = []
    for level in (0.7, 1.0):
        rng = np.random.default_rng(int(10 * level))
        t = np.arange(FINE * 2500) / (FINE * RATE)
        z, v = (0.006 * level * x for x in sines(rng, t, 0.5, 4.0))
        u = np.clip(1.5 + 0.8 * sines(rng, t, 0.3, 8.0)[0], 0.0, 3.0)
        felt = u
        if input_lag:
            b, a, _ = cont2discrete(([1.0], [input_lag, 1.0]), t[1], method="foh")
            felt = u[0] + lfilter(np.ravel(b), a, u - u[0])
        force = 1500 * z + 250 * v + (50 + 150 * felt) * v / np.hypot(v, 0.02)
        force = np.interp(t - late, t, force)[::FINE]
        force += 0.005 * force.std() * rng.standard_normal(len(force))
        file = folder / f"{level}.npz"
        np.savez(file, allow_pickle=False, z=z[::FINE], F=force, u=u[::FINE])
        sources.append(RecordSource(file, "fit", condition=f"level {level}"))
    return Measurement(folder / "m.toml", "path", CHANNELS, tuple(sources), sample_rate=RATE)


def stepped_damper(folder: Path, input_lag: float) -> Measurement:
    """40 s of random motion under a voltage that is stepped every second, and friction that turns over a little after
    the speed does."""
    rng = np.random.default_rng(3)
    t = np.arange(FINE * round(40 * RATE)) / (FINE * RATE)
    z, v = (0.004 * x for x in sines(rng, t, 0.5, 4.0))
    u = np.repeat(rng.uniform(0, 2.5, 40), round(FINE * RATE))
    felt = lagged(u, input_lag, 1 / (FINE * RATE))
    force = 1500 * z + 250 * v + (50 + 150 * felt) * np.tanh((v + 1.5 * z) / 0.02)
    force = force[::FINE] + 0.5 * rng.standard_normal(round(40 * RATE))
    np.savez(folder / "steps.npz", allow_pickle=False, z=z[::FINE], F=force, u=u[::FINE])
    source = RecordSource(folder / "steps.npz", "fit")
    return Measurement(folder / "m.toml", "path", CHANNELS, (source,), sample_rate=RATE)
