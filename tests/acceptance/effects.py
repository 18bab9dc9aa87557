"""What is hidden in the joint: the classes of the catalogue, each by a formula that no law of the program has.

Sizes are shares of the peak joint force at the highest level; u = z/z_peak, w = ż/ż_peak.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from generator import Array, ComplexArray, Dynamic, Hidden, Rig, no_force, no_stiffness
from masing import masing

COLOUR = {"a1": 0.5, "a2": -0.3, "a3": 0.2, "P": 0.6}
"""Noise of first order, n_i = colour n_(i−1) + white."""
Channels = dict[str, Array]
Sensors = Callable[[Channels, Array], Channels]
"""(channels (records, samples), t in s) → channels as a faulty sensor shows them."""


@dataclass(frozen=True)
class Scale:
    """Motion of the linear rig at the highest level, and the course of the records."""

    z: float
    """Peak displacement in m."""
    v: float
    """Peak velocity in m/s."""
    v_rms: float
    force: float
    """Peak joint force in N."""
    records: int
    window: float
    """s in a record, run-in included."""
    position: Array
    """Feed position of each record at its first sample, m."""
    feed: float
    """m/s."""


@dataclass(frozen=True)
class Injected:
    """The truth of one data set. ``families`` empty: nothing in the catalogue is right."""

    families: tuple[str, ...]
    site: str = ""
    """Channel, or body, of a sensor fault or a missing mass."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Parameters that have a true value."""
    hidden: Hidden = no_force
    dynamic: Dynamic = no_stiffness
    rig: Rig | None = None
    """Another rig than the declared one."""
    sensors: tuple[Sensors, ...] = ()
    rocking: tuple[float, float, float] | None = None
    """Natural frequency in Hz, damping ratio, size relative to the acceleration of body 2."""
    distortion: float = 0.0
    """Third-order distortion of the exciter, a share of its peak force."""
    inputs: Mapping[str, Array] = field(default_factory=dict)
    """What is logged beside the channels, by quantity, (records and the quiet one, samples), SI."""
    louder: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Noise by channel that grows with the drive: at its highest level over that at rest, and its colour."""
    memory: bool = False
    """True where the hidden force depends on the path before."""
    whole_record: bool = False
    """True where something changes along the record, so that no period repeats."""


Maker = Callable[[np.random.Generator, Scale, float], Injected]
"""(random, scale, share of the peak joint force) → what is injected."""


def rounded(x: Array, corner: float) -> Array:
    """max(x, 0) with its corner rounded over ±corner."""
    return np.asarray(0.5 * (x + np.sqrt(x * x + corner * corner)))


def limited(x: Array, limit: float, power: float = 12.0) -> Array:
    """x/limit clipped to ±1, with rounded corners."""
    y = x / limit
    return np.asarray(y / (1 + np.abs(y) ** power) ** (1 / power))


def settled(course: Callable[[Array], Array], scale: Scale) -> Callable[[Array], Array]:
    """A course of time that returns to its beginning smoothly within the first 50 ms, which are run-in."""

    def closed(t: Array) -> Array:
        s = np.clip(t / 0.05, 0, 1)
        blend = s * s * s * (10 - 15 * s + 6 * s * s)
        return np.asarray(blend * course(t) + (1 - blend) * course(t + scale.window))

    return closed


def side_of(rng: np.random.Generator) -> float:
    """1 or −1."""
    return float(rng.choice([-1.0, 1.0]))


def cubic(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    sign = side_of(rng)
    return Injected(("cubic",), hidden=lambda z, v, t: sign * share * s.force * ((z / s.z) ** 3 + 0.1 * (z / s.z) ** 5))


def quadratic(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    size = side_of(rng) * share * s.force / (np.cosh(0.8) - 1)
    return Injected(("quadratic",), hidden=lambda z, v, t: size * (np.cosh(0.8 * z / s.z) - 1))


def gap(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    clearance = s.z * rng.uniform(0.15, 0.4)
    return Injected(("gap",), hidden=lambda z, v, t: -share * s.force * limited(z, clearance))


def contact_loss(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    side, free = side_of(rng), rng.uniform(0.2, 0.5)
    slope = share * s.force / (1 - free)
    return Injected(("contact-loss",), hidden=lambda z, v, t: -side * slope * rounded(side * z / s.z - free, 0.01))


def coulomb(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    corner = s.v_rms * rng.uniform(0.05, 0.12)
    return Injected(("coulomb",), hidden=lambda z, v, t: share * s.force * v / np.hypot(v, corner))


def stribeck(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    corner, bump = s.v_rms * rng.uniform(0.05, 0.08), rng.uniform(0.6, 1.0)
    fading = s.v_rms * rng.uniform(0.3, 0.5)
    return Injected(
        ("stribeck",),
        hidden=lambda z, v, t: share * s.force * v / np.hypot(v, corner) * (1 + bump / (1 + (v / fading) ** 2)) / 1.4,
    )


def hysteresis(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    reach, exponent = s.z * rng.uniform(0.08, 0.25), rng.uniform(1.6, 3.0)
    return Injected(("hysteresis",), hidden=lambda z, v, t: share * s.force * masing(z, reach, exponent), memory=True)


def hysteresis_with_play(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    reach, play = s.z * rng.uniform(0.15, 0.3), rng.uniform(0.25, 0.45)

    def force(z: Array, v: Array, t: Array) -> Array:
        y = masing(z, reach, 3.0)
        return np.asarray(share * s.force * (rounded(y - play, 0.02) - rounded(-y - play, 0.02)) / (1 - play))

    return Injected(("hysteresis",), hidden=force, memory=True)


def quadratic_damping(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    power = rng.uniform(0.85, 1.1)
    return Injected(
        ("quadratic-damping",), hidden=lambda z, v, t: share * s.force * v / s.v * np.hypot(v / s.v, 0.01) ** power
    )


def viscous_by_direction(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    way = side_of(rng)
    return Injected(
        ("viscous-by-direction",), hidden=lambda z, v, t: way * share * s.force * rounded(way * v / s.v, 0.02)
    )


def structural_damping(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """Maxwell elements side by side: a loss that hardly depends on frequency from 1 to 16 kHz, and causal."""
    corners = 2 * np.pi * np.geomspace(200, 8e4, 9)
    loss = share * s.force / s.z

    def stiffness(omega: Array) -> ComplexArray:
        parts = [1j * omega / (corner + 1j * omega) for corner in corners]
        middle = np.sum([1j * 18e3 / (corner + 1j * 18e3) for corner in corners]).imag
        return np.asarray(loss / middle * np.sum(parts, axis=0))

    return Injected(("structural-damping",), dynamic=stiffness)


def relaxation(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A film that yields in the middle of the band: not within one time, but within three that lie close together."""
    middle, spread = 2 * np.pi * rng.uniform(3000, 7000), rng.uniform(0.2, 0.3)
    k = 2 * share * s.force / s.z

    def stiffness(omega: Array) -> ComplexArray:
        parts = [1j * omega / (middle * q + 1j * omega) for q in (1 - spread, 1.0, 1 + spread)]
        return np.asarray(k * np.mean(parts, axis=0))

    return Injected(("relaxation",), dynamic=stiffness)


