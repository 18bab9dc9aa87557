"""Where a branch of the loop closes on itself."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.arrays import Array, ComplexArray
from machines.cutting.loops.loop_branches import Bracket, closed, regeneration


@pytest.mark.parametrize(("at", "kind"), [(0.5 - 2e-16, "flip"), (0.5 - 1e-9, "hopf"), (0.47, "hopf")])
def test_what_numbers_cannot_tell_from_a_flip_is_one(at: float, kind: str) -> None:
    def loop(fraction: Array) -> ComplexArray:
        """λ·(1 − e^(−2πjν)) = −500·(1 + j(ν − at)): real where ν is ``at``, at 2 mm."""
        turned = -500.0 * (1 + 1j * (fraction - at))
        return np.asarray((turned / regeneration(fraction))[:, None, None])

    ends = (0.4, 0.5)
    start, end = (complex(loop(np.array([nu]))[0, 0, 0]) for nu in ends)
    found = closed(loop, Bracket(1e-3, *ends, start, end))
    assert found is not None
    assert found.kind == kind
    assert found.depth == pytest.approx(2e-3, rel=1e-12)
