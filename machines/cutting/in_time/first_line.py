"""The line that a simulated vibration starts with, and how it stands to the flutes."""

from __future__ import annotations

import numpy as np

from jointlib.errors import InputError

from ...model.machine import Machine
from ..amplitude.frozen_lobes import frozen_lobes
from ..process.cutter import Cutter
from ..process.cutting import Cutting

_HALF_WAVE = 0.01


def chatter_of(machine: Machine, speed: float, amplitude: float) -> float:
    """Chatter frequency in Hz with the joints frozen at an amplitude; where nothing chatters, the most flexible one."""
    chart, _ = frozen_lobes(machine, [speed], amplitude)
    found = float(chart.chatter_frequency[0])
    if np.isfinite(found):
        return found
    if np.isfinite(chart.minimum_frequency):
        return float(chart.minimum_frequency)
    raise InputError(f"{machine.where}: nothing chatters inside its frequencies; give the frequency of the start")


def stands(cutting: Cutting, speed: float, hertz: float) -> bool:
    """Whether a vibration stands still against the flutes: it repeats every second time they do, or every time."""
    if cutting.process != "milling":
        return False
    cutter = Cutter.of(cutting, runout=cutting.feed is not None)
    turns = hertz / cutter.frequency(speed) % 1
    return abs(turns - 0.5) < _HALF_WAVE or (len(cutter.flutes) > 1 and _folds(turns))


def _folds(turns: float) -> bool:
    return min(turns, 1 - turns) < _HALF_WAVE


def refuse_fold(cutter: Cutter, speed: float, hertz: float) -> None:
    """Raise where chatter repeats with the flutes, as what they force does."""
    fed = cutter.cutting.process == "milling" and cutter.cutting.feed is not None
    if fed and len(cutter.flutes) > 1 and _folds(hertz / cutter.frequency(speed) % 1):
        raise InputError(
            f"simulated cut: {hertz:.4g} Hz repeats with the flutes at {speed:g} rpm, as what they force does, so the "
            "two are not told apart; leave 'feed' out"
        )
