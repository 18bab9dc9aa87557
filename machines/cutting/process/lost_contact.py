"""Edges that leave the cut: in turning what a vibration then feels of its own surface, older turns included.

A tool that moves as A cos θ along the chip, θ = ωt, meets what it left one revolution earlier, at θ − ε with ε = ωτ;
where it was not in the cut then, what it left k revolutions earlier. So the chip is the least of all,

    h(θ) = max(0, min over k ≥ 1 of k·h₀ + A·[cos θ − cos(θ − kε)]),

and the force K_s·b·h₀^(1−q)·h^q/q has the first harmonic K_s·b·A·D(A, ε). While the edge stays in the cut D is
(N(r)/q)·(1 − e^(−jε)) with the N(r) of `power_law`. The vibration persists where 1 + b·K_s·D(A, ωτ)·G(ω; A) = 0.
"""

from __future__ import annotations

from bisect import bisect_left

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ...tool.tool_point import ToolPoint
from .cutting import Cutting
from .power_law import first_harmonic

_ANGLES = 360
_A_LOBE = 48
"""Frequencies on which a lobe, 1/τ wide, is searched."""
_TOGETHER = 2**21
_SETTLED = 1e-10
_ARC, _SIZES, _SMALLEST, _LARGEST = 200, 200, 1e-3, 10.0
_FELT = 0.05


def chip_gain(size: Array, turned: Array, exponent: float) -> ComplexArray:
    """D(A, ε), dimensionless, for amplitudes in units of the feed and angles ε in rad, both (n,)."""
    theta = 2 * np.pi * np.arange(_ANGLES) / _ANGLES
    passes = int(np.floor(2 * float(np.max(size, initial=0.0)))) + 1
    found = np.empty(len(size), dtype=complex)
    some = max(1, _TOGETHER // _ANGLES)
    for first in range(0, len(size), some):
        part = slice(first, first + some)
        A, eps = size[part, None], turned[part, None]
        moved = A * np.cos(theta)
        chip = np.full(moved.shape, np.inf)
        for k in range(1, passes + 1):
            np.minimum(chip, k + moved - A * np.cos(theta - k * eps), out=chip)
        force = np.maximum(chip, 0.0) ** exponent / exponent
        found[part] = 2 * np.mean(force * np.exp(-1j * theta), axis=1) / A[:, 0]
    return found


def persistence(
    point: ToolPoint, stiffness: float, speed: float, feed: float, amplitude: float, exponent: float
) -> tuple[float, float]:
    """Least depth (m) at which a vibration of an amplitude (m) along the chip persists, and its frequency (Hz).

    ``point`` is the tool along the chip with the joints as they are at that amplitude, ``stiffness`` K_s in N/m²,
    ``speed`` in rpm. Infinite and nan where it dies out at any depth.
    """
    tau = 60 / speed
    low, high = float(point.lines[0]), float(point.lines[-1])
    lines = np.union1d(point.lines, np.linspace(low, high, int(np.ceil((high - low) * tau * _A_LOBE)) + 2))

    def stiff(f: Array) -> ComplexArray:
        """−1/(K_s·D·G) in m: real and positive at a depth at which the vibration persists."""
        D = chip_gain(np.full(len(f), amplitude / feed), 2 * np.pi * f * tau, exponent)
        return np.asarray(-1 / (stiffness * D * point(f)[:, 0, 0]))

    with np.errstate(divide="ignore", invalid="ignore"):
        w = stiff(lines)
    crosses = (w.imag[1:] * w.imag[:-1] <= 0) & (np.minimum(w.real[1:], w.real[:-1]) > 0)
    share = w.imag[:-1] / np.where(crosses, w.imag[:-1] - w.imag[1:], 1.0)
    depth = np.where(crosses, w.real[:-1] + share * (w.real[1:] - w.real[:-1]), np.inf)
    for i in np.argsort(depth):
        if not np.isfinite(depth[i]):
            break
        ends = float(lines[i]), float(lines[i + 1])
        f = float(scipy.optimize.brentq(lambda f: float(stiff(np.array([f]))[0].imag), *ends, xtol=_SETTLED * ends[1]))
        return float(stiff(np.array([f]))[0].real), f
    return np.inf, np.nan


def milling_contact(cutting: Cutting, axes: tuple[str, ...], direction: ComplexArray, turned: float) -> float:
    """Amplitude over the feed at which milling edges begin to leave the cut: a vibration feels 5 % less of the chip.

    ``direction`` is the vibration along the tool's axes, the larger of x and y at 1, and ``turned`` |1 − e^(−jωτ)|. The
    chip feed·sin φ varies by r(φ) times itself, and the first harmonic is N(r) of the whole (see `power_law`), weighed
    with what the tooth pushes at φ.
    """
    phi = np.linspace(cutting.entry_angle, cutting.exit_angle, _ARC + 2)[1:-1]
    push, along = (part[:, ["xy".index(axis) for axis in axes]] for part in cutting.tooth(phi))
    chip = np.abs(along @ direction) * turned
    weight = chip * np.linalg.norm(push, axis=1)
    sizes = np.geomspace(_SMALLEST, _LARGEST, _SIZES)

    def less(size: float) -> bool:  # never again once it is
        felt = weight @ first_harmonic(size * chip / np.sin(phi), 1.0)
        return bool(felt < (1 - _FELT) * np.sum(weight))

    return float(np.append(sizes, np.inf)[bisect_left(sizes, True, key=less)])
