"""A preload that is not the one the guide was identified with."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide


class PreloadChange(JointEffect):
    """P0 → factor·P0 of a Hertz guide: like a cubic with a fifth power, and a knee at lift-off."""

    family: ClassVar[str] = "preload"
    member: ClassVar[str] = "hertz-guide"
    words: ClassVar[str] = "a preload other than the assumed one"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "cubic": "Drive the guide to at least 0.8 of lift-off, or load it statically past lift-off.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"cubic"})

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        if not any(isinstance(law, HertzGuide) for law in joint.laws):
            return ()
        return tuple({"factor": f} for f in (0.3, 0.5, 0.7, 0.85, 1.2, 1.5, 2.0))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        """The guides at the new preload less the guides at the old one, kappa held."""
        before = forces(path, *(law for law in joint.laws if isinstance(law, HertzGuide)))
        after = forces(path, *(law for law in _scaled(joint, shape["factor"]).laws if isinstance(law, HertzGuide)))
        return np.asarray((after - before).sum(axis=0, keepdims=True))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        """The part of the change that the coefficient asks for, as a preload; a refit makes it exact."""
        factor = 1 + float(coefficients[0]) * (shape["factor"] - 1)
        return _scaled(joint, factor) if 0.05 < factor < 20 else None


def _scaled(joint: Joint, factor: float) -> Joint:
    laws = tuple(
        dataclasses.replace(law, preload=law.preload * factor) if isinstance(law, HertzGuide) else law
        for law in joint.laws
    )
    return dataclasses.replace(joint, laws=laws, covariance=None)
