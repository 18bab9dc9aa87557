"""Anderson's mixing: the next place of an iteration u → u + r(u) from its last ones, as if r were straight.

Of the mean of the places with weights that make the mean of their moves least, u + r. Lines that follow others by a
gain of a third each round then take a third of the rounds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array

REMEMBERED = 8
"""Places that count."""


def mixed(places: Sequence[Array], moves: Sequence[Array]) -> Array:
    """The next place from places u, (n,), and their moves r, the last of each the newest."""
    u, r = np.array(places[-REMEMBERED:]), np.array(moves[-REMEMBERED:])
    new: Array = u[-1] + r[-1]
    if len(u) > 1:
        turned = np.diff(r, axis=0)
        share = np.linalg.lstsq(turned @ turned.T, turned @ r[-1], rcond=1e-14)[0]
        new = new - share @ (np.diff(u, axis=0) + turned)
    return new
