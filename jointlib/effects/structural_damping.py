"""Damping whose loss per cycle does not depend on the frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.joint import Joint
from jointlib.laws.structural_damping import StructuralDamping


class MaterialDamping(JointEffect):
    """j·loss_stiffness·z: quadrature flat in ω; along a whole period of a steady state only, where z has a spectrum."""

    family: ClassVar[str] = "structural-damping"
    member: ClassVar[str] = "structural-damping"
    words: ClassVar[str] = "damping that does not depend on frequency (structural)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "viscous": "Drive over at least one octave: viscous loss grows with frequency, structural loss does not.",
        "delay": "Record P as well and swap cables: a delay of a channel shows in the balance, damping does not.",
        "coulomb": "Repeat at three or more levels: friction loses weight, structural damping keeps it.",
    }

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        spectrum = 1j * np.fft.rfft(path.displacement)
        return np.fft.irfft(spectrum, len(path.displacement))[None]

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        loss = float(coefficients[0])
        return joint + StructuralDamping(loss) if loss > 0 else None
