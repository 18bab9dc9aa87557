"""Structures struck by hammers and driven by shakers, simulated step by step: what the estimators are held against.

The modes are stepped exactly for a force that is straight between fine steps; nothing here knows of spectra.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import expm

FINE = 8


@dataclass(frozen=True)
class Structure:
    """Modes by natural frequency (Hz), damping ratio and mass-normalised shapes (a row per place)."""

    frequency: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray

    def receptance(self, f: np.ndarray, response: int, drive: int) -> np.ndarray:
        """m/N by the sum over modes."""
        s, w = 2j * np.pi * f[:, None], 2 * np.pi * self.frequency
        weight = self.shapes[response] * self.shapes[drive]
        return np.sum(weight / (s**2 + 2 * self.damping_ratio * w * s + w**2), axis=1)

    def motion(self, force: np.ndarray, step: float, drive: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement, velocity and acceleration (places, samples) for a force that is straight between samples."""
        x, v, a = (np.zeros((len(self.shapes), len(force))) for _ in range(3))
        for r, (fn, zeta) in enumerate(zip(self.frequency, self.damping_ratio, strict=True)):
            w = 2 * np.pi * fn
            A = np.zeros((4, 4))
            A[0, 1], A[1, :2], A[1, 2], A[2, 3] = 1, [-(w**2), -2 * zeta * w], 1, 1
            E = expm(A * step)
            phi, b0, b1 = E[:2, :2], E[:2, 2], E[:2, 3] / step
            modal = np.zeros((2, len(force)))
            q = np.zeros(2)
            f = force * self.shapes[drive, r]
            pushed = b0[:, None] * f[:-1] + b1[:, None] * np.diff(f)
            p00, p01, p10, p11 = phi.ravel().tolist()
            y0, y1 = [0.0], [0.0]
            q0, q1 = q.tolist()
            for u0, u1 in zip(*pushed.tolist(), strict=True):
                q0, q1 = p00 * q0 + p01 * q1 + u0, p10 * q0 + p11 * q1 + u1
                y0.append(q0)
                y1.append(q1)
            modal[0], modal[1] = y0, y1
            own = f - 2 * zeta * w * modal[1] - w**2 * modal[0]
            for out, of_mode in ((x, modal[0]), (v, modal[1]), (a, own)):
                out += self.shapes[:, r : r + 1] * of_mode
        return x, v, a


def pulses(samples: int, rate: float, at: list[float], peak: list[float], width: float = 1e-3) -> np.ndarray:
    """A force of sin² pulses on the fine grid that is `FINE` times the sample rate."""
    t = np.arange(samples * FINE) / (rate * FINE)
    force = np.zeros(len(t))
    for begin, size in zip(at, peak, strict=True):
        inside = (t >= begin) & (t < begin + width)
        force[inside] += size * np.sin(np.pi * (t[inside] - begin) / width) ** 2
    return force


_TAPS = np.arange(-6 * FINE, 6 * FINE + 1)
_LOW_PASS = np.sinc(_TAPS / FINE) * np.kaiser(len(_TAPS), 8.0)
"""The filter before the converter: 7e-4 is lacking at 0.3 of the sample rate, and 7e-4 left of what folds there."""


def converted(x: np.ndarray) -> np.ndarray:
    """Signals on the fine grid as a converter shows them, without what would fold into the band."""
    return np.array([np.convolve(row, _LOW_PASS / np.sum(_LOW_PASS), mode="same")[::FINE] for row in x])


def sampled(structure: Structure, force: np.ndarray, rate: float, drive: int, kind: int = 2) -> tuple:
    """Force and motions (0 displacement, 1 velocity, 2 acceleration) at the sample rate.

    The force that acts is straight between fine samples; its spectrum is that of the samples times sinc² of frequency
    over fine rate, here by its series, F + ∇²F/12. What the masses follow of it at once is the same.
    """
    motion = structure.motion(force, 1 / (rate * FINE), drive)[kind]
    straight = (np.roll(force, 1) - 2 * force + np.roll(force, -1)) / 12
    if kind == 2:
        motion = motion + (structure.shapes @ structure.shapes[drive])[:, None] * straight
    return converted(force[None] + straight)[0], converted(motion)


def write_record(path: Path, force: np.ndarray, motions: np.ndarray) -> None:
    """A record as npz with columns F, x0, x1 …"""
    np.savez(path, F=force, **{f"x{k}": x for k, x in enumerate(motions)})


def declared(
    kind: str, rate: float, records: list[str], places: int, more: str = "", quantity: str = "acceleration"
) -> str:
    """The measurement file of such records."""
    units = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}
    channels = '[[channel]]\nname = "F"\nquantity = "force"\nunit = "N"\ndof = "part.p0"\n'
    for k in range(places):
        channels += (
            f'[[channel]]\nname = "x{k}"\nquantity = "{quantity}"\nunit = "{units[quantity]}"\ndof = "part.p{k}"\n'
        )
    listed = "".join(f'[[record]]\nfile = "{name}"\n' for name in records)
    return (
        f'schema = "jointlib/measurement/1"\nkind = "{kind}"\nsimulated = true\nsample_rate = {rate}\n'
        f"{channels}{listed}{more}"
    )
