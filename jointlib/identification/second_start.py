"""A fit from two starts: least squares of a joint that bends have a false minimum where it seems hardly to bend."""

from __future__ import annotations

from collections.abc import Sequence

from jointlib.identification.estimate import Estimate, estimate
from jointlib.identification.records import FitRecords
from jointlib.identification.scatter import by_test, misses, overall
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
        first, last = (overall(balances, estimate(j, balances, asked, unknowns).rms) for j in elastic)
        if not last < _BETTER * first:
            return found
    again = estimate(other, balances, free, unknowns)
    return again if overall(balances, again.rms) < _BETTER * overall(balances, found.rms) else found


def _holds(found: Estimate, tests: Sequence[FitRecords]) -> bool:
    """True where the noise is known of every test and explains what is left of it."""
    return all(noise is not None and not misses(rms, noise) for _, rms, noise in by_test(tests, found))
