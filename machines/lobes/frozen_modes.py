"""Collocation of a machine: its joints frozen into springs and dampers, speed by speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import CheckFailed, InputError

from ..machine import Machine
from .amplitude import chattering_point, lobes_at_amplitude, wide_receptance
from .chart import StabilityLobes
from .chatter_band import chatter_band, modes_at_rest
from .collocation import FINER, MORE, arc_map
from .critical_depth import near
from .cutting import Cutting
from .developed_lobes import HELD, developed_chatter
from .loop_branches import Crossing
from .machine_model import OpenJoints, machine_model
from .multipliers import largest_multipliers
from .periodic import NOTES
from .tool_model import ToolModel

_RAISES = 8
_GUARD = 1e-6


def tool_models(machine: Machine, cutting: Cutting, speed: Array, amplitude: float) -> list[ToolModel]:
    """Modes of the tool point at every speed (rpm), while it vibrates with ``amplitude`` (m): one if all are the same.

    They are at rest, where the joints are springs and dampers. Otherwise K = Re G and C = Im G/ω are taken at the
    chatter frequency of the chart at that amplitude, in milling that of `DevelopedChatter`.
    """
    exact = modes_at_rest(machine) if amplitude == 0 else None
    if exact is not None:
        return [exact]
    rest = machine_model(machine, chatter_band(machine).middle)  # refuses a machine without modes at once
    if cutting.process == "milling":
        chatter = developed_chatter(
            machine, cutting, amplitude, wide_receptance(machine, amplitude), "collocation", True
        )
        found = [chatter.persistent(rpm) for rpm in speed.tolist()]
        tooth = cutting.cuts_per_revolution * speed / 60
        opened = OpenJoints.of(machine)
        return [
            rest if one.gain is None else opened.models(one.gain[None], one.line * each)[0]
            for one, each in zip(found, tooth.tolist(), strict=True)
        ]
    lines = lobes_at_amplitude(machine, speed, amplitude, "turning").chatter_frequency
    return [_turned(machine, cutting, f, amplitude) if np.isfinite(f) else rest for f in lines.tolist()]


def _turned(machine: Machine, cutting: Cutting, frequency: float, amplitude: float) -> ToolModel:
    gain = chattering_point(machine, cutting, frequency, amplitude)[0].gain[0]
    return machine_model(machine, frequency, gain)


def collocated_turning(machine: Machine, cutting: Cutting, speed: ArrayLike, amplitude: float = 0.0) -> StabilityLobes:
    """Turning chart by collocation with the joints held at each speed as the closed form leaves them."""
    chart = lobes_at_amplitude(machine, speed, amplitude, "turning")
    depth, frequency = chart.depth.ravel().copy(), chart.chatter_frequency.ravel().copy()
    for i, (rpm, f) in enumerate(zip(chart.speed.ravel().tolist(), frequency.tolist(), strict=True)):
        if not np.isfinite(f):
            continue
        model, turns = _turned(machine, cutting, f, amplitude), 60 * f / rpm
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


def multipliers(machine: Machine, speed: ArrayLike, depth: ArrayLike, amplitude: float = 0.0) -> Array:
    """Largest size |μ| of a Floquet multiplier at every speed (rpm) and depth (m), shape (speeds, depths).

    A vibration about the amplitude (m) grows by |μ| from one tooth period (revolution in turning) to the next; below 1
    the cut is stable. By collocation of `tool_models`.
    """
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
    cutting = Cutting(**machine.cutting)
    speeds, depths = np.atleast_1d(np.asarray(speed, dtype=float)), np.atleast_1d(np.asarray(depth, dtype=float))
    for name, values in (("spindle speeds", speeds), ("depths", depths)):
        if not np.all(np.isfinite(values) & (values > 0)):
            raise InputError(f"lobes: {name} must be finite and positive")
    models = tool_models(machine, cutting, speeds, amplitude)
    if len(models) == 1:
        return largest_multipliers(models[0], cutting, speeds, depths)
    parts = [
        largest_multipliers(model, cutting, np.array([rpm]), depths) for model, rpm in zip(models, speeds, strict=True)
    ]
    return np.concatenate(parts)
