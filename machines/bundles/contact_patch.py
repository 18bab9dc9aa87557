"""A patch of two faces pressed together: stiff in the normal until it opens, in the plane until it slips."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointlib.errors import InputError
from jointlib.io.toml import Section
from jointlib.joint import Joint
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear

from .bundle import assumed_value, positive

MINDLIN = 0.82
"""2(1 − ν)/(2 − ν) at ν = 0.3: tangential over normal stiffness of spheres that do not slip (Mindlin 1949).

Assumed of faces; 0.1 to 0.2 was measured on some (Kono et al., Key Eng. Mat. 523–524, 2012, 457).
"""
_STICTION = 0.15
"""Assumed. Lightly oiled bare steel, threads and bolt heads: 0.14 to 0.24 (VDI 2230)."""
_STEEPEST = 3.0
"""Exponent that no face reaches; 1 would be that of a surface of exponentially few asperities."""
_EXPONENT = 0.5
"""Assumed."""


@dataclass(frozen=True)
class Face:
    """Contact stiffness per area in N/m³ at its pressure, and friction.

    Stiffness goes with a power of the pressure, k = k_ref (p/p_ref)^m: rough faces touch at more places as they are
    pressed. m = ½ is assumed where the file does not say it.
    """

    normal: float
    tangential: float
    friction: float
    sliders: int = 1

    @classmethod
    def from_section(
        cls,
        section: Section,
        said: list[str],
        pressed: Callable[[float], float],
        normally: bool = True,
        across: bool = True,
    ) -> Face:
        """``pressed`` gives the mean pressure in N/m² at a coefficient of friction.

        Without ``normally`` or ``across`` what only that direction needs is not asked for.
        """
        friction = assumed_value(section, said, "friction", "1", _STICTION, f"{_STICTION:g}") if across else 0.0
        if friction < 0:
            raise InputError(f"face: friction is {friction:g}, expected at least 0")
        pressure, normal, tangential, sliders = pressed(friction), np.nan, np.nan, 1
        positive("face", pressure=pressure)
        if normally:
            normal = section.number("normal_stiffness", "N/m^3")
            positive("face", normal_stiffness=normal)
            if section.has("reference_pressure"):
                reference = section.number("reference_pressure", "N/m^2")
                positive("face", reference_pressure=reference)
                exponent = assumed_value(section, said, "pressure_exponent", "1", _EXPONENT, f"{_EXPONENT:g}")
                if not 0 <= exponent <= _STEEPEST:
                    raise InputError(f"face: pressure_exponent is {exponent:g}, expected 0 to {_STEEPEST:g}")
                normal *= (pressure / reference) ** exponent
                positive("face", normal_stiffness=normal)
        if across:
            if normally and not section.has("tangential_stiffness"):
                said.append(f"tangential_stiffness = {MINDLIN:g} of the normal one")
                tangential = MINDLIN * normal
            else:
                tangential = section.number("tangential_stiffness", "N/m^3")
                positive("face", tangential_stiffness=tangential)
            sliders = section.integer("sliders", 1, lower=1, upper=1000)
        return cls(normal, tangential, friction, sliders)

    def pressed(self, area: float, pressure: float) -> Joint:
        """Normal joint; z > 0 presses, and it opens where the preload is used up."""
        stiffness = self.normal * area
        return Joint((Linear(stiffness), ContactLoss(stiffness, pressure / self.normal, -1.0)))

    def rubbed(self, area: float, pressure: float) -> Joint:
        """Joint in the plane: sticks with its stiffness, slips at friction times the load.

        Several sliders slip one after another, evenly from nothing to twice their mean.
        """
        stiffness, slip, n = self.tangential * area, self.friction * pressure * area, self.sliders
        if n == 1:
            return Joint((Jenkins(stiffness, slip),))
        return Joint((Iwan((stiffness / n,) * n, tuple(slip * (2 * i + 1) / n**2 for i in range(n))),))
