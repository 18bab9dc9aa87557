"""Whether the cut that a study recommends by zero order is stable by a method that keeps the tooth frequency."""

from __future__ import annotations

import numpy as np

from jointlib.errors import CheckFailed, InputError

from ...cutting.amplitude.pocket import RESERVE, WANDER, limit_of, told_depth
from ...deadline import within
from ...files.machine_file import read_machine
from .best import BestMachine

_NEAR = np.linspace(1 - WANDER, 1 + WANDER, 5)
"""Of the recommended speed."""
_SECONDS = 60.0


def checked(best: BestMachine) -> str:
    """What an exact method says of the pocket of a machine whose depths are by zero order; empty where none is told.

    The pocket stays `RESERVE` below the lowest limit within `WANDER` of its speed, by zero order.
    """
    speed = best.results.get("pocket-speed", np.nan)
    if best.method != "zero-order" or not np.isfinite(speed):
        return ""
    file, near = best.files[0], speed * _NEAR
    try:
        machine = read_machine(file)
        told = (1 - RESERVE) * float(np.min(limit_of(machine, best.amplitudes, best.method)(near)))
        with within(_SECONDS):
            exact = float(np.min(limit_of(machine, best.amplitudes, None)(near)))
    except (CheckFailed, InputError) as refused:
        return f"The depth at {speed:.0f} rpm was not checked by the exact method: {refused}."
    if not np.isfinite(told):
        return ""
    depth, there = told_depth(told), f"at {speed:.0f} rpm and up to {100 * WANDER:g} % off it"
    if not np.isfinite(exact):
        return f"The exact method finds no limit {there}, where {depth} are recommended."
    if exact >= told:
        return f"By the exact method {file.name} is stable below {told_depth(exact)} {there}: {depth} are recommended."
    return (
        f"Do not cut as deep as this study says, {depth}: by the exact method, which keeps the tooth frequency, "
        f'{file.name} chatters above {told_depth(exact)} {there}. Give lobes = "multi-frequency" in [conditions].'
    )
