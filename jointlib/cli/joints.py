"""Joints that a machine file leaves to be identified are identified before anything is computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from machines import Machine


def with_joints(machine: Machine) -> Machine:
    """The machine with every ``identify`` carried out; the trace is left to ``run`` and ``trace``."""
    from jointlib import identify
    from jointlib.io.joint_file import read_joint
    from jointlib.io.measurement_file import read_measurement

    for connection in machine.connections:
        if connection.identify is not None:
            start = connection.identify.start
            records = [read_measurement(path) for path in connection.identify.records]
            found = identify(records, start=None if start is None else read_joint(start))
            machine = machine.with_joint(connection.name, found.joint)
    return machine
