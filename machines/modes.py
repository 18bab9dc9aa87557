"""Equations of motion in their own modes."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, eigh

from jointlib.arrays import Array
from jointlib.errors import InputError

from .component import SecondOrder

_SHIFT = 1e-4
_FREE = 1e-13
_DIAGONAL = 1e-10


def modes(mass: Array, stiffness: Array) -> tuple[Array, Array, float]:
    """ω² in (rad/s)², descending, mass-normalised shapes, and a bound of the fastest ω².

    They are those of M φ = ν (K + σM) φ with ω² = 1/ν − σ: the slow modes, which decide a receptance, have the
    largest ν and come out to rounding, and so does what each fast one adds to the static compliance. σ, a
    ten-thousandth of the fastest ω², is there for free bodies; motions slower than rounding count as free.
    """
    fastest = float(np.max(np.diag(stiffness) / np.diag(mass), initial=0.0)) or 1.0
    shift = _SHIFT * fastest
    try:
        inverse, shapes = eigh(mass, stiffness + shift * mass)
    except LinAlgError:
        raise InputError(
            "equations of motion: masses or stiffnesses lie too far apart for floats, expected ones of like size"
        ) from None
    squared = 1 / inverse - shift
    return np.where(squared < _FREE * fastest, 0.0, squared), shapes / np.sqrt(inverse), fastest


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
