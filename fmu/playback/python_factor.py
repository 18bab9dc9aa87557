"""The factor of a modulation, as the Python slave has it."""

from __future__ import annotations

import math
from collections.abc import Sequence


def factor(points: Sequence[tuple[float, float]], period: float, reference: float, x: float) -> float:
    """Linear between points, kept beyond their ends, 1 at the reference; repeated where there is a period."""
    if x == reference:
        return 1.0
    if period:
        x -= period * math.floor((x - points[0][0]) / period)
    if x <= points[0][0]:
        return points[0][1]
    if x >= points[-1][0]:
        return points[-1][1]
    i = next(i for i, (end, _) in enumerate(points) if x < end)
    (x0, y0), (x1, y1) = points[i - 1 : i + 1]
    return (y1 - y0) / (x1 - x0) * (x - x0) + y0
