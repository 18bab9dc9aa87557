"""Ball screw and nut: shaft, nut contact and support bearings in series along the screw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from jointlib.io.toml import Section
from jointlib.joint import Joint
from jointlib.laws.linear import Linear

from ..shapes.solid import Solid, bar, ring
from .bundle import Bundle, Row, assumed_value, positive

MOUNTINGS = ("fixed-free", "fixed-fixed")
ENDS = ("start", "end")
"""Where the fixed bearing sits: the axis of the bundle points away from it, or towards it."""
STEEL_MODULUS = 206e9
"""N/m²."""
STEEL_SHEAR = 79e9
"""N/m²."""

_PIECES = 12
"""That a shaft is drawn in."""


@dataclass(frozen=True)
class Shaft:
    """A screw along the axis of its bundle: diameter, and where it begins and ends from the nut, m."""

    diameter: float
    start: float
    end: float
    both: bool
    """Whether bearings hold both ends, else the one it is fixed at."""
    fixed_start: bool


@dataclass(frozen=True, eq=False)
class BallScrew(Bundle):
    """One row, ``axial``, between the nut's part and the part that holds the bearings; axis: the screw.

    A nut that is not linear is a connection of its own, with its joint, between the nut's part and a part that has the
    mass of the screw; the row ``without_nut`` then holds that part: shaft and bearings alone.
    """

    joint: Joint
    assumed: tuple[str, ...] = ()
    shaft: Shaft | None = None

    kind: ClassVar[str] = "ball-screw"
    main: ClassVar[tuple[float, float, float]] = (1.0, 0.0, 0.0)
    slides_with: ClassVar[int | None] = 1

    @classmethod
    def from_section(cls, section: Section) -> BallScrew:
        if section.has("joint"):
            return cls(read_joint(section.path("joint")))
        said: list[str] = []
        diameter, length = section.number("diameter", "m"), section.number("length", "m")
        position = section.number("position", "m")
        fixed_start = section.text("fixed_end", "start", ENDS) == "start"
        alone = section.flag("without_nut")
        nut = np.inf if alone else section.number("nut_stiffness", "N/m")
        if not alone and section.has("nut_preload"):
            # Known at one preload, the preloaded nut goes with the cube root (Hertz).
            preload, reference = section.number("nut_preload", "N"), section.number("reference_preload", "N")
            positive(cls.kind, nut_preload=preload, reference_preload=reference)
            nut *= float(np.cbrt(preload / reference))
        bearing = section.number("bearing_stiffness", "N/m")
        if not section.has("mounting"):
            said.append("mounting = fixed-free")
        mounting = section.text("mounting", MOUNTINGS[0], choices=MOUNTINGS)
        modulus = assumed_value(section, said, "modulus", "N/m^2", STEEL_MODULUS, "206 GPa")
        lead = section.number("lead", "m", None)
        if lead is not None:
            said.append("shear modulus = 79 GPa")
        stiffness = screw_stiffness(diameter, position, length, nut, bearing, mounting, modulus, lead)
        start = -position if fixed_start else position - length
        shaft = Shaft(diameter, start, start + length, mounting == "fixed-fixed", fixed_start)
        return cls(Joint((Linear(stiffness),)), tuple(said), shaft)

    @classmethod
    def slid(cls, section: Section, along: float) -> dict[str, Any]:
        """The nut stands further from the fixed bearing, or nearer to it."""
        if not section.has("position"):
            return {}
        away = 1.0 if section.text("fixed_end", "start", ENDS) == "start" else -1.0
        return {"position": section.number("position", "m") + away * along}

    def rows(self) -> tuple[Row, ...]:
        return (Row("axial", np.zeros(3), np.array([1.0, 0.0, 0.0]), self.joint),)

    def solids(self) -> tuple[Solid, ...]:
        """Nut, shaft and bearings; nothing where the file gives the joint of the whole drive alone."""
        if self.shaft is None:
            return ()
        d, s = self.shaft.diameter, self.shaft
        nut = ring(-1.5 * d, 1.5 * d, 0.9 * d, d / 2, frame=0)
        ends = [x for x, held in ((s.start, s.both or s.fixed_start), (s.end, s.both or not s.fixed_start)) if held]
        bearings = [ring(x - 0.5 * d, x + 0.5 * d, 1.2 * d, d / 2, frame=1) for x in ends]
        return nut, bar(s.start, s.end, d / 2, frame=1, pieces=_PIECES), *bearings


def screw_stiffness(
    diameter: float,
    position: float,
    length: float,
    nut: float,
    bearing: float,
    mounting: str = "fixed-free",
    modulus: float = STEEL_MODULUS,
    lead: float | None = None,
) -> float:
    """Axial stiffness of screw, nut and bearings in series, N/m.

    1/k = 1/k_nut + 1/k_shaft. With the nut at x from the fixed bearing the shaft is EA/x in series with that bearing;
    fixed-fixed it is held both ways at once, over x and over L − x. With a lead p its twist between nut and drive
    gives way too: (G I_p/x)(2π/p)² in series.

    Parameters
    ----------
    diameter
        Root diameter of the shaft in m.
    position, length
        From the fixed bearing to the nut, and between the bearings, m.
    nut, bearing
        Stiffness along the screw of the nut and of the bearing at one end, N/m.
    lead
        m per revolution; None: twist is left out.
    """
    values = {"diameter": diameter, "position": position, "length": length, "modulus": modulus}
    positive(BallScrew.kind, **values, nut_stiffness=nut, bearing_stiffness=bearing)
    if not position < length:
        raise InputError(
            f"{BallScrew.kind}: position is {position:g} m, expected the nut between the bearings, which are "
            f"{length:g} m apart"
        )
    area = np.pi * diameter**2 / 4
    reach = [position] if mounting == "fixed-free" else [position, length - position]
    give = 1 / nut + 1 / sum(1 / (x / (modulus * area) + 1 / bearing) for x in reach)
    if lead is not None:
        positive(BallScrew.kind, lead=lead)
        give += position / (STEEL_SHEAR * np.pi * diameter**4 / 32) * (lead / (2 * np.pi)) ** 2
    return float(1 / give)
