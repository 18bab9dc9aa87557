"""The tool point for small vibrations."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..components.measured import Measured
from ..harmonic_balance.assembly import Assembly
from ..model.machine import Machine
from ..statics.working_point import tangents
from .chatter_band import chatter_band
from .tabulated import Tabulated
from .tool_model import ToolModel
from .tool_point import ToolPoint


def tool_at_rest(machine: Machine) -> ToolModel | ToolPoint:
    """The tool for small vibrations as every verb takes it: as modes, or where no sum of modes is it on any line.

    What the second answers depends, in its last digits, on how much was asked of it before; each is new.
    """
    return chatter_band(machine).model or _asked_often(machine)


kept_tool = lru_cache(maxsize=8)(tool_at_rest)
"""For those who ask one machine speed by speed."""


def _asked_often(machine: Machine) -> ToolPoint:
    """`tip_at_rest` from a table, whose pieces end on the lines of records: between those, a receptance is smooth."""
    lines = chatter_band(machine).lines
    tip = tip_at_rest(machine, lines)
    records = [part.frequency for part in machine.components if isinstance(part, Measured)]
    known = np.concatenate(records or [lines])
    knots = np.union1d(known[(known > lines[0]) & (known < lines[-1])], lines[[0, -1]])
    return replace(tip, receptance=Tabulated(tip.receptance, knots))


def tip_at_rest(machine: Machine, lines: Array) -> ToolPoint:
    """The tool point for small vibrations, known at every frequency; ``lines`` (Hz) are where a search starts."""
    axes, tool = machine.tool_axes, machine.tool_dofs
    if not axes:
        raise InputError(f"{machine.where}: no tool point, expected [tool] with x or y")
    assembly = Assembly(machine, tool, tool)
    return ToolPoint(lambda f: assembly.coupled(2 * np.pi * f, tangents(machine, f)), lines, axes, sampled=False)
