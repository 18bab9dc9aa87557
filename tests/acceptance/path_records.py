"""Simulated records of a force along a path with known effects; shares no code and no formula with the program.

The motion is a sum of sines, whose derivatives and shifts are exact. Effects are rounded or uneven shapes of their
class: friction as v/√(v² + v0²), stiffness as a hyperbolic sine, damping with exponents off two, direction as a rounded
abs, hysteresis by an equation of its own that is integrated with Runge–Kutta steps. Sizes are drawn from the seed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RATE, SAMPLES, LEVELS = 125.0, 1500, (0.45, 0.7, 1.0)
STROKE = 8e-3
"""m, rms of the motion at the highest level."""


@dataclass(frozen=True)
class Motion:
    """z, ż, z̈ as functions of time in s, a sum of sines; ``u`` is a control voltage in V, a sum of slower ones."""

    omega: Array
    size: Array
    phase: Array
    slow: tuple[Array, Array]

    def at(self, t: Array, order: int = 0) -> Array:
        """The derivative of that order at times t."""
        angle = self.omega * t[:, None] + self.phase + order * np.pi / 2
        return np.asarray((self.size * self.omega**order * np.cos(angle)).sum(axis=1))

    def u(self, t: Array) -> Array:
        omega, phase = self.slow
        return np.asarray(2.5 + 2.0 * np.mean(np.cos(omega * t[:, None] + phase), axis=1) * np.sqrt(len(omega) / 2))


def motion(rng: np.random.Generator, signal: str, level: float) -> Motion:
    """``random``: 40 sines up to 3 Hz. ``pulses``: strokes of a slow sine and a few of its multiples."""
    if signal == "random":
        omega = 2 * np.pi * rng.uniform(0.15, 3.0, 40)
        size = rng.uniform(0.5, 1.0, 40) / (1 + (omega / 9.0) ** 2)
    else:
        omega = 2 * np.pi * rng.uniform(0.28, 0.34) * np.arange(1, 6)
        size = np.array([1.0, 0.0, 0.22, 0.0, 0.06]) * rng.uniform(0.8, 1.2, 5)
        size[1] = rng.uniform(0.05, 0.15)
    size = size * level * STROKE / np.sqrt(np.sum(size**2) / 2)
    slow = 2 * np.pi * rng.uniform(0.05, 0.35, 6), rng.uniform(0, 2 * np.pi, 6)
    return Motion(omega, size, rng.uniform(0, 2 * np.pi, len(omega)), slow)


def _loop(t: Array, m: Motion) -> Array:
    """Smooth slip: dw/dt = v (1 − |w|^1.6 (0.7 + 0.3 sign(w v)))/L, by Runge–Kutta, four steps a sample."""
    length, steps = 0.12 * STROKE, 4
    fine = np.linspace(t[0], t[-1], 2 * steps * (len(t) - 1) + 1)
    v, h, w, out = m.at(fine, 1) / length, (t[1] - t[0]) / steps, 0.0, [0.0]

    def rate(w: float, v: float) -> float:
        return float(v * (1 - abs(w) ** 1.6 * (0.7 + 0.3 * np.sign(w * v))))

    for i in range(0, len(fine) - 1, 2):
        a = rate(w, v[i])
        b = rate(w + h / 2 * a, v[i + 1])
        c = rate(w + h / 2 * b, v[i + 1])
        w += h / 6 * (a + 2 * b + 2 * c + rate(w + h * c, v[i + 2]))
        if (i + 2) % (2 * steps) == 0:
            out.append(w)
    return np.array(out)


def _dry(t: Array, m: Motion) -> Array:
    v = m.at(t, 1)
    return np.asarray(v / np.sqrt(v**2 + 1e-6))


EFFECTS: dict[str, Callable[[Array, Motion], Array]] = {
    "coulomb": _dry,
    "cubic": lambda t, m: np.sinh(0.3 * m.at(t) / STROKE) - 0.3 * m.at(t) / STROKE,
    "quadratic": lambda t, m: m.at(t) ** 2 / (1 + 0.05 * np.abs(m.at(t)) / STROKE),
    "quadratic-damping": lambda t, m: np.sign(m.at(t, 1)) * np.abs(m.at(t, 1)) ** 1.95,
    "viscous-by-direction": lambda t, m: np.sqrt(m.at(t, 1) ** 2 + 1e-6),
    "missing-mass": lambda t, m: m.at(t, 2),
    "hysteresis": _loop,
    "modulation": lambda t, m: (m.u(t) - 2.5) * _dry(t, m),
    "position-stiffness": lambda t, m: np.cos(2 * np.pi * m.at(t) / (0.9 * STROKE) + 0.4),
    "damping-by-displacement": lambda t, m: m.at(t) ** 2 * m.at(t, 1),
    "stiffness-by-speed": lambda t, m: m.at(t) * m.at(t, 1) ** 2,
    "slow-force": lambda t, m: np.cos(2 * np.pi * 0.37 * t),
}
"""Force of each effect at unit size; the last three are of no family of the catalogue. ``lag`` shifts all of them."""
OUTSIDE = ("damping-by-displacement", "stiffness-by-speed", "slow-force")


@dataclass(frozen=True)
class Case:
    """One measurement: what is hidden in it, how it moves, how much noise."""

    effects: tuple[str, ...]
    signal: str
    decibel: float
    seed: int

    @property
    def name(self) -> str:
        return f"{'+'.join(self.effects) or 'nothing'}/{self.signal}/{self.decibel:g}/{self.seed}"


def write(folder: Path, case: Case) -> tuple[Path, Path]:
    """The measurement and the joint file of a case: three records at three levels; noise on the force at ``decibel``
    below its rms, on the displacement 20 dB further down."""
    rng = np.random.default_rng([case.seed, *(ord(c) for c in "".join(case.effects) + case.signal)])
    drives = [motion(rng, case.signal, level) for level in LEVELS]
    t = np.arange(SAMPLES) / RATE
    late = rng.uniform(0.012, 0.02) if "lag" in case.effects else 0.0
    stiffness, damping, mass = (3000.0, 300.0, 0.0) if case.signal == "random" else (0.0, 200.0, 15.0)
    forces = []
    for m in drives:
        s = t - late
        forces.append(stiffness * m.at(s) + damping * m.at(s, 1) + mass * m.at(s, 2) + 1.5)
    power = float(np.sqrt(np.mean(np.square(forces))))
    for name in (e for e in case.effects if e != "lag"):
        own = [EFFECTS[name](t - late, m) for m in drives]
        if name == "modulation":
            own = [o + 2.5 * _dry(t - late, m) for o, m in zip(own, drives, strict=True)]
        size = rng.uniform(0.2, 0.3) * power / float(np.sqrt(np.mean(np.square(own))))
        forces = [f + size * o for f, o in zip(forces, own, strict=True)]
    noise = 10 ** (-case.decibel / 20) * float(np.sqrt(np.mean(np.square(forces))))
    for i, (m, force) in enumerate(zip(drives, forces, strict=True)):
        z = m.at(t)
        seen = z + 10 ** (-(case.decibel + 20) / 20) * float(np.std(z)) * rng.standard_normal(len(z))
        heard = force + noise * rng.standard_normal(len(force))
        np.savez(folder / f"r{i}.npz", allow_pickle=False, z=seen, F=heard, u=m.u(t))
    return _files(folder, case)


def _files(folder: Path, case: Case) -> tuple[Path, Path]:
    head = 'schema = "jointlib/measurement/1"\nkind = "path"\nsimulated = true\n'
    text = f'{head}sample_rate = "{RATE:g} Hz"\n'
    if case.signal == "pulses" and "missing-mass" not in case.effects:
        text += 'carriage = "unknown"\n'
    text += '[[channel]]\nname = "z"\nquantity = "displacement"\nunit = "m"\n'
    text += '[[channel]]\nname = "F"\nquantity = "force"\nunit = "N"\n'
    if "modulation" in case.effects:
        text += '[[channel]]\nname = "u"\nquantity = "voltage"\nunit = "V"\ninput = true\n'
    for i in range(len(LEVELS)):
        text += f'[[record]]\nfile = "r{i}.npz"\ncondition = "level {i}"\n'
    measurement = folder / "path.measurement.toml"
    measurement.write_text(text)
    laws = '[[law]]\nkind = "viscous"\ndamping = 50.0\n'
    if case.signal == "random":
        laws += '[[law]]\nkind = "linear"\nstiffness = 1000.0\n'
    joint = folder / "start.joint.toml"
    joint.write_text(f'schema = "jointlib/joint/1"\nname = "start"\n{laws}')
    return measurement, joint
