"""Do the rocking modes of a rig keep away from the mode that is used? Six degrees of freedom, eq. 14."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array


@dataclass(frozen=True)
class RigBody:
    """Mass in kg and moments of inertia in kg m² about the axes X and Y through the centre."""

    mass: float
    inertia_x: float
    inertia_y: float


@dataclass(frozen=True)
class RigModes:
    """Natural frequencies in Hz, ascending, the rigid-body ones (0) included."""

    frequencies: Array
    mass: Array
    stiffness: Array


def rig_modes(block: RigBody, rail: RigBody, *, stiffness: float, arm_x: float, arm_y: float) -> RigModes:
    """Modes of two free bodies on four springs of a quarter of ``stiffness`` (N/m) at (±arm_y, ±arm_x).

    M ẍ + K x = 0 for x = (z1, θx1, θy1, z2, θx2, θy2) (Dhupia et al. 2008, eq. 14, K symmetric). ``arm_x`` is the
    distance in m of the springs from the axis X, about which θx turns, and ``arm_y`` that from Y.
    """
    M = np.diag([block.mass, block.inertia_x, block.inertia_y, rail.mass, rail.inertia_x, rail.inertia_y])
    spring = np.diag([1.0, arm_x**2, arm_y**2]) * stiffness
    K = np.block([[spring, -spring], [-spring, spring]])
    return RigModes(natural_frequencies(M, K), M, K)


def natural_frequencies(mass: Array, stiffness: Array) -> Array:
    """√eig(M⁻¹K)/2π in Hz, ascending, for a K that need not be symmetric; rounding below zero is zero."""
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real
    noise = 1e-12 * np.max(np.abs(squares))
    return np.asarray(np.sort(np.sqrt(np.where(squares > noise, squares, 0.0))) / (2 * np.pi))
