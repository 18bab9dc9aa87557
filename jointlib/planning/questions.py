"""Which effects are in question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from jointlib.effect import JointEffect
from jointlib.errors import InputError, nearest
from jointlib.fault import Fault
from jointlib.loop.answer.catalogue import catalogue
from jointlib.planning.setup import Setup
from jointlib.planning.spoiled import FAMILIES
from jointlib.planning.truths import InJoint, OfSensors, Truth
from jointlib.registry import installed

FAULTS = "faults"
"""Asks for every fault of sensors, masses and rig that can be simulated."""


def questions(asked: Sequence[str], setup: Setup) -> tuple[Truth, ...]:
    """Effects by family or by the name they are installed under (one member of a family); by default those of the
    joint. A fault is in question at every channel or body it may sit in."""
    known = catalogue()
    families: dict[str, list[JointEffect]] = {}
    for e in known.joint:
        if e.leads:
            families.setdefault(e.family, []).append(e)
    faults = {f.family: f for f in known.rig if f.family in FAMILIES}
    members = {n: e() for n, e in installed("jointlib.effects").found.items() if issubclass(e, JointEffect)}
    found: dict[str, Truth] = {}
    for word in asked or [*families]:
        if word in families:
            found[word] = InJoint(tuple(families[word]))
        elif word in members:
            found[members[word].family] = InJoint((members[word],))
        elif word == FAULTS or word in faults:
            for fault in faults.values() if word == FAULTS else (faults[word],):
                found |= {t.name: t for t in (OfSensors(fault, site) for site in _sites(fault, setup))}
        else:
            valid = {*families, *members, *faults, FAULTS}
            other = next((f for f in known.rig if f.family == word), None)
            if other is not None:
                what = "changes along a record" if other.on == "joint" else "holds a body to ground"
                raise InputError(f"--effects: {word} {what}, which a plan does not simulate")
            raise InputError(f"--effects: unknown effect {word!r}, {nearest(word, valid)}")
    return tuple(found.values())


def rivals() -> Mapping[str, Sequence[JointEffect]]:
    """What competes in the joint, by family."""
    out: dict[str, list[JointEffect]] = {}
    for e in catalogue().joint:
        if e.leads:
            out.setdefault(e.family, []).append(e)
    return out


def _sites(fault: Fault, setup: Setup) -> tuple[str, ...]:
    if fault.on == "rig":
        return ("",)
    bodies = ("a1", "a2", "a3") if setup.carried[1] else ("a1", "a2")
    return tuple(c for c in (bodies if fault.on == "body" else ("a1", "a2", "a3", "P")) if c in setup.channels)
