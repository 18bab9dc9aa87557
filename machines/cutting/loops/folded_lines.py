"""One eigenvalue of a loop of many lines: the strong lines are solved for, the weak ones follow them.

Of the lines of λ·x = A·x those on which the gain round the loop, |H|·|G|/|λ|, is well below 1 only follow what the
others drive:

    λ·x_s = A_ss·x_s + A_sw·x_w,   λ·x_w = A_ws·x_s + A_ww·x_w.

The second equation is iterated as it stands. In the first A_sw·x_w is held as a multiple of x_s, which leaves an
eigenvalue problem of some tens of rows. Each round takes two or three products A·x.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from jointlib.arrays import ComplexArray

from ...indices import Mask
from .loop_branches import nearest_of

_ROUNDS = 40
_SWEEPS = 2
"""Times that the weak lines follow in a round."""
_SETTLED = 1e-14
_CLOSE = 1e-3
"""Share of the guess within which an eigenvalue is the one that was meant."""
_SLOWEST = 0.7
"""Share of the change before from which on a round does not settle."""


def folded_eigenvalue(
    applied: Callable[[ComplexArray], ComplexArray], among: ComplexArray, strong: Mask, guess: complex
) -> tuple[complex, ComplexArray] | None:
    """The eigenvalue of A close to a guess and its vector.

    None where the weak rows do not just follow, or where it is so far from the guess that another may be nearer.

    ``applied`` is x → A·x, ``among`` A_ss and ``strong`` the rows s, shape (m,).
    """
    x, change = np.zeros(len(strong), dtype=complex), np.inf
    value, x[strong] = nearest_of(among, guess)
    for _ in range(_ROUNDS):
        for _ in range(_SWEEPS):
            moved = applied(x)
            x[~strong] = moved[~strong] / value
        own = x[strong]
        from_weak = applied(x)[strong] - among @ own
        new, vector = nearest_of(among + np.outer(from_weak, own.conj() / np.vdot(own, own).real), value)
        x[strong] = vector * (np.vdot(own, own) / np.vdot(own, vector))
        before, change, value = change, abs(new - value), new
        if change <= _SETTLED * abs(new):
            return (new, x / np.linalg.norm(x)) if abs(new - guess) <= _CLOSE * abs(guess) else None
        if not change <= max(_SLOWEST * before, 10 * _SETTLED * abs(new)):
            return None
    return None
