"""Play in series with an element that remembers: how much of a travel the play swallows."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array

Mask: TypeAlias = NDArray[np.bool_]


def is_absent(clearance: float | Array) -> bool:
    """True where there is no play at all, so that a step may leave it out."""
    return clearance == 0.0 if isinstance(clearance, float | int) else not np.any(clearance)


def split(stretch: Array, clearance: float | Array) -> tuple[Array, Array]:
    """Deflection of the element and elongation of the play, m, of both together.

    The element is loaded only where the play has come to an end, so one number holds both.
    """
    gap = np.minimum(np.maximum(stretch, -clearance), clearance)
    return stretch - gap, gap


def swallowed(direction: Array, travel: Array, to_zero: Array, gap: Array, clearance: float | Array) -> Array:
    """Part of a travel, m, that only moves the play: what is left when the element is unloaded, until the other end.

    ``to_zero`` is the travel that unloads the element; 0 where the motion loads it, and then the play is used up.
    """
    return np.minimum(np.maximum(travel - to_zero, 0.0), clearance - direction * gap)


def is_free(direction: Array, travel: Array, to_zero: Array, gap: Array, clearance: float | Array) -> Mask:
    """Where a travel ends inside the play, the element without load; without a travel, where it stands inside.

    A play that has been used up is told from one that is open by its bounds, which `split` meets exactly.
    """
    ends_inside = (travel >= to_zero) & (np.maximum(travel - to_zero, 0.0) < clearance - direction * gap)
    return np.asarray(np.where(direction == 0.0, np.abs(gap) < clearance, ends_inside))


def remembered(position: Array, stretch: Array) -> Array:
    """The state of an element behind play: where the joint is, and the stretch of element and play, both in m."""
    state = np.empty((*np.shape(stretch), 2))
    state[..., 0] = position
    state[..., 1] = stretch
    return state


def virgin(position: Array) -> Array:
    """Unloaded, in the middle of the play."""
    return remembered(position, np.zeros(np.shape(position)))
