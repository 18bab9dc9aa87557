"""Motions of joints that agree with their forces at several lines of force at once."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import ComplexArray

from ...harmonic_balance.balance import Balance
from ...harmonic_balance.newton import Elimination
from ...indices import Mask

SAMPLES = 256
"""Of a period, in which the laws of the joints are followed."""
_ITERATIONS = 20
_SETTLED = 1e-8
_LONGEST = 0.5
_SERVES = 0.3
"""Share of the last step that one with the Jacobian kept may have."""
_RAMP = (0.3, 0.6, 0.8, 1.0)


def balanced(balance: Balance, target: ComplexArray) -> tuple[ComplexArray, Mask]:
    """Newton's method at several lines of force at once, from rest; what does not settle is driven up in steps."""
    z, settled = _newton(balance, target, target.copy())
    lost = np.flatnonzero(~settled)
    if len(lost):
        part, start, before = balance.at(lost), _RAMP[0] * target[lost], _RAMP[0]
        fine = np.ones(len(lost), dtype=bool)
        for share in _RAMP:
            on = np.flatnonzero(fine)
            if not len(on):
                break
            start[on], fine[on] = _newton(part.at(on), share * target[lost[on]], start[on] * share / before)
            before = share
        z[lost], settled[lost] = start, fine
    return z, settled


def _newton(balance: Balance, target: ComplexArray, start: ComplexArray) -> tuple[ComplexArray, Mask]:
    """Newton's method with the Jacobian kept while it serves: that of joints with memory costs many times a force."""
    z, done = start.astype(complex), np.zeros(len(start), dtype=bool)
    size = 2 * int(np.prod(target.shape[1:]))
    J, fresh = np.empty((len(start), size, size)), np.zeros(len(start), dtype=bool)
    before, left = np.full(len(start), np.inf), np.arange(len(start))
    for _ in range(_ITERATIONS):
        new = left[~fresh[left]]
        if len(new):
            J[new], fresh[new] = balance.at(new).jacobian(balance.at(new).forces(z[new], SAMPLES)), True
        part = balance.at(left)
        r = part.residual(z[left], part.forces(z[left], SAMPLES, slopes=False).force) - target[left]
        delta = Elimination(J[left]).solve(-r)
        length = np.max(np.abs(delta), axis=(1, 2)) / np.maximum(np.max(np.abs(z[left]), axis=(1, 2)), 1e-300)
        fine = np.isfinite(length)
        share = np.minimum(1.0, _LONGEST / np.maximum(length, 1e-300))
        z[left[fine]] += (share[:, None, None] * delta)[fine]
        done[left] = fine & (length <= _SETTLED)
        fresh[left] = length <= _SERVES * before[left]
        before[left] = np.where(fresh[left], length, np.inf)
        left = left[fine & ~done[left]]
        if not len(left):
            break
    return z, done
