"""Joints that a machine file leaves to be identified are identified before anything is computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .. import Machine


def with_joints(machine: Machine) -> tuple[Machine, tuple[str, ...]]:
    """The machine with every ``identify`` carried out, and a sentence for each; the trace is left to ``run``.

    First come the remarks of the components, last what looks like a mistake.
    """
    from jointlib import identify, read_joint, read_measurement

    said = list(machine.remarks())
    for connection in machine.connections:
        if connection.identify is not None:
            start = connection.identify.start
            records = [read_measurement(path) for path in connection.identify.records]
            found = identify(records, start=None if start is None else read_joint(start))
            machine = machine.with_joint(connection.name, found.joint)
            said.append(
                f"{connection.name}: as identified from its records; what that leaves unexplained is traced and mended "
                "by `jointlib run` only."
            )
    from ..mistakes import mistakes

    return machine, (*said, *mistakes(machine))


def look_ahead(machine: Machine) -> None:
    """Read every file that will be needed but no record, test cuts too, so that a fault is found before work begins."""
    from jointlib import read_joint, read_measurement

    for path in machine.cuts:
        read_measurement(path)
    for connection in machine.connections:
        if connection.identify is not None:
            for path in connection.identify.records:
                read_measurement(path)
            if connection.identify.start is not None:
                read_joint(connection.identify.start)
