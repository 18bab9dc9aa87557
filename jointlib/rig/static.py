"""Static rig: a guide clamped in a two-piece vise, loaded in small steps both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint


@dataclass(frozen=True)
class StaticRig:
    """Load cell and displacement pick-ups on a joint that is pushed and pulled slowly (Dhupia et al. 2008, fig. 3).

    The spindle of the vise sets the deflection; the load is what the joint answers, with whatever it remembers of
    the way there.
    """

    joint: Joint
    load_noise: float = 15.0
    """Standard deviation of the load cell, N."""
    displacement_noise: float = 10e-9
    """Standard deviation of the mean of the two pick-ups, m."""

    def curve(self, rng: np.random.Generator, deflection: Array) -> tuple[Array, Array]:
        """Measured deflection (m) and load (N) along a path of set deflections in m."""
        load = self.joint.force_along(deflection, np.zeros_like(deflection))
        shown = deflection + self.displacement_noise * rng.standard_normal(len(deflection))
        return shown, load + self.load_noise * rng.standard_normal(len(deflection))


def push_and_pull(reach: float, steps: int) -> Array:
    """Set deflections in m: from rest to ``reach``, through to the opposite side and back to rest, evenly spaced."""
    quarter = np.linspace(0, reach, steps + 1)
    return np.concatenate([quarter, quarter[-2::-1], -quarter[1:], -quarter[-2::-1]])