def hertz_force(z: Array, preload: float, kappa: float, angle: float) -> Array:
    """Two rows of balls (N): each row carries its approach to the power 3/2, (δ/κ)^1.5, and nothing once it has parted.

    At rest every row is pressed by the preload to δ0 = κ P0^(2/3); z along the guide's normal direction moves the
    rows by ± z sin φ. Force along z is 2 sin φ times the difference of the row loads.
    """
    rest = kappa * preload ** (2 / 3)
    upper = np.maximum(rest + z * np.sin(angle), 0) / kappa
    lower = np.maximum(rest - z * np.sin(angle), 0) / kappa
    return np.asarray(2 * np.sin(angle) * (upper * np.sqrt(upper) - lower * np.sqrt(lower)))


PRELOAD, KAPPA, ANGLE = 630.0, 3.93e-8, np.pi / 4


def guide_stiffness(preload: float) -> float:
    """Slope of :func:`hertz_force` at rest in N/m."""
    return float(6 * np.sin(ANGLE) ** 2 * preload ** (1 / 3) / KAPPA)


def preload(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A guide that lost preload; ``share`` is the bend of its curve against the declared one at the peak motion."""

    def bend(factor: float) -> float:
        unit = [
            float(hertz_force(np.array(s.z), PRELOAD * q, KAPPA, ANGLE)) / guide_stiffness(PRELOAD * q)
            for q in (1, factor)
        ]
        return (unit[0] - unit[1]) / s.z

    few, many = 0.05, 1.0
    for _ in range(50):
        middle = 0.5 * (few + many)
        few, many = (middle, many) if bend(middle) > share else (few, middle)
    found = PRELOAD * many
    k = guide_stiffness(found)
    return Injected(
        ("preload",),
        values={"preload": found},
        rig=Rig(stiffness=k),
        hidden=lambda z, v, t: hertz_force(z, found, KAPPA, ANGLE) - k * z,
    )


def stiffness_drift(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """Warming up: every record begins cold, and each warms at a rate of its own."""
    size = side_of(rng) * share * s.force / s.z * rng.uniform(0.8, 1.2, (s.records, 1))
    course = settled(lambda t: (1 - np.exp(-t / 0.6)) / (1 - np.exp(-s.window / 0.6)), s)
    return Injected(("stiffness-drift",), hidden=lambda z, v, t: size * course(t) * z, whole_record=True)


def position_stiffness(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """Balls that pass: stiffness changes along the feed, not quite as a cosine."""
    pitch, size, phase = rng.uniform(8e-3, 16e-3), share * s.force / s.z, 2 * np.pi * rng.random()

    def course(t: Array) -> Array:
        angle = 2 * np.pi * (s.position[:, None] + s.feed * t) / pitch + phase
        return np.asarray(np.cos(angle + 0.2 * np.sin(angle)))

    closed = settled(course, s)
    return Injected(("position-stiffness",), hidden=lambda z, v, t: size * closed(t) * z, whole_record=True)


def exact_cubic(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """z³ itself, where the estimate has a true value."""
    k3 = side_of(rng) * share * s.force / s.z**3
    return Injected(("cubic",), values={"stiffness3": k3}, hidden=lambda z, v, t: k3 * z**3)


def exact_quadratic(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """z² itself."""
    k2 = side_of(rng) * share * s.force / s.z**2
    return Injected(("quadratic",), values={"stiffness2": k2}, hidden=lambda z, v, t: k2 * z**2)


def exact_coulomb(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """The hyperbolic tangent itself."""
    F, corner = share * s.force, 0.1 * s.v_rms
    return Injected(("coulomb",), values={"slip_force": F}, hidden=lambda z, v, t: F * np.tanh(v / corner))
