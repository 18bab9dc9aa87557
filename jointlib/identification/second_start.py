"""A fit from two starts: least squares of a joint that bends have a false minimum where it seems hardly to bend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.identification.estimate import Estimate, estimate
from jointlib.identification.force_balance import ForceBalance
from jointlib.identification.records import FitRecords
from jointlib.identification.scatter import explained, misses, overall
from jointlib.joint import Joint

SHARE = 0.25
"""Of the motion at which the joint of the second start bends; the first bends at about all of it."""
_BETTER = 0.99
"""Share of the residual of the first start below which that of the second counts."""


def nearest_fit(joint: Joint, second: Joint | None, tests: Sequence[FitRecords], free: list[str]) -> Estimate:
    """The fit from a joint; from the second one where noise does not explain the first and that one leaves less.

    A law with memory is slow to fit, so those without memory are asked first whether the second start is worth it.
    """
    balances, unknowns = tuple(b for t in tests for b in t.balances), tests[0].unknowns
    found = estimate(joint, balances, free, unknowns)
    if second is None or _holds(found, tests):
        return found
    other = joint.with_parameters({n: second.parameters[n] for n in free if n not in joint.fixed})
    if joint.states:
        elastic = [j.parted(lambda law: bool(law.states))[1] for j in (joint, other)]
        asked = [n for n in free if n in elastic[0].parameters]
        if not asked:
            return found
        first, last = (_left(estimate(j, balances, asked, unknowns), balances) for j in elastic)
        if not last < _BETTER * first:
            return found
    again = estimate(other, balances, free, unknowns)
    return again if _left(again, balances) < _BETTER * _left(found, balances) else found


def _left(found: Estimate, balances: tuple[ForceBalance, ...]) -> float:
    """Root mean square residual over all rows."""
    return float(np.sqrt(np.average(np.square(found.rms), weights=[len(b.target) for b in balances])))


def _holds(found: Estimate, tests: Sequence[FitRecords]) -> bool:
    """True where the noise is known of every test and explains what is left of it."""
    first = 0
    for test in tests:
        rms = found.rms[first : first + len(test.balances)]
        first += len(test.balances)
        noise = explained(test, found.joint)
        if noise is None or misses(overall(test, rms), noise):
            return False
    return True
