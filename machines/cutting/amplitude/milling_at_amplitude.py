"""Milling charts of a machine at an amplitude, by collocation or by harmonics, from `DevelopedChatter`."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError, Outcome
from jointlib.shown.progress import each

from ...indices import Mask
from ...model.machine import Machine
from ...operating.operating_point import OpenTool, OperatingPoint
from ...tool.bounded_band import shape
from ...tool.machine_model import machine_model
from ...tool.tool_point import tool_point
from ..loops.critical_depth import near
from ..loops.harmonic_crossing import Found
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting
from ..rest.beyond_record import refuse_beyond
from ..rest.periodic import charted
from ..rest.solve import default_method, known_method, said_before, spindle_speeds
from .developed_chatter import DevelopedChatter, Persistent
from .held_joints import Constant, HeldInHarmonics, HeldInModes, HeldJoints

_UNBOUNDED, _WORTH_TELLING = 1.0, 1e-4

HELD = (
    "Joints are held, at every speed, as the springs and dampers that they are at this amplitude and the frequency of "
    "the chatter there."
)


def developed_lobes(
    machine: Machine, cutting: Cutting, speed: ArrayLike, amplitude: float, method: str | None, table: OperatingPoint
) -> tuple[StabilityLobes, Mask]:
    """Milling chart while the tool vibrates with an amplitude in m, and at which speeds a joint is held at its limit.

    ``table`` is the machine at that amplitude over its band, moved by the mean cut. Without a method: as
    `stability_lobes`, collocation where the machine has modes.
    """
    speeds = spindle_speeds(speed)
    middle = len(table.gain) // 2
    try:
        model = machine_model(machine, float(table.frf.frequency[middle]), table.gain[middle])
    except InputError:
        if method == "collocation":
            raise
        model = None
    point = tool_point(table.frf, machine.tool_axes)
    name = default_method(model or point, cutting, speeds) if method is None else known_method(method, cutting)
    # Where so many oscillations are in a cut that harmonics are chosen, the search in modes would not end either.
    few = model is not None and "collocation" in (name, default_method(model, cutting, speeds))
    chatter = developed_chatter(machine, cutting, amplitude, table, name, few, model is not None)
    vibrations = list(each("speeds", chatter.persistent(speeds.ravel().tolist()), speeds.size))
    found = [Found(one.crossing, one.line) for one in vibrations]
    said = (
        *said_before(point, cutting),
        HELD,
        *_limits(vibrations),
        *_band(chatter.method, vibrations, speeds.ravel()),
    )
    chart = charted(name, found, cutting, speeds.ravel(), said)
    keys = ("depth", "chatter_frequency", "kind", "lobe")
    held = np.array([one.outcome not in (Outcome.CONVERGED, Outcome.STALLED) for one in vibrations])
    return (
        replace(chart, speed=speeds, **{key: getattr(chart, key).reshape(speeds.shape) for key in keys}),
        held.reshape(speeds.shape),
    )


def developed_chatter(
    machine: Machine,
    cutting: Cutting,
    amplitude: float,
    table: OperatingPoint,
    method: str,
    modes: bool,
    known: bool = True,
) -> DevelopedChatter:
    """What vibrates in a cut; ``modes`` says whether collocation is to be had, ``known`` whether the machine's are."""
    cutting.refuse_unlike("chatter of an amplitude by modes")
    point = tool_point(table.frf, machine.tool_axes)
    highest = shape(point).highest
    harmonics = HeldInHarmonics(machine, cutting, table.frf.frequency, highest, modes=known)
    search: HeldJoints = HeldInModes(machine, cutting, highest) if modes else harmonics
    tool = OpenTool(machine, table.frf.frequency)
    return DevelopedChatter(
        cutting,
        table,
        lambda frequency, direction: tool.on(frequency).held(amplitude, direction),
        search,
        harmonics if method == "multi-frequency" else search,
    )


def _limits(vibrations: list[Persistent]) -> list[str]:
    """A sentence for every limit that a joint met, and where joints and crossing do not agree."""
    counts, every = Counter(one.outcome for one in vibrations), len(vibrations)
    apart = counts.pop(Outcome.STALLED, 0)
    said = [
        f"At {count} of {every} speeds a joint is held at its limit ({outcome.value})."
        for outcome, count in counts.items()
        if outcome is not Outcome.CONVERGED
    ]
    if apart:
        said.append(
            f"At {apart} of {every} speeds no vibration of that size agrees with the joints it moves, as where one of "
            "them sticks; the depth there is that with the joints as they are at the nearest resonance."
        )
    return said


def _band(method: HeldJoints, vibrations: list[Persistent], speed: Array) -> list[str]:
    """What the ends of a measured band may cost, refused where that is more than the depth itself."""
    if not isinstance(method, HeldInHarmonics) or not np.isfinite(method.machine.known_band[1]):
        return []
    bare = HeldInHarmonics(method.machine, method.cutting, method.lines, method.highest, carried_on=False)
    doubt = np.zeros(len(vibrations))
    for i, (one, rpm) in enumerate(zip(vibrations, speed.tolist(), strict=True)):
        if one.crossing.kind and one.gain is not None:
            tooth = method.cutting.cuts_per_revolution * rpm / 60
            without = near(bare.loop(rpm, 0, Constant(one.line * tooth, one.gain)), one.crossing)
            doubt[i] = abs(without.depth / one.crossing.depth - 1)
    worst, (low, high) = int(np.argmax(doubt)), method.machine.known_band
    lines = [
        one.line * method.cutting.cuts_per_revolution * rpm / 60 for one, rpm in zip(vibrations, speed, strict=True)
    ]
    refuse_beyond("multi-frequency", speed, np.array(lines), low, high)
    if doubt[worst] > _UNBOUNDED:
        raise InputError(
            f"multi-frequency: the receptance is known from {low:g} to {high:g} Hz, which decides the depth at "
            f"{int(np.count_nonzero(doubt > _UNBOUNDED))} of {len(doubt)} speeds, at {speed[worst]:g} rpm most; "
            "expected a wider band"
        )
    if doubt[worst] < _WORTH_TELLING:
        return []
    return [
        f"The receptance is known from {low:g} to {high:g} Hz; beyond, it is carried on as a mass and below as a "
        f"spring: the depth may be off by up to {100 * doubt[worst]:.2g} %, at {speed[worst]:g} rpm."
    ]
