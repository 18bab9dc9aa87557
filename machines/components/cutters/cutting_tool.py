"""A tool by its sizes: fluted part, shank, stick-out, and the holder behind it as revolved sections, as a beam."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.toml import Section

from ...shapes.profile import Material
from ...shapes.segment import Segment
from ..beam import Beam
from ..component import Component

EQUIVALENT = 0.8
"""Diameter of the round bar that bends like the fluted part, over that of the cutter, for two and four flutes: Kops,
Vo, Determination of the Equivalent Diameter of an End Mill Based on its Compliance, CIRP Annals 39 (1990)."""
MATERIALS = {
    "carbide": Material("carbide", 580e9, 0.22, 14450.0),
    "hss": Material("hss", 220e9, 0.29, 8150.0),
    "steel": Material("steel", 210e9, 0.3, 7850.0),
}
"""Typical values; makers tell theirs, which stand in the file beside the word."""
HOLDER = "steel"
_LARGEST = 5.0
"""m; of a tool."""
TIP, SHANK, FACE = "tip", "shank", "face"


@dataclass(frozen=True)
class CuttingTool:
    """Sizes of a tool in m, from its tip to where it is held.

    Parameters
    ----------
    diameter, flute_length
        Of the cutter and of its fluted part.
    shank, stick_out
        Diameter of the shank, and distance from the tip to the holder.
    material
        Of cutter and shank.
    sections
        Of the holder behind, one after the other towards the spindle.
    equivalent
        Diameter that bends like the fluted part, over ``diameter``.
    """

    diameter: float
    flute_length: float
    shank: float
    stick_out: float
    material: Material
    sections: tuple[Segment, ...] = ()
    equivalent: float = EQUIVALENT

    def __post_init__(self) -> None:
        for key in ("diameter", "shank", "stick_out"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{key} is {value!r} m, expected more than 0")
            if value > _LARGEST:
                raise InputError(f"{key} is {value:g} m, expected at most {_LARGEST:g} m")
        if not 0 <= self.flute_length <= self.stick_out:
            raise InputError(
                f"flute_length is {self.flute_length!r} m, expected at most the stick_out, {self.stick_out:g} m"
            )
        if not 0 < self.equivalent <= 1:
            raise InputError(f"equivalent is {self.equivalent!r}, expected above 0 and at most 1")

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The round bars that it is made of, from the tip on."""
        lengths = (self.flute_length, self.stick_out - self.flute_length)
        diameters = (self.equivalent * self.diameter, self.shank)
        own = [Segment(n, self.material, d) for n, d in zip(lengths, diameters, strict=True) if n > 0]
        return (*own, *self.sections)

    @property
    def length(self) -> float:
        """m, from the tip to where the holder ends."""
        return self.stick_out + sum(section.length for section in self.sections)

    def beam(
        self,
        name: str,
        at: Array,
        axis: Array,
        up_to: float,
        more: dict[str, float],
        notes: Sequence[str] = (),
        turns: float = 0.0,
    ) -> Beam:
        """A beam with stations tip, shank (at the holder) and, behind a holder, face, which lies at ``at`` (m).

        ``axis`` points from the tip to the spindle; ``more`` are further stations, m from the tip.
        """
        stations = {TIP: 0.0, SHANK: self.stick_out, **({FACE: self.length} if self.sections else {}), **more}
        held = FACE if self.sections else SHANK
        size = float(np.linalg.norm(axis))
        if not size > 0:
            raise InputError(f"component {name!r}: axis is {axis.tolist()}, expected a direction that is not zero")
        start = at - self.length * axis / size
        return Beam(
            name,
            self.segments,
            stations,
            start,
            axis,
            up_to=up_to,
            held=(held,),
            turns=turns,
            notes=tuple(notes),
            flutes=self.flute_length,
        )


class ToolBySizes(Component):
    """A ``[[component]]`` of kind tool, which is a `Beam`."""

    kind: ClassVar[str] = "tool"

    @classmethod
    def from_section(cls, section: Section) -> Component:
        name, word = section.text("name"), section.text("material", "carbide", tuple(MATERIALS))
        loss = section.number("loss_factor", "1", 0.0)
        of_it = MATERIALS[word]
        own = Material(
            word,
            section.number("young", "N/m^2", of_it.young),
            section.number("poisson", "1", of_it.poisson),
            section.number("density", "kg/m^3", of_it.density),
            loss,
        )
        diameter = section.number("diameter", "m")
        flutes, shank = section.number("flute_length", "m"), section.number("shank", "m", diameter)
        stick_out = section.number("stick_out", "m")
        notes = []
        if not section.has("equivalent") and flutes > 0:
            notes.append(f"assumed equivalent = {EQUIVALENT:g}: the fluted part bends like a bar of that share of it.")
        equivalent = section.number("equivalent", "1", EQUIVALENT)
        of_holder = MATERIALS[HOLDER]
        steel = Material(HOLDER, of_holder.young, of_holder.poisson, of_holder.density, loss)
        sections = tuple(_section(part, steel) for part in section.sections("section"))
        more = {}
        for part in section.sections("station"):
            more[part.text("name")] = part.number("at", "m")
            part.done()
        at, axis = (section.numbers(key, unit, default, length=3) for key, unit, default in _PLACES)
        up_to, turns = section.number("up_to", "Hz", 10e3), section.number("turns", "1", 0.0)
        try:
            tool = CuttingTool(diameter, flutes, shank, stick_out, own, sections, equivalent)
        except InputError as error:
            raise InputError(f"{section.where}: {error}") from None
        return tool.beam(name, np.array(at), np.array(axis), up_to, more, notes, turns)


_PLACES = (("at", "m", (0.0, 0.0, 0.0)), ("axis", "1", (0.0, 0.0, 1.0)))


def _section(part: Section, material: Material) -> Segment:
    """A revolved section of the holder."""
    length, diameter, bore = part.number("length", "m"), part.number("diameter", "m"), part.number("bore", "m", 0.0)
    part.done()
    try:
        return Segment(length, material, diameter, bore)
    except InputError as error:
        raise InputError(f"{part.where}: {str(error).removeprefix('segment: ')}") from None
