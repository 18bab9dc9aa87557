"""A spindle with a tool in it, struck by a hammer and simulated in time: finite elements of its own, stepped exactly.

Nothing here knows of receptances, spectra or coupling: beams of two-node elements, bearings with dampers, and states
driven by a force that is straight between fine samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import eigh
from scipy.signal import lfilter
from struck import FINE, converted, pulses

YOUNG, POISSON, DENSITY, TIME = 210e9, 0.3, 7850.0, 1e-6
"""Steel, and the time constant of its Kelvin-Voigt damping in s."""
ELEMENT, HIGHEST = 1e-3, 250e3
"""Length of an element in m, and Hz up to which modes are kept."""
SPINDLE = ((0.08, 0.07), (0.17, 0.06), (0.05, 0.06))
"""Length and diameter in m, from the nose inwards; the bearings lie behind the first and the second bar."""
BEARINGS = ((2.2e8, 3500.0), (1.4e8, 2500.0))
RATE = 25600.0


@dataclass(frozen=True)
class States:
    """ẋ = λ x + b f per pole, motion Re Σ c x: poles in 1/s, and inputs and outputs by place."""

    poles: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray
    frequency: np.ndarray
    """Hz, of the oscillating poles, ascending."""

    def acceleration(self, force: np.ndarray, step: float, drive: int) -> np.ndarray:
        """m/s² at every place for a force at one, straight between samples."""
        total = np.zeros((len(self.outputs), len(force)))
        rise = np.append(np.diff(force), 0.0) / step
        for s, b, c in zip(self.poles, self.inputs[:, drive], self.outputs.T, strict=True):
            # x₊ = e^(sh) x + (e^(sh) − 1)/s f + ((e^(sh) − 1)/s − h)/s f'
            grown = np.exp(s * step)
            first = (grown - 1) / s
            pushed = b * (first * force[:-1] + (first - step) / s * rise[:-1])
            x = np.append(0.0, lfilter([1.0], [1.0, -grown], pushed))
            total += np.real(c[:, None] * (s * (s * x + b * force) + b * rise))
        return total

    def compliance(self, f: np.ndarray, place: int) -> np.ndarray:
        """m/N under a steady force, motion over force at one place."""
        own = self.outputs[place] * self.inputs[:, place]
        s = 2j * np.pi * f[:, None]
        return np.sum(own / (s - self.poles) + own.conj() / (s - self.poles.conj()), axis=1) / 2


def assembled(tool: Sequence[tuple[float, float]], places: Sequence[float]) -> States:
    """A tool of bars (length, diameter) before the nose, struck and sensed at ``places`` (m from its tip)."""
    bars = [*tool, *SPINDLE]
    counts = [round(length / ELEMENT) for length, _ in bars]
    n = sum(counts) + 1
    M, K, C = (np.zeros((2 * n, 2 * n)) for _ in range(3))
    first = 0
    for (length, diameter), count in zip(bars, counts, strict=True):
        area, second, h = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64, length / count
        kappa = 6 * (1 + POISSON) / (7 + 6 * POISSON)
        shear = kappa * YOUNG / (2 * (1 + POISSON)) * area
        # Linear functions, the shear at the middle: errors of the square of h.
        bend = YOUNG * second / h * np.array([[0, 0, 0, 0], [0, 1, 0, -1], [0, 0, 0, 0], [0, -1, 0, 1.0]])
        slide = np.array([-1 / h, -0.5, 1 / h, -0.5])
        own = bend + shear * h * np.outer(slide, slide)
        weights = np.array([DENSITY * area, DENSITY * second]) * h / 6
        mass = np.kron([[2, 1], [1, 2]], np.diag(weights))
        for i in range(first, first + count):
            at = np.ix_(range(2 * i, 2 * i + 4), range(2 * i, 2 * i + 4))
            K[at] += own
            M[at] += mass
        first += count
    C += TIME * K
    node = sum(counts[: len(tool)])
    for (stiffness, damping), count in zip(BEARINGS, counts[len(tool) :], strict=False):
        node += count
        K[2 * node, 2 * node] += stiffness
        C[2 * node, 2 * node] += damping
    squared, shapes = eigh(K, M)
    kept = shapes[:, squared < (2 * np.pi * HIGHEST) ** 2]
    m = kept.shape[1]
    A = np.block([[np.zeros((m, m)), np.eye(m)], [-np.diag(squared[:m]), -kept.T @ C @ kept]])
    poles, right = np.linalg.eig(A)
    left = np.linalg.inv(right)
    at = kept[[2 * round(place / ELEMENT) for place in places]]
    up = poles.imag > 0
    order = np.argsort(np.abs(poles[up]))
    inputs, outputs = left[:, m:] @ at.T, at @ right[:m]
    frequency = np.abs(poles[up][order]) / (2 * np.pi)
    return States(poles[up][order], inputs[up][order], 2 * outputs[:, up][:, order], frequency)


def struck(folder: Path, name: str, tool: Sequence[tuple[float, float]], neck: float, seed: int) -> Path:
    """Six hits at the tip and six at the neck, accelerations at both with noise: the path of the measurement file."""
    random = np.random.default_rng(seed)
    states, records = assembled(tool, (0.0, neck)), []
    for drive in range(2):
        at = [0.01 + 0.16 * k + random.uniform(0, 0.005) for k in range(6)]
        peaks = random.uniform(150.0, 250.0, 6).tolist()
        force = pulses(round(0.98 * RATE), RATE, at, peaks, 1.6e-4)
        a = converted(states.acceleration(force, 1 / (RATE * FINE), drive))
        F = converted(force[None])[0]
        noise = random.normal(0, 1, (3, len(F)))
        record = f"{name}_{drive}.npz"
        np.savez(folder / record, F=F + 0.02 * noise[0], x0=a[0] + 0.05 * noise[1], x1=a[1] + 0.05 * noise[2])
        hit = 'drive = "neck.x"\n' if drive else ""
        records.append(f'[[record]]\nfile = "{record}"\n{hit}')
    channels = "".join(
        f'[[channel]]\nname = "{word}"\nquantity = "{quantity}"\nunit = "{unit}"\ndof = "{dof}"\n'
        for word, quantity, unit, dof in (
            ("F", "force", "N", "tip.x"),
            ("x0", "acceleration", "m/s^2", "tip.x"),
            ("x1", "acceleration", "m/s^2", "neck.x"),
        )
    )
    path = folder / f"{name}.impact.toml"
    path.write_text(
        'schema = "jointlib/measurement/1"\nkind = "impact"\nsimulated = true\nband = [250, 4500]\n'
        f"sample_rate = {RATE}\n{channels}{''.join(records)}[estimate]\nlength = 0.12\nforce_window = true\n"
    )
    return path
