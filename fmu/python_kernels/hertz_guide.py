"""Scalar kernel of the preloaded ball guide, both sides of lift-off."""

from __future__ import annotations

import math


def hertz_guide_force(z: float, v: float, *, preload: float, kappa: float, contact_angle: float) -> float:
    u = z * math.sin(contact_angle) / (kappa * math.pow(preload, 2.0 / 3.0))
    rows = math.pow(max(1.0 + u, 0.0), 1.5) - math.pow(max(1.0 - u, 0.0), 1.5)
    return 2.0 * math.sin(contact_angle) * preload * rows
