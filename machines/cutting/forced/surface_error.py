"""Surface location error: how far the finished wall stands from where it is set. Stable is not yet accurate.

A wall is what the tooth leaves where it touches it, at φ = 0 in up-milling and φ = π in down-milling: there the tool
stands off by its forced motion, in height z when the flute has come round by its lag (Schmitz & Smith, Machining
Dynamics, ch. 5). Of several flutes the one that reaches deepest leaves the wall.
"""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

from ..process.cutter import Cutter
from ..process.cutting import Cutting
from .forced_vibration import ForcedVibration

_HEIGHTS = 9


def surface_errors(cutting: Cutting, found: ForcedVibration) -> Array:
    """Errors in m of both walls, (cuts, 2, heights): of that at φ = 0 and of that at φ = π, nan where none is left.

    Above 0 where too much is cut away, below where material is left standing; over the depth from the tip upwards, one
    height for straight edges. The deflection by the mean force is in it where it is known (`ForcedVibration.mean`),
    and else nan.
    """
    cutter = Cutter.of(cutting, runout=True)
    n, k = cutter.patterns, np.arange(1, found.tool.shape[1] + 1)
    across = cutting.rotation[1][["xy".index(axis) for axis in found.axes]]
    motion, mean = found.tool @ across, found.mean @ across
    share = np.linspace(0.0, 1.0, _HEIGHTS if cutter.twisted else 1)
    height = found.depth[:, None] * share
    radius = np.zeros(len(cutter.flutes)) if cutting.runout is None else np.array(cutting.runout[: len(cutter.flutes)])
    radius = radius - (0.0 if cutting.runout is None else float(np.mean(cutting.runout)))
    walls = np.full((len(found.depth), 2, len(share)), np.nan)
    for i, (angle, sign, left) in enumerate(((0.0, 1.0, cutting.mode != "down"), (np.pi, -1.0, cutting.mode != "up"))):
        if not left:
            continue
        each = []
        for flute, out in zip(cutter.flutes, radius.tolist(), strict=True):
            turned = angle + flute.place + flute.lag * height
            wave = np.einsum("ck,chk->ch", motion, np.exp(1j * n * turned[..., None] * k)).real
            each.append(sign * (mean[:, None] + wave) + out)
        walls[:, i] = np.max(each, axis=0)
    return walls


def worst_error(walls: Array) -> Array:
    """The error farthest from 0 on either wall and at any height, with its sign, (cuts,); nan where none is known."""
    flat = walls.reshape(len(walls), -1)
    at = np.argmax(np.where(np.isnan(flat), -1.0, np.abs(flat)), axis=1)
    return np.asarray(flat[np.arange(len(flat)), at])
