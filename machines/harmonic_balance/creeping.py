"""Where states end that creep towards their steady cycle."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

_CREEPS = 0.2


def look_ahead(state: Array, moved: Array, before: Array) -> tuple[Array, Array]:
    """Where states that creep end, if each cycle moves them by the same share of the one before, and what they moved.

    Whether they do is seen in the cycles that follow.
    """
    share = np.divide(moved, before, out=np.zeros_like(moved), where=np.abs(before) > 0)
    creeps = (share > _CREEPS) & (share < 1)
    jump = np.where(creeps, moved * share / np.where(creeps, 1 - share, 1.0), 0.0)
    return state + jump, np.where(np.any(creeps, axis=1)[:, None], np.nan, moved)
