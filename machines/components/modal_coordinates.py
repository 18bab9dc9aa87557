"""Equations of motion in their own modes."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

from .component import SecondOrder
from .mode_sum import modes

_DIAGONAL = 1e-10


def in_modes(model: SecondOrder, lossy: Array | None = None) -> SecondOrder:
    """The same equations in modal coordinates, and modal damping from structural damping.

    ``lossy`` K_η is the sum of loss factor times stiffness over the materials: a mode gets the damping ratio η_r/2
    with η_r = φᵀ K_η φ / φᵀ K φ, its loss by strain energy. At a resonance that dissipates what structural damping
    does; unlike it, it exists in time. Free motions are not damped.
    """
    squared, shapes, _ = modes(model.mass, model.stiffness)
    C = shapes.T @ model.damping @ shapes
    own = np.sqrt(np.abs(np.diag(C)))
    off = C - np.diag(np.diag(C))
    if np.all(np.abs(off) <= _DIAGONAL * np.outer(own, own)):
        C = np.diag(np.diag(C))
    if lossy is not None:
        loss = np.einsum("ir,ij,jr->r", shapes, lossy, shapes)
        C = C + np.diag(np.where(squared > 0, loss, 0.0) / np.sqrt(np.where(squared > 0, squared, 1.0)))
    return SecondOrder(np.eye(len(C)), C, np.diag(squared), model.shapes @ shapes)
