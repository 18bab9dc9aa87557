"""Periodic steady state of something that is stepped in time, many segments of the period at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from jointlib.arrays import Array
from jointlib.law import JointLaw, MemorylessLaw, Motion

_SEGMENTS = 64


def periodic_sweep(
    advance: Callable[[int, Array], tuple[Array, Array]], start: Array, steps: int, tolerance: float, sweeps: int
) -> tuple[Array, bool]:
    """Output over one period in the steady state, shape (steps, segments, ...), and whether it was reached.

    The period is cut into segments that are stepped side by side; each takes over the state in which the one before
    it ended, the first that of the last, until the output changes by no more than ``tolerance`` of its size. A system
    that forgets needs a few sweeps; one that does not forget needs as many as there are segments, which is the cost
    of plain stepping. ``advance(i, state)`` makes step i in every segment and returns the output at its end and
    the new state; ``state`` has the segments on its first axis and its components on the last.
    """
    state, last = start, None
    for _ in range(sweeps):
        rows = []
        for i in range(steps):
            output, state = advance(i, state)
            rows.append(output)
        out = np.array(rows)
        state = np.roll(state, 1, axis=0)
        if last is not None and np.abs(out - last).max() <= tolerance * np.abs(out).max():
            return out, True
        last = out
    return out, False


def steady_force(law: JointLaw, displacement: Array, velocity: Array, time_step: float) -> Array:
    """Force in N of a law along periodic paths, time on the first axis, every internal state periodic too."""
    z, v = np.broadcast_arrays(displacement, velocity)
    if isinstance(law, MemorylessLaw) or not law.states:
        return np.asarray(law.step(Motion(z, v, time_step), law.initial_state(z))[0])
    T = len(z)
    K = max(k for k in range(1, _SEGMENTS + 1) if T % k == 0)
    cut = (K, T // K, *z.shape[1:])
    # Step i of every segment lies together in memory.
    zs, vs = (np.ascontiguousarray(np.moveaxis(x.reshape(cut), 1, 0)) for x in (z, v))

    def advance(i: int, state: Array) -> tuple[Array, Array]:
        return law.step(Motion(zs[i], vs[i], time_step), state)

    # Virgin in the middle of the path: contacts that never slip then stay at rest from the first sweep on.
    middle = (z.max(axis=0) + z.min(axis=0)) / 2
    start = np.broadcast_to(law.initial_state(middle), (K, *z.shape[1:], len(law.states))).copy()
    force, _ = periodic_sweep(advance, start, T // K, 1e-10, K + 2)
    return np.asarray(np.moveaxis(force, 0, 1).reshape(z.shape))
