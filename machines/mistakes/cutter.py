"""The cutter of a mill: one that points into the machine, along its own axis, or whose sizes do not go together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from jointlib.arrays import Array

from ..components.beam import Beam
from ..components.cutters.cutting_tool import EQUIVALENT, SHANK
from ..components.rigid import Rigid
from ..files.tool_file import HELD
from ..model.machine import Machine
from ..modes.natural_modes import NaturalModes
from .bodies import block
from .tool_point import place_of

_WIDER, _NARROWER = 8.0, 1 / 3
"""Diameter of the cut over that of the cutter by its sizes; a slitting saw on its arbor has 6."""
_SLIM = 15.0
"""Stick-out over diameter; milling cutters have 3 to 6, on extensions up to 12."""
_ALONG = 0.99
_SLENDER = 0.6
"""Second largest over largest side of a ram or quill."""
_BACK = 0.8
"""Share of the stick-out by which the tip is farther from the workpiece than the end that is held."""
_KILO = 1e3


def wrong_cutter(machine: Machine) -> Iterator[str]:
    """What is wrong with a cutter that is given by its sizes."""
    cutting = machine.cutting or {}
    cutter = _cutter(machine)
    if cutter is None or cutter.start is None:
        return
    if cutting.get("process", "milling") == "milling":
        yield from _sizes(cutter, cutting.get("diameter"))
        for axis in machine.tool_axes:
            side = machine.tool[axis].partition(" - ")[0].strip()
            way = "xyz".find(side.rpartition(".")[2].removeprefix("u"))
            if way >= 0 and abs(float(cutter.frame[0][way])) > _ALONG:
                yield (
                    f"{machine.tool_table}: {axis} is {side}, along the axis of {cutter.name}; a mill cuts across it, "
                    "so expected x and y across it"
                )
    yield from _pointing(machine, cutter)


def _cutter(machine: Machine) -> Beam | None:
    own = {dof.partition(".")[0] for dof in machine.tool.values()}
    found = [
        part for part in machine.components if isinstance(part, Beam) and part.flutes is not None and part.name in own
    ]
    return found[0] if len(found) == 1 else None


def _sizes(cutter: Beam, cut: float | None) -> Iterator[str]:
    out = cutter.stations[SHANK]
    ends = np.cumsum([s.length for s in cutter.segments])
    own = [s.diameter for s, end in zip(cutter.segments, ends, strict=True) if end <= out * (1 + 1e-9) and s.diameter]
    if not own:
        return
    fluted = own[0] if len(own) == 1 else own[0] / EQUIVALENT
    if cut is not None and not _NARROWER * fluted < float(cut) < _WIDER * max(own):
        yield (
            f"[cutting]: diameter is {float(cut) * 1e3:g} mm, and {cutter.name} is by its sizes one of about "
            f"{fluted * 1e3:.3g} mm; expected the same: which of them is wrong?"
        )
    elif out > _SLIM * max(own):
        yield (
            f"{cutter.name}: it sticks out {out * 1e3:.4g} mm at a diameter of {max(own) * 1e3:.3g} mm, "
            f"{out / max(own):.3g} times as long, expected at most 12: is its unit right?"
        )


def _pointing(machine: Machine, cutter: Beam) -> Iterator[str]:
    """A tip inside of what carries the tool, or behind the end that is held as the workpiece sees it."""
    assert cutter.start is not None
    held = cutter
    carriers = _beside(machine, held.name)
    if carriers == {HELD}:
        held = next((c for c in machine.components if c.name == HELD and isinstance(c, Beam)), cutter)
        carriers = _beside(machine, HELD) - {cutter.name}
    if held.start is None or len(carriers) != 1:
        return
    carrier = next((c for c in machine.components if c.name in carriers), None)
    tip, nose = cutter.start, held.start + sum(s.length for s in held.segments) * held.frame[0]
    inside = isinstance(carrier, Beam) and _in_beam(carrier, tip, nose)
    if inside or (isinstance(carrier, Rigid) and _in_ram(carrier, tip, nose)):
        assert carrier is not None
        yield (
            f"{cutter.name}: its tip lies at {_words(tip)} m, inside of {carrier.name}, which holds it at "
            f"{_words(nose)} m, so that it points into the machine: is the axis of the tool, or of [spindle], "
            "the wrong way round?"
        )
        return
    for dof in machine.tool.values():
        work = dof.partition(" - ")[2].strip()
        at = place_of(machine, work) if work else None
        if at is None:
            continue
        out = float(np.linalg.norm(tip - nose))
        aside = float(np.linalg.norm(np.cross(at - nose, (tip - nose) / out)))
        far, near = float(np.linalg.norm(tip - at)), float(np.linalg.norm(nose - at))
        if far - near > _BACK * out and aside < out:
            yield (
                f"{cutter.name}: its tip lies {far * 1e3:.4g} mm from {work.rpartition('.')[0]} and the end that is "
                f"held {near * 1e3:.4g} mm, so that it points away from it: is the axis of the tool, or of [spindle], "
                "the wrong way round?"
            )
            return


def _in_beam(carrier: Beam, tip: Array, nose: Array) -> bool:
    """Within a spindle, along it, from one of its ends inwards."""
    assert carrier.start is not None
    length = sum(s.length for s in carrier.segments)
    first, last = (float((at - carrier.start) @ carrier.frame[0]) for at in (nose, tip))
    aside = float(np.linalg.norm(tip - carrier.start - last * carrier.frame[0]))
    thick = max(s.diameter or s.height or 0.0 for s in carrier.segments)
    inwards = 0 < last < length and (last < first if first > length / 2 else last > first)
    return inwards and abs(last - first) > _ALONG * float(np.linalg.norm(tip - nose)) and aside < thick / 2


def _in_ram(carrier: Rigid, tip: Array, nose: Array) -> bool:
    """Within a slender body, along its longest side, towards its middle from one of its ends."""
    assert carrier.centre is not None
    size, vectors = block(carrier), np.linalg.eigh(carrier.inertia)[1]
    along = vectors[:, 0]  # the least inertia is about the longest side
    if size[1] > _SLENDER * size[2]:
        return False
    out = tip - nose
    first, last = float((nose - carrier.centre) @ along), float((tip - carrier.centre) @ along)
    aside = max(float(np.linalg.norm(np.cross(at - carrier.centre, along))) for at in (tip, nose))
    return (
        abs(float(out @ along)) > _ALONG * float(np.linalg.norm(out))
        and abs(first) > size[2] / 4
        and abs(last) < abs(first)
        and first * last > 0
        and aside < size[1] / 2
    )


def _beside(machine: Machine, part: str) -> set[str]:
    sides = [{side.partition(".")[0] for side in c.between} for c in machine.connections]
    return {other for pair in sides if part in pair for other in pair} - {part}


def _words(at: Array) -> str:
    return "(" + ", ".join(f"{round(float(x), 4) + 0.0:g}" for x in at) + ")"


def band_of_none(modes: NaturalModes) -> Iterator[str]:
    """A band of ``[response]`` far below every mode that in kHz would hold those that the tool feels."""
    band = modes.machine.frequency
    if band is None or not modes.machine.tool or not len(modes.pole):
        return
    low, high = band
    felt = modes.frequency[modes.felt]
    if high * 3 < modes.frequency[0] and np.any((felt > _KILO * low) & (felt < _KILO * high)):
        yield (
            f"[response]: frequency ends at {high:g} Hz, far below the first mode at {modes.frequency[0]:.4g} Hz, so "
            f'that nothing resonates in it: was it meant in kHz? Then write ["{low:g} kHz", "{high:g} kHz"]'
        )
