"""Limits of many tools at once, where the cut is the same at all times: turning, and zero order in milling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array

from ...indices import Index
from ...tool.plausible import refuse_undamped, sign_warnings
from ...tool.tool_model import ToolModel, ToolModels
from ...tool.tool_point import tool_point
from ..loops.crossing import first_crossings
from ..loops.regeneration import Loops, highest_between, lowest_depth, trace
from ..process import turning, zero_order
from ..process.cutting import Cutting
from .solve import stability_lobes

METHODS = ("turning", "zero-order")
_SPEEDS = 100
"""Over the range of a file, for the minimum where it differs from speed to speed."""


def preview(process: str) -> str:
    """The one of these methods that is for a process; of milling it is an approximation."""
    return "zero-order" if process == "milling" else "turning"


@dataclass(frozen=True, eq=False)
class Limits:
    """What `StabilityLobes` says of the depth, for every tool."""

    minimum_depth: Array
    """m, (tools,)."""
    depth: Array
    """m, (tools, speeds)."""


def limits(models: Sequence[ToolModel], cuttings: Sequence[Cutting], method: str, speed: Array) -> Limits:
    """Limits of tools that move along the same axes, each in its cut, as `stability_lobes` finds them one by one.

    ``speed`` in rpm, (tools, speeds); with no speeds only the minimum is computed.
    """
    several = ToolModels(models)
    _refuse_impossible(models, several)
    if not all(cutting.plain for cutting in cuttings):
        return _one_by_one(models, cuttings, method, speed)
    if method == "turning":
        stiffness = np.array([turning.loop_stiffness(cutting) for cutting in cuttings])
        several = ToolModels([m.along(cutting.rotation[0]) for m, cutting in zip(models, cuttings, strict=True)])
    else:
        stiffness = np.array([zero_order.loop_stiffness(cutting, several.axes) for cutting in cuttings])
    loops = Loops(several, stiffness, several.lines, several.tool)
    traced = trace(loops)
    depth = speed
    if speed.size:
        cuts = np.array([cutting.cuts_per_revolution for cutting in cuttings])
        depth = first_crossings(loops, traced, 60 / (cuts[:, None] * speed)).depth
    return Limits(lowest_depth(loops, traced).depth, depth)


def _one_by_one(models: Sequence[ToolModel], cuttings: Sequence[Cutting], method: str, speed: Array) -> Limits:
    """Where a cut has several delays or rubs, the minimum is that at the speeds, or at those of the file."""
    depth, lowest = np.full(speed.shape, np.inf), np.empty(len(models))
    for i, (model, cutting) in enumerate(zip(models, cuttings, strict=True)):
        some = speed[i] if speed.size else cutting.speeds(_SPEEDS)
        chart = stability_lobes(model, cutting, some, method)
        lowest[i] = chart.minimum_depth
        if speed.size:
            depth[i] = chart.depth
    return Limits(lowest, depth)


def static_compliance(models: Sequence[ToolModel]) -> Array:
    """Largest direct compliance of every tool in m/N, along its axes."""
    G = ToolModels(models)(np.zeros(len(models)), np.arange(len(models)))
    return np.asarray(np.max(np.abs(np.einsum("tii->ti", G)), axis=1))


def peak_receptance(models: Sequence[ToolModel]) -> Array:
    """Largest direct receptance of every tool in m/N, over frequency and its axes."""
    several = ToolModels(models)
    f, tool = several.lines, several.tool
    size = np.abs(np.einsum("fii->fi", several(f, tool)))
    ends = np.searchsorted(tool, np.arange(len(models) + 1))
    found = np.zeros(len(models))
    for axis, own in enumerate(size.T):
        row = np.array([first + np.argmax(own[first:last]) for first, last in pairwise(ends)])

        def direct(frequency: Array, which: Index, axis: int = axis) -> Array:
            return np.asarray(np.abs(several(frequency, which)[:, axis, axis]))

        low, high = f[np.maximum(row - 1, ends[:-1])], f[np.minimum(row + 1, ends[1:] - 1)]
        found = np.maximum(found, highest_between(direct, low, f[row], high, own[row])[1])
    return found


def _refuse_impossible(models: Sequence[ToolModel], several: ToolModels) -> None:
    """Raise for receptances that cannot be those of a tool, as `sign_warnings` does; none of those left out can be."""
    direct = np.einsum("fii->fi", several(several.lines, several.tool))
    ends = np.searchsorted(several.tool, np.arange(len(models) + 1))
    for i, model in enumerate(models):
        refuse_undamped(model)
        G = direct[ends[i] : ends[i + 1]]
        first = G[: max(3, len(G) // 20)]
        if np.any(first.real < 0) or np.any(first.imag > 0) or np.any(np.sum(G.imag, axis=0) > 0):
            sign_warnings(tool_point(model, model.axes, model.lines))
