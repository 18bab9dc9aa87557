"""The depth below which what a knock leaves dies out at every speed, in turning."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from jointlib.shown.progress import Progress

from ..cutting.amplitude.amplitude_limits import depends_on_amplitude
from ..cutting.amplitude.frozen_lobes import frozen_lobes
from ..cutting.amplitude.least_depth import least_depth, least_depth_at
from ..cutting.amplitude.pocket import RESERVE, WANDER, Pocket, told_depth
from ..cutting.amplitude.sampled_amplitudes import amplitude_range
from ..cutting.process.chart import StabilityLobes
from ..cutting.process.cutting import Cutting
from ..deadline import OutOfTime, within
from ..model.machine import Machine
from ..model.spindle_speed import depends_on_speed

_KNOCKS = 10
"""Tool amplitudes behind it."""
_IN_BAND = 17
"""Speeds of the band of a pocket."""


def safe_from_knocks(
    model: Machine, chart: StabilityLobes, budget: float, progress: Progress
) -> tuple[dict[str, Any], list[str]]:
    """In turning, where something depends on amplitude: the depth below which knocks die out at every speed.

    Left out, which is told, where it takes more than the ``budget`` (s), or would in a machine that is another at every
    speed.
    """
    cutting = Cutting(**(model.cutting or {}))
    if not _matter(model, chart, cutting):
        return {}, []
    sizes = amplitude_range(cutting, _KNOCKS)
    with progress.step(f"computing the least depth over amplitude, in at most {budget:.3g} s"):
        if depends_on_speed(model):
            begun = time.monotonic()
            frozen_lobes(model, chart.speed[:1], float(sizes[0]), chart.method)
            needed = (time.monotonic() - begun) * chart.speed.size * len(sizes)
            if needed > budget:
                return {}, [
                    f"The depth below which knocks die out was left out: {len(sizes)} amplitudes at each of "
                    f"{chart.speed.size} speeds take about {needed:.0f} s, more than --budget leaves ({budget:.3g} s)."
                ]
        try:
            with within(budget):
                depth, amplitude = least_depth(model, chart, sizes)
        except OutOfTime:
            left = f"not done in the {budget:.3g} s that --budget leaves"
            return {}, [f"The depth below which knocks die out was left out: {left}."]
    if not np.isfinite(depth):
        return {}, []
    data = {"safe_at_every_speed": {"depth": depth, "amplitude": amplitude}}
    return data, [
        f"vibrations of up to {amplitude * 1e6:.3g} um, as a knock leaves them, die out at every speed below "
        f"{depth * 1e3:.5g} mm"
    ]


def knocks_in_pocket(
    model: Machine, chart: StabilityLobes, best: Pocket | None, budget: float, progress: Progress
) -> tuple[dict[str, Any], list[str]]:
    """In turning, where something depends on amplitude: below which depth knocks die out in the whole band of a pocket.

    Nothing where that is no less than the depth of the pocket, or takes more than the ``budget`` (s).
    """
    cutting = Cutting(**(model.cutting or {}))
    if best is None or not _matter(model, chart, cutting) or depends_on_speed(model):
        return {}, []
    band = best.speed * np.linspace(1 - WANDER, 1 + WANDER, _IN_BAND)
    sizes = amplitude_range(cutting, _KNOCKS)
    rest = replace(chart, speed=band, minimum_depth=best.depth / (1 - RESERVE))
    try:
        with progress.step("looking what knocks do at the best speed"), within(budget):
            depth, amplitude = least_depth_at(model, rest, sizes)
    except OutOfTime:
        return {}, []
    if not depth < best.depth:
        return {}, []
    return {"knocks": {"depth": depth, "amplitude": amplitude}}, [
        f"A knock at the recommended speed may start chatter that lasts: below {told_depth(depth)} vibrations of up to "
        f"{amplitude * 1e6:.3g} µm die out, speeds {100 * WANDER:g} % off included."
    ]


def _matter(model: Machine, chart: StabilityLobes, cutting: Cutting) -> bool:
    """Whether limits over amplitude are known in closed form, and are not those at rest."""
    return chart.method == "turning" and cutting.plain and depends_on_amplitude(model)
