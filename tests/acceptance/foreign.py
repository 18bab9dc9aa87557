"""What the catalogue does not hold, and what is no error at all."""

from __future__ import annotations

import numpy as np
from effects import COLOUR, Injected, Scale, rounded, settled
from faults import rms
from generator import Array, ComplexArray

PICKED_UP = (("a1", "P"), ("a1", "a2"), ("a2", "P"), ("a3", "a1"), ("P", "a3"))
"""Who picks up whom; a2 and a3 move alike, between them it would be a delay."""


def ripple(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A force that waves along the path."""
    waves, phase = rng.uniform(0.8, 1.4), rng.uniform(0.3, 1.2)
    return Injected((), hidden=lambda z, v, t: share * s.force * np.sin(2 * np.pi * waves * z / s.z + phase))


def stiffness_by_speed(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A spring that stiffens with speed, z ż²."""
    return Injected((), hidden=lambda z, v, t: share * s.force * 2.6 * z / s.z * (v / s.v) ** 2)


def damping_by_displacement(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A damper that grows with the displacement, z² ż."""
    return Injected((), hidden=lambda z, v, t: share * s.force * 2.6 * v / s.v * (z / s.z) ** 2)


def damping_in_time(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A damper that swings by itself, at no multiple of the period."""
    rate, phase = rng.uniform(25, 35), 2 * np.pi * rng.random((s.records, 1))
    course = settled(lambda t: np.cos(2 * np.pi * rate * t + phase), s)
    size = 0.5 * share * s.force / s.v
    return Injected((), hidden=lambda z, v, t: size * course(t) * v, whole_record=True)


def inner_resonance(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """Something light inside the joint that swings by itself within the band: k − kₐ²/(kᵢ − mω² + jωc), less k."""
    own, damping = 2 * np.pi * rng.uniform(4000, 10000), rng.uniform(0.06, 0.15)
    peak = 2 * share * s.force / s.z

    def stiffness(omega: Array) -> ComplexArray:
        x = omega / own
        return np.asarray(-peak * 2 * damping / (1 - x**2 + 2j * damping * x))

    return Injected((), dynamic=stiffness)


def dead_time(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A part of the force that comes a quarter of a period late, or more."""
    late, k = rng.uniform(60e-6, 120e-6), share * s.force / s.z

    def stiffness(omega: Array) -> ComplexArray:
        # Above 40 kHz the late force has died out.
        return np.asarray(-k * np.exp(-1j * omega * late) / (1 + 1j * omega / (2 * np.pi * 4e4)))

    return Injected((), dynamic=stiffness)


def slack_in_speed(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A damper that takes hold only above a speed."""
    free = rng.uniform(0.3, 0.45)

    def force(z: Array, v: Array, t: Array) -> Array:
        w = v / s.v
        return np.asarray(share * s.force / (1 - free) * (rounded(w - free, 0.02) - rounded(-w - free, 0.02)))

    return Injected((), hidden=force)


def cross_talk(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A channel that picks up the rate of another one."""
    to, source = PICKED_UP[int(rng.integers(len(PICKED_UP)))]

    def shown(channels: dict[str, Array], t: Array) -> dict[str, Array]:
        x = channels[source]
        rate = np.gradient(x, axis=-1)
        return {**channels, to: channels[to] + share * rms(channels[to][:-1]) / rms(rate[:-1]) * rate}

    return Injected((), to, sensors=(shown,))


def noise_with_drive(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """Noise that grows with the drive, in all channels alike."""
    times = rng.uniform(1.0, 2.5)
    return Injected((), louder={c: (times, colour) for c, colour in COLOUR.items()})


def noise_by_channel(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """The same, in each channel by its own factor."""
    return Injected((), louder={c: (rng.uniform(0.0, 3.0), colour) for c, colour in COLOUR.items()})


def coloured_noise(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """The same in all channels alike, of another colour than the noise at rest."""
    times = rng.uniform(1.0, 2.5)
    return Injected((), louder={c: (times, rng.uniform(-0.8, 0.8)) for c in COLOUR})


def distorted_exciter(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """Inert: the exciter distorts its force, but the force is measured."""
    return Injected((), distortion=2 * share)


def nothing(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A rig as declared."""
    return Injected(())
