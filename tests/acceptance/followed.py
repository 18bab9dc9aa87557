"""Parameters of the joint that follow a temperature, which differs between records or rises along each of them."""

from __future__ import annotations

import numpy as np
from effects import Injected, Scale
from generator import Array

_STIFFNESS, _DAMPING = 654e6, 500.0
_LOW, _HIGH = 288.0, 318.0
"""K."""
_WARMS = 4.0
"""K along a record that warms up."""


def _temperatures(rng: np.random.Generator, s: Scale) -> Array:
    """Of each record, two cold and two warm ones to fit, far from the order of their levels."""
    places = np.array([0.05, 0.9, 0.2, 0.8]) + rng.uniform(-0.05, 0.05, 4)
    turn = [[0, 1, 2, 3], [1, 0, 2, 3], [2, 3, 0, 1], [3, 2, 1, 0]][int(rng.integers(4))]
    return _LOW + (_HIGH - _LOW) * np.append(places[turn], rng.uniform(0.1, 0.9, s.records - 4))


def _shares(temperature: Array) -> Array:
    """Of the range, about its middle."""
    return np.asarray((temperature - 0.5 * (_LOW + _HIGH)) / (_HIGH - _LOW))


def _saturating(x: Array) -> Array:
    """A course that goes flat, from −1/2 to 1/2."""
    return np.asarray((1 - np.exp(-3 * (x + 0.5))) / (1 - np.exp(-3.0)) - 0.5)


def _logged(temperature: Array, s: Scale, rng: np.random.Generator) -> Array:
    """What a sensor shows over time, for every record and the quiet one: (records + 1, samples)."""
    samples = round(s.window * 102400)
    every = np.concatenate([temperature, [temperature.mean()]])
    return np.asarray(every[:, None] + 0.05 * rng.standard_normal((s.records + 1, samples)))


def stiffness_by_temperature(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A stiffness that falls or rises by 2 to 6 % over the range."""
    side, at = rng.choice([-1.0, 1.0]), _temperatures(rng, s)
    k = side * share * _STIFFNESS * _shares(at)[:, None]
    rise = {"rise": float(side * share / (_HIGH - _LOW))}  # 1/K, of the stiffness in the middle of the range.
    logged = {"temperature": _logged(at, s, rng)}
    return Injected(("modulation",), "stiffness-by-temperature", rise, hidden=lambda z, v, t: k * z, inputs=logged)


def saturating_stiffness(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """The same along a curve."""
    side, at = rng.choice([-1.0, 1.0]), _temperatures(rng, s)
    k = side * share * _STIFFNESS * _saturating(_shares(at))[:, None]
    return Injected(
        ("modulation",),
        hidden=lambda z, v, t: k * z,
        inputs={"temperature": _logged(at, s, rng)},
        site="stiffness-by-temperature",
    )


def damping_by_temperature(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A damping that changes by 30 to 90 % over the range."""
    side, at = rng.choice([-1.0, 1.0]), _temperatures(rng, s)
    c = side * 15 * share * _DAMPING * _shares(at)[:, None]
    return Injected(
        ("modulation",),
        hidden=lambda z, v, t: c * v,
        inputs={"temperature": _logged(at, s, rng)},
        site="damping-by-temperature",
    )


def warming_stiffness(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A stiffness that follows a temperature which rises by 4 K along each record, from another place each time."""
    side, begin = rng.choice([-1.0, 1.0]), _temperatures(rng, s)

    def course(t: Array) -> Array:
        """Rises and falls with the whole window, so that the motion repeats with it."""
        return 0.5 * _WARMS * (1 - np.cos(2 * np.pi * np.asarray(t) / s.window))

    def force(z: Array, v: Array, t: Array) -> Array:
        return np.asarray(side * share * _STIFFNESS * _shares(begin[:, None] + course(t)) * z)

    time = np.arange(round(s.window * 102400)) / 102400
    logged = _logged(begin, s, rng) + course(time)
    return Injected(
        ("modulation",),
        hidden=force,
        inputs={"temperature": logged},
        whole_record=True,
        site="stiffness-by-temperature",
    )


def idle_temperature(rng: np.random.Generator, s: Scale, share: float) -> Injected:
    """A temperature that nothing follows."""
    return Injected((), inputs={"temperature": _logged(_temperatures(rng, s), s, rng)})
