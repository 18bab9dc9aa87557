"""The check against python-control, joints identified first where the file leaves that open."""

from __future__ import annotations

from dataclasses import replace

from jointlib.answers.given import File, Quantity, one

from ..files.opened import machine_of
from ..harmonic_balance.linear_check import LinearCheck, linear_check
from ..model.machine import Machine
from ..road.open_joints import with_joints


def check(machine: Machine | File, *, amplitude: Quantity | None = None, tool: str | None = None) -> LinearCheck:
    """Compare a machine, joints linearised, with a state space by feedback in python-control: ``jointlib check``.

    Parameters
    ----------
    machine
        A machine or its file.
    amplitude
        Joint amplitude at which they are linearised, m or with its unit; None: the tangent at rest.
    tool
        Which of several named tools is in the machine.
    """
    model, remarks = with_joints(machine_of(machine, tool))
    return replace(linear_check(model, one(amplitude, "m", "amplitude")), remarks=remarks)
