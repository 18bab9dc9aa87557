"""The force of a steady cut on the tool: what repeats with every tooth, in harmonics of the tooth frequency."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..in_time.delay_simulation import Chip
from ..process.cutting import Cutting

_POINTS = 64
"""Of the quadrature, beside four a harmonic."""


def tooth_forces(cutting: Cutting, axes: tuple[str, ...], harmonics: Array) -> ComplexArray:
    """Phasors F_k of the force on the tool per depth of cut in N/m, (harmonics, axes): F(t) = b·Re Σ F_k e^(jkω_T t).

    A tooth at φ cuts a chip of feed·sin φ and pushes with −u(φ)·b·chip, so that over N teeth

        F_k = −(N/π)∫ u(φ)·h(φ)·e^(−jkNφ) dφ   over the arc of cut, h the chip as `Chip` weighs it,

    half of that for k = 0, the mean (the series of the milling force: Altintas, Manufacturing Automation, 2nd ed.,
    2012). At time 0 tooth 0 stands at φ = 0. A vibration that repeats with the tooth cuts the same chip,
    q(t) = q(t − τ), so the regenerative part of the force is nothing. Needs a ``feed``.
    """
    N, arc = cutting.cuts_per_revolution, cutting.exit_angle - cutting.entry_angle
    x, w = np.polynomial.legendre.leggauss(_POINTS + 4 * int(np.ceil((1 + np.max(harmonics)) * N * arc / (2 * np.pi))))
    angle, weight = cutting.entry_angle + arc * (x + 1) / 2, w * arc / 2
    push, _ = cutting.tooth(angle)
    assert cutting.feed is not None
    chip = Chip(cutting.feed, cutting.exponent).force(cutting.feed * np.sin(angle))
    f = -push[:, ["xy".index(axis) for axis in axes]] * (chip * weight)[:, None]
    share = np.where(harmonics > 0, 1.0, 0.5)[:, None]
    return np.asarray(N / np.pi * share * (np.exp(-1j * N * harmonics[:, None] * angle) @ f))
