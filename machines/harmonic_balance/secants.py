"""Joints that hardly bend: held at the gains of the motions before, until nothing changes.

q ← (I + Hzz Tᵀ diag(G(T q) − G0) T)⁻¹ Hzf F needs no derivative and half the unknowns of Newton's method. It is taken
where every step is much shorter than the one before. Then it has a single solution near by, no fold was passed on the
way from rest, and the error left is that of a geometric series.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..deadline import in_time
from ..indices import Index, Mask
from ..solved import solve_each
from ..statics.bias import Biased, Together
from .newton import FULL, Problem, gains

_ITERATIONS = 40
_SHORTER = 0.3
"""Of the step before, at most."""
_ROUNDING = 1e-12
"""A step below which rounding decides."""

Force = Callable[[Index, ComplexArray, ComplexArray], Array]
"""Lines, motions q at a unit force, gains → force in N, (lines,)."""


@dataclass(frozen=True, eq=False)
class Held:
    """Motions q (lines, r), gains (lines, nj), forces (lines,), shifts of the means in m, and which lines settled."""

    q: ComplexArray
    gain: ComplexArray
    force: Array
    shift: Array
    """In the coordinates, (lines, r); empty where no mean moves."""
    settled: Mask


@np.errstate(all="ignore")  # a motion beyond all bounds is one that is not kept
def by_secants(problem: Problem, start: ComplexArray, force: Array, forced: Force, exact: float = FULL.left) -> Held:
    """Motions at forces that ``forced`` finds, from motions ``start`` and forces to begin with.

    The driving of the problem is that of a unit force; ``exact`` is what may be left of the error.
    """
    c, omega, biased = problem.coordinates, problem.omega, _means_of(problem)
    q, F = start.astype(complex), force.astype(float)
    shift = np.zeros((len(q), 0 if biased is None else q.shape[1]))
    G, settled = np.zeros((len(q), len(problem.joints)), dtype=complex), np.zeros(len(q), dtype=bool)
    left, before = np.arange(len(q)), np.full(len(q), np.inf)
    unit = np.eye(q.shape[1])
    for round_ in range(_ITERATIONS):
        in_time()
        A = np.abs(c.motions(q[left]))
        gain, moved = _held(problem, biased, A, omega[left], shift[left])
        system = unit + c.through(problem.Hzz[left], gain - problem.base[left])
        new: ComplexArray = solve_each(system, problem.driven[left, :, None])[:, :, 0].astype(complex)
        F_new = forced(left, new, gain)
        new = new * F_new[:, None]
        size = np.maximum(np.max(np.abs(new), axis=1), 1e-300)
        step = np.max(np.abs(new - q[left]), axis=1)
        if biased is not None:
            step += np.max(np.abs(c.motions(moved - shift[left])), axis=1)
        step = step / size
        share = step / before[left]
        steady = np.isfinite(step) & ((share <= _SHORTER) if round_ else (step <= _SHORTER))
        done = np.isfinite(step) & (step <= _ROUNDING) | steady & (round_ > 0) & (step * share / (1 - share) <= exact)
        kept = steady | done
        here = left[kept]
        q[here], F[here], G[here], shift[here] = new[kept], F_new[kept], gain[kept], moved[kept]
        before[left] = step
        settled[left[done]] = True
        left = left[steady & ~done]
        if not len(left):
            break
    return Held(q, G, F, shift, settled)


def _means_of(problem: Problem) -> Biased | None:
    return problem.joints.biased if isinstance(problem.joints, Together) else None


def _held(problem: Problem, biased: Biased | None, A: Array, omega: Array, shift: Array) -> tuple[ComplexArray, Array]:
    """Gains at amplitudes A about the means as they are, and where the means go next."""
    if biased is None:
        return gains(problem.joints, A, omega)[0], shift
    return biased.drifting(A, omega, shift)
