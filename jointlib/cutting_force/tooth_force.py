"""The forces of a cut as harmonics of the passing teeth: a matrix over the coefficients, which enter linearly.

A tooth at the angle φ meets the chip h = c·sin φ and feels, per depth, F_t = K_tc·h + K_te against its motion,
F_n = K_nc·h + K_ne against the chip and F_a = K_ac·h + K_ae along the spindle (Altintas, Manufacturing Automation,
chapter 2). On the tool F_x = −F_t·cos φ − F_n·sin φ, F_y = F_t·sin φ − F_n·cos φ, F_z = F_a.
"""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.cutting_force.cut import Cut

COEFFICIENTS = {
    "tangential": "N/m^2",
    "normal": "N/m^2",
    "axial": "N/m^2",
    "edge_tangential": "N/m",
    "edge_normal": "N/m",
    "edge_axial": "N/m",
}
"""K_tc, K_nc, K_ac, K_te, K_ne, K_ae and their units."""


def harmonics(cut: Cut, order: Array) -> ComplexArray:
    """What every coefficient gives to the forces on the tool, (orders, 3, 6), F(t) = Σ_k F_k·e^(jkω_T t) over all k.

    ω_T is that of the passing teeth and a tooth stands at φ = 0 at t = 0. A flute at height z comes later by κz, so a
    depth a damps order k by sinc(kNκa/2) and turns it. In turning the forces are constant: order 0 alone is not zero.
    """
    found = np.zeros((len(order), 3, 6), dtype=complex)
    if cut.process == "turning":
        still = (order == 0).astype(float)[:, None] * cut.depth
        for axis in range(3):
            found[:, axis, [axis, axis + 3]] = still * np.array([cut.feed, 1.0])
        return found
    wave = cut.teeth * order
    return np.asarray(cut.teeth * along(cut, wave) * of_arc(wave, cut.arc, cut.feed, 0.0))


def along(cut: Cut, wave: Array) -> ComplexArray:
    """m, (waves, 1, 1): the depth, damped and turned by the helix at each order of the revolution."""
    late = wave * cut.lag * cut.depth
    return np.asarray((cut.depth * np.exp(-0.5j * late) * np.sinc(late / (2 * np.pi)))[:, None, None])


def of_arc(wave: Array, arc: tuple[float, float], slope: float, offset: float) -> ComplexArray:
    """What every coefficient gives, per depth, to the forces of one tooth whose chip over an arc in rad is
    slope·sin φ + offset (m): (waves, 3, 6), (1/2π)·∫ f(φ)·e^(−j·wave·φ) dφ."""
    sine, cosine = (_arc(arc, wave, 1, part) for part in ("sine", "cosine"))
    double, turned = (_arc(arc, wave, 2, part) for part in ("sine", "cosine"))
    one = _arc(arc, wave, 0, "cosine")
    mixed = slope * double / 2 + offset * cosine
    square = slope * (one - turned) / 2 + offset * sine
    found = np.zeros((len(wave), 3, 6), dtype=complex)
    found[:, 0, 0], found[:, 0, 1], found[:, 0, 3], found[:, 0, 4] = -mixed, -square, -cosine, -sine
    found[:, 1, 0], found[:, 1, 1], found[:, 1, 3], found[:, 1, 4] = square, -mixed, sine, -cosine
    found[:, 2, 2], found[:, 2, 5] = slope * sine + offset * one, one
    return found


def _arc(arc: tuple[float, float], wave: Array, times: int, part: str) -> ComplexArray:
    """Fourier coefficient (1/2π)·∫ trig(times·φ)·e^(−j·wave·φ) dφ over an arc."""
    first, last = arc
    middle, half = (first + last) / 2, (last - first) / 2

    def turning(s: Array) -> ComplexArray:
        return np.asarray(half / np.pi * np.exp(1j * s * middle) * np.sinc(s * half / np.pi))

    up, down = turning(times - wave), turning(-times - wave)
    return (up + down) / 2 if part == "cosine" else (up - down) / 2j
