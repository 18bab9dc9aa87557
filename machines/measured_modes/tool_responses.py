"""The receptance of a tool whose machine has parts that are known by their receptance only, to fit modes to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.errors import InputError
from jointlib.modal_fit.responses import Responses

from ..components.measured import Measured
from ..model.machine import Machine
from ..operating.operating_point import frozen_receptance
from ..uncertainty.drawn_machines import sampled_value

_SAMPLES = 16
_FLOOR = 1e-3
"""Least deviation, as a share of a receptance: what interpolation and a model are worth."""


def tool_responses(machine: Machine, amplitude: float = 0.0) -> Responses:
    """Receptances between the directions of the tool on the lines of a measured part, joints as at an amplitude (m).

    Deviations are the scatter of so many machines whose measured parts vary within their variance, and a thousandth of
    the receptance at least.

    Raises
    ------
    InputError
        Where there is no tool, or no measured part that has lines.
    """
    parts = [part for part in machine.components if isinstance(part, Measured)]
    if not machine.tool or not parts:
        raise InputError(f"{machine.where}: no tool and no measured part, expected both to fit modes at the tool")
    low, high = max(part.band[0] for part in parts), min(part.band[1] for part in parts)
    if machine.frequency is not None:
        low, high = max(low, machine.frequency[0]), min(high, machine.frequency[1])
    finest = max(parts, key=lambda part: len(part.frequency))
    lines = finest.frequency[(finest.frequency >= low) & (finest.frequency <= high)]
    if len(lines) < 2:
        raise InputError(f"{machine.where}: its measured parts have no lines in common, expected the same band")
    H = frozen_receptance(machine, lines, amplitude).receptance
    drawn = np.array([frozen_receptance(one, lines, amplitude).receptance for one in _drawn(machine, parts)])
    scatter = np.sqrt(np.mean(np.abs(drawn - H) ** 2, axis=0)) if len(drawn) else np.zeros(H.shape)
    deviation = np.maximum(scatter, _FLOOR * np.max(np.abs(H), axis=(1, 2), keepdims=True))
    axes = machine.tool_axes
    pairs = tuple((o, i) for o in range(len(axes)) for i in range(len(axes)) if o >= i)
    kept = [pair for pair in pairs if pair[0] == pair[1] or np.max(np.abs(H[:, *pair])) > _FLOOR * np.max(np.abs(H))]
    return Responses(
        lines,
        np.array([H[:, o, i] for o, i in kept]),
        np.array([deviation[:, o, i] for o, i in kept]),
        tuple(kept),
        axes,
    )


def _drawn(machine: Machine, parts: Sequence[Measured]) -> list[Machine]:
    """The machine with its measured parts drawn from their variance; none where they have none."""
    if all(part.variance is None for part in parts):
        return []
    varied = {part.name: sampled_value(part, _SAMPLES) for part in parts}
    each = [[varied[c.name][k] if c.name in varied else c for c in machine.components] for k in range(_SAMPLES)]
    return [replace(machine, components=tuple(components)) for components in each]
