"""The depth below which no vibration lasts at any speed, in turning."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.system.processes import on_every_core

from ...deadline import in_time
from ...model.machine import Machine
from ...operating.operating_point import OperatingPoint
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from ..process.power_law import touching_ratio
from .chattering_tool import known_tool
from .frozen_lobes import frozen_lobes


def least_depth(machine: Machine, chart: StabilityLobes, amplitude: Array) -> tuple[float, float]:
    """Depth in m below which no vibration lasts at any speed in turning, and up to which amplitude in m that is known.

    The least over every speed of the ``chart`` at rest and of the machine at each amplitude (m, ascending).
    """
    return _least(machine, chart, amplitude, everywhere=True)


def least_depth_at(machine: Machine, chart: StabilityLobes, amplitude: Array) -> tuple[float, float]:
    """`least_depth` at the speeds of the ``chart`` alone, whose minimum is that at rest."""
    return _least(machine, chart, amplitude, everywhere=False)


def _least(machine: Machine, chart: StabilityLobes, amplitude: Array, everywhere: bool) -> tuple[float, float]:
    """A cut whose force grows with a power q < 1 of the chip is weakest where the edge just leaves it, see
    `touching_ratio`.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    bent = min(1.0, touching_ratio(cutting.exponent)) if cutting.feed is not None else 1.0
    least, known = chart.minimum_depth, 0.0

    def at(size: float) -> tuple[StabilityLobes, bool, OperatingPoint | None]:
        in_time()
        layer, held = frozen_lobes(machine, chart.speed, size, chart.method, deepest=chart.minimum_depth)
        return layer, bool(np.any(held)), known_tool(machine, cutting, size).point

    sizes = amplitude.tolist()
    for size, (layer, held, point) in zip(sizes, on_every_core(at, sizes, len(sizes)), strict=True):
        known_tool(machine, cutting, size).point = point
        if held:
            break
        least, known = min(least, layer.minimum_depth if everywhere else float(np.min(layer.depth))), size
    return (least * bent, known) if known else (np.inf, 0.0)
