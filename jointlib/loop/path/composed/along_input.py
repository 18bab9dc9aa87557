"""Effects that need an input along the path: what parameters of the joint follow, and how late."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.joint import Joint
from jointlib.loop.path.evidence import Evidence


class AlongInput(JointEffect):
    """An effect whose columns an evidence makes, as they hang on an input beside the motion."""

    unit: ClassVar[str]
    """SI, of what it sets."""

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        raise NotImplementedError("columns need the input along the path, see `along`")

    @abstractmethod
    def along(self, evidence: Evidence, shape: Mapping[str, float], joint: Joint) -> Array:
        """What each coefficient being 1 adds to the force, filtered and thinned, (coefficient, sample)."""

    @abstractmethod
    def sizes(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> dict[str, float]:
        """The parameters of the mended model that it sets in a joint that lacks it, by name, SI."""
