"""What a chip of finite thickness makes of limits over amplitude: a force that bends with it, edges that leave it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array

from ...harmonic_balance.assembly import is_linear
from ...model.machine import Machine
from ...tool.at_rest import tip_at_rest
from ...tool.tool_point import ToolPoint, tool_point
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from ..process.lost_contact import milling_contact, persistence
from ..process.power_law import depth_ratio
from .chattering_tool import chattering_point, operating_receptance

_LINES, _BARELY = 600, 1e-9


def with_chip(machine: Machine, chart: StabilityLobes, cutting: Cutting, amplitude: float) -> StabilityLobes:
    """The chart with the cut's own nonlinearity, where the feed says how thick the chip is (turning).

    While the edge stays in the cut the first harmonic of the power law scales the depth; beyond, `persistence` has the
    surface of earlier turns too.
    """
    feed, q = cutting.feed, cutting.exponent
    if cutting.process == "milling" or feed is None:
        return chart
    hertz, chip = np.nan_to_num(chart.chatter_frequency), np.full(len(chart.speed), amplitude)
    point: ToolPoint | None = None
    if len(machine.tool_axes) > 1:
        point, moves = _tool(machine, amplitude), np.isfinite(chart.chatter_frequency)
        chip[moves] *= _along_chip(point, cutting, hertz[moves])
    ratio = chip * np.abs(1 - np.exp(-2j * np.pi * hertz * 60 / chart.speed)) / feed
    depth, frequency = chart.depth * depth_ratio(ratio, q), chart.chatter_frequency.copy()
    left = np.flatnonzero(ratio > 1)
    if len(left):
        along = (point or _tool(machine, amplitude)).along(cutting.rotation[0])
        K = float(cutting.mean_stiffness[0, 0])
        for i in left:
            depth[i], frequency[i] = persistence(along, K, float(chart.speed[i]), feed, float(chip[i]), q)
    return replace(chart, depth=depth, chatter_frequency=frequency)


def _tool(machine: Machine, amplitude: float) -> ToolPoint:
    """The tool point with the joints as they are at an amplitude in m."""
    if all(is_linear(joint) for joint in machine.joints()) and machine.frequency is not None:
        return tip_at_rest(machine, np.linspace(*machine.frequency, _LINES))
    return tool_point(operating_receptance(machine, amplitude).frf, machine.tool_axes)


def _along_chip(point: ToolPoint, cutting: Cutting, hertz: Array) -> Array:
    """Motion along the chip over that of the axis which moves more, for a force along the chip at each frequency."""
    share = cutting.rotation[0][["xy".index(axis) for axis in point.axes]]
    moved = point(hertz) @ share
    return np.asarray(np.abs(moved @ share) / np.max(np.abs(moved), axis=1))


def contact_amplitude(machine: Machine, cutting: Cutting, speed: Array, frequency: Array) -> Array:
    """Amplitude in m up to which the edges of a milling cut feel nearly the whole chip of a vibration, per speed."""
    found = np.full(len(speed), np.inf)
    if cutting.process != "milling" or cutting.feed is None:
        return found
    for i in np.flatnonzero(np.isfinite(frequency)):
        hertz = float(frequency[i])
        point, direction = chattering_point(machine, cutting, hertz, _BARELY)
        moved = point.frf.receptance[0] @ direction
        turned = abs(1 - np.exp(-2j * np.pi * hertz * 60 / speed[i] / cutting.cuts_per_revolution))
        found[i] = cutting.feed * milling_contact(cutting, machine.tool_axes, moved / np.max(np.abs(moved)), turned)
    return found
