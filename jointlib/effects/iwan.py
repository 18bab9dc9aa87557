"""Hysteresis: contacts that slip one after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins

SLIDERS = 4
_NEGATIVE = 0.05
"""A slider that the fit makes negative by less than this share of all is left out; more than that is no Iwan model."""


class GradualSlip(JointEffect):
    """Iwan model of four sliders; shapes are the smallest slip distance and the factor from one to the next."""

    family: ClassVar[str] = "hysteresis"
    leads: ClassVar[bool] = False
    member: ClassVar[str] = "iwan"
    words: ClassVar[str] = "contacts that slip one after the other (hysteresis)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Move less than the slip distance: stuck contacts are elastic.",
        "gap": "Run a slow loop: slip encloses an area, play does not.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple(
            {"slip_distance": d * scale.displacement, "spread": s} for d in (0.01, 0.03, 0.1) for s in (1.8, 2.5, 4.0)
        )

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, *(Jenkins(1.0, d) for d in _distances(shape)))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        total = float(np.sum(coefficients))
        if total <= 0 or np.min(coefficients) < -_NEGATIVE * total:
            return None
        sliders = [(float(k), float(k) * d) for k, d in zip(coefficients, _distances(shape), strict=True) if k > 0]
        return joint + Iwan(tuple(k for k, _ in sliders), tuple(F for _, F in sliders))


def _distances(shape: Mapping[str, float]) -> list[float]:
    """Slip distance of each slider, m."""
    return [shape["slip_distance"] * shape["spread"] ** i for i in range(SLIDERS)]
