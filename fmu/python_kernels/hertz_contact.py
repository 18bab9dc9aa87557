"""Scalar kernel of one preloaded rolling contact."""

from __future__ import annotations

import math


def hertz_contact_force(z: float, v: float, *, preload: float, kappa: float) -> float:
    u = z / (kappa * math.pow(preload, 2.0 / 3.0))
    return preload * (math.pow(max(1.0 + u, 0.0), 1.5) - 1.0)
