"""How many vibrations grow in a cut, by Nyquist's criterion on the loop over one pattern.

The tool by itself is stable, so the roots of det(1 + b·A(ω)) = 0 that grow are as many as the determinant turns about
zero while ν = ω/ω_P passes −1/2 to 1/2. That it counts at one depth and needs no branches, no multipliers and no modes
is what makes it good for cuts whose coefficients hold the depth: islands are found where they are.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from jointlib.arrays import Array, ComplexArray

_TURN = 0.7
"""rad by which the determinant may turn between neighbours."""
_GROWS = 4.0
_ROUNDS = 14


def growing(closed: Callable[[Array], ComplexArray], fraction: Array) -> tuple[int, Array, Array]:
    """The number of vibrations that grow; the ν looked at and |det| there.

    ``closed`` gives b·A at ν, and ``fraction`` the ν to begin with, from 0 to 1/2.
    """
    nu = fraction
    turn, size = _determinant(closed(nu))
    for _ in range(_ROUNDS):
        step = np.abs(np.angle(turn[1:] / turn[:-1]))
        coarse = (step > _TURN) | (np.abs(np.diff(size)) > np.log(_GROWS))
        if not np.any(coarse):
            break
        middle = (nu[1:] + nu[:-1])[coarse] / 2
        new, there = _determinant(closed(middle))
        order = np.argsort(np.concatenate([nu, middle]), kind="stable")
        nu, turn, size = (np.concatenate(pair)[order] for pair in ((nu, middle), (turn, new), (size, there)))
    whole = float(np.sum(np.angle(turn[1:] / turn[:-1]))) / np.pi
    return round(-whole), nu, size


def _determinant(matrices: ComplexArray) -> tuple[ComplexArray, Array]:
    """The direction of det(1 + A), and the logarithm of its size; the matrices are changed."""
    along = np.arange(matrices.shape[-1])
    matrices[:, along, along] += 1
    sign, size = np.linalg.slogdet(matrices)
    return sign, size
