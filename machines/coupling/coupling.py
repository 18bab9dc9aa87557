"""Receptance coupling of components through joints, exact from an open joint to a rigid one."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError


def couple(H: ComplexArray, B: Array, Z: ArrayLike, forced: Array | None = None) -> ComplexArray:
    """Receptance of parts ``H`` joined through joints of dynamic stiffness ``Z``.

    H_C = H − H Bᵀ (I + Z Hzz)⁻¹ Z B H with Hzz = B H Bᵀ, which equals H − H Bᵀ (Hzz + Z⁻¹)⁻¹ B H (Dhupia et al.
    2008, eqs 19, 20) without inverting Z. Both ends are exact: with Z written as b/a the joint forces g obey
    (a + b Hzz) g = b z_lin, where an open joint has b = 0 and a rigid one a = 0.

    Parameters
    ----------
    H
        m/N, shape (nf, n, m), or any leading shape.
    B
        Relative displacements z = B x, shape (nj, n).
    forced
        The same over the columns of H, (nj, m), where those are other than its rows.
    Z
        N/m, one gain per joint, broadcast against shape (..., nj); an infinite one is a rigid joint.
    """
    across = B if forced is None else forced
    rows: ComplexArray = B @ H
    return joined(rows @ across.T, rows, H @ across.T, H, Z)


def joined(Hzz: ComplexArray, Hzf: ComplexArray, Hoz: ComplexArray, Hof: ComplexArray, Z: ArrayLike) -> ComplexArray:
    """What `couple` finds, from receptances of joints (z), outputs (o) and forces (f): Hof − Hoz (Hzz + Z⁻¹)⁻¹ Hzf.

    ``Hzz`` is (..., nj, nj), ``Z`` as there.
    """
    gain = np.broadcast_to(np.asarray(Z, dtype=complex), Hzz.shape[:-1])
    rigid = ~np.isfinite(gain)
    # Each row is scaled to be of order one, whatever the stiffness.
    own = np.abs(np.einsum("...ii->...i", Hzz))
    finite = np.where(rigid, 0.0, gain)
    scale = 1 / (1 + np.abs(finite) * own)
    a = np.where(rigid, 0.0, scale)
    b = np.where(rigid, 1 / np.where(own > 0, own, 1.0), finite * scale)
    system = b[..., None] * Hzz
    joints = np.arange(Hzz.shape[-1])
    system[..., joints, joints] += a
    try:
        force = np.linalg.solve(system, b[..., None] * Hzf)
    except np.linalg.LinAlgError:
        raise InputError("coupling: a rigid connection asks for a motion that its parts cannot make") from None
    return Hof - Hoz @ force
