"""Simulated rig records small enough for tests: 100 Hz lines, memory of the start gone after three periods."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.viscous import Viscous
from jointlib.measurement import Channel, Mass, Measurement, Record, RecordSource
from jointlib.rig.dynamic import DynamicRig, SteadyState
from jointlib.rig.excitation import multisine
from jointlib.rig.sensors import noise_level, with_noise

RATE, PERIOD = 102.4e3, 1024
GUIDE = Joint((HertzGuide(612.0, 3.98e-8), Viscous(480.0)), name="guide")
CHANNELS = tuple(
    [
        Channel(n, "acceleration", "m/s^2", "m/s^2", 1.0, body=b)
        for n, b in (("a1", "runner"), ("a2", "rail"), ("a3", "block"))
    ]
    + [Channel("P", "force", "N", "N", 1.0)]
)


def measurement(**changes: object) -> Measurement:
    """A rig measurement with no files behind it."""
    values: dict[str, object] = {
        "source": Path("rig.measurement.toml"),
        "kind": "rig",
        "channels": CHANNELS,
        "records": (),
        "sample_rate": RATE,
        "period": PERIOD,
        "band": (2e3, 20e3),
        "driven": "runner",
        "bodies": {"runner": Mass(0.942), "rail": Mass(1.1), "block": Mass(1.1)},
    }
    return Measurement(**{**values, **changes})  # type: ignore[arg-type]


def record(channels: Mapping[str, np.ndarray], name: str = "r.npz", period: int | None = PERIOD) -> Record:
    """A record in memory."""
    return Record(RecordSource(Path(name), "fit"), dict(channels), RATE, period, "0" * 64)


def shaken(joint: Joint = GUIDE, levels: tuple[float, ...] = (60.0, 150.0), substeps: int = 4) -> SteadyState:
    """Steady state at several rms forces in N, phases from a fixed seed."""
    return _shaken(joint.laws, levels, substeps)


@cache
def _shaken(laws: tuple[JointLaw, ...], levels: tuple[float, ...], substeps: int) -> SteadyState:
    rng = np.random.default_rng(7)
    lines = [multisine(rng, rms, period=PERIOD, sample_rate=RATE) for rms in levels]
    return DynamicRig(Joint(laws)).steady_state(lines, settle=3, substeps=substeps)


def noisy(steady: SteadyState, seed: int, snr: float = 60.0, periods: int = 4) -> list[Record]:
    """Records with sensor noise, one per level."""
    rng = np.random.default_rng(seed)
    sigma = {c: noise_level(v, snr) for c, v in steady.channels.items()}
    count = steady.displacement.shape[1]
    clean = [{c: v[:, k] for c, v in steady.channels.items()} for k in range(count)]
    return [record(with_noise(rng, one, sigma, periods), f"r{k}.npz") for k, one in enumerate(clean)]
