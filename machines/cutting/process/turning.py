"""Turning: one edge cuts the surface left one revolution earlier."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError

from .cutting import Cutting

NOTES = ("Not covered: process damping, nose radius and mode coupling across the cut, loss of contact.",)


def loop_stiffness(cutting: Cutting) -> Array:
    """K_s in N/m², shape (1, 1): force and chip thickness both lie along one direction."""
    if cutting.process == "milling":
        raise InputError("turning: the process is milling, expected turning or boring")
    return cutting.mean_stiffness


def minimum_depth_of_mode(stiffness: ArrayLike, damping_ratio: ArrayLike, specific: ArrayLike) -> Array:
    """Depth in m below which a single mode is stable at any speed: b = 2·k·ζ·(1 + ζ)/K_s.

    ``stiffness`` in N/m, ``specific`` in N/m². The tool chatters there at √(1 + 2ζ) times its natural frequency
    (Tobias & Fishwick; Tlusty).
    """
    k, zeta, K_s = _positive(stiffness=stiffness, damping_ratio=damping_ratio, specific=specific)
    return np.asarray(2 * k * zeta * (1 + zeta) / K_s)


def notch_delays(natural_frequency: float, damping_ratio: float, count: int) -> Array:
    """Times of revolution in s, shape (count,), at which the first ``count`` lobes touch the minimum depth.

    τ_j = 2·[jπ − arctan((r² − 1)/(2ζr))]/ω at r = ω/ω_n = √(1 + 2ζ), j = 1, 2, …; ``natural_frequency`` in Hz.
    """
    f, zeta = _positive(natural_frequency=natural_frequency, damping_ratio=damping_ratio)
    r = np.sqrt(1 + 2 * zeta)
    j = np.arange(1, count + 1)
    return np.asarray(2 * (j * np.pi - np.arctan((r**2 - 1) / (2 * zeta * r))) / (2 * np.pi * f * r))


def _positive(**values: ArrayLike) -> list[Array]:
    checked = []
    for name, value in values.items():
        array = np.asarray(value, dtype=float)
        if not np.all(np.isfinite(array) & (array > 0)):
            raise InputError(f"turning: {name} is {value!r}, expected more than 0 in SI units")
        checked.append(array)
    return checked
