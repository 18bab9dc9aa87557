"""The curved spring of a preloaded guide, where the joint stands for the guide by a linear spring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.hertz_guide import HertzGuide

_ANGLE = np.pi / 4


class PreloadShape(JointEffect):
    """h(z, D) = [(D + z)₊^1.5 − (D − z)₊^1.5]/(3√D), slope 1 at rest, D the displacement at lift-off.

    h = z − z³/(24 D²) − …: below lift-off its series is odd like that of a cubic, and in the limit of a high preload
    it is one. So for D within the motion it is a Hertz guide that has lost contact; for D beyond, the change
    h(z, q D) − h(z, D) between two preloads, of either sign, to its leading power. Takes part only where the joint
    has no Hertz guide of its own.
    """

    family: ClassVar[str] = "preload"
    member: ClassVar[str] = "hertz-guide"
    words: ClassVar[str] = "the curved spring of a preloaded guide"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "cubic": "Drive the guide to at least 0.8 of lift-off, or load it statically past lift-off.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"cubic"})

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        if any(isinstance(law, HertzGuide) for law in joint.laws):
            return ()
        peak = scale.displacement
        return tuple({"lift_off": f * peak, "peak": peak} for f in (0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.4, 2.0, 4.0))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, _guide(1.0, shape["lift_off"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness, lift_off = float(coefficients[0]), shape["lift_off"]
        if stiffness > 0:
            return joint + _guide(stiffness, lift_off)
        return None if lift_off < shape["peak"] else joint + Cubic(-stiffness / (24 * lift_off**2))


def _guide(stiffness: float, lift_off: float) -> HertzGuide:
    """A guide of given stiffness at rest and lift-off: K0 = 6 sin φ P0/D and D = κ P0^(2/3)/sin φ."""
    preload = stiffness * lift_off / (6 * np.sin(_ANGLE))
    return HertzGuide(preload, lift_off * np.sin(_ANGLE) / np.cbrt(preload) ** 2, _ANGLE)
