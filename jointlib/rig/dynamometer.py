"""A cut on a dynamometer, simulated slice by slice in time: the records from which coefficients are identified."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.io.atomic import write_npz, write_text

EXAMPLE = {
    "tangential": 796e6,
    "normal": 252e6,
    "axial": 110e6,
    "edge_tangential": 23e3,
    "edge_normal": 31e3,
    "edge_axial": 4e3,
}
"""Of the records that ship, N/m² and N/m."""
FEEDS, RATE, SECONDS, COUNT = (0.04, 0.08, 0.12, 0.16), 6400.0, 0.6, 0.05
"""mm per tooth, Hz, s and N of a count of the recorder."""
_DECLARED = """\
# Simulated by jointlib/rig/dynamometer.py: slots at four feeds in aluminium, on a dynamometer.
schema = "jointlib/measurement/1"
kind = "cutting-force"
simulated = true
sample_rate = "6.4 kHz"
band = [0, "2 kHz"]            # lines of the teeth that are used

[cutting]                      # what all records share
process = "milling"
teeth = 2
mode = "slot"
diameter = "12 mm"
helix = "30 deg"
speed = "3000 rpm"
depth = "1 mm"
acts_on = "workpiece"          # which of the two feels the force that the channels tell
"""
_CHANNEL = """
[[channel]]
name = "{0}"
quantity = "force"
unit = "N"
gain = {1:g}                    # of a count
transfer = "dynamometer.csv"   # its FRF, measured force over force
"""
_RECORD = """
[[record]]
file = "feed_{0:g}.npz"
feed = "{0:g} mm"
"""
_AIR = """
[[record]]                     # the tool in the air: the zero of the dynamometer
file = "air.npz"
role = "quiet"
"""
_FINER = 16
"""Simulated samples to one that is recorded; the recorder's filter takes away what lies above it."""
_LEAD = 0.05
"""s cut before the recorder begins, in which the dynamometer settles."""
_SLICE = 25e-6
"""m of depth that a slice of an edge takes, at most."""


@dataclass(frozen=True)
class Stand:
    """A table on a dynamometer: first mode of each axis (Hz, damping ratio), zero in N, noise as a share of the rms."""

    mode: tuple[float, float] | None = None
    zero: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: float = 0.0


@dataclass(frozen=True)
class Milled:
    """A milled cut in SI: N/m² and N/m by the names of a cutting file, arc in degrees from the normal of the feed."""

    coefficients: Mapping[str, float]
    teeth: int
    arc: tuple[float, float]
    speed: float
    feed: float
    depth: float
    diameter: float
    helix: float = 0.0
    runout: tuple[float, ...] = ()
    """m by which each tooth stands out."""


def milled(cut: Milled, rate: float, seconds: float, stand: Stand, rng: np.random.Generator) -> Array:
    """Forces F_x, F_y, F_z on the tool in N, (3, samples), as a dynamometer records them.

    A tooth cuts away what the teeth before it left, c·sin φ and by how much it stands out further than they; where that
    is nothing it feels nothing.
    """
    time = np.arange(round((seconds + _LEAD) * rate) * _FINER) / (rate * _FINER)
    slices = max(1, math.ceil(cut.depth / _SLICE)) if cut.helix else 1
    height = (np.arange(slices) + 0.5) / slices * cut.depth
    begin = rng.uniform(0, 2 * np.pi)
    out = np.array(cut.runout) if cut.runout else np.zeros(cut.teeth)
    force, step = np.zeros((3, len(time))), 2 * np.pi * cut.speed / 60 / (rate * _FINER)
    K = cut.coefficients
    for tooth in range(cut.teeth):
        ahead = [(k * cut.feed, out[tooth] - out[tooth - k]) for k in range(1, cut.teeth + 1)]
        for z in height:
            lag = 2 * math.tan(math.radians(cut.helix)) * z / cut.diameter
            angle = begin + 2 * np.pi * cut.speed / 60 * time - 2 * np.pi * tooth / cut.teeth - lag
            low, high = _inside(angle, step, cut.arc)
            in_cut, middle = np.maximum(high - low, 0.0) / step, (low + high) / 2
            sine, cosine = np.sin(middle), np.cos(middle)
            chip = np.min([travel * sine + further for travel, further in ahead], axis=0)
            part = in_cut * cut.depth / slices * (chip > 0)
            tangential = part * (K["tangential"] * chip + K["edge_tangential"])
            normal = part * (K["normal"] * chip + K["edge_normal"])
            force[0] += -tangential * cosine - normal * sine
            force[1] += tangential * sine - normal * cosine
            force[2] += part * (K["axial"] * chip + K["edge_axial"])
    return _recorded(force, rate, stand, rng)


