"""Preloads that press rolling contacts and faces further, or less far, than any of them is pressed."""

from __future__ import annotations

from collections.abc import Iterator

from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.hertz_contact import HertzContact

from ..model.machine import Machine
from .elements import Element

_ROLLING = (2e-7, 8e-5)
"""m by which balls or rollers and their grooves approach each other; catalogue preloads of guides, screws and bearings
make 2 to 20 µm, and at 80 µm a ball of 10 mm is far beyond its static load rating (ISO 76)."""
_FACES = (5e-8, 3e-4)
"""m by which two faces approach each other; pressures of 1 to 100 N/mm² on measured stiffnesses make 0.5 to 50 µm."""


def wrong_preload(machine: Machine, element: Element) -> Iterator[str]:
    """An element of a kind whose contacts are pressed by too much or too little."""
    if not element.kind:
        return
    joints = [machine.flexible[i].joint for i in element.rows]
    laws = [law for joint in joints if joint is not None for law in joint.laws]
    rolling = [law.kappa * law.preload ** (2 / 3) for law in laws if isinstance(law, HertzContact)]
    faces = [abs(law.clearance) for law in laws if isinstance(law, ContactLoss)]
    for what, (low, high), pressed in (("rolling contacts", _ROLLING, rolling), ("faces", _FACES, faces)):
        off = [value for value in pressed if not low <= value <= high]
        if off:
            yield (
                f"{element.name}: its preload presses its {what} together by {off[0] * 1e6:.3g} um, expected "
                f"{low * 1e6:g} to {high * 1e6:g} um: is the unit of its preload, or of its stiffness, right?"
            )
