"""A segment of a beam: its length, its material and its cross-section, by shape or by the constants of the section."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.io.mistakes import Lost
from jointlib.io.toml import Section

from .profile import Material, Profile, box, rectangle, tube
from .solid import circle

_SHEAR = 5 / 6
"""κ of a solid rectangle without lateral contraction: what stands in where a given section has none."""

_ROUNDED = 1.01
"""What constants of a circle that were read from a table may miss of each other."""


@dataclass(frozen=True)
class Segment:
    """A piece of a beam: length in m, material, and one kind of cross-section, lengths in m.

    A round one has diameter and bore; a rectangle width and height, a box a wall as well. Any other is given by
    ``area`` (m²), ``second_moments`` (m⁴) and ``torsion`` (m⁴).

    Parameters
    ----------
    second_moments
        In m⁴: of the bending in the plane of the height, ∫ h² dA, and in that of the width, ∫ w² dA; both are
        principal axes.
    torsion
        Saint-Venant's constant J in m⁴, the polar moment only for a circle.
    shear_factors
        κ for a force along the height, and along the width: shear area over area; where absent, 5/6 each.
    """

    length: float
    material: Material
    diameter: float | None = None
    bore: float = 0.0
    width: float | None = None
    height: float | None = None
    wall: float | None = None
    area: float | None = None
    second_moments: tuple[float, float] | None = None
    torsion: float | None = None
    shear_factors: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        constants = [self.area, self.second_moments, self.torsion]
        round_bar, block = self.diameter is not None, self.width is not None or self.height is not None
        given = any(value is not None for value in (*constants, self.shear_factors))
        if (
            round_bar + block + given != 1
            or (block and (self.width is None or self.height is None))
            or (given and any(value is None for value in constants))
        ):
            raise InputError(
                "segment: expected one of diameter, of width and height, or of area, second_moments and torsion"
            )
        if not round_bar and self.bore:
            raise InputError("segment: a bore is given without a diameter, expected it with one; a box has a wall")
        for key, unit in (("length", "m"), ("diameter", "m"), ("width", "m"), ("height", "m"), ("wall", "m")):
            _positive(key, getattr(self, key), unit)
        for key, unit in (("area", "m^2"), ("torsion", "m^4")):
            _positive(key, getattr(self, key), unit)
        for key, unit in (("second_moments", "m^4"), ("shear_factors", "")):
            for value in getattr(self, key) or ():
                _positive(key, value, unit)
        if self.shear_factors is not None and max(self.shear_factors) > 1:
            raise InputError(f"segment: shear_factors is {list(self.shear_factors)}, expected at most 1")
        if not 0 <= self.bore < (self.diameter or np.inf):
            raise InputError(f"segment: bore is {self.bore!r} m, expected at least 0 and less than the diameter")
        if self.wall is not None and not (block and 2 * self.wall < min(self.width or 0, self.height or 0)):
            raise InputError(f"segment: wall is {self.wall!r} m, expected less than half of width and of height")
        if self.area is not None and self.torsion is not None and self.second_moments is not None:
            polar = sum(self.second_moments)
            largest = np.sqrt(2 * np.pi * polar)
            if self.area > _ROUNDED * largest:
                raise InputError(
                    f"segment: area is {self.area:g} m^2, expected at most {largest:g} m^2 with a polar moment of "
                    f"{polar:g} m^4, which a full circle has: is one of their units wrong?"
                )
            if self.torsion > polar * (1 + 1e-9):
                raise InputError(
                    f"segment: torsion is {self.torsion:g} m^4, expected at most the polar moment {polar:g} m^4, which "
                    "only a circle reaches"
                )

    @classmethod
    def from_section(cls, section: Section, materials: dict[str, Material], all_read: bool = True) -> Segment:
        """Of a ``[[component.segment]]``; a material that is not there is refused where all of them could be read."""
        word = section.text("material", next(iter(materials), ""))
        if word not in materials and all_read:
            section.fault(f"material is {word!r}, {nearest(word, materials)}")
        length, bore = section.number("length", "m"), section.number("bore", "m", 0.0)
        diameter, width = section.number("diameter", "m", None), section.number("width", "m", None)
        height, wall = section.number("height", "m", None), section.number("wall", "m", None)
        area, torsion = section.number("area", "m^2", None), section.number("torsion", "m^4", None)
        moments = section.numbers("second_moments", "m^4", None, length=2)
        factors = section.numbers("shear_factors", "1", None, length=2)
        section.done()
        if word not in materials:
            raise Lost
        both = None if moments is None else (moments[0], moments[1])
        shear = None if factors is None else (factors[0], factors[1])
        try:
            return cls(length, materials[word], diameter, bore, width, height, wall, area, both, torsion, shear)
        except InputError as error:
            raise InputError(f"{section.where}: {str(error).removeprefix('segment: ')}") from None

    @property
    def profile(self) -> Profile:
        """Its cross-section."""
        if self.diameter is not None:
            return tube(self.diameter, self.bore, self.material.poisson)
        if self.width is not None and self.height is not None:
            if self.wall is not None:
                return box(self.width, self.height, self.wall, self.material.poisson)
            return rectangle(self.width, self.height, self.material.poisson)
        assert self.area is not None
        assert self.second_moments is not None
        assert self.torsion is not None
        upright, sideways = self.shear_factors or (_SHEAR, _SHEAR)
        return Profile(self.area, *self.second_moments, self.torsion, sideways, upright)

    @property
    def outline(self) -> Array:
        """Corners (k, 2) of its section in width and height, m; by constants, of a rectangle of the same gyration."""
        if self.diameter is not None:
            return circle(self.diameter / 2)
        section = self.profile
        width, height = (np.sqrt(12 * second / section.area) for second in (section.second_3, section.second_2))
        size = [self.width or width, self.height or height]
        return np.asarray(np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * size)

    @property
    def lies_any_way(self) -> bool:
        """Whether its section bends alike in all planes, so that nobody need say where its height points."""
        section = self.profile
        return section.second_2 == section.second_3 and section.shear_2 == section.shear_3

    @property
    def assumed(self) -> bool:
        """Whether its shear factors are assumed."""
        return self.area is not None and self.shear_factors is None


_LONGEST = 1e6
"""m; products of six lengths and more are formed of it."""


def _positive(key: str, value: float | None, unit: str) -> None:
    if value is not None and not (np.isfinite(value) and value > 0):
        raise InputError(f"segment: {key} is {value!r} {unit}".rstrip() + ", expected more than 0")
    if value is not None and unit == "m" and value > _LONGEST:
        raise InputError(f"segment: {key} is {value:g} m, expected at most {_LONGEST:g} m")
