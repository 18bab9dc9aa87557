"""Turning at an amplitude by collocation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.errors import CheckFailed

from ...model.machine import Machine
from ...tool.machine_model import machine_model
from ...tool.tool_model import ToolModel
from ..loops.collocation import FINER, MORE, arc_map
from ..loops.critical_depth import near
from ..loops.loop_branches import Crossing
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from ..rest.periodic import NOTES
from .chattering_tool import chattering_point
from .milling_at_amplitude import HELD

_RAISES = 8
_GUARD = 1e-6


def collocated_turning(
    machine: Machine, cutting: Cutting, chart: StabilityLobes, amplitude: float = 0.0
) -> StabilityLobes:
    """Turning chart by collocation with the joints held at each speed as a ``chart`` by the closed form leaves them."""
    cutting.refuse_unlike("collocation with joints held speed by speed")
    depth, frequency = chart.depth.ravel().copy(), chart.chatter_frequency.ravel().copy()
    for i, (rpm, f) in enumerate(zip(chart.speed.ravel().tolist(), frequency.tolist(), strict=True)):
        if not np.isfinite(f):
            continue
        model, turns = turned_tool(machine, cutting, f, amplitude), 60 * f / rpm
        share = cutting.rotation[0][["xy".index(axis) for axis in model.axes]]
        value = complex(cutting.mean_stiffness[0, 0] * (share @ model(np.array([f]))[0] @ share))
        nu = turns % 1
        start = Crossing(float(depth[i]), min(nu, 1 - nu), value if nu < 0.5 else value.conjugate())
        settled = _resolved(model, cutting, rpm, start)
        depth[i] = settled.depth
        frequency[i] = rpm / 60 * (np.floor(turns) + (settled.fraction if nu < 0.5 else 1 - settled.fraction))
    lowest = int(np.argmin(depth))
    return replace(
        chart,
        method="collocation",
        depth=depth.reshape(chart.depth.shape),
        chatter_frequency=frequency.reshape(chart.depth.shape),
        minimum_depth=float(depth[lowest]),
        minimum_frequency=float(frequency[lowest]),
        minimum_phase=float(60 * frequency[lowest] / chart.speed.ravel()[lowest] % 1),
        branches=(),
        notes=NOTES,
        warnings=(*chart.warnings, HELD),
    )


def turned_tool(machine: Machine, cutting: Cutting, frequency: float, amplitude: float) -> ToolModel:
    """Modes of the tool point with the joints as they are at a chatter frequency (Hz) and an amplitude (m)."""
    gain = chattering_point(machine, cutting, frequency, amplitude)[0].gain[0]
    return machine_model(machine, frequency, gain)


def _resolved(model: ToolModel, cutting: Cutting, rpm: float, crossing: Crossing) -> Crossing:
    """The crossing near a given one, with nodes enough that four more change nothing."""
    before = near(arc_map(model, cutting, rpm), crossing)
    for raised in range(1, _RAISES):
        after = near(arc_map(model, cutting, rpm, MORE + FINER * raised), crossing)
        if after.kind and abs(after.depth / before.depth - 1) <= _GUARD:
            return after
        before = after
    raise CheckFailed(
        f"collocation: at {rpm:g} rpm the depth still changes with the number of nodes; use the method turning"
    )
