"""What the declaration of a measurement must hold for its kind."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

from jointlib.corrections import faults
from jointlib.cutting_force.cut import AXES
from jointlib.errors import InputError, nearest, together
from jointlib.estimation.settings import EXCITED
from jointlib.measurement import CUTS, FORCES, MOTIONS, RINGDOWN, Channel, Correction, Measurement


def check(m: Measurement, channels: bool = True, records: bool = True) -> None:
    """Refuse what does not fit together; without ``channels`` or ``records`` not all of those could be read."""
    of_channels = (_names, _wanted, _excited, _dynamometer, _heard) if channels else ()
    of_records = (
        (_roles, _rates, _one_process, *(partial(_correction, correction=c) for c in m.corrections)) if records else ()
    )
    together(*(partial(each, m) for each in (_driven, _place, _accelerations, *of_channels, *of_records)))


def _names(m: Measurement) -> None:
    names = [c.name for c in m.channels]
    if len(set(names)) < len(names):
        raise InputError(f"{m.source}: a channel name stands twice among {', '.join(names)}")


def _wanted(m: Measurement) -> None:
    """The quantities without which there is no equation."""
    names = [c.name for c in m.channels]
    said = []
    for name in ("a1", "a2") if m.kind == "rig" else ():
        if name not in names:
            said.append(f"{m.source}: channel {name!r} is missing, a rig needs accelerations a1 and a2")
    wanted = {"path": ("force", "displacement"), "static": ("force", "displacement")}.get(m.kind, ())
    for quantity in wanted:
        if not m.of(quantity) and not (quantity == "displacement" and m.of("position")):
            said.append(f"{m.source}: no {quantity} channel, a {m.kind} measurement needs one")
    motions = [c.name for c in m.channels if c.quantity in MOTIONS and not c.is_input]
    if m.kind == RINGDOWN and len(motions) != 1:
        told = ", ".join(motions) or "none"
        said.append(f"{m.source}: channels of motion: {told}; expected one in a ringdown, the motion across the joint")
    if said:
        raise InputError(*said)


def _excited(m: Measurement) -> None:
    """Hits and shakers: one force, motions, and where each acts."""
    if m.kind not in EXCITED:
        return
    forces, motions = m.of("force"), [c for c in m.channels if c.quantity in MOTIONS and not c.is_input]
    said = []
    if len(forces) != 1 and (m.kind == "impact" or not forces):
        found = ", ".join(c.name for c in forces) or "no force channel"
        said.append(f"{m.source}: {found}, expected one channel of quantity 'force' in a measurement of {m.kind}")
    elif len(forces) > 1:
        said += _several(m, forces)
    if not motions:
        said.append(f"{m.source}: no channel of {', '.join(MOTIONS)}, expected the motion that the force causes")
    for c in motions:
        if c.dof is None:
            said.append(f"{m.source}: channel {c.name}: dof is missing, expected what it measures, such as 'tool.x'")
    for c in forces:
        if c.dof is None and any(r.drive is None for r in m.records):
            said.append(
                f"{m.source}: channel {c.name}: dof is missing, expected where it acts (or drive in each record)"
            )
    if said:
        raise InputError(*said)


def _dynamometer(m: Measurement) -> None:
    """Cutting forces: channels that are forces along known directions."""
    process = next((r.cut.process for r in m.records if r.cut is not None), None)
    if m.kind != FORCES or process is None:
        return
    axes = AXES[process]
    forces = [c.name for c in m.of("force")]
    said = [
        f"{m.source}: channel {name}, expected a force of {process} among {', '.join(axes)} (name, or role)"
        for name in forces
        if name not in axes
    ]
    if not said and not set(axes[:2]) & set(forces):
        said = [f"{m.source}: no channel {' or '.join(axes[:2])}, expected a force in the plane of the cut"]
    if said:
        raise InputError(*said)


def _heard(m: Measurement) -> None:
    """Test cuts with records: a rate, which WAV files tell themselves, and something that was recorded."""
    if m.kind != CUTS or not m.records:
        return
    silent = m.sample_rate is None and any(r.file.suffix.lower() != ".wav" for r in m.records)
    said = [f"{m.source}: sample_rate is missing, expected that of the records"] if silent else []
    if not [c for c in m.channels if c.quantity not in ("time", "temperature")]:
        said.append(f"{m.source}: no [[channel]], expected the sound, vibration or force of the cuts")
    if said:
        raise InputError(*said)


def _one_process(m: Measurement) -> None:
    found = list(dict.fromkeys(r.cut.process for r in m.records if r.cut is not None))
    if len(found) > 1:
        raise InputError(f"{m.source}: records of {' and '.join(found)}, expected one process in a measurement")


def _several(m: Measurement, forces: Sequence[Channel]) -> list[str]:
    """What does not go with several forces at once."""
    said = []
    many = f"{len(forces)} forces at once"
    places = [c.dof for c in forces if c.dof is not None]
    if len(set(places)) < len(places):
        said.append(f"{m.source}: {many}, two of them at {max(places, key=places.count)!r}, expected a place for each")
    if m.estimate.signal != "random" or m.period is not None or any(r.period is not None for r in m.records):
        said.append(f'{m.source}: {many}, expected signal = "random" in [estimate] and no period')
    if m.estimate.estimator != "H1":
        said.append(f"{m.source}: {many} and estimator {m.estimate.estimator!r}, expected 'H1'")
    if any(r.drive is not None for r in m.records):
        said.append(f"{m.source}: {many} and drive in a record, expected dof of each force channel alone")
    return said


def _accelerations(m: Measurement) -> None:
    said = []
    for channel in m.of("acceleration") if m.kind == "rig" else ():
        if channel.body not in m.bodies:
            word = f"{channel.name}: body is {channel.body!r}"
            said.append(f"{m.source}: channel {word}, {nearest(str(channel.body), m.bodies)}")
    if said:
        raise InputError(*said)


def _driven(m: Measurement) -> None:
    if m.kind == "rig" and (m.driven is None or m.driven not in m.bodies):
        raise InputError(f"{m.source}: driven is {m.driven!r}, {nearest(str(m.driven), m.bodies)}")


def _place(m: Measurement) -> None:
    if m.kind == "frf" and (m.channels or m.corrections):
        found = "[[channel]]" if m.channels else "[[correction]]"
        raise InputError(f"{m.source}: {found} has no place in a measurement of kind 'frf', expected [[record]] alone")


def _roles(m: Measurement) -> None:
    if m.kind != CUTS and not m.with_role("fit"):
        raise InputError(f'{m.source}: no record has role = "fit", expected at least one')


def _rates(m: Measurement) -> None:
    rates = {r.sample_rate for r in m.records if r.sample_rate is not None} | ({m.sample_rate} - {None})
    if len(rates) > 1:
        listed = " and ".join(f"{r:g} Hz" for r in sorted(r for r in rates if r))
        raise InputError(f"{m.source}: records of different sample rates ({listed}), expected one rate")


def _correction(m: Measurement, correction: Correction) -> None:
    units = faults(m.kind)[correction.family].parameters.values()
    if m.sample_rate is None and any(re.search(r"\b(s|Hz)\b", unit) for unit in units):
        raise InputError(f"{m.source}: [[correction]] {correction.family} acts in time, expected a sample_rate")
    if not any(correction.concerns(record) for record in m.records):
        said = nearest(str(correction.record), {record.name for record in m.records})
        raise InputError(f"{m.source}: [[correction]] names record {correction.record!r}, {said}")
