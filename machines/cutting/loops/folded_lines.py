"""One eigenvalue of a loop of many lines: the strong lines are solved for, the weak ones follow them.

Newton's method in the vector x and κ of

    F = x − κ·A·x = 0,   c·x = 1,   λ = 1/κ.

A step is solved for on the strong lines alone; the others, on which the gain round the loop, |H|·|G|/|λ|, is well below
1, only follow. Each round takes one product A·x.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ...indices import Mask
from .mixing import mixed

_ROUNDS = 40
_SETTLED = 1e-13
"""|F| over |x| of an eigenvalue."""
_CLOSE = 0.05
"""Share of the guess within which an eigenvalue is the one that was meant."""
TURNED = 2.0
"""|x| over its part along the first vector, from which on it may be the vector of another eigenvalue."""

Step = Callable[[ComplexArray], ComplexArray]


def strong_step(among: ComplexArray, strong: Mask) -> Step:
    """F → what 1 − κ·A makes it of, on the strong lines, whose 1 − κ·A is ``among``; the weak ones as they are."""
    factors, pivots, _ = scipy.linalg.lapack.zgetrf(among)

    def step(left: ComplexArray) -> ComplexArray:
        solved = left.copy()
        solved[strong] = scipy.linalg.lapack.zgetrs(factors, pivots, left[strong])[0]
        return solved

    return step


def first_vector(step: Step, strong: Mask) -> ComplexArray:
    """A unit vector on the strong lines that is nearly that of the eigenvalue for which ``step`` solves."""
    x = np.zeros(len(strong), dtype=complex)
    x[strong] = np.exp(1j * np.arange(np.count_nonzero(strong)) ** 2)
    for _ in range(2):
        x = step(x)
        x /= np.linalg.norm(x)
    return x


def folded_eigenvalue(
    applied: Callable[[ComplexArray], ComplexArray], among: ComplexArray, strong: Mask, guess: complex
) -> tuple[complex, ComplexArray] | None:
    """The eigenvalue of A close to a guess and its vector.

    None where the weak rows do not just follow, or where it is so far from the guess that another may be nearer.

    ``applied`` is x → A·x, ``among`` A_ss and ``strong`` the rows s, shape (m,).
    """
    step = strong_step(np.eye(len(among)) - among / guess, strong)
    along = first_vector(step, strong)
    of, x, kappa = along.conj(), along, 1 / guess
    places, moves = list[Array](), list[Array]()
    for _ in range(_ROUNDS):
        moved = applied(x)
        left = x - kappa * moved
        if np.linalg.norm(left) <= _SETTLED * np.linalg.norm(x):
            size = float(np.linalg.norm(x))
            return (1 / kappa, x / size) if size <= TURNED else None
        back, along = step(left), step(moved)
        further = complex(of @ back) / complex(of @ along)
        places.append(np.append(x, kappa * guess).view(float))
        moves.append(np.append(further * along - back, further * guess).view(float))
        new = mixed(places, moves).view(complex)
        x, kappa = new[:-1], complex(new[-1]) / guess
        if not abs(kappa * guess - 1) <= _CLOSE:
            return None
    return None
