"""Tool-holder taper in a spindle nose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.io.toml import Section

from ..shapes.solid import Solid, bar
from .bundle import Bundle, Row, assumed_value, gauss, positive
from .contact_patch import Face


@dataclass(frozen=True, eq=False)
class Taper(Bundle):
    """Rows ``normal_ij``, ``axial_ij`` and ``round_ij`` on rings of patches; axis: from the gauge line inwards.

    The holder is the first side. Patches at Gauss points along the cone and evenly round it; n = cos β radially +
    sin β along the axis presses, the other two rub along the cone and round it. The drawbar force F spreads evenly
    over the cone of area S: p = F/(S (sin β + μ cos β)), friction acting against the pull. A holder that also rests
    on its face has a ``bolted-face`` beside it.

    Parameters
    ----------
    diameter
        At the gauge line in m, where the bundle's ``at`` lies.
    length
        Of the contact, from the gauge line, in m.
    ratio
        Loss of diameter per length, 7/24 for steep tapers.
    drawbar
        Pull in N.
    """

    diameter: float
    length: float
    ratio: float
    drawbar: float
    face: Face
    rings: int = 2
    points: int = 4
    assumed: tuple[str, ...] = ()

    kind: ClassVar[str] = "taper"
    main: ClassVar[tuple[float, float, float]] = (0.0, 1.0, 0.0)

    @classmethod
    def from_section(cls, section: Section) -> Taper:
        said: list[str] = []
        diameter, length = section.number("diameter", "m"), section.number("length", "m")
        ratio = assumed_value(section, said, "ratio", "1", 7 / 24, "7/24")
        drawbar = section.number("drawbar", "N")
        positive(cls.kind, diameter=diameter, length=length, ratio=ratio, drawbar=drawbar)
        positive(cls.kind, **{"diameter at the inner end": diameter - ratio * length})
        face = Face.from_section(section, said, lambda mu: drawbar / cls._resisted(diameter, length, ratio, mu))
        rings, points = (
            section.integer("rings", 2, lower=1, upper=100),
            section.integer("points", 4, lower=3, upper=100),
        )
        return cls(diameter, length, ratio, drawbar, face, rings, points, tuple(said))

    @staticmethod
    def _resisted(diameter: float, length: float, ratio: float, friction: float) -> float:
        """Force along the axis per pressure in m²."""
        half = np.arctan(ratio / 2)
        area = np.pi * (diameter - ratio * length / 2) * length / np.cos(half)
        return float(area * (np.sin(half) + friction * np.cos(half)))

    @property
    def pressure(self) -> float:
        """N/m²."""
        return self.drawbar / self._resisted(self.diameter, self.length, self.ratio, self.face.friction)

    def rows(self) -> tuple[Row, ...]:
        half = np.arctan(self.ratio / 2)
        cos, sin = np.cos(half), np.sin(half)
        axis, out = np.array([1.0, 0.0, 0.0]), []
        for i, (place, share) in enumerate(gauss(self.rings, self.length), start=1):
            depth = self.length / 2 + place
            radius = (self.diameter - self.ratio * depth) / 2
            area = 2 * np.pi * radius * share * self.length / cos / self.points
            pressed, rubbed = self.face.pressed(area, self.pressure), self.face.rubbed(area, self.pressure)
            for j in range(self.points):
                angle = 2 * np.pi * j / self.points
                radial = np.array([0.0, np.cos(angle), np.sin(angle)])
                at = depth * axis + radius * radial
                out.append(Row(f"normal_{i}{j + 1}", at, cos * radial + sin * axis, pressed))
                out.append(Row(f"axial_{i}{j + 1}", at, cos * axis - sin * radial, rubbed))
                out.append(Row(f"round_{i}{j + 1}", at, np.cross(axis, radial), rubbed))
        return tuple(out)

    def solids(self) -> tuple[Solid, ...]:
        """The cone."""
        return (bar(0.0, self.length, self.diameter / 2, to=self.diameter / 2 - self.ratio * self.length / 2),)
