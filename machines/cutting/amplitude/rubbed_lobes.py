"""Limits at an amplitude of an edge whose flank has a shape: it damps by how long and how high its waves are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from jointlib.arrays import Array, ArrayLike

from ...model.machine import Machine
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from ..process.flank import flank_damping

EQUAL = (
    "The flank is taken as the damper that takes the same energy from a vibration of that amplitude; what its land "
    "adds in stiffness for short waves is left out."
)
_ROUNDS, _AGREE = 25, 1e-3


def rubbed_lobes(
    machine: Machine, speed: ArrayLike, amplitude: float, chart: Callable[[Machine, Array], StabilityLobes]
) -> StabilityLobes:
    """The ``chart`` at an amplitude (m) with the damping of the flank that chatter of its frequency meets, by speed.

    Damping and chatter frequency are made to agree at each speed in rpm; where they do not, that is said.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    whole = np.asarray(speed, dtype=float)
    bare = dict.fromkeys(("indentation", "wear_land", "clearance"))
    found, lost = list[StabilityLobes](), 0
    for rpm in whole.ravel().tolist():
        damping, hertz = cutting.process_damping or 0.0, np.nan
        for _ in range(_ROUNDS):
            with_flank = replace(machine, cutting={**(machine.cutting or {}), **bare, "process_damping": damping})
            one = chart(with_flank, np.array([rpm]))
            hertz = float(one.chatter_frequency[0]) if np.isfinite(one.depth[0]) else hertz
            felt = flank_damping(cutting, amplitude, hertz, rpm)
            if abs(felt - damping) <= _AGREE * damping:
                break
            damping = (felt + damping) / 2
        else:
            lost += 1
        found.append(one)
    least = min(found, key=lambda one: one.minimum_depth)
    keys = ("depth", "chatter_frequency", "kind", "lobe")
    joined: dict[str, Any] = {
        key: np.concatenate([getattr(one, key) for one in found]).reshape(whole.shape) for key in keys
    }
    said = [*dict.fromkeys(text for one in found for text in one.warnings), EQUAL]
    if lost:
        said.append(f"At {lost} of {len(found)} speeds the flank's damping and the chatter that meets it do not agree.")
    return replace(least, speed=whole, branches=(), warnings=tuple(said), **joined)
