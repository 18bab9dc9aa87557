"""Simulated free decays of a chain of masses with a known joint; shares no code and no formula with the program.

The chain stands on the joint; it is let go from a deflection, and the motion across the joint is recorded at three
levels. Equations of motion are integrated step by step (Dormand and Prince of order 8, relative tolerance 1e-9).
Effects are rounded or uneven shapes of their class. Sizes are drawn from the seed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

Array = NDArray[np.float64]
RATE, TIME, LEVELS = 3000.0, 1.6, (1.0, 0.6, 0.36)
A0 = 2e-4
"""m, the first deflection at the highest level."""
STIFFNESS, FREQUENCY = 2e6, 70.0
"""N/m of the joint when nothing is hidden, and Hz of the first mode."""


@dataclass(frozen=True)
class Case:
    """What is hidden, how many masses the chain has, how much noise, and which sensor hears it."""

    effects: tuple[str, ...]
    masses: int
    decibel: float
    seed: int

    @property
    def name(self) -> str:
        return f"{'+'.join(self.effects) or 'nothing'}/{self.masses}/{self.decibel:g}/{self.seed}"


@dataclass(frozen=True)
class Chain:
    """Masses in kg from the joint outwards and springs in N/m between them; damping in proportion to both."""

    masses: Array
    springs: Array
    ratio: float

    @property
    def mass(self) -> Array:
        return np.diag(self.masses)

    @property
    def stiffness(self) -> Array:
        """With the joint as a spring to ground."""
        n = len(self.masses)
        K = np.zeros((n, n))
        K[0, 0] = STIFFNESS
        for i, k in enumerate(self.springs):
            K[i : i + 2, i : i + 2] += k * np.array([[1, -1], [-1, 1]])
        return K

    def modes(self) -> tuple[Array, Array]:
        """ω in rad/s and shapes that are 1 across the joint, in columns."""
        squares, shapes = eigh(self.stiffness, self.mass)
        return np.sqrt(squares), shapes / shapes[0]

    def modal(self) -> tuple[float, float, float]:
        """Mass, stiffness and damping of the first mode, as felt across the joint."""
        omega, shapes = self.modes()
        m = float(shapes[:, 0] @ self.mass @ shapes[:, 0])
        return m, m * float(omega[0]) ** 2, 2 * self.ratio * m * float(omega[0])


def chain(rng: np.random.Generator, count: int) -> Chain:
    masses = np.array([1.0, 0.25, 0.12][:count]) * rng.uniform(0.9, 1.1, count)
    springs = STIFFNESS * np.array([1.1, 1.4][: count - 1]) * rng.uniform(0.9, 1.1, count - 1)
    trial = Chain(masses, springs, float(rng.uniform(0.003, 0.006)))
    omega = trial.modes()[0][0]
    return Chain(masses * (omega / (2 * np.pi * FREQUENCY)) ** 2, springs, trial.ratio)


Force = Callable[[float, float], float]


def force_of(name: str, rng: np.random.Generator, k: float, c: float, omega: float) -> Force:
    """An effect as a force of z and ż, sized against stiffness and damping of the first mode."""
    V = A0 * omega
    size = rng.uniform(0.7, 1.3)
    if name == "coulomb":
        F, v0 = 0.4 * size * c * V, 0.01 * V
        return lambda z, v: F * v / np.sqrt(v * v + v0 * v0)
    if name == "cubic":
        b = 0.5 / A0
        a = 6 * 0.16 * size * k / (b**3 * A0**2)
        return lambda z, v: a * (np.sinh(b * z) - b * z)
    if name == "quadratic":
        a = 0.25 * size * k / A0
        return lambda z, v: a * z * z / (1 + 0.05 * abs(z) / A0)
    if name == "quadratic-damping":
        a = 1.2 * size * c * V / V**1.95
        return lambda z, v: a * np.sign(v) * abs(v) ** 1.95
    if name == "gap":
        k1, play = 0.25 * size * k, 0.2 * size * A0
        r2 = (0.05 * play) ** 2
        return lambda z, v: -0.5 * k1 * (np.sqrt((z + play) ** 2 + r2) - np.sqrt((z - play) ** 2 + r2))
    if name == "contact-loss":
        k1, lift, r2 = 0.3 * size * k, 0.2 * size * A0, (0.02 * A0) ** 2
        return lambda z, v: -0.5 * k1 * (z - lift + np.sqrt((z - lift) ** 2 + r2))
    if name == "damping-by-displacement":
        a = 4 * size * c / A0**2
        return lambda z, v: a * z * z * v
    if name == "damping-that-saturates":
        a = -0.75 * c
        v0 = 0.25 * V
        return lambda z, v: a * v * (v / v0) ** 2 / (1 + (v / v0) ** 2)
    if name == "ripple":
        wave = 2 * np.pi / (0.55 * A0)
        a = 0.1 * size * k / wave
        return lambda z, v: a * np.sin(wave * z)
    raise ValueError(name)


OUTSIDE = ("damping-by-displacement", "damping-that-saturates", "ripple")
"""Of no family of the catalogue."""


def decay(c: Chain, forces: list[Force], slip: tuple[float, float] | None, shape: Array) -> Array:
    """Displacement, velocity and acceleration of the first mass, in rows. ``slip``: stiffness and force of a contact
    whose force follows w' = v (1 − |w|^1.6 (0.7 + 0.3 sign(w v)))/d."""
    n = len(c.masses)
    M = c.masses
    K, (omega, _) = c.stiffness, c.modes()
    D = 2 * c.ratio / omega[0] * K

    def rate(t: float, y: Array) -> Array:
        x, v = y[:n], y[n : 2 * n]
        f = -(K @ x + D @ v)
        f[0] -= sum(one(x[0], v[0]) for one in forces)
        if slip is None:
            return np.concatenate([v, f / M])
        w = y[2 * n]
        f[0] -= slip[1] * w
        turn = v[0] * slip[0] / slip[1] * (1 - abs(w) ** 1.6 * (0.7 + 0.3 * np.sign(w * v[0])))
        return np.concatenate([v, f / M, [turn]])

    t = np.arange(round(TIME * RATE)) / RATE
    begin = np.concatenate([shape, np.zeros(n + (slip is not None))])
    y = solve_ivp(rate, (0, t[-1]), begin, "DOP853", t, rtol=1e-9, atol=1e-13).y
    a = np.array([rate(0.0, column)[n] for column in y.T])
    return np.array([y[0], y[n], a])


