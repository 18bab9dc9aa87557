"""Hertz's point contact of a ball in a groove."""

from __future__ import annotations

import numpy as np
import scipy

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

    Hertz, as in Johnson, Contact Mechanics (1985), chapter 4, with A ≤ B half these sums, semi-axes a ≥ b and Carlson's
    integrals R_F and R_D at p = b²/a²: B/A = R_D(0, 1, p)/R_D(0, p, 1), a³ = Q R_D(0, p, 1)/(2π E* A),
    δ = 3Q R_F(0, p, 1)/(2π a E*).
    """
    A, B = sorted((first / 2, second / 2))
    reduced = modulus / (2 * (1 - STEEL_RATIO**2))

    def excess(log_ratio: float) -> float:
        p = np.exp(-2 * log_ratio)
        return float(scipy.special.elliprd(0, 1, p) / scipy.special.elliprd(0, p, 1) - B / A)

    p = np.exp(-2 * scipy.optimize.brentq(excess, 0.0, 20.0, xtol=1e-15))
    first_kind, second_kind = scipy.special.elliprf(0, p, 1), scipy.special.elliprd(0, p, 1)
    return float(3 * first_kind / (2 * np.pi * reduced) * np.cbrt(2 * np.pi * reduced * A / second_kind))
