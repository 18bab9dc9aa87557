"""What a trace of a rig leaves: corrections of the measurement, modulations of the joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.fault import Fault, Shape
from jointlib.joint import Joint
from jointlib.loop.answer.catalogue import catalogue
from jointlib.loop.balance.bench import Found, Raw
from jointlib.loop.contest.fitted import Fitted
from jointlib.loop.periodic.readings import Readings
from jointlib.measurement import Correction
from jointlib.modulation import Modulation
from jointlib.parameter import Role


def corrections_of(fitted: Fitted, data: Readings) -> tuple[Correction, ...]:
    """The named faults as they are written into a measurement file; one a record where records share no clock."""
    out = []
    for f in fitted.found:
        if f.fault.on == "joint":
            continue
        channel = f.site if f.fault.on == "channel" else None
        body = data.rig.bodies.get(f.site, f.site) if f.fault.on == "body" else None
        records = [raw.spectra.name for raw in fitted.raws] if f.fault.per_record else [None]
        for name, parameters in zip(records, f.parameters, strict=True):
            out.append(Correction(f.fault.family, channel, body, parameters, name))
    return tuple(out)


def modulated(joint: Joint, fitted: Fitted) -> Joint:
    """The joint with what was found to change its stiffness over time or place."""
    found = [f for f in fitted.found if f.fault.on == "joint"]
    if not found:
        return joint
    k = float(np.mean([o.stiffness for o in fitted.records]))
    others = [m for m in joint.modulations if not _is_fault(m, fitted.raws)]
    return replace(joint, modulations=(*others, *(_modulation(f, fitted, k) for f in found)))


def _modulation(f: Found, fitted: Fitted, stiffness: float) -> Modulation:
    """A table of the stiffness factor: over the length of a record, or over one wave."""
    if f.fault.family == "stiffness-drift":
        end = max(r.spectra.samples / r.spectra.sample_rate for r in fitted.raws)
        rate, bend = (float(np.mean([p[n] for p in f.parameters])) for n in ("stiffness_rate", "stiffness_bend"))
        course = [(t, 1.0 + (rate * t + bend * t**2) / stiffness) for t in np.linspace(0.0, end, 9).tolist()]
        return Modulation(Role.STIFFNESS, "time", 0.0, tuple(course))
    period = f.shape["wavelength"] if "wavelength" in f.shape else 1 / f.shape["frequency"]
    size = float(np.sqrt(np.mean([p["cosine"] ** 2 + p["sine"] ** 2 for p in f.parameters]))) / stiffness
    at = np.linspace(0.0, period, 25)
    table = tuple((float(x), float(1 + size * np.sin(2 * np.pi * x / period))) for x in at)
    return Modulation(Role.STIFFNESS, "position" if "wavelength" in f.shape else "time", 0.0, table, period)


def starting_point(joint: Joint, raws: Sequence[Raw]) -> tuple[Joint, tuple[Found, ...]]:
    """A joint whose modulations over time or place, found by an earlier trace, are fitted to each record from the
    start; those that follow an input stay with the joint."""
    faults = {f.family: f for f in catalogue().rig}
    found = []
    for m in joint.modulations:
        if not _is_fault(m, raws):
            continue
        family = "position-stiffness" if m.period else "stiffness-drift"
        if family in faults:
            key = "wavelength" if m.condition == "position" else "frequency"
            value = 0.0 if m.period is None else m.period if m.condition == "position" else 1 / m.period
            shape: Shape = {key: value} if m.period else {}
            found.append(_unsized(faults[family], shape, len(raws)))
    return joint, tuple(found)


def _is_fault(m: Modulation, raws: Sequence[Raw]) -> bool:
    """Whether a modulation is fitted to each record by itself: over time, or wave by wave over the place."""
    if m.role is not Role.STIFFNESS or m.condition not in ("time", "position"):
        return False
    return m.period is not None or not raws[0].inputs.active([m])


def _unsized(fault: Fault, shape: Shape, records: int) -> Found:
    """A fault with coefficients still to be fitted."""
    zero = np.zeros(len(fault.parameters) - len(fault.shape_parameters) + 2)
    return Found(fault, "", shape, (fault.correction(zero, shape) or {},) * records, (zero,) * records)
