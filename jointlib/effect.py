"""The contract of an effect that a joint model may lack."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import JointLaw


@dataclass(frozen=True)
class Scale:
    """Size of the motion in the fit records; candidates place their thresholds relative to it."""

    displacement: float
    """Peak abs(z) in m."""
    velocity: float
    """Root mean square of ż in m/s."""
    stiffness: float
    """Tangent stiffness of the baseline joint at rest, N/m (0 if it has none)."""


@dataclass(frozen=True)
class Path:
    """Relative motion across the joint, sampled evenly; one-dimensional arrays."""

    displacement: Array
    """z in m."""
    velocity: Array
    """ż in m/s."""
    time_step: float
    """s."""


class JointEffect(ABC):
    """A family of restoring forces with linear coefficients and, where it has them, nonlinear shape parameters.

    The joint force gains Σ coefficients[k] · f_k(z, ż; shape), f_k being laws with unit coefficients: what a
    candidate is judged by is the law that the machine and the FMU will use. Ours are stateless singletons in all
    but name: they are constructed without arguments.
    """

    family: ClassVar[str]
    member: ClassVar[str]
    """The kind of law the effect adds; differs from the family where several laws form one."""
    leads: ClassVar[bool] = True
    """False for a member of a family that is tried only where the first members come near the best candidate."""
    words: ClassVar[str] = ""
    """The effect in a sentence that begins "The joint lacks"; without it the family is said."""
    look_alikes: ClassVar[Mapping[str, str]] = {}
    """Families with a similar signature, each with the experiment that separates them."""
    declared_pairs: ClassVar[frozenset[str]] = frozenset()
    """Look-alikes that ordinary records can hardly tell apart."""

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        """Grid of shape parameters to try, SI; one empty mapping where there is none, nothing where not applicable."""
        return ({},)

    def reached(self, shape: Mapping[str, float], scale: Scale) -> bool:
        """Whether a motion of this size shows what tells the effect from simpler ones; a slider has to slip."""
        return True

    @abstractmethod
    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        """Force along the path for each coefficient being 1, shape (number of coefficients, number of samples)."""

    @abstractmethod
    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        """The joint with the effect; None where the coefficients are not physical (the sign rule)."""

    def shows(self, joint: Joint) -> bool:
        """Whether a joint that was refitted with the effect still has what the effect is named for."""
        return True


def forces(path: Path, *laws: JointLaw) -> Array:
    """The force of each law along a path, one row a law."""
    rows = [Joint((law,)).force_along(path.displacement, path.velocity, path.time_step) for law in laws]
    return rows[0][None] if len(rows) == 1 else np.array(rows)
