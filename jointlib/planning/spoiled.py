"""Faults of sensors, masses and rig, in a size at which they matter, put upon what perfect sensors show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.fault import Fault
from jointlib.fault import Setting as Undoing
from jointlib.planning.setup import Setup

_ROUNDS = 40
_MAINS = 50.0
_ROCKING = 0.02
FAMILIES = (
    "gain",
    "delay",
    "offset",
    "drift",
    "hum",
    "clipping",
    "sensor-nonlinearity",
    "missing-mass",
    "rocking-mode",
)
"""Those that can be simulated here; the others change the joint along a record, or hold a body to ground."""


@dataclass(frozen=True)
class Spoiled:
    """A fault at its place, of a size."""

    fault: Fault
    site: str
    parameters: Mapping[str, float]

    def rig(self, setup: Setup) -> Setup:
        """The rig as it is, where a mass is not what was declared."""
        if self.fault.family != "missing-mass":
            return setup
        more = self.parameters["mass"]
        if self.site == "a1":
            return replace(setup, m1=setup.m1 + more)
        two, three = setup.carried
        return replace(setup, carried=(two + more, three) if self.site == "a2" else (two, three + more))

    def shown(self, channels: Mapping[str, Array], setup: Setup, rate: float) -> Mapping[str, Array]:
        """Whole records as they come out: what the loop's own correction would undo, done."""
        if self.fault.family == "missing-mass":
            return channels
        if self.fault.family == "clipping":
            level = self.parameters["level"]
            return {**channels, self.site: np.clip(channels[self.site], -level, level)}
        masses = {"a1": setup.m1, "a2": setup.carried[0], "a3": setup.carried[1]}
        setting = Undoing(rate, 0, True, {n: m for n, m in masses.items() if n in channels})
        out: Mapping[str, Array] = dict(channels)
        for _ in range(_ROUNDS):
            back = self.fault.undo(out, self.site, self.parameters, setting)
            off = {n: channels[n] - back[n] for n in channels}
            out = {n: out[n] + off[n] for n in channels}
            if all(np.max(np.abs(off[n])) <= 1e-9 * np.max(np.abs(channels[n])) for n in channels):
                break
        return out


def spoiled(
    fault: Fault,
    site: str,
    top: Mapping[str, Array],
    setup: Setup,
    rate: float,
    seconds: float,
    size: float,
    way: float,
) -> Spoiled:
    """A fault that makes ``size`` of the rms of its channel at the top level, a mass wrong by that share."""
    family = fault.family
    if family == "missing-mass":
        held = {"a1": setup.m1, "a2": setup.carried[0], "a3": setup.carried[1]}
        return Spoiled(fault, site, {"mass": way * size * held[site]})
    x = top[site or "a2"]
    rms, peak = float(np.std(x)), float(np.abs(x).max())
    if family == "gain":
        return Spoiled(fault, site, {"gain": way * size})
    if family == "delay":
        slope = np.fft.irfft(2j * np.pi * np.fft.rfftfreq(len(x), 1 / rate) * np.fft.rfft(x), len(x))
        return Spoiled(fault, site, {"delay": way * size * rms / float(np.std(slope))})
    if family == "offset":
        return Spoiled(fault, site, {"offset": way * size * rms})
    if family == "drift":
        parts = {"offset": 0.0, "slope": way * size * rms / seconds, "curvature": way * size * rms / seconds**2}
        return Spoiled(fault, site, parts)
    if family == "hum":
        parts = {"cosine": size * rms, "sine": way * size * rms, "cosine3": 0.2 * size * rms, "sine3": 0.0}
        return Spoiled(fault, site, {"frequency": _MAINS, **parts})
    if family == "clipping":
        levels = peak * np.linspace(0.3, 1.0, 400)
        lost = np.array([np.std(x - np.clip(x, -c, c)) for c in levels])
        return Spoiled(fault, site, {"level": float(levels[int(np.argmin(np.abs(lost - size * rms)))])})
    if family == "sensor-nonlinearity":
        bend = way * size * rms / float(np.std(x**2))
        return Spoiled(fault, site, {"quadratic": bend, "cubic": 0.0})
    if family == "rocking-mode":
        mode = {"frequency": 1.25 * setup.resonance, "damping_ratio": _ROCKING, "on_a2": 1.0, "on_a3": -1.0}
        one = Spoiled(fault, site, mode)
        error = float(np.std(one.shown(top, setup, rate)["a2"] - top["a2"]))
        return replace(one, parameters={**mode, "on_a2": way * size * rms / error, "on_a3": -way * size * rms / error})
    raise InputError(f"--effects: {family} changes along a record, which a plan does not simulate")
