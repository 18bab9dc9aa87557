"""A machine as one of the things compared: peaks of its tool at rest, and the lowest stable depth where it cuts."""

from __future__ import annotations

import time

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.amplitude.lobes_over_range import lobes_over_range
from ..cutting.process.chart import StabilityLobes
from ..cutting.rest.beyond_record import refuse_unknown
from ..cutting.rest.chart_file import default_speeds
from ..cutting.rest.periodic import AT_SPEEDS
from ..model.machine import Machine
from ..tool.at_rest import tip_at_rest
from ..tool.chatter_band import ChatterBand, chatter_band, frequency_range
from ..tool.tool_model import around
from .computed_peaks import tops_of
from .sides import Curve, Fact, Limits, Side

_LINES = 3000
_COUNTS = ((200, 5.0), (100, 5.0), (40, 30.0))
"""Speeds over the range, the most as `jointlib lobes` has them, and the seconds that they may take: what dips between
them takes as long."""
_FEWEST = 20
_SHARE, _LEAST, _MOST = 4.0, 10.0, 75.0
"""Time for the depths of one machine: so many times that of the speeds, and the fewest and most seconds."""


def of_machine(name: str, machine: Machine) -> Side:
    """Receptances of the tool at rest over the band of the file, and the lowest stable depth where it cuts."""
    open_joints = [c.name for c in machine.connections if c.identify is not None]
    if open_joints:
        raise InputError(
            f"{name}: {open_joints[0]} is to be identified; `jointlib run` does that, and its folder can be compared"
        )
    curves = receptances(machine)
    if machine.cutting is None or machine.cutting.get("speed") is None:
        return Side(name, "machine", {}, curves)
    try:
        speeds, needed = _speeds(machine)
        budget = min(max(_SHARE * needed, _LEAST), _MOST)
        chart = lobes_over_range(machine, speeds, budget=budget, every=True)
        refuse_unknown(chart)
    except (CheckFailed, InputError) as refused:
        return Side(name, "machine", {}, curves, (f"{name}: depths are not compared: {refused}",))
    partly = _cut_short(chart)
    facts = {
        "lowest stable depth": Fact(chart.minimum_depth, "m", partly=partly),
        "chatter there": Fact(chart.minimum_frequency, "Hz", partly=partly),
    }
    limits = Limits(chart.speed, chart.depth, chart.chatter_frequency, chart.short_of)
    return Side(name, "machine", facts, curves, _remarks(name, chart, budget), limits, _way(chart))


def _speeds(machine: Machine) -> tuple[Array, float]:
    """As many over the range of the file as there is time for, and the seconds that they take.

    What the first one builds once does not count.
    """
    few = default_speeds(machine, 3)
    lobes_at_amplitude(machine, few[:1], 0.0)
    begun = time.perf_counter()
    lobes_at_amplitude(machine, few[1:], 0.0)
    each = (time.perf_counter() - begun) / 2
    count = next((n for n, most in _COUNTS if n * each < most), _FEWEST)
    return np.asarray(default_speeds(machine, count)), count * each


def _cut_short(chart: StabilityLobes) -> bool:
    return bool(chart.left_out) or AT_SPEEDS in chart.notes


def _way(chart: StabilityLobes) -> str:
    low, high = float(np.min(chart.speed)), float(np.max(chart.speed))
    reach = f"{chart.speed.size} speeds" if _cut_short(chart) else "all speeds"
    return f"{chart.method}, the lowest of {reach} from {low:g} to {high:g} rpm"


def _remarks(name: str, chart: StabilityLobes, budget: float) -> tuple[str, ...]:
    """That the depth is not that of the whole range where it is not."""
    if not _cut_short(chart):
        return ()
    lower = "between them it may be lower; `jointlib lobes` looks longer"
    return (f"{name}: time was up after {budget:.2g} s: the depth is the lowest at {chart.speed.size} speeds, {lower}",)


def receptances(machine: Machine) -> dict[str, Curve]:
    """Those of its tool at rest over the band of its file, or of its modes; none without a tool.

    Peaks are solved for between lines on which every mode leaves a trace, as `tool_peaks` has them at a small force.
    """
    if not machine.tool:
        return {}
    band, (low, high) = _band(machine), frequency_range(machine)
    lines = np.linspace(low, high, _LINES)
    near = np.zeros(0) if band is None else band.lines
    if band is not None and band.model is not None:
        near = np.concatenate([near, around(band.model.poles) / (2 * np.pi)])
    lines = np.union1d(lines, near[(near > low) & (near < high)])
    tip = tip_at_rest(machine, lines) if band is None or band.model is None else band.model
    H = tip(lines)

    def curve(i: int) -> Curve:
        return Curve(lines, H[:, i, i], tops=tops_of(lambda f: np.abs(tip(f)[:, i, i]), lines))

    return {f"tool {axis}": curve(i) for i, axis in enumerate(machine.tool_axes)}


def _band(machine: Machine) -> ChatterBand | None:
    """Where its modes are; None where they are not told, and the file says over which band it is asked for."""
    try:
        return chatter_band(machine)
    except InputError:
        if machine.frequency is None:
            raise
        return None
