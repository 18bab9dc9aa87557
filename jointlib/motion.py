"""Relative motion across a joint at one instant."""

from __future__ import annotations

from dataclasses import dataclass

from jointlib.arrays import Array


@dataclass(frozen=True)
class Motion:
    """Relative motion across the joint at one instant; arrays of any common shape."""

    displacement: Array
    """z in m."""
    velocity: Array
    """ż in m/s."""
    duration: float | Array = 0.0
    """Time since the instant of the state that goes in, s."""