def write(folder: Path, case: Case) -> tuple[Path, Path]:
    """The measurement and the joint file of a case."""
    rng = np.random.default_rng([case.seed, case.masses, *(ord(x) for x in "".join(case.effects))])
    c = chain(rng, case.masses)
    m, k, d = c.modal()
    omega, shapes = c.modes()
    forces = [force_of(name, rng, k, d, float(omega[0])) for name in case.effects if name != "hysteresis"]
    slip = None
    if "hysteresis" in case.effects:
        stiff = 0.12 * k * rng.uniform(0.7, 1.3)
        slip = stiff, 0.15 * stiff * A0 * rng.uniform(0.7, 1.3)
    sensor = ("displacement", "acceleration", "velocity")[case.seed % 3]
    row = {"displacement": 0, "velocity": 1, "acceleration": 2}[sensor]
    noise = None
    for i, level in enumerate(LEVELS):
        share = np.array([1.0, 0.06, 0.04][: case.masses]) * (
            1 if case.masses == 1 else rng.uniform(0.8, 1.2, case.masses)
        )
        x = decay(c, forces, slip, level * A0 * (shapes @ share))[row]
        noise = 10 ** (-case.decibel / 20) * float(np.max(np.abs(x))) / np.sqrt(2) if noise is None else noise
        x = x + noise * rng.standard_normal(len(x))
        np.savetxt(folder / f"level_{i}.csv", x, header="x", comments="", fmt="%.9g")
    unit = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}[sensor]
    lines = [
        'schema = "jointlib/measurement/1"',
        'kind = "ringdown"',
        "simulated = true",
        f"sample_rate = {RATE}",
        f"modal_mass = {m}",
        "[[channel]]",
        'name = "x"',
        f'quantity = "{sensor}"',
        f'unit = "{unit}"',
    ]
    for i in range(len(LEVELS)):
        lines += ["[[record]]", f'file = "level_{i}.csv"']
    measurement, joint = folder / "decay.measurement.toml", folder / "decay.joint.toml"
    measurement.write_text("\n".join(lines) + "\n")
    off = 1 + 0.05 * rng.standard_normal(2)
    joint.write_text(
        f'schema = "jointlib/joint/1"\nname = "mode"\n[[law]]\nkind = "linear"\nstiffness = {k * off[0]}\n'
        f'[[law]]\nkind = "viscous"\ndamping = {d * off[1]}\n'
    )
    return measurement, joint
