"""Whether what a study recommends by zero order is stable by a method that keeps the tooth frequency."""

from __future__ import annotations

import numpy as np

from jointlib.errors import CheckFailed, InputError

from ...cutting.amplitude.lobes_over_range import lobes_over_range
from ...cutting.amplitude.pocket import RESERVE, WANDER, limit_of, told_depth
from ...cutting.process.cutting import Cutting
from ...deadline import within
from ...files.machine_file import read_machine
from ...model.machine import Machine
from .best import BestMachine

_NEAR = np.linspace(1 - WANDER, 1 + WANDER, 5)
"""Of the recommended speed."""
_SECONDS = 60.0
"""For each answer."""
_SAME = 1e-3
_INSTEAD = 'Give lobes = "multi-frequency" in [conditions].'
_EXACT = "by the exact method, which keeps the tooth frequency"


def checked(best: BestMachine) -> str:
    """What an exact method says of the depths of a machine for which they are by zero order, a sentence each.

    The pocket stays `RESERVE` below the lowest limit within `WANDER` of its speed, by zero order; the depth that is
    stable at every speed is held against the lowest limit over the speeds of its file.
    """
    if best.method != "zero-order":
        return ""
    speed, depth = best.results.get("pocket-speed", np.nan), best.results.get("minimum-depth", np.nan)
    machine, name = read_machine(best.files[0]), best.files[0].name
    pocket = _pocket(machine, name, best, speed) if np.isfinite(speed) else ""
    everywhere = _everywhere(machine, name, best, depth) if np.isfinite(depth) else ""
    return " ".join(said for said in (pocket, everywhere) if said)


def _pocket(machine: Machine, name: str, best: BestMachine, speed: float) -> str:
    near = speed * _NEAR
    try:
        told = (1 - RESERVE) * float(np.min(limit_of(machine, best.amplitudes, best.method)(near)))
        with within(_SECONDS):
            exact = float(np.min(limit_of(machine, best.amplitudes, None)(near)))
    except (CheckFailed, InputError) as refused:
        return f"The depth at {speed:.0f} rpm was not checked by the exact method: {_ended(refused)}"
    if not np.isfinite(told):
        return ""
    depth, there = told_depth(told), f"at {speed:.0f} rpm and up to {100 * WANDER:g} % off it"
    if not np.isfinite(exact):
        return f"The exact method finds no limit {there}, where {depth} are recommended."
    if exact >= told:
        return f"By the exact method {name} is stable below {told_depth(exact)} {there}: {depth} are recommended."
    return (
        f"Do not cut as deep as this study says, {depth}: {_EXACT}, {name} chatters above {told_depth(exact)} {there}. "
        f"{_INSTEAD}"
    )


def _everywhere(machine: Machine, name: str, best: BestMachine, depth: float) -> str:
    speeds = Cutting(**dict(machine.cutting or {})).speeds(best.speed_count)
    each = _SECONDS / len(best.amplitudes)
    try:
        with within(2 * _SECONDS):
            charts = [lobes_over_range(machine, speeds, A, None, each) for A in best.amplitudes]
    except (CheckFailed, InputError) as refused:
        return f"The depth at every speed was not checked by the exact method: {_ended(refused)}"
    lowest = min(charts, key=lambda chart: chart.minimum_depth)
    fewest = min(charts, key=lambda chart: chart.speed.size)
    looked = f"from {speeds[0]:.0f} to {speeds[-1]:.0f} rpm"
    if fewest.left_out:
        looked = f"at {fewest.speed.size} speeds {looked}, for more of which a minute did not suffice,"
    told, exact = told_depth(depth), lowest.minimum_depth
    if not np.isfinite(exact):
        return f"The exact method finds no limit {looked}."
    if exact >= depth * (1 - _SAME):
        return f"By the exact method {name} is stable below {told_depth(exact)} {looked}: this study says {told}."
    at = float(lowest.speed.ravel()[np.argmin(lowest.depth)]) if lowest.minimum_at is None else lowest.minimum_at
    return (
        f"Do not cut {told} at every speed: {_EXACT}, {name} chatters above "
        f"{told_depth(exact)} at {at:.0f} rpm, {100 * (1 - exact / depth):.2g} % below it. {_INSTEAD}"
    )


def _ended(refused: Exception) -> str:
    return f"{str(refused).rstrip('.')}."
