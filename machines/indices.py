"""Index and mask arrays, beside the two array types of the numerical heart."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Index: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]
Reasons: TypeAlias = NDArray[np.object_]
"""An `Outcome` per entry."""

__all__ = ["Index", "Mask", "Reasons"]
