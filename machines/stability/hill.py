"""Hill's method: how a small disturbance of a vibration grows, from the machine's equations of motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

from ..coupling.second_order import MachineEquations
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.harmonics import tangent_harmonics
from ..indices import Mask

_BLOCK = 2**22
_MARGIN = 1e-6
"""Growth per radian that still counts as none: rounding, and a body that floats freely."""


def floquet_exponents(
    equations: MachineEquations, joints: Sequence[Joint], z: ComplexArray, omega: Array, harmonics: Harmonics
) -> ComplexArray:
    """λ in 1/s of disturbances e^(λt) Σ q_p e^(jpωt), p = ± the harmonics, of the motions z.

    (M s_p² + C s_p + K) q_p + Rᵀ Σ_q (κ_(p−q) + s_q γ_(p−q)) R q_q = 0 with s_p = λ + jpω, R the rows of the joints and
    κ, γ the Fourier coefficients of their tangent stiffness and damping along the cycle. One harmonic: the lowest
    block, exact for what the describing function knows; its determinant at λ = 0 vanishes where a branch folds. Where
    the mean moves (harmonic 0), p = 0 is among the disturbances.

    Parameters
    ----------
    z
        Motions of all flexible joints in m, shape (points, nh, joints).
    """
    p = np.array(sorted({*(-h for h in harmonics), *harmonics}))
    n, blocks, points = len(equations.mass), len(p), len(omega)
    size = n * blocks
    inverse, R = np.linalg.inv(equations.mass), equations.joints
    out = np.empty((points, 2 * size), dtype=complex)
    for begin in range(0, points, max(1, _BLOCK // (2 * size) ** 2)):
        now = slice(begin, min(points, begin + max(1, _BLOCK // (2 * size) ** 2)))
        w = omega[now]
        k, c = tangent_harmonics(joints, z[now], w, harmonics, 2 * max(harmonics))
        gap = p[:, None] - p
        stiffness, damping = (_spread(part, gap, R) for part in (k, c))
        unit = np.eye(blocks)[None, :, :, None, None]
        stiffness += unit * equations.stiffness
        damping += unit * equations.damping
        # In units of the angular frequency: s_p = ω (σ + jp).
        rate = 1j * p[None, :, None, None]
        own = np.arange(blocks)
        by_rate = damping / w[:, None, None, None, None]
        constant = stiffness / w[:, None, None, None, None] ** 2 + by_rate * rate[:, None]
        constant[:, own, own] -= p[:, None, None] ** 2 * equations.mass
        first = by_rate.copy()
        first[:, own, own] += 2j * p[:, None, None] * equations.mass
        A = np.zeros((len(w), 2 * size, 2 * size), dtype=complex)
        A[:, :size, size:] = np.eye(size)
        for part, columns in ((constant, slice(0, size)), (first, slice(size, 2 * size))):
            A[:, size:, columns] = -np.swapaxes(inverse @ part, 2, 3).reshape(len(w), size, size)
        out[now] = np.linalg.eigvals(A) * w[:, None]
    return out


def growth(
    equations: MachineEquations, joints: Sequence[Joint], z: ComplexArray, omega: Array, harmonics: Harmonics
) -> Array:
    """Largest growth rate Re λ in 1/s per point; e^(2π Re λ/ω) is the size of the largest Floquet multiplier."""
    return np.asarray(np.max(floquet_exponents(equations, joints, z, omega, harmonics).real, axis=1))


def grows(rate: Array, omega: Array) -> Mask:
    """Whether a disturbance grows beyond rounding."""
    return np.asarray(rate > _MARGIN * omega)


def _spread(part: ComplexArray, gap: np.ndarray, R: Array) -> ComplexArray:
    """Rᵀ κ_(p−q) R for every pair of blocks, (points, blocks, blocks, n, n)."""
    value = part[:, np.abs(gap)]
    value = np.where((gap < 0)[None, :, :, None], value.conj(), value)
    return np.asarray((value[..., None, :] * R.T) @ R)
