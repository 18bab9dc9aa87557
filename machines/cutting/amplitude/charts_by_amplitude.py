"""The charts of a machine at several amplitudes on the same speeds, in a budget of time."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed

from ...harmonic_balance.assembly import Assembly
from ...model.machine import Machine
from ...model.spindle_speed import depends_on_speed
from ..process.chart import BY_SPEED, StabilityLobes, joined
from .frozen_lobes import lobes_at_amplitude
from .lobes_over_range import farthest, lobes_over_range, without

_MANY = 12
"""Joints that depend on amplitude beyond which a speed takes many seconds in milling."""


def charts_by_amplitude(
    machine: Machine, speed: Array, amplitude: Sequence[float], method: str | None, budget: float | None
) -> list[StabilityLobes]:
    """A chart an amplitude (m), all of them at the same speeds (rpm).

    At rest over a range, which has a ``budget`` (s), what dips between the speeds is looked for; other amplitudes take
    the same speeds. A nonlinear machine that is another at every speed costs a frozen receptance a speed and amplitude,
    one of very many nonlinear joints many seconds a speed in milling: the charts then share the budget and have the
    speeds that were reached at all amplitudes.
    """
    at_rest = [A for A in amplitude if not A][:1]
    vibrating = tuple(A for A in amplitude if A)
    bent = len(Assembly(machine, (), ()).nonlinear) if vibrating else 0
    dear = bent > 0 and (depends_on_speed(machine) or (bent > _MANY and _speed_by_speed(machine, method)))
    begun, found = time.monotonic(), {}
    if at_rest and budget is not None:
        share = budget / len(amplitude) if dear else budget
        found[0.0] = lobes_over_range(machine, speed, 0.0, method, share)
        speed = found[0.0].speed
    elif at_rest:
        found[0.0] = lobes_at_amplitude(machine, speed, 0.0, method)
    if budget is not None and dear:
        charts = within_budget(machine, speed, vibrating, method, budget, budget - (time.monotonic() - begun))
        found |= dict(zip(vibrating, charts, strict=True))
        found = {A: _at(chart, charts[0].speed) for A, chart in found.items()}
    else:
        found |= {A: lobes_at_amplitude(machine, speed, A, method) for A in vibrating}
    left_out = tuple(sorted({rpm for chart in found.values() for rpm in chart.left_out}))
    return [replace(found[A], left_out=left_out) for A in amplitude]


def _speed_by_speed(machine: Machine, method: str | None) -> bool:
    """Whether a chart at an amplitude costs by its speeds."""
    return (machine.cutting or {}).get("process") == "milling" and method != "zero-order"


def within_budget(
    machine: Machine, speed: Array, amplitude: Sequence[float], method: str | None, budget: float, seconds: float
) -> list[StabilityLobes]:
    """`lobes_at_amplitude` speed by speed (rpm), those spread over the range first, in so many ``seconds``.

    They are what is left of the ``budget`` (s), which is told. A speed is computed at all amplitudes (m) or at none, at
    least one is tried, and none is begun that would take longer than is left: the charts then say so. A speed at which
    the method does not settle is left out, and that is said.
    """
    left, deadline = np.unique(speed), time.monotonic() + seconds
    count, longest, following = left.size, 0.0, left.size // 2
    done: list[list[StabilityLobes]] = []
    refused: dict[float, str] = {}
    while left.size and (not (done or refused) or time.monotonic() + longest < deadline):
        rpm, started = float(left[following]), time.monotonic()
        left = np.delete(left, following)
        try:
            done.append([lobes_at_amplitude(machine, [rpm], A, method) for A in amplitude])
        except CheckFailed as error:
            refused[rpm] = str(error)
        longest = max(longest, time.monotonic() - started)
        known = np.array([*(row[0].speed[0] for row in done), *refused])
        following = farthest(left, known) if left.size else 0
    if not done:
        raise CheckFailed(next(iter(refused.values())))
    charts = [without(joined(column), refused) for column in zip(*done, strict=True)]
    short = (
        f"Time was up after {budget:g} s: {len(done)} of {count} speeds are computed at every amplitude, spread over "
        "the range; the others are left out."
    )
    if not left.size:
        return charts
    return [replace(chart, warnings=(*chart.warnings, short), left_out=tuple(left.tolist())) for chart in charts]


def _at(chart: StabilityLobes, speed: Array) -> StabilityLobes:
    """The chart at some of its speeds (rpm); the minimum stays that of all that were computed."""
    kept = np.isin(chart.speed, speed)
    if np.all(kept):
        return chart
    return replace(chart, **{key: getattr(chart, key)[kept] for key in BY_SPEED}, minimum_at=None)