def _inside(angle: Array, step: float, arc: tuple[float, float]) -> tuple[Array, Array]:
    """The part of the step around each angle that lies in the arc of cut, from and to in rad; empty where to < from."""
    first, last = (math.radians(end) for end in arc)
    middle = (first + last) / 2
    turned = np.mod(angle - middle + np.pi, 2 * np.pi) - np.pi + middle
    return np.maximum(turned - step / 2, first), np.minimum(turned + step / 2, last)


def turned(
    coefficients: Mapping[str, float], feed: float, depth: float, rate: float, seconds: float, stand: Stand,
    rng: np.random.Generator,
) -> Array:  # fmt: skip
    """Forces along the cutting speed, the feed and the edge in N, (3, samples)."""
    size = [
        depth * (coefficients[name] * feed + coefficients[f"edge_{name}"]) for name in ("tangential", "normal", "axial")
    ]
    force = np.repeat(np.array(size)[:, None], round((seconds + _LEAD) * rate) * _FINER, axis=1)
    return _recorded(force, rate, stand, rng)


def transfer(stand: Stand, frequency: Array) -> Any:
    """FRF of the dynamometer, measured force over force, complex."""
    if stand.mode is None:
        return np.ones(len(frequency), dtype=complex)
    natural, zeta = stand.mode
    r = frequency / natural
    return np.asarray(1 / (1 - r**2 + 2j * zeta * r))


def _recorded(force: Array, rate: float, stand: Stand, rng: np.random.Generator) -> Array:
    """What the recorder holds of a force: the dynamometer's mode, zero and noise, and its filter, flat within 1e-5."""
    lead = round(_LEAD * rate)
    frequency = np.fft.rfftfreq(force.shape[1], 1 / (rate * _FINER))
    felt = np.fft.rfft(force, axis=1) * transfer(stand, np.asarray(frequency, dtype=float))
    force = np.asarray(np.fft.irfft(felt, force.shape[1], axis=1), dtype=float)
    taps = scipy.signal.firwin(64 * _FINER + 1, 0.9 / _FINER, window=("kaiser", 10.0))
    slow = scipy.signal.fftconvolve(force, taps[None], "same", axes=1)[:, lead * _FINER :: _FINER]
    rms = np.sqrt(np.mean(slow**2, axis=1, keepdims=True))
    return np.asarray(slow + stand.noise * rms * rng.standard_normal(slow.shape) + np.array(stand.zero)[:, None])


def write_forces(folder: Path) -> Path:
    """Write the records that ship and their measurement file."""
    stand, rng = Stand(mode=(1500.0, 0.03), zero=(3.0, -2.0, 1.0), noise=0.01), np.random.default_rng(12)
    text = _DECLARED + "".join(_CHANNEL.format(name, COUNT) for name in ("Fx", "Fy", "Fz"))
    for feed in FEEDS:
        cut = Milled(EXAMPLE, 2, (0.0, 180.0), 3011.0, feed * 1e-3, 1e-3, 12e-3, 30.0, (4e-6, -4e-6))
        force = milled(cut, RATE, SECONDS, stand, rng)
        _write_counts(folder / f"feed_{feed:g}.npz", 2 * np.array(stand.zero)[:, None] - force)
        text += _RECORD.format(feed)
    still = np.array(stand.zero)[:, None] + 0.3 * rng.standard_normal((3, 640))
    _write_counts(folder / "air.npz", still)
    text += _AIR
    frequency = np.linspace(0.0, 3200.0, 161)
    gain = transfer(stand, frequency)
    rows = [f"{f:g},{h.real:.9g},{h.imag:.9g}" for f, h in zip(frequency, gain, strict=True)]
    write_text(folder / "dynamometer.csv", "\n".join(["frequency [Hz],real,imaginary", *rows]) + "\n")
    write_text(folder / "forces.measurement.toml", text)
    return folder / "forces.measurement.toml"


def _write_counts(path: Path, force: Array) -> None:
    counts = np.round(force / COUNT).astype(np.int16)
    write_npz(path, dict(zip(("Fx", "Fy", "Fz"), counts, strict=True)))
