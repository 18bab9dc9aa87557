"""Damping whose loss per cycle does not depend on the frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale
from jointlib.joint import Joint
from jointlib.laws.structural_damping import StructuralDamping

_REFERENCE = 1000.0
"""Hz; any would do, since a spring beside it takes up the difference."""


class MaterialDamping(JointEffect):
    """Quadrature flat in ω; along a whole period of a steady state only, where z has a spectrum.

    Tried as it stands in textbooks, j·loss_stiffness·z, and in its causal form, whose spring stiffens with frequency.
    Around the corner frequency of a single relaxation its loss is level too, and its spring stiffens alike: within an
    octave or two the causal form and a relaxation are a declared pair.
    """

    family: ClassVar[str] = "structural-damping"
    member: ClassVar[str] = "structural-damping"
    words: ClassVar[str] = "damping that does not depend on frequency (structural)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "viscous": "Drive over at least one octave: viscous loss grows with frequency, structural loss does not.",
        "relaxation": "Drive over two decades: the loss of one relaxation peaks, structural loss stays level.",
        "delay": "Record P as well and swap cables: a delay of a channel shows in the balance, damping does not.",
        "coulomb": "Repeat at three or more levels: friction loses weight, structural damping keeps it.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"relaxation"})

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple({"reference_frequency": f} for f in (0.0, _REFERENCE))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        n = len(path.displacement)
        law = StructuralDamping(1.0, shape["reference_frequency"])
        gain = law.describing_function(1.0, 2 * np.pi * np.fft.rfftfreq(n, path.time_step))
        return np.asarray(np.fft.irfft(gain * np.fft.rfft(path.displacement), n))[None]

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        loss = float(coefficients[0])
        return joint + StructuralDamping(loss, shape["reference_frequency"]) if loss > 0 else None
