"""The motion that uneven flutes force: each meets another surface than it leaves, so it has to be solved for."""

from __future__ import annotations

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import CheckFailed

from .delay_simulation import Cut, Period
from .moving_parts import MovingParts
from .surface import Ground, Surface

_NEWTON, _KRYLOV = 10, 80
_REPEATS, _SOLVED = 1e-6, 1e-5
_NUDGE = 1e-3
"""Share of the motion by which a direction is tried: an edge that just touches is not pushed out of the cut."""


def repeated(
    parts: MovingParts, cut: Cut, state: Array, memories: list[Array], surfaces: list[Surface]
) -> tuple[Array, list[Array], list[Surface]]:
    """State, memories and surfaces of the motion that repeats with the pattern of flutes, stable or not.

    From a motion close to it: Newton's method on what a period changes, its steps by GMRES with differences of stepped
    periods (Saad & Schultz 1986), so few periods beyond the number of vibrations that a pattern does not damp out.
    """
    period = Period.of(parts, cut)
    shapes = [(s.height.shape, s.between.shape) for s in surfaces]
    nodes, batch = sum(s.steps for s in cut.stretches), state.shape[1]
    largest = np.max(np.abs(state), axis=1, keepdims=True)
    waves = max(max((float(np.max(np.abs(s.height), initial=0.0)) for s in surfaces), default=0.0), 1e-300)
    size = np.broadcast_to(np.maximum(largest, 1e-6 * np.max(largest) + 1e-300), state.shape).ravel()
    scale = np.concatenate([size, np.full(sum(int(np.prod(a)) + int(np.prod(b)) for a, b in shapes), waves)])

    def laid(state: Array, surfaces: list[Surface]) -> Array:
        flat = [part.ravel() for s in surfaces for part in (s.height, s.between)]
        return np.asarray(np.concatenate([state.ravel(), *flat]) / scale)

    def taken(z: Array) -> tuple[Array, list[Surface]]:
        full, at, found = z * scale, state.size, list[Surface]()
        for a, b in shapes:
            m, n = int(np.prod(a)), int(np.prod(b))
            found.append(Surface(full[at : at + m].reshape(a), full[at + m : at + m + n].reshape(b)))
            at += m + n
        return full[: state.size].reshape(state.shape), found

    def passed(z: Array) -> tuple[Array, list[Array]]:
        begun, left = taken(z)
        ground = Ground(cut.stretches, left)
        held = [memory.copy() for memory in memories]
        after, held, _ = period.passed(begun, held, ground, np.empty((nodes, parts.tool, batch)))
        return laid(after, ground.surfaces), held

    z = laid(state, surfaces)
    for _ in range(_NEWTON):
        after, held = passed(z)
        left = after - z
        if not np.all(np.isfinite(left)):
            break
        if np.max(np.abs(left)) <= _REPEATS * max(1.0, float(np.max(np.abs(z)))):
            state, surfaces = taken(z)
            return state, held, surfaces
        memories = held

        def change(d: Array, z: Array = z, after: Array = after) -> Array:
            share = _NUDGE / max(float(np.max(np.abs(d))), 1e-300)
            return np.asarray(d - (passed(z + share * d)[0] - after) / share)

        step, _ = scipy.sparse.linalg.gmres(
            scipy.sparse.linalg.LinearOperator((len(z), len(z)), matvec=change, dtype=float),
            left,
            rtol=_SOLVED,
            restart=_KRYLOV,
            maxiter=1,
        )
        z = z + step
    raise CheckFailed("simulated cut: no motion that repeats with the flutes was found; leave 'feed' out")
