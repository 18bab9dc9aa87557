"""The machine as small vibrations about its static working point see it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.joint import Joint

from ..model.machine import Machine
from .asked_together import same_joints
from .at_bias import AtBias
from .statics import static_point


def at_working_point(machine: Machine) -> Machine:
    """The machine as small vibrations see it: joints at their static displacements, and no static load any more."""
    if machine.static is None:
        return machine
    return placed(machine, static_point(machine).displacement)


def tangents(machine: Machine, frequency: ArrayLike) -> ComplexArray:
    """Gains of the joints in N/m about where they stand, (nf, connections), at rest; ``frequency`` in Hz, (nf,)."""
    omega = 2 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float))
    joints = machine.joints()
    stands = np.zeros(len(joints)) if machine.static is None else static_point(machine).displacement
    gains = np.empty((len(omega), len(joints)), dtype=complex)
    for columns in same_joints(joints):
        gains[:, columns] = joints[columns[0]].first_harmonic(0.0, omega[:, None], stands[columns]).gain
    return gains


def placed(machine: Machine, displacement: Array) -> Machine:
    """The machine with its joints about these displacements (m, one per flexible connection), and no static load."""
    place = dict(zip((c.name for c in machine.flexible), displacement, strict=True))
    connections = tuple(
        c if c.joint is None else replace(c, joint=about(c.joint, float(place[c.name]))) for c in machine.connections
    )
    return replace(machine, connections=connections, static=None)


def about(joint: Joint, bias: float) -> Joint:
    """A joint seen from a static displacement; the range that is left of the one it was identified on goes with it."""
    validity = dict(joint.validity)
    if "amplitude" in validity:
        low, high = validity["amplitude"]
        validity["amplitude"] = (low, max(high - abs(bias), 0.0))
    laws = tuple(AtBias(law, bias) for law in joint.laws)
    return Joint(laws, joint.name, validity=validity, provenance=joint.provenance)
