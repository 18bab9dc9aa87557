"""What the scatter between the periods of a shaken rig explains of a residual."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from jointlib.identification.estimate import Estimate
from jointlib.identification.force_balance import ForceBalance
from jointlib.identification.force_samples import RestoringForce
from jointlib.identification.records import FitRecords
from jointlib.joint import Joint

_ABOVE = 3.0
"""Times what the scatter explains, above which a residual is that of a law which misses something."""


def explained(test: FitRecords, joint: Joint) -> float | None:
    """Root mean square in N that noise leaves in the rows of all records; None where a record has one period alone."""
    pairs = list(zip(test.surfaces, test.balances, strict=False))
    found = [_of_record(surface, balance, joint) for surface, balance in pairs]
    if not found or any(x is None for x in found):
        return None
    sizes = [len(balance.target) for _, balance in pairs]
    return float(np.sqrt(np.average([(x or 0.0) ** 2 for x in found], weights=sizes)))


def overall(balances: Sequence[ForceBalance], rms: Sequence[float]) -> float:
    """Root mean square over the rows of all records from that of each."""
    return float(np.sqrt(np.average(np.square(rms), weights=[len(b.target) for b in balances])))


def by_test(tests: Sequence[FitRecords], found: Estimate) -> Iterator[tuple[FitRecords, float, float | None]]:
    """Every test with what a fit leaves of it in N, and what noise explains of that."""
    first = 0
    for test in tests:
        rms = found.rms[first : first + len(test.balances)]
        first += len(test.balances)
        yield test, overall(test.balances, rms), explained(test, found.joint)


def misses(rms: float, noise: float | None) -> bool:
    """Whether a residual stands too far above its noise for a law that holds; False where the noise is unknown."""
    return noise is not None and rms > _ABOVE * noise


def _of_record(surface: RestoringForce, balance: ForceBalance, joint: Joint) -> float | None:
    """Scatter of f − K z − c ż about its mean, K and c of the joint along the motion; that of the mean of all periods.

    All three come from the same accelerations, so their noise is taken together.
    """
    if surface.periods is None:
        return None
    motion = np.column_stack([balance.rows(surface.z), balance.rows(surface.v)])
    K, c = np.linalg.lstsq(motion, balance.of(joint), rcond=None)[0]
    z, v, f = surface.periods
    each = np.stack([surface.filtered(row) for row in f - K * z - c * v])
    apart = each - each.mean(axis=0)
    count = len(each)
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=0)) / (count - 1) / count))
