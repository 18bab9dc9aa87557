"""What is wrong with the rig or its sensors: masses, a rocking mode, gains, delays, and what is added to a channel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from effects import Channels, Injected, Scale, Sensors, side_of
from excitation import RATE
from generator import Array, Rig

BODIES = ("runner_block", "rail", "block")
CHANNELS = ("a1", "a2", "a3", "P")
FEW = 0.04
"""The usual share of the peak joint force; what is no force grows and shrinks with it."""


def replaced(channel: str, change: Callable[[Array, Array], Array]) -> Sensors:
    """A sensor that shows something else: (x, t) → what it shows."""

    def shown(channels: Channels, t: Array) -> Channels:
        return {**channels, channel: change(channels[channel], t)}

    return shown


def rms(x: Array) -> float:
    """Root mean square over all records."""
    return float(np.sqrt(np.mean(x * x)))


def rocking_mode(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """Rail and block rock about their common centre of mass: a2 and a3 move apart, their sum does not."""
    size = side_of(rng) * share / FEW * rng.uniform(0.03, 0.06)
    return Injected(("rocking-mode",), rocking=(rng.uniform(4000, 6500), rng.uniform(0.01, 0.03), size))


def missing_mass(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A body that weighs more or less than was declared."""
    body = int(rng.integers(3))
    change = side_of(rng) * share / FEW * rng.uniform(0.01, 0.03)
    masses = [0.942, 1.1, 1.1]
    added = masses[body] * change
    masses[body] += added
    return Injected(("missing-mass",), BODIES[body], {"mass": added}, rig=Rig(m1=masses[0], m2=masses[1], m3=masses[2]))


def suspension(body: str) -> Callable[[np.random.Generator, Scale, float], Injected]:
    """Cords between a body and the ground: its side swings on them at 60 to 300 Hz, damped by 0.2 to 20 %."""

    def make(rng: np.random.Generator, s: Scale, share: float) -> Injected:
        driven = body == "runner_block"
        mass, swing, damping = 0.942 if driven else 2.2, 60 * 5 ** rng.uniform(0, 1), 0.2 * 100 ** -rng.uniform(0, 1)
        k = share / FEW * mass * (2 * np.pi * swing) ** 2
        c = 2 * damping * float(np.sqrt(k * mass))
        cords = ((k, c), (0.0, 0.0)) if driven else ((0.0, 0.0), (k, c))
        return Injected(("suspension",), body, {"stiffness": k, "damping": c}, rig=Rig(cords=cords))

    return make


def gain(*channels: str) -> Callable[[np.random.Generator, Scale, float], Injected]:
    """A sensitivity that is wrong by 1 to 3 %, on one of the channels."""

    def make(rng: np.random.Generator, s: Scale, share: float) -> Injected:
        channel = str(rng.choice(channels))
        g = side_of(rng) * share / FEW * rng.uniform(0.01, 0.03)
        return Injected(("gain",), channel, {"gain": g}, sensors=(replaced(channel, lambda x, t: (1 + g) * x),))

    return make


def delay(*channels: str) -> Callable[[np.random.Generator, Scale, float], Injected]:
    """A channel that comes 1 to 3 µs late or early."""

    def make(rng: np.random.Generator, s: Scale, share: float) -> Injected:
        channel = str(rng.choice(channels))
        late = side_of(rng) * share / FEW * rng.uniform(1e-6, 3e-6)

        def shifted(x: Array, t: Array) -> Array:
            omega = 2 * np.pi * np.fft.rfftfreq(x.shape[-1], 1 / RATE)
            return np.asarray(np.fft.irfft(np.fft.rfft(x) * np.exp(-1j * omega * late), x.shape[-1]))

        return Injected(("delay",), channel, {"delay": late}, sensors=(replaced(channel, shifted),))

    return make


def hum(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """The mains and its third harmonic in one channel, the phase of every record its own."""
    channel, mains = str(rng.choice(CHANNELS)), rng.uniform(49.9, 50.1)
    size, third = share, rng.uniform(0.2, 0.5)
    phases = 2 * np.pi * rng.random((2, s.records + 1, 1))

    def add(x: Array, t: Array) -> Array:
        angle = 2 * np.pi * mains * t
        wave = np.cos(angle + phases[0]) + third * np.cos(3 * angle + phases[1])
        return np.asarray(x + size * rms(x[:-1]) * wave[: len(x)])

    return Injected(("hum",), channel, sensors=(replaced(channel, add),))


def drift(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A charge amplifier that creeps towards its rest, in every record from another value."""
    channel, constant = str(rng.choice(CHANNELS)), rng.uniform(0.15, 0.4)
    size = 2 * share * rng.uniform(0.5, 1.0, (s.records + 1, 1)) * rng.choice([-1, 1], (s.records + 1, 1))
    return Injected(
        ("drift",),
        channel,
        sensors=(replaced(channel, lambda x, t: x + rms(x[:-1]) * size * (1 - np.exp(-t / constant))),),
    )


def offset(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A channel whose zero is off, the same in every record."""
    channel = str(rng.choice(CHANNELS))
    size = side_of(rng) * 2 * share
    return Injected(("offset",), channel, sensors=(replaced(channel, lambda x, t: x + size * rms(x[:-1])),))


def sensor_nonlinearity(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A sensor that yields: an arc tangent, or one that answers unequally to push and pull."""
    channel, one_sided = str(rng.choice(CHANNELS)), bool(rng.random() < 0.5)

    def shown(x: Array, t: Array) -> Array:
        peak = float(np.abs(x).max())
        if one_sided:
            return np.asarray(x + 2 * share * (np.hypot(x, 0.8 * peak) - 0.8 * peak))
        # arctan(y)/y = 1 − y²/3: at the peak ``share`` is missing.
        reach = peak / np.sqrt(3 * share)
        return np.asarray(reach * np.arctan(x / reach))

    return Injected(("sensor-nonlinearity",), channel, sensors=(replaced(channel, shown),))


def clipping(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """An amplifier that saturates, softly over its last per cent; only the highest level reaches it."""
    channel = str(rng.choice(CHANNELS))

    def shown(x: Array, t: Array) -> Array:
        top = x[2]
        low, high = 0.2 * float(np.abs(top).max()), float(np.abs(top).max())
        for _ in range(40):
            middle = 0.5 * (low + high)
            lost = rms(top - np.clip(top, -middle, middle)) / rms(top)
            low, high = (middle, high) if lost > share else (low, middle)
        y = np.abs(x / high)
        return np.asarray(x / (1 + y**60) ** (1 / 60))

    return Injected(("clipping",), channel, sensors=(replaced(channel, shown),))
