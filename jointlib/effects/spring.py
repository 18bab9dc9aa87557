"""A spring that a joint lacks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.law import memoryless
from jointlib.laws.linear import Linear


class MissingSpring(JointEffect):
    """f = stiffness·z, where no law of the joint answers a displacement that is held.

    A return spring, a bellows or a cable chain beside a joint of friction and damping alone. Falling forces are
    springs too: the weight of a chain that an axis lays down.
    """

    family: ClassVar[str] = "linear"
    member: ClassVar[str] = "linear"
    words: ClassVar[str] = "a force in proportion to the displacement (linear spring)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "missing-mass": "Repeat at two speeds: inertia grows with their square, a spring does not.",
        "lag": "Hold still off the middle: a spring goes on pulling, a late force comes to rest.",
        "relaxation": "Hold still off the middle: a spring goes on pulling, what relaxes gives way.",
        "hysteresis": "Move farther: a contact slips, a spring pulls harder.",
        "preload": "Move farther, or load it statically past lift-off: a straight spring stays straight.",
        "contact-loss": "Move farther to both sides: a lost contact shows a knee.",
        "cubic": "Repeat at three or more levels: a straight spring is the same at all of them.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        held = scale.displacement * np.linspace(-1.0, 1.0, 9)
        springs = (law for law in joint.laws if not law.states)
        return () if any(np.ptp(memoryless(law, held, 0.0 * held)) > 0 for law in springs) else ({},)

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Linear(1.0))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        return joint + Linear(float(coefficients[0]))
