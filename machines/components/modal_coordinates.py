"""Equations of motion in their own modes."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

from ..indices import Index
from .component import SecondOrder
from .mode_sum import modes

_DIAGONAL = 1e-10
_UNSTRAINED = 1e-9
"""Stiffness of a part that moves as a whole, relative to that of its coordinates: rounding."""


def in_modes(model: SecondOrder, lossy: Array | None = None, held: Index | None = None) -> SecondOrder:
    """The same equations in modal coordinates, and modal damping from structural damping.

    ``lossy`` K_η is the sum of loss factor times stiffness over the materials: a mode gets the damping ratio η_r/2
    with η_r = φᵀ K_η φ / φᵀ K φ, its loss by strain energy (Johnson, Kienholz, AIAA J. 20, 1982). At a resonance that
    dissipates what structural damping does; unlike it, it exists in time. Free motions are not damped.

    The modes that get it are those of the free part, or with coordinates ``held`` those of the part held there. A force
    that dissipates η of the energy at every frequency is larger, over the velocity, where a motion is slow: what holds
    for the free modes is too little, in proportion to the frequency, for the slower ones of a part that is held.
    """
    squared, shapes, _ = modes(model.mass, model.stiffness)
    C = shapes.T @ model.damping @ shapes
    if lossy is not None and held is not None:
        added = shapes.T @ _of_the_held(model, lossy, held) @ shapes
        added[squared == 0] = 0.0
        added[:, squared == 0] = 0.0
        C = C + (added + added.T) / 2
    own = np.sqrt(np.abs(np.diag(C)))
    off = C - np.diag(np.diag(C))
    if np.all(np.abs(off) <= _DIAGONAL * np.outer(own, own)):
        C = np.diag(np.diag(C))
    if lossy is not None and held is None:
        loss = np.einsum("ir,ij,jr->r", shapes, lossy, shapes)
        C = C + np.diag(np.where(squared > 0, loss, 0.0) / np.sqrt(np.where(squared > 0, squared, 1.0)))
    return SecondOrder(np.eye(len(C)), C, np.diag(squared), model.shapes @ shapes)


def _of_the_held(model: SecondOrder, lossy: Array, held: Index) -> Array:
    """Damping of what moves beyond the static shapes of the held coordinates, and of what these shapes strain."""
    M, K, n = model.mass, model.stiffness, len(model.mass)
    rest = np.setdiff1d(np.arange(n), held)
    static = np.zeros((n, len(held)))
    static[held] = np.eye(len(held))
    static[rest] = -np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, held)])
    beyond = np.eye(n)[rest]
    beyond[:, held] = -static[rest]
    inner = np.ix_(rest, rest)
    C = beyond.T @ _modal(M[inner], K[inner], lossy[inner]) @ beyond
    strained = static.T @ K @ static
    own = np.sqrt(np.abs(np.diag(K)[held]))
    if np.any(np.abs(strained) > _UNSTRAINED * np.outer(own, own)):
        C[np.ix_(held, held)] += _modal(static.T @ M @ static, strained, static.T @ lossy @ static)
    return np.asarray(C)


def _modal(mass: Array, stiffness: Array, lossy: Array) -> Array:
    """C = M Φ diag(φᵀ K_η φ/ω) Φᵀ M of the modes of these equations."""
    squared, shapes, _ = modes(mass, stiffness)
    loss = np.einsum("ir,ij,jr->r", shapes, lossy, shapes)
    rate = np.where(squared > 0, loss, 0.0) / np.sqrt(np.where(squared > 0, squared, 1.0))
    pull = mass @ shapes
    return np.asarray((pull * rate) @ pull.T)
