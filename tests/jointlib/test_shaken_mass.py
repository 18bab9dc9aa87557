"""A body that vibrates at random near its resonance, and whose mass nobody declared."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import Verdict
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Measurement, RecordSource

RATE, MASS, STIFFNESS, DAMPING = 750.0, 2.0, 1e5, 10.0


def shaken(size: float, seed: int, count: int = 8192) -> dict[str, Array]:
    """Displacement in m and force in N of a random vibration from 5 to 150 Hz, 60 dB above its noise."""
    rng = np.random.default_rng(seed)
    f = np.fft.rfftfreq(count, 1 / RATE)
    w = 2 * np.pi * f
    F = np.where((f > 5) & (f < 150), np.exp(2j * np.pi * rng.uniform(size=len(f))), 0.0)
    z = np.fft.irfft(F / (STIFFNESS - MASS * w**2 + 1j * DAMPING * w), count)
    force = np.fft.irfft(F, count)
    scale = size / np.std(force)
    noise = 1e-3 * np.std(z) * rng.standard_normal(count)
    return {"z": scale * (z + noise), "F": scale * force}


@pytest.mark.slow
def test_strokes_that_are_nearly_alike_are_no_measure_of_noise_near_a_resonance(tmp_path: Path) -> None:
    # Springs and inertia cancel there, so that a hundredth of the motion is more than all of the force.
    records = []
    for number, size in enumerate((20.0, 50.0, 100.0)):
        np.savez(tmp_path / f"{number}.npz", allow_pickle=False, **shaken(size, number))
        records.append(RecordSource(tmp_path / f"{number}.npz", "fit"))
    channels = Channel("z", "displacement", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0)
    measurement = Measurement(tmp_path / "m.toml", "path", channels, tuple(records), sample_rate=RATE)
    found = trace(measurement, Joint((Linear(STIFFNESS), Viscous(DAMPING))))
    assert found.verdict is not Verdict.NOTHING_MISSING
    # 60 dB of the motion, carried into the force by springs and inertia, are some 4 % of it.
    assert max(found.noise_floor["force_rel_per_record"].values()) < 0.06
    assert found.chosen is not None
    assert found.chosen.family == "missing-mass"
