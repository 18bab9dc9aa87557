"""A joint that was measured as a whole, shared among the contacts of a bundle."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.viscous import Viscous

_FORCE = re.compile(r"N(?:[ /].*)?")
_COMPLIANCE = re.compile(r"m/N\^\((\d+)/(\d+)\)")
_MASS = re.compile(r"\b(?:N|kg|Pa|J|W)\b")


def shared(joint: Joint, share: float) -> Joint:
    """The part of a joint that carries this share of its force at the same motion.

    A force that is ``share`` times as large is the same law in another unit of force: parameters in Nᵖ·… become
    shareᵖ times as large.
    """
    factor = {name: share ** _power(joint, name, unit) for name, unit in joint.units.items()}
    values = joint.parameters
    return joint.with_parameters({name: values[name] * factor[name] for name in values})


def _power(joint: Joint, name: str, unit: str) -> float:
    if _FORCE.fullmatch(unit):
        return 1.0
    compliance = _COMPLIANCE.fullmatch(unit)
    if compliance:
        return -int(compliance[1]) / int(compliance[2])
    if _MASS.search(unit):
        raise InputError(f"joint {joint.name!r}: {name} in {unit} cannot be shared among contacts, expected N, N/m, …")
    return 0.0


def guide_of(joint: Joint, kind: str) -> HertzGuide:
    """The guide of a joint that can be shared among rows of balls at an angle to the direction it was measured in."""
    guides = [law for law in joint.laws if isinstance(law, HertzGuide)]
    others = [law.kind for law in joint.laws if not isinstance(law, HertzGuide | Viscous)]
    if len(guides) != 1 or others:
        found = " + ".join(law.kind for law in joint.laws)
        raise InputError(
            f"{kind}: joint {joint.name!r} is {found}, expected hertz-guide with viscous at most: only those can "
            "be shared among the rows"
        )
    return guides[0]


def guide_row(measured: Joint, kind: str, share: float) -> Joint:
    """The joint along the contact line of one contact, which carries this share of one of a guide's four rows."""
    guide = guide_of(measured, kind)
    joint = Joint((HertzContact(guide.preload * share, guide.kappa * share ** (-2 / 3)),))
    sin = float(np.sin(guide.contact_angle))
    for law in measured.laws:
        if isinstance(law, Viscous):
            joint = joint + Viscous(law.damping * share / (4 * sin**2))
    # What was measured along the normal moves a row by sin φ of it.
    slanted = ("amplitude", "velocity")
    validity = {k: (a * sin, b * sin) if k in slanted else (a, b) for k, (a, b) in measured.validity.items()}
    return replace(joint, validity=validity, provenance=dict(measured.provenance))
