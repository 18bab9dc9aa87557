"""Floquet multipliers at some depths of a tool of many modes, by those that matter there."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed

from ...tool.bounded_band import shape
from ...tool.tool_model import ToolModel
from ...tool.tool_point import ToolPoint
from ..loops.characteristic import decided
from ..loops.collocation import MOST_NODES, node_count
from ..loops.harmonic_crossing import GAIN
from ..loops.multi_frequency import stiffest_direction
from ..process.cutting import Cutting
from .pattern_multipliers import largest_multipliers

_RAISES, _FURTHER = 6, 1.4
_SETTLED = 1e-5


def settled_multipliers(model: ToolModel, cutting: Cutting, speed: Array, depth: Array) -> Array:
    """`largest_multipliers` at every speed (rpm) and depth (m), shape (speeds, depths), of any number of modes.

    Where the fastest mode asks for more nodes than there may be, those above the last line on which the deepest cut
    could feed a vibration act together (`ToolModel.up_to`), and that line is raised until it changes no multiplier by
    more than 10⁻⁵ of itself (of 1 where it is smaller). What still changes is told to the digits that are known where
    they say on which side of 1 it is; else `CheckFailed`.
    """
    slowest = float(np.min(speed))
    if node_count(model, cutting, slowest) <= MOST_NODES:
        return largest_multipliers(model, cutting, speed, depth)
    axes = tuple("xy".index(axis) for axis in model.axes)
    milled = cutting.process == "milling"
    stiffest = stiffest_direction(cutting, axes) if milled else abs(float(cutting.mean_stiffness[0, 0]))
    level = GAIN / (2 * stiffest * float(np.max(depth)))
    seen = shape(ToolPoint(model, model.lines, model.axes, sampled=False))
    highest, sizes = max(seen.reaching(level), float(seen.lines[np.argmax(seen.size)])), list[Array]()
    for _ in range(_RAISES):
        found = largest_multipliers(model.up_to(highest), cutting, speed, depth)
        if sizes and np.all(np.abs(found - sizes[-1]) <= _SETTLED * np.maximum(found, 1)):
            return found
        sizes.append(found)
        highest *= _FURTHER
    if (sure := decided(sizes)) is not None:
        return sure
    raise CheckFailed(
        f"collocation: at {slowest:g} rpm the growth of a vibration still changes with the modes that are kept"
    )
