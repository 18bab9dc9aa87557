"""Under which conditions a machine works: ``[conditions]`` of its file, for joints with modulations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from jointlib.errors import InputError
from jointlib.io.toml import Section
from jointlib.modulation import CONDITIONS

from ..model.machine import Machine
from ..model.spindle_speed import SPINDLE_SPEED


def conditions_of(section: Section) -> dict[str, float]:
    """Values in SI by condition; the speed of the spindle is that of ``[response]`` or of a chart."""
    found = {name: section.number(name, unit) for name, unit in CONDITIONS.items() if section.has(name)}
    if SPINDLE_SPEED in found:
        raise InputError(f"{section.where}: {SPINDLE_SPEED} is that of `[response] speed` or of each speed of a chart")
    section.done()
    return found


def under(machine: Machine, conditions: Mapping[str, float]) -> Machine:
    """The machine with its joints as they are under the conditions."""
    joints = [c.joint for c in machine.connections if c.joint is not None]
    depend = {m.condition for joint in joints for m in joint.modulations}
    for name in conditions:
        if name not in depend:
            known = f"one of {', '.join(sorted(depend))}" if depend else "joints with a [[modulation]]"
            raise InputError(f"{machine.where}: [conditions]: no joint depends on {name}, expected {known}")
    joined = list(machine.connections)
    for name, value in conditions.items():
        for m in (m for joint in joints for m in joint.modulations if m.condition == name and not m.covers(value)):
            low, high = m.table[0][0], m.table[-1][0]
            raise InputError(
                f"{machine.where}: [conditions]: {name} is {value:g} {CONDITIONS[name]}, expected {low:g} to {high:g}, "
                f"where the {m.role.value} of its joint is known"
            )
        joined = [c if c.joint is None else replace(c, joint=c.joint.based(name, value)) for c in joined]
    return replace(machine, connections=tuple(joined))
