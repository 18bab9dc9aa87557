"""A tap test of a milling tool, simulated: what a hammer and an accelerometer at the tip record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.io.atomic import write_npz, write_text

MODES = ((412.0, 0.032, 1.5), (955.0, 0.024, 0.62), (1730.0, 0.018, 0.35))
"""Frequency in Hz, damping ratio and modal mass in kg at the tip."""
RATE, FINE = 12800.0, 8
SPACING, PULSE = 0.55, 0.6e-3
PEAKS = (610.0, 540.0, 580.0, 655.0, 500.0, 1350.0, 575.0, 620.0)
"""N; the fourth is a double hit and the sixth beyond the range of the hammer."""
DOUBLE, SECOND, LATER = 3, 0.3, 4.5e-3
RANGE, COUNTS = (1000.0, 5000.0), 32767
"""Full scale of the hammer in N and of the accelerometer in m/s²."""
NOISE = (0.4, 1.0)

_DECLARED = """\
# Simulated by jointlib/rig/tap_test.py: a hammer on the tip of a milling tool and an accelerometer opposite to it.
schema = "jointlib/measurement/1"
kind = "impact"
simulated = true
sample_rate = "12.8 kHz"
band = ["60 Hz", "2.5 kHz"]

[[channel]]
name = "hammer"
quantity = "force"
unit = "N"
gain = {0:.10g}          # of a count
range = {2:g}
dof = "tool.x"

[[channel]]
name = "acc"
quantity = "acceleration"
unit = "m/s^2"
gain = {1:.10g}
range = {3:g}
dof = "tool.x"

[[record]]
file = "hits.npz"

[estimate]
estimator = "H1"
length = "0.4 s"               # of a block, from shortly before a hit
force_window = true            # the force is nothing but the pulse
"""


def tip_acceleration(force: Array, step: float) -> Array:
    """m/s² at the tip for a force in N that is straight between samples."""
    out = np.zeros(len(force))
    for frequency, zeta, mass in MODES:
        w = 2 * np.pi * frequency
        system: Any = ([1 / mass, 0.0, 0.0], [1.0, 2 * zeta * w, w**2])
        b, a, _ = scipy.signal.cont2discrete(system, step, method="foh")
        out += scipy.signal.lfilter(np.ravel(b), a, force)
    return out


def counts_of(seed: int = 5, peaks: Sequence[float] = PEAKS) -> dict[str, Array]:
    """What the converter shows of hammer and accelerometer."""
    rng = np.random.default_rng(seed)
    samples = round((SPACING * len(peaks) + 0.1) * RATE)
    t = np.arange(samples * FINE) / (RATE * FINE)
    force = np.zeros(len(t))
    for k, peak in enumerate(peaks):
        begin = 0.05 + SPACING * k + rng.uniform(0, 0.01)
        hits = [(begin, peak), (begin + LATER, SECOND * peak)] if k == DOUBLE else [(begin, peak)]
        for at, size in hits:
            inside = (t >= at) & (t < at + PULSE)
            force[inside] += size * np.sin(np.pi * (t[inside] - at) / PULSE) ** 2
    signals = force[::FINE], tip_acceleration(force, 1 / (RATE * FINE))[::FINE]
    out = {}
    for name, signal, noise, full in zip(("hammer", "acc"), signals, NOISE, RANGE, strict=True):
        shown = np.clip(signal + rng.normal(0, noise, len(signal)), -full, full)
        out[name] = np.round(shown / full * COUNTS).astype(np.int16)
    return out  # type: ignore[return-value]


def write_tap_test(folder: Path) -> None:
    """The records and their measurement file."""
    gains = [full / COUNTS for full in RANGE]
    write_npz(folder / "hits.npz", counts_of())
    write_text(folder / "hits.measurement.toml", _DECLARED.format(*gains, *RANGE))
