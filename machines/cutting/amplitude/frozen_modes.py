"""Collocation of a machine: its joints frozen into springs and dampers, speed by speed."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError

from ...model.machine import Machine
from ...model.spindle_speed import at_speed, depends_on_speed
from ...tool.chatter_band import chatter_band, modes_at_rest
from ...tool.machine_model import OpenJoints, machine_model
from ...tool.tool_model import ToolModel
from ..cutters.settled_multipliers import settled_multipliers
from ..process.cutting import Cutting
from .chattering_tool import wide_receptance
from .collocated_turning import turned_tool
from .frozen_lobes import lobes_at_amplitude
from .milling_at_amplitude import developed_chatter

_RAISES = 8
_GUARD = 1e-6


def tool_models(machine: Machine, cutting: Cutting, speed: Array, amplitude: float) -> list[ToolModel]:
    """Modes of the tool point at every speed (rpm), while it vibrates with ``amplitude`` (m): one if all are the same.

    They are at rest, where the joints are springs and dampers. Otherwise K = Re G and C = Im G/ω are taken at the
    chatter frequency of the chart at that amplitude, in milling that of `DevelopedChatter`.
    """
    if depends_on_speed(machine):
        return [_at_one(at_speed(machine, rpm), cutting, np.array([rpm]), amplitude)[0] for rpm in speed.tolist()]
    return _at_one(machine, cutting, speed, amplitude)


def _at_one(machine: Machine, cutting: Cutting, speed: Array, amplitude: float) -> list[ToolModel]:
    """`tool_models` of a machine that is one at these speeds."""
    exact = modes_at_rest(machine) if amplitude == 0 else None
    if exact is not None:
        return [exact]
    rest = machine_model(machine, chatter_band(machine).middle)  # refuses a machine without modes at once
    if cutting.process == "milling":
        chatter = developed_chatter(
            machine, cutting, amplitude, wide_receptance(machine, amplitude), "collocation", True
        )
        found = list(chatter.persistent(speed.tolist()))
        tooth = cutting.cuts_per_revolution * speed / 60
        opened = OpenJoints.of(machine)
        return [
            rest if one.gain is None else opened.models(one.gain[None], one.line * each)[0]
            for one, each in zip(found, tooth.tolist(), strict=True)
        ]
    lines = lobes_at_amplitude(machine, speed, amplitude, "turning").chatter_frequency
    return [turned_tool(machine, cutting, f, amplitude) if np.isfinite(f) else rest for f in lines.tolist()]


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
        return settled_multipliers(models[0], cutting, speeds, depths)
    parts = [
        settled_multipliers(model, cutting, np.array([rpm]), depths) for model, rpm in zip(models, speeds, strict=True)
    ]
    return np.concatenate(parts)
