"""The border of stability where the depth is inside the loop: a crossing beside what nearly crosses."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.arrays import Array, ComplexArray
from machines.cutting.cutters.border import changes

LIMIT, PLACE = 2.3e-3, 0.25


def closed(fraction: Array, depth: float) -> ComplexArray:
    """One vibration starts to grow at `LIMIT`; another stands just inside the border at every depth."""
    found = np.zeros((len(fraction), 2, 2), dtype=complex)
    found[:, 0, 0] = -depth / LIMIT * np.exp(-4j * np.pi * (fraction - PLACE))
    turned = np.interp(fraction, [0.0, 0.1, 0.5], [-np.pi, 0.0, np.pi])
    found[:, 1, 1] = -(1 - 1e-7) * np.exp(-1j * turned)
    return found


def test_what_nearly_crosses_hides_no_crossing() -> None:
    (one,) = changes(closed, np.array([0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5]), 1e-3, 5e-3)
    assert (one.below, one.above) == (0, 2)
    assert one.crossing.depth == pytest.approx(LIMIT, rel=1e-9)
    assert one.crossing.fraction == pytest.approx(PLACE, rel=1e-6)
