"""A machine whose joints are held as small vibrations see them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous

from ...harmonic_balance.assembly import is_linear
from ...model.machine import Machine
from ...statics.working_point import tangents
from ..process.cutting import Cutting
from .forced_vibration import too_many


def held_at_rest(machine: Machine, frequency: float) -> Machine:
    """The machine whose joints are the springs and dampers that they are to small vibrations at ``frequency`` in Hz.

    k = Re G in N/m and c = Im G/ω in N s/m of the gain G about where each joint stands; joints that are linear stay as
    they are, and so do those that are open.
    """
    gains = dict(zip((c.name for c in machine.flexible), tangents(machine, frequency)[0], strict=True))

    def linear(joint: Joint, G: complex) -> Joint:
        laws = Linear(float(G.real)), Viscous(max(float(G.imag), 0.0) / (2 * np.pi * frequency))
        return Joint(laws, joint.name, provenance=joint.provenance)

    connections = tuple(
        c if c.joint is None or is_linear(c.joint) else replace(c, joint=linear(c.joint, complex(gains[c.name])))
        for c in machine.connections
    )
    return replace(machine, connections=connections, static=None)


def held_if_many(machine: Machine, speed: float) -> tuple[Machine, list[str]]:
    """The machine that a cut at ``speed`` (rpm) shakes, and what is to be said of it.

    Where very many joints depend on amplitude they are held as at rest at the tooth frequency, which is told; else, and
    where no tooth forces a vibration, the machine stays as it is.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    if cutting.process != "milling" or cutting.feed is None or not (bent := too_many(machine)):
        return machine, []
    as_at_rest = f"{bent} joints depend on amplitude and are held as at rest in what the teeth force"
    return held_at_rest(machine, speed / 60 * cutting.cuts_per_revolution), [f"{as_at_rest}; larger motions change it."]
