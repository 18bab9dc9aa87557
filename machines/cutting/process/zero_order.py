"""Milling by the zero-order approximation: only the mean of the turning tooth forces is kept."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

from .cutting import Cutting

NOTES = (
    "Zero-order approximation: tooth forces are replaced by their mean, so flip lobes (period doubling) are absent.",
    "Not covered: helix, uneven tooth pitch, runout, process damping, axial and torsional motion, loss of contact.",
)
INTERRUPTED = (
    "There are moments without a tooth in the cut: flip lobes may lie far below the depths shown, by a factor of three "
    "at a tenth of the diameter. Check by a method that keeps the tooth frequency."
)


def loop_stiffness(cutting: Cutting, axes: tuple[str, ...]) -> Array:
    """Mean cutting stiffness D in N/m² on the directions that move; Altintas & Budak 1995, eqs for α."""
    if cutting.process != "milling":
        raise InputError(f"zero-order: the process is {cutting.process}, expected milling")
    rows = ["xy".index(axis) for axis in axes]
    return cutting.mean_stiffness[np.ix_(rows, rows)]


def warnings(cutting: Cutting) -> tuple[str, ...]:
    """What about this cut makes the approximation doubtful."""
    return (INTERRUPTED,) if cutting.interrupted else ()
