"""What a set of lobe charts tells the one who sets the machine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.errors import CheckFailed, InputError

from ...model.machine import Machine
from ...model.spindle_speed import at_speed
from ...statics.working_point import tangents
from ...tool.machine_model import machine_model
from ..amplitude.chattering_tool import chattering_point
from ..amplitude.pocket import WANDER, Pocket, limit_of, safe_depth
from ..cutters.settled_multipliers import settled_multipliers
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from .quiet_pocket import pocket_in_cut
from .shaken_limits import agreeing_limit, shakes

_MATTERS = 0.05
"""Share by which the depth must change with amplitude before a sentence is made of it."""
_ALONE = 0.9


def advice(
    charts: Sequence[tuple[float, StabilityLobes]],
    cutting: Cutting,
    best: Pocket | None,
    machine: Machine | None = None,
) -> tuple[str, ...]:
    """Sentences on the ``best`` pocket, the depth that is safe at every speed, and what amplitude does.

    ``charts`` holds (tool-point amplitude in m, chart) with the same speeds, amplitudes ascending. Where the limiting
    depth grows with amplitude, a vibration settles at the amplitude whose limit is the depth of the cut; where it
    falls, the vibration is a threshold above which it grows. With the ``machine`` they also tell the vibration that
    the teeth force, count it in where they speak of amplitude, and say why amplitude matters; without it, nothing is
    said of amplitude in a cut with a feed that mills.
    """
    lowest = [chart.minimum_depth for _, chart in charts]
    if not np.isfinite(min(lowest)):
        return ("No chatter was found at any speed and depth, inside the frequencies that were searched.",)
    said = []
    if best is not None:
        said.append(f"Recommended: {best.words()}; it holds for speeds {100 * WANDER:g} % off as well.")
        if machine is not None:
            limits = safe_depth([chart for _, chart in charts])
            limit = limit_of(machine, [A for A, _ in charts], charts[0][1].method)
            said += pocket_in_cut(machine, charts[0][1].speed.ravel(), limits, limit, best)[2]
    said.append(safe_words(charts[int(np.argmin(lowest))][1]))
    if len(charts) > 1 and charts[0][0] == 0:
        said += _amplitude_words(charts, cutting, machine)
    return tuple(said)


def safe_words(chart: StabilityLobes) -> str:
    """The depth below which nothing chatters, at the speeds of which the chart knows that."""
    where, at = "every speed is stable" if chart.branches else "the cut is stable at the speeds computed", ""
    if chart.minimum_at is not None:
        low, high = float(np.min(chart.speed)), float(np.max(chart.speed))
        where, at = f"every speed from {low:.0f} to {high:.0f} rpm is stable", f", at {chart.minimum_at:.0f} rpm"
    return f"Below {_mm(chart.minimum_depth)} {where} (chatter would come at {chart.minimum_frequency:.0f} Hz{at})."


def _amplitude_words(
    charts: Sequence[tuple[float, StabilityLobes]], cutting: Cutting, machine: Machine | None
) -> list[str]:
    """What the largest amplitude does at the speed with the lowest onset, the forced motion counted in."""
    (_, rest), (size, grown) = charts[0], charts[-1]
    worst = int(np.argmin(rest.depth.ravel()))
    speed, first, last = (float(part.ravel()[worst]) for part in (rest.speed, rest.depth, grown.depth))
    if abs(last / first - 1) <= _MATTERS or not np.isfinite(first):
        return []
    at, vibration = f"At {speed:.0f} rpm", f"a vibration of {size * 1e6:g} µm at the tool point"
    beside = ""
    if cutting.process == "milling" and cutting.feed is not None:
        if machine is None or not shakes(machine):
            return []
        alone, first, last = last, *(agreeing_limit(machine, speed, A, b) for A, b in ((0.0, first), (size, last)))
        if not (np.isfinite(first) and np.isfinite(last)):
            return [f"{at} nothing is said of {vibration}: with what the teeth make of the joints it was not followed."]
        beside = " beside that of the teeth"
        if abs(last / alone - 1) > _MATTERS:
            beside += f" (without theirs {_mm(alone)})"
    chatter, middle = float(rest.chatter_frequency.ravel()[worst]), float(np.sqrt(first * last))
    why = "" if machine is None else _reason(machine, cutting, speed, size, chatter, middle)
    if last > (1 + _MATTERS) * first:
        return [
            f"{at} {vibration} dies out below {_mm(last)}{beside}: chatter that sets in from {_mm(first)} on stays "
            f"smaller than that{why}."
        ]
    if last < (1 - _MATTERS) * first:
        return [
            f"{at} {vibration}, once started, lasts from {_mm(last)} on{beside}, below the {_mm(first)} at which it "
            f"starts by itself{why}."
        ]
    return []


def _reason(machine: Machine, cutting: Cutting, speed: float, amplitude: float, chatter: float, depth: float) -> str:
    """What of the change is due to the stiffness and what to the damping that the joints have at that amplitude.

    At a ``depth`` in m between the two limits a vibration at ``chatter`` Hz grows by |μ| a tooth with the joints at
    rest. With K = Re G of the vibrating joints and the damping of those at rest, and the other way round, ln |μ| falls
    or rises by what stiffness and damping do alone. Nothing is said where they work against each other.
    """
    try:
        machine = at_speed(machine, speed)
        rest = tangents(machine, chatter)[0]
        held = chattering_point(machine, cutting, chatter, amplitude)[0].gain[0]
        mixed = (rest, held.real + 1j * rest.imag, rest.real + 1j * held.imag)
        models = [machine_model(machine, chatter, G) for G in mixed]
        mu = [settled_multipliers(model, cutting, np.array([speed]), np.array([depth]))[0, 0] for model in models]
    except (CheckFailed, InputError):
        return ""
    none, *alone = np.log(mu)
    by_stiffness, by_damping = (float(one - none) for one in alone)
    if by_stiffness * by_damping <= 0:
        return ""
    share, softens = by_damping / (by_stiffness + by_damping), float(np.sum(held.real - rest.real)) < 0
    grow = "lose stiffness" if softens else "gain stiffness"
    damps = "damp it more" if float(np.sum(held.imag - rest.imag)) > 0 else "damp it less"
    if share > _ALONE:
        return f", because the joints {damps} as it grows"
    if share < 1 - _ALONE:
        return f", because the joints {grow} as it grows"
    return f", because the joints {grow} ({100 * (1 - share):.0f} %) and {damps} ({100 * share:.0f} %) as it grows"


def _mm(depth: float) -> str:
    return f"{depth * 1e3:.3g} mm" if np.isfinite(depth) else "any depth"
