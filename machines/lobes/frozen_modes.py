"""Collocation of a machine: its joints frozen into springs and dampers, speed by speed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError

from ..machine import Machine
from .amplitude import _point, lobes_at_amplitude
from .chart import StabilityLobes
from .cutting import Cutting
from .machine_model import machine_model, modes_at_rest
from .multipliers import largest_multipliers
from .solve import stability_lobes
from .tool_model import ToolModel

HELD = (
    "Joints are held, at every speed, as the springs and dampers that they are at this amplitude and the frequency of "
    "the chatter there."
)


def tool_models(machine: Machine, cutting: Cutting, speed: Array, amplitude: float) -> list[ToolModel]:
    """Modes of the tool point at every speed (rpm), while it vibrates with ``amplitude`` (m): one if all are the same.

    They are at rest, where the joints are springs and dampers. Otherwise K = Re G and C = Im G/ω are taken at the
    chatter frequency that the multi-frequency method (in turning, the closed form) finds.
    """
    exact = modes_at_rest(machine) if amplitude == 0 else None
    if exact is not None:
        return [exact]
    if machine.frequency is None:
        raise InputError(f"{machine.where}: no frequency in [response], lobes need the band to search for chatter")
    middle = float(np.mean(machine.frequency))
    machine_model(machine, middle)  # refuses a machine without modes at once
    chatter = lobes_at_amplitude(machine, speed, amplitude).chatter_frequency
    found = []
    for f in np.where(np.isfinite(chatter), chatter, middle).tolist():
        joints = _point(machine, cutting, np.array([f]), amplitude).joint_amplitude[0]
        found.append(machine_model(machine, f, joints))
    return found


def collocated_lobes(machine: Machine, cutting: Cutting, speed: ArrayLike, amplitude: float = 0.0) -> StabilityLobes:
    """Stability lobes by collocation, of `tool_models`."""
    speeds = np.asarray(speed, dtype=float)
    if amplitude == 0 and (exact := modes_at_rest(machine)) is not None:
        return stability_lobes(exact, cutting, speeds, "collocation")
    models = tool_models(machine, cutting, speeds.ravel(), amplitude)
    charts = [
        stability_lobes(model, cutting, rpm, "collocation") for model, rpm in zip(models, speeds.ravel(), strict=True)
    ]

    def joined(key: str) -> Any:
        return np.array([getattr(chart, key) for chart in charts]).reshape(speeds.shape)

    return replace(
        min(charts, key=lambda chart: chart.minimum_depth),
        speed=speeds,
        depth=joined("depth"),
        chatter_frequency=joined("chatter_frequency"),
        kind=joined("kind"),
        lobe=joined("lobe"),
        warnings=(*dict.fromkeys(w for chart in charts for w in chart.warnings), HELD),
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
