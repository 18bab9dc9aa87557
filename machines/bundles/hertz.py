"""Hertz's point contact of a ball in a groove."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

STEEL_MODULUS = 208e9
"""N/m², rolling bearing steel."""
STEEL_RATIO = 0.3


def groove_contact(ball: float, conformity: float, along: float, modulus: float = STEEL_MODULUS) -> float:
    """κ in m/N^(2/3) of one ball in one groove, δ = κ Q^(2/3).

    Parameters
    ----------
    ball
        Diameter D in m.
    conformity
        Groove radius over D, more than 0.5.
    along
        Curvature of the raceway in the direction of rolling in 1/m: 0 for a straight one, positive where it is convex.
    modulus
        Young's modulus of both, N/m²; Poisson's ratio is that of steel.
    """
    return point_contact(2 / ball - 1 / (conformity * ball), 2 / ball + along, modulus)


def point_contact(first: float, second: float, modulus: float) -> float:
    """κ for sums of curvatures of both bodies in the two principal planes in 1/m.

    Johnson, Contact Mechanics (1985), eq. 4.25 to 4.27: with A ≤ B half these sums, semi-axes a ≥ b and e² = 1 − b²/a²,
    B/A = ((a/b)² E − K)/(K − E), a³ = 3Q(K − E)/(2π E* e² A), δ = 3Q K/(2π a E*), K and E complete elliptic integrals.
    """
    A, B = sorted((first / 2, second / 2))
    reduced = modulus / (2 * (1 - STEEL_RATIO**2))
    if B - A <= 1e-9 * B:
        return float(np.cbrt(9 * (A + B) / (16 * reduced**2)))

    def excess(log_ratio: float) -> float:
        b2 = np.exp(-2 * log_ratio)
        K, E = ellipk(1 - b2), ellipe(1 - b2)
        return float((E / b2 - K) / (K - E) - B / A)

    b2 = np.exp(-2 * brentq(excess, 1e-6, 20.0, xtol=1e-14))
    m = 1 - b2
    K, E = ellipk(m), ellipe(m)
    return float(3 * K / (2 * np.pi * reduced) * np.cbrt(2 * np.pi * reduced * m * A / (3 * (K - E))))
