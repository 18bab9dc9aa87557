"""Stepped Timoshenko beams in closed form: four waves a segment, no finite element and no coupling formula.

    python tests/machines/spectral_beams.py machines/library

writes the simulated records of the library, a bar in a spindle, by these waves alone.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array, ComplexArray

YOUNG, POISSON, DENSITY, TIME = 210e9, 0.3, 7850.0, 2e-7
"""Steel, and the time constant of its Kelvin-Voigt damping in s."""


@dataclass(frozen=True)
class Bar:
    """A round bar: length and diameter in m."""

    length: float
    diameter: float
    young: float = YOUNG
    density: float = DENSITY
    time: float = TIME

    def stiffness(self, omega: Array) -> ComplexArray:
        """Dynamic stiffness over deflection and slope at the start, then at the end, (lines, 4, 4)."""
        area, second = np.pi * self.diameter**2 / 4, np.pi * self.diameter**4 / 64
        kappa = 6 * (1 + POISSON) / (7 + 6 * POISSON)
        E = self.young * (1 + 1j * omega * self.time)
        B, S = E * second, kappa * E / (2 * (1 + POISSON)) * area
        m, j = self.density * area * omega**2, self.density * second * omega**2
        # B S k⁴ + (B m + S j) k² + (j - S) m = 0 for w = exp(k x)
        b, c = (B * m + S * j) / (B * S), (j - S) * m / (B * S)
        root = np.sqrt(b**2 - 4 * c + 0j)
        k = np.sqrt(np.stack([(-b + root) / 2, (-b - root) / 2], axis=1) + 0j)
        k = np.concatenate([k, -k], axis=1)
        turn = (k**2 + (m / S)[:, None]) / k
        moment, shear = B[:, None] * turn * k, S[:, None] * (k - turn)
        far = np.exp(k * self.length)
        one = np.ones_like(k)
        moved = np.stack([one, turn, far, turn * far], axis=1)
        forces = np.stack([-shear, -moment, shear * far, moment * far], axis=1)
        return np.asarray(forces @ np.linalg.inv(moved))


def receptance(bars: Sequence[Bar], springs: Mapping[int, tuple[float, float]], frequency: Array) -> ComplexArray:
    """Of bars in a row, held at some joints by springs and dampers (N/m, N s/m): (lines, 2 n, 2 n).

    Deflection and slope at the start of every bar, and at the last end.
    """
    omega = 2 * np.pi * frequency
    size = 2 * (len(bars) + 1)
    K = np.zeros((len(omega), size, size), dtype=complex)
    for i, bar in enumerate(bars):
        K[:, 2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += bar.stiffness(omega)
    for at, (stiffness, damping) in springs.items():
        K[:, 2 * at, 2 * at] += stiffness + 1j * omega * damping
    return np.asarray(np.linalg.inv(K))


SPINDLE = (Bar(0.08, 0.07), Bar(0.17, 0.06), Bar(0.05, 0.06))
"""From the nose inwards, front and rear bearing behind the first and the second bar."""
BEARINGS = {"x": ((2.2e8, 2200.0), (1.4e8, 1500.0)), "y": ((1.9e8, 2400.0), (1.5e8, 1500.0))}


def spindle(frequency: Array, axis: str = "x") -> ComplexArray:
    """Its end alone, deflection and slope towards the inside, (lines, 2, 2)."""
    front, rear = BEARINGS[axis]
    return receptance(SPINDLE, {1: front, 2: rear}, frequency)[:, :2, :2]


def in_spindle(tool: Sequence[Bar], frequency: Array, axis: str = "x") -> ComplexArray:
    """Deflections of the spindle with a tool before its nose, at the start of every bar of the tool."""
    front, rear = BEARINGS[axis]
    n = len(tool)
    H = receptance([*tool, *SPINDLE], {n + 1: front, n + 2: rear}, frequency)
    return H[:, : 2 * n : 2, : 2 * n : 2]


LINES = np.arange(200.0, 4001.0, 10.0)
BAR = (Bar(0.045, 0.04), Bar(0.015, 0.04))
"""Tip, neck 45 mm behind it, and 15 mm further the face."""
PLACES = ("tip", "neck")


def noisy(H: ComplexArray, decibels: float, random: np.random.Generator) -> tuple[ComplexArray, Array]:
    """With noise of this ratio on every line, and its deviation √(E|error|²)."""
    deviation = 10 ** (-decibels / 20) * np.abs(H)
    normal = random.standard_normal((2, *H.shape))
    return H + deviation * (normal[0] + 1j * normal[1]) / np.sqrt(2), deviation


def write(folder: Path) -> None:
    """A CSV for every pair of places and direction, with 60 dB; the files that name them stand beside."""
    random = np.random.default_rng(21)
    folder.mkdir(exist_ok=True)
    for axis in ("x", "y"):
        H, deviation = noisy(in_spindle(BAR, LINES, axis), 60.0, random)
        for o, d in ((0, 0), (1, 0), (1, 1)):
            value, error = H[:, o, d], deviation[:, o, d]
            table = np.column_stack([LINES, value.real, value.imag, error])
            name = folder / f"{PLACES[o]}_{PLACES[d]}_{axis}.csv"
            np.savetxt(name, table, ["%.0f", "%.6e", "%.6e", "%.2e"], ",", header="f,re,im,deviation", comments="")


if __name__ == "__main__":
    write(Path(sys.argv[1]) / "bar")
