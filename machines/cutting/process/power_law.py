"""A cutting force that grows with a power of the chip thickness: what a vibration of finite size feels of it.

The force K·b·h^q at h = h₀(1 + r cos θ) has a first harmonic in phase with the chip,

    N(r) = (1/(πr))·∫₀^2π (1 + r cos θ)^q cos θ dθ,   N(0) = q,

so a vibration of chip amplitude r·h₀ feels N(r)/q of the tangent coefficient, and the depth at which it persists is
q/N(r) of the linear one. Below r = 1 that is less than 1 for q < 1: a knock can start chatter in a cut that is stable.
"""

from __future__ import annotations

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError

_RULE = np.polynomial.legendre.leggauss(80)


def first_harmonic(ratio: ArrayLike, exponent: float) -> Array:
    """N(r) for chip amplitudes r in units of the nominal chip thickness, r ≥ 0.

    Up to r = 1, where contact is lost once a cycle, N = q·₂F₁((1 − q)/2, 1 − q/2; 2; r²). Beyond, the chip is cut off
    at 0 and N falls as 1/r or faster; that the tool then also meets what earlier passes left is not in it.
    """
    r = np.asarray(ratio, dtype=float)
    if not (np.isfinite(exponent) and exponent > 0):
        raise InputError(f"power law: the exponent is {exponent!r}, expected more than 0")
    if not np.all(r >= 0):
        raise InputError("power law: the chip amplitude must be at least 0")
    inside = np.minimum(r, 1.0)
    closed = exponent * scipy.special.hyp2f1((1 - exponent) / 2, 1 - exponent / 2, 2.0, inside**2)
    return np.where(r <= 1, closed, _interrupted(np.maximum(r, 1.0), exponent))


def depth_ratio(ratio: ArrayLike, exponent: float) -> Array:
    """b(r)/b_lin = q/N(r): the depth at which a vibration persists, over the linear limit."""
    return np.asarray(exponent / first_harmonic(ratio, exponent))


def touching_ratio(exponent: float) -> float:
    """b(1)/b_lin = √π·Γ(q + 2)/(2^(q+1)·Γ(q + ½)), where the tool just leaves the cut once a cycle."""
    q = exponent
    return float(np.sqrt(np.pi) * scipy.special.gamma(q + 2) / (2 ** (q + 1) * scipy.special.gamma(q + 0.5)))


def _interrupted(r: Array, q: float) -> Array:
    """N(r) for r ≥ 1 by quadrature over the part of the cycle in contact; a sine map tames the power at its ends."""
    x, weight = _RULE
    edge = np.arccos(-1 / r)[..., None]
    theta = edge * (1 + np.sin(np.pi / 2 * x)) / 2
    chip = np.maximum(1 + r[..., None] * np.cos(theta), 0.0) ** q
    integral = (
        edge / 2 * np.pi / 2 * np.sum(weight * np.cos(np.pi / 2 * x) * chip * np.cos(theta), axis=-1, keepdims=True)
    )
    return np.asarray(2 * integral[..., 0] / (np.pi * r))
