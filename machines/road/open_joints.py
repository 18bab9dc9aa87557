"""Joints that a machine file leaves to be identified are identified before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
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

    wrong = mistakes(machine)
    _refuse_by_cause(machine, wrong)
    return machine, (*said, *wrong)


def _refuse_by_cause(machine: Machine, wrong: Sequence[str]) -> None:
    """A load that nothing holds because of mistakes that are named: refused by these, not by what follows from them."""
    from jointlib.errors import InputError

    from ..statics.statics import UNHELD, static_point

    if not wrong or machine.static is None or all(said.startswith(UNHELD) for said in wrong):
        return
    try:
        static_point(machine)
    except InputError as error:
        if UNHELD in str(error):
            raise InputError(*(f"{machine.where}: {said}" for said in wrong)) from None


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
