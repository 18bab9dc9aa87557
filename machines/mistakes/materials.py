"""Materials and sections of beams, and modes of modal parts, that no machine is made of."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..components.beam import Beam
from ..components.modal import Modal
from ..components.riding import Riding
from ..model.machine import Machine
from ..shapes.segment import Segment
from .scale import outside

_DENSITY = (400.0, 20e3)
"""kg/m³, from balsa-cored panels and wood to tungsten (19 300); cast iron 7200, steel 7850, polymer concrete 2300
(Ashby, Materials Selection in Mechanical Design, table of densities)."""
_YOUNG = (5e8, 1.2e12)
"""Pa, from polymers to diamond; aluminium 70, cast iron 115, steel 210, cemented carbide 600 GPa (ibid.)."""
_LOSS = 0.3
"""Loss factor; rubber has as much, castings 0.001 to 0.01, polymer concrete 0.02 to 0.05."""
_RINGS = 3e-5
"""Less than any loss factor of steel, and twice any damping ratio; what is undamped has 0."""
_THICK = (0.5e-3, 3.0)
"""m, from the smallest micro-tool to the largest column."""
_LONG = 20.0
"""m; beds of the largest machines are built of pieces of less."""
_SLENDER = 150.0
"""Length over thickness; a boring bar reaches 15, a deep-hole drill 100."""
_WALL = 1 / 150
"""Wall over diameter; castings have 1/30, sheet-metal columns 1/100."""
_RATIO = 1.0
"""Damping ratio at which a mode no longer swings."""
_DAMPED = 0.45
"""Damping ratio above all that is measured of parts; tuned absorbers of high damping reach 0.35. Modes that were fitted
to measured responses may have any, as some stand for what lies outside their band."""
_FREQUENCY = (0.5, 1e5)
"""Hz of a mode of a part: below stand machines on air springs, above nothing that a machine does."""


def wrong_beams(machine: Machine) -> Iterator[str]:
    """Sections and materials of beams; one sentence for every wrong value."""
    for beam in machine.components:
        if not isinstance(beam, Beam):
            continue
        for material in dict.fromkeys(s.material for s in beam.segments):
            of = f"{beam.name}: the {{}} of {material.name!r}"
            yield from filter(None, [outside(material.density, *_DENSITY, of.format("density"), "kg/m^3")])
            yield from filter(None, [outside(material.young, *_YOUNG, of.format("modulus young"), "GPa", 1e-9)])
            if material.loss_factor > _LOSS:
                yield (
                    f"{of.format('loss_factor')} is {material.loss_factor:g}, that of rubber; expected 0.001 to "
                    "0.05: was "
                    "it given in percent?"
                )
            if 0 < material.loss_factor < _RINGS:
                yield (
                    f"{of.format('loss_factor')} is {material.loss_factor:.3g}, less than of a bell; expected 0.001 to "
                    "0.05"
                )
        for number, segment in enumerate(beam.segments, start=1):
            yield from _section(f"{beam.name}: segment {number}", segment)
        length = sum(s.length for s in beam.segments)
        if length > _LONG:
            yield f"{beam.name}: it is {length:g} m long, expected at most {_LONG:g} m: were mm read as m?"
        elif length > _SLENDER * max(_sizes(s)[0] for s in beam.segments):
            yield (
                f"{beam.name}: it is {length * 1e3:g} mm long and nowhere thicker than "
                f"{max(_sizes(s)[0] for s in beam.segments) * 1e3:g} mm, slender beyond reason (more than {_SLENDER:g} "
                "times): is its section right?"
            )


def _sizes(segment: Segment) -> tuple[float, float]:
    """Largest and smallest size of a section in m; of one given by its moments, those of the bar that has them."""
    if segment.diameter is not None:
        return segment.diameter, segment.diameter
    if segment.width is not None and segment.height is not None:
        return max(segment.width, segment.height), min(segment.width, segment.height)
    profile = segment.profile
    second = np.array([profile.second_2, profile.second_3])
    sides = np.sqrt(12 * second / profile.area)
    return float(np.max(sides)), float(np.min(sides))


def _section(where: str, segment: Segment) -> Iterator[str]:
    for size in dict.fromkeys(_sizes(segment)):
        said = outside(size, *_THICK, f"{where}: its section", "mm", 1e3)
        if said:
            yield said
            return
    if segment.diameter is not None and segment.bore and segment.diameter - segment.bore < 2 * _WALL * segment.diameter:
        yield (
            f"{where}: a bore of {segment.bore * 1e3:g} mm in a diameter of {segment.diameter * 1e3:g} mm "
            "leaves a wall of "
            f"{(segment.diameter - segment.bore) * 500:.3g} mm, expected more than 1/150 of the diameter: is "
            "its section "
            "right?"
        )
    if segment.wall is not None and segment.wall < _WALL * max(_sizes(segment)):
        side = max(_sizes(segment)) * 1e3
        yield (
            f"{where}: a wall of {segment.wall * 1e3:g} mm in a box of {side:g} mm, expected more than 1/150 of its "
            "side: is its section right?"
        )


def oversized(machine: Machine) -> bool:
    """Whether a beam is longer than any machine."""
    beams = (part for part in machine.components if isinstance(part, Beam))
    return any(sum(s.length for s in beam.segments) > _LONG for beam in beams)


def wrong_modes(machine: Machine) -> Iterator[str]:
    """Modes of modal parts: damping in percent, frequencies off by a thousand."""
    for component in machine.components:
        part = component.modes if isinstance(component, Riding) else component
        if not isinstance(part, Modal):
            continue
        for frequency, ratio in zip(part.frequency, part.damping_ratio, strict=True):
            if ratio >= _RATIO:
                yield (
                    f"{part.name}: the mode at {frequency:g} Hz has a damping_ratio of {ratio:g}, so it does "
                    "not swing; "
                    "expected 0.001 to 0.2: was it given in percent?"
                )
            elif ratio > _DAMPED and not part.notes:
                yield (
                    f"{part.name}: the mode at {frequency:g} Hz has a damping_ratio of {ratio:g}, that of a shock "
                    "absorber; expected 0.001 to 0.2: was it given in percent?"
                )
            if 0 < 2 * ratio < _RINGS:
                yield (
                    f"{part.name}: the mode at {frequency:g} Hz has a damping_ratio of {ratio:.3g}, less than a bell; "
                    "expected 0.001 to 0.2"
                )
            if frequency > 0:
                said = outside(float(frequency), *_FREQUENCY, f"{part.name}: the frequency of a mode", "Hz")
                yield from filter(None, [said])
        flexible = part.frequency > 0
        assert part.modal_mass is not None
        size = np.max(np.abs(part.shapes), axis=0)
        for f, m, s in zip(part.frequency[flexible], part.modal_mass[flexible], size[flexible], strict=True):
            with np.errstate(over="ignore", divide="ignore"):
                stiffness = float(m * (2 * np.pi * f) ** 2 / s**2) if s > 0 else np.inf
            if np.isfinite(stiffness):
                what = f"{part.name}: the stiffness of its mode at {f:g} Hz, modal_mass·ω² at its largest shape,"
                yield from filter(None, [outside(stiffness, 1e3, 1e14, what, "N/um", 1e-6)])
