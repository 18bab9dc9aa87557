"""Corrections: the fault of the catalogue that each one names, and records without those faults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.fault import Fault, Setting
from jointlib.loop.balance.bodies import rig_of
from jointlib.measurement import Correction, Measurement, RecordSource
from jointlib.path_fault import PathFault
from jointlib.registry import installed


def faults(kind: str) -> dict[str, Fault | PathFault]:
    """The installed faults that a measurement of this kind can be corrected for, by family.

    Along a path, the fault of the force comes before that of a rig with the same name.
    """
    effects = [effect() for effect in installed("jointlib.effects").found.values()]
    sites = ("channel", "body", "rig") if kind == "rig" else ("channel", "body")
    found: dict[str, Fault | PathFault] = {e.family: e for e in effects if isinstance(e, Fault) and e.on in sites}
    if kind == "path":
        found |= {e.family: e for e in effects if isinstance(e, PathFault)}
    return found


def without_faults(
    m: Measurement, source: RecordSource, channels: Mapping[str, Array], period: int | None
) -> Mapping[str, Array]:
    """The channels of a record in SI with every correction undone, in file order."""
    corrections = [c for c in m.corrections if c.concerns(source)]
    if not corrections:
        return channels
    known = faults(m.kind)
    length = len(next(iter(channels.values())))
    parts = _parts(length, period, m.settle)
    masses = _masses(m)
    for correction in corrections:
        fault = known[correction.family]
        try:
            with np.errstate(all="ignore"):
                if isinstance(fault, PathFault):
                    channels = _undo_on_path(fault, m, source, channels, correction)
                else:
                    channels = _undo_in_parts(fault, correction, channels, parts, m.sample_rate or 0.0, masses)
        except InputError as error:
            raise InputError(f"{m.source}: {source.name}: {error}") from None
        for name, x in channels.items():
            if not np.all(np.isfinite(x)):
                what = f"{correction.family} of {correction.site}" if correction.site else correction.family
                raise InputError(f"{m.source}: undoing the [[correction]] {what} leaves no finite numbers in {name}")
    return channels


def _undo_in_parts(
    fault: Fault,
    correction: Correction,
    channels: Mapping[str, Array],
    parts: Sequence[tuple[int, int, bool]],
    sample_rate: float,
    masses: Mapping[str, float],
) -> Mapping[str, Array]:
    """The parts of a record apart from each other, so that in its steady part a shift wraps around."""
    mended = []
    for first, end, periodic in parts:
        piece = {name: x[first:end] for name, x in channels.items()}
        setting = Setting(sample_rate, first, periodic, masses)
        mended.append(fault.undo(piece, correction.site, correction.parameters, setting))
    return {name: np.concatenate([piece[name] for piece in mended]) for name in channels}


def _parts(length: int, period: int | None, settle: int) -> list[tuple[int, int, bool]]:
    """(first, end, periodic) of the run-in, the whole periods of the steady state, and what is left."""
    if not period or length < (settle + 1) * period:
        return [(0, length, False)]
    begin, end = settle * period, length // period * period
    return [p for p in ((0, begin, False), (begin, end, True), (end, length, False)) if p[1] > p[0]]


def _masses(m: Measurement) -> dict[str, float]:
    """kg that move with each accelerometer of a rig, those that are known."""
    if m.kind != "rig":
        return {}
    if any(mass.value is None for name, mass in m.bodies.items() if name != m.driven):
        return {}
    return rig_of(m).masses


def _undo_on_path(
    fault: PathFault, m: Measurement, source: RecordSource, channels: Mapping[str, Array], correction: Correction
) -> Mapping[str, Array]:
    name = correction.site
    clock, along = m.of("time"), (*m.of("position"), *m.of("displacement"))
    time = np.arange(len(channels[name])) / (m.sample_rate or 1.0) + (source.start or 0.0)
    if clock:
        time = channels[clock[0].name]
    force = fault.undo(channels[name], time, channels[along[0].name], correction.parameters)
    return {**channels, name: force}


def joined(kind: str, known: Iterable[Correction], further: Iterable[Correction]) -> tuple[Correction, ...]:
    """Corrections in the order in which they are undone: ``known`` first, ``further`` next.

    A further one joins a known one of the same fault at the same site and with the same shape, so that a chain of
    traces does not pile them up; not across another correction of that site, which need not commute with it.
    """
    found, out = faults(kind), list(known)
    for new in further:
        fault = found[new.family]
        place = _place(out, new, found)
        if place is None:
            out.append(new)
        else:
            together = fault.combined(out[place].parameters, new.parameters)
            out[place] = replace(out[place], parameters=dict(together))
    return tuple(out)


def _place(known: list[Correction], new: Correction, found: Mapping[str, Fault | PathFault]) -> int | None:
    """Where a known correction lies that the new one can join."""
    for index in range(len(known) - 1, -1, -1):
        old = known[index]
        if (old.family, old.channel, old.body, old.record) == (new.family, new.channel, new.body, new.record):
            same = all(old.parameters[n] == new.parameters[n] for n in found[new.family].shape_parameters)
            return index if same else None
        if not _apart(old, new, found):
            return None
    return None


def _apart(one: Correction, other: Correction, found: Mapping[str, Fault | PathFault]) -> bool:
    """True if two corrections can be undone in either order: masses beside samples, or samples of other channels.

    A fault of the force along a path may read time and position, so whatever mends those must keep its place.
    """
    if one.body or other.body:
        return True
    if any(isinstance(found[c.family], PathFault) for c in (one, other)):
        return False
    return bool(one.channel and other.channel and one.channel != other.channel)
