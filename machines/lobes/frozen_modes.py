"""Collocation of a machine: its joints frozen into springs and dampers, speed by speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError

from ..machine import Machine
from .amplitude import _point, lobes_at_amplitude
from .chart import StabilityLobes
from .collocation import largest_multipliers
from .cutting import Cutting
from .machine_model import machine_model, modes_at_rest
from .solve import stability_lobes
from .tool_model import ToolModel

HELD = (
    "Joints are held, at every speed, as the springs and dampers that they are at this amplitude and the frequency of "
    "the chatter there."
)


def tool_models(machine: Machine, cutting: Cutting, speed: Array, amplitude: float) -> list[ToolModel]:
    """Modes of the tool point at every speed (rpm), while it vibrates with ``amplitude`` (m).

    At rest they are the same at all speeds where the joints are springs and dampers. Otherwise K = Re G and C = Im G/ω
    are taken at the chatter frequency that the multi-frequency method (in turning, the closed form) finds.
    """
    exact = modes_at_rest(machine) if amplitude == 0 else None
    if exact is not None:
        return [exact] * len(speed)
    if machine.frequency is None:
        raise InputError(f"{machine.where}: no frequency in [response], lobes need the band to search for chatter")
    machine_model(machine, float(np.mean(machine.frequency)))  # a machine without modes is told before anything is computed
    chart = lobes_at_amplitude(machine, speed, amplitude)
    found = []
    for chatter in chart.chatter_frequency:
        f = float(chatter) if np.isfinite(chatter) else float(np.mean(machine.frequency))
        joints = _point(machine, cutting, np.array([f]), amplitude).joint_amplitude[0]
        found.append(machine_model(machine, f, joints))
    return found


def collocated_lobes(machine: Machine, cutting: Cutting, speed: ArrayLike, amplitude: float = 0.0) -> StabilityLobes:
    """Stability lobes by collocation, of `tool_models`."""
    speeds = np.asarray(speed, dtype=float)
    models = tool_models(machine, cutting, speeds.ravel(), amplitude)
    if all(model is models[0] for model in models):
        return stability_lobes(models[0], cutting, speeds, "collocation")
    charts = [
        stability_lobes(model, cutting, rpm, "collocation") for model, rpm in zip(models, speeds.ravel(), strict=True)
    ]
    lowest = min(charts, key=lambda chart: chart.minimum_depth)
    joined = {
        key: np.array([getattr(chart, key) for chart in charts]).reshape(speeds.shape)
        for key in ("depth", "chatter_frequency", "kind", "lobe")
    }
    warnings = tuple(dict.fromkeys(w for chart in charts for w in chart.warnings))
    return replace(lowest, speed=speeds, warnings=(*warnings, HELD), **joined)


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
    if all(model is models[0] for model in models):
        return largest_multipliers(models[0], cutting, speeds, depths)
    parts = [
        largest_multipliers(model, cutting, np.array([rpm]), depths) for model, rpm in zip(models, speeds, strict=True)
    ]
    return np.concatenate(parts)
