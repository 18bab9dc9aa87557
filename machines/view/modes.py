"""Mode shapes to look at: those that the tool feels, low ones first."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..model.machine import Machine
from ..modes.natural_modes import NaturalModes, natural_modes
from .mode_shape import Mode
from .scene import Scene

_MOST = 16
_FELT = 0.01
"""Least peak compliance of the tool in a mode over that in the mode that the tool feels most."""


def modes_of(machine: Machine, drawn: Scene, also: Collection[int] = ()) -> tuple[tuple[Mode, ...], str]:
    """The mode shapes to be shown, joints at rest, or a sentence why there are none.

    Raises
    ------
    InputError
        Where a mode is asked for by its number, from 1 on in ascending frequency, that is not known.
    """
    try:
        found = natural_modes(machine)
    except InputError as error:
        if also:
            raise
        return (), f"Its modes are not shown. {error}."
    count = len(found.frequency)
    for number in also:
        if number > count:
            raise InputError(f"{machine.where}: mode {number}, expected 1 to {count}, in ascending frequency")
    return shown_modes(drawn, found, also), ""


def shown_modes(scene: Scene, found: NaturalModes, also: Collection[int] = ()) -> tuple[Mode, ...]:
    """The modes that the tool feels most, and those whose numbers are asked for, low ones first."""
    felt = peak_share(found)
    chosen = np.argsort(-felt, kind="stable")[:_MOST]
    chosen = chosen[felt[chosen] >= _FELT] if np.any(felt > 0) else np.arange(len(felt))[:_MOST]
    numbers = sorted({*(int(i) for i in chosen), *(number - 1 for number in also)})
    moved = scene.moves(found.shapes[:, numbers])
    return tuple(
        Mode(i + 1, float(found.frequency[i]), float(found.damping_ratio[i]), _scaled(scene, one), float(felt[i]))
        for i, one in zip(numbers, moved, strict=True)
    )


def peak_share(found: NaturalModes) -> Array:
    """Peak compliance of the tool in every mode, φ²/(2 |s| |Re s|), over the largest of all; 0 without a tool."""
    tool = np.max(np.abs(found.tool) ** 2, axis=0, initial=0.0)
    decay = np.maximum(np.abs(found.pole.real), 1e-6 * np.abs(found.pole))
    peak = tool / (2 * np.abs(found.pole) * decay)
    return np.asarray(peak / max(np.max(peak, initial=0.0), 1e-300))


def _scaled(scene: Scene, moved: ComplexArray) -> ComplexArray:
    corners, frame = scene.corners
    every = scene.displaced(corners, frame, moved)
    largest = every.ravel()[int(np.argmax(np.abs(every)))]
    return np.asarray(moved / largest) if abs(largest) > 0 else moved
