"""What kind of measurement the signals make, as far as they tell it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

_MOTIONS = ("acceleration", "velocity", "displacement")
_SHOWN = 3
_STRUCK = 0.1
"""Of a hammer, the force is above a tenth of its peak for less than this share of the time."""


@dataclass(frozen=True)
class Seen:
    """One signal, as far as the kind depends on it."""

    name: str
    quantity: str
    values: Array


def likely_kind(
    seen: Sequence[Seen], sampled: bool, known: Sequence[str], where: str, left_out: Sequence[str] = ()
) -> tuple[str, str]:
    """The kind and why; refused where the signals make none, with what was left out of them."""
    forces = [s for s in seen if s.quantity == "force"]
    travels = [s for s in seen if s.quantity in ("displacement", "position")]
    accelerations = [s for s in seen if s.quantity == "acceleration"]
    motions = [s for s in seen if s.quantity in _MOTIONS]
    names = {s.name.casefold() for s in accelerations}
    if {"a1", "a2"} <= names:
        return "rig", "channels a1 and a2 are those of a rig of two bodies"
    if "impact" in known and sampled and len(forces) == 1 and motions and not _is_slow(travels, accelerations):
        if _struck(forces[0].values):
            return "impact", "the force comes in short hits"
        if not travels:
            some = 2 <= len(accelerations) <= 3
            return _RIG if some else ("shaker", "a force that lasts and the motion that it causes")
    if "shaker" in known and sampled and len(forces) > 1 and motions and not _is_slow(travels, accelerations):
        return "shaker", "several forces and the motions that they cause"
    if forces and travels:
        if sampled:
            return "path", "a force over a displacement in time"
        return "static", "a force over a displacement, without a time"
    if sampled and 2 <= len(accelerations) <= 3:
        return _RIG
    found = ", ".join(f"{s.name} ({s.quantity})" for s in seen) or "no signal"
    volts = next((s.name for s in seen if s.quantity == "voltage"), None)
    which = f"{volts or 'NAME'}.quantity=force{f' and channel.{volts}.sensitivity=2.2mV/N' if volts else ''}"
    kinds = f"expected --kind {', '.join(known)}, or --set channel.{which}"
    drives = [told for told in left_out if "makes it a force" in told]
    drives += [
        f"{s.name} does with --set channel.{s.name}.sensitivity='14.7 N/A'" for s in seen if s.quantity == "current"
    ]
    drives = drives or [told for told in left_out if "at a lever of" in told][:1]
    if drives:
        kinds = f"and {'; '.join(drives[:_SHOWN])}"
    elif left_out:
        more = f" (and {len(left_out) - _SHOWN} more)" if len(left_out) > _SHOWN else ""
        kinds = f"as {'; '.join(left_out[:_SHOWN])}{more}; {kinds}"
    raise InputError(f"{where}: {found} make{'s' * (len(seen) == 1)} no measurement alone, {kinds}")


_RIG = ("rig", "two or three accelerations are those of a rig of bodies on a joint")


def _is_slow(travels: Sequence[Seen], accelerations: Sequence[Seen]) -> bool:
    return bool(travels) and not accelerations


def _struck(force: Array) -> bool:
    """Whether a force is nearly nothing for nearly all of the time."""
    size = np.abs(force - np.median(force))
    peak = float(np.max(size, initial=0.0))
    return peak > 0 and float(np.mean(size > 0.1 * peak)) < _STRUCK
