"""Cross-sections and materials of beams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.errors import InputError

_MOST_LOSS = 10.0
"""Rubber has 1; of far more no mode is left, and the search for one takes all memory."""


@dataclass(frozen=True)
class Material:
    """Isotropic material: young (Pa), poisson, density (kg/m³) and its damping.

    Parameters
    ----------
    loss_factor
        Structural damping η: energy lost per cycle over 2π times the strain energy, at any frequency. A mode gets
        the damping ratio η/2, weighted by the strain energy in each material (Johnson, Kienholz, AIAA J. 20, 1982).
    viscous
        Time constant τ in s of a Kelvin–Voigt material, E (1 + τ d/dt).
    """

    name: str
    young: float
    poisson: float
    density: float
    loss_factor: float = 0.0
    viscous: float = 0.0

    def __post_init__(self) -> None:
        where = f"material {self.name!r}"
        for key, value, unit in (("young", self.young, "Pa"), ("density", self.density, "kg/m^3")):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{where}: {key} is {value!r} {unit}, expected more than 0")
        if not -1 < self.poisson <= 0.5:
            raise InputError(f"{where}: poisson is {self.poisson!r}, expected above -1 and at most 0.5")
        for key in ("loss_factor", "viscous"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"{where}: {key} is {value!r}, expected at least 0")
        if self.loss_factor > _MOST_LOSS:
            raise InputError(f"{where}: loss_factor is {self.loss_factor!r}, expected at most {_MOST_LOSS:g}")

    @property
    def shear(self) -> float:
        """Shear modulus in Pa."""
        return self.young / (2 * (1 + self.poisson))


@dataclass(frozen=True)
class Profile:
    """What a beam needs of its cross-section; axis 1 runs along the beam, 2 is its width, 3 its height.

    ``area`` A in m²; ``second_2`` = ∫y3² dA and ``second_3`` = ∫y2² dA in m⁴; ``torsion`` J in m⁴ (the polar
    moment only for a circle); ``shear_2``, ``shear_3`` = κ by direction of the force (Cowper, J. Appl. Mech. 33,
    1966).
    """

    area: float
    second_2: float
    second_3: float
    torsion: float
    shear_2: float
    shear_3: float


def tube(diameter: float, bore: float, poisson: float) -> Profile:
    """Round bar of this diameter with a concentric bore (0: solid), both in m."""
    area = np.pi * (diameter**2 - bore**2) / 4
    second = np.pi * (diameter**4 - bore**4) / 64
    m = (bore / diameter) ** 2
    both = (1 + m) ** 2
    shear = 6 * (1 + poisson) * both / ((7 + 6 * poisson) * both + (20 + 12 * poisson) * m)
    return Profile(area, second, second, 2 * second, shear, shear)


def rectangle(width: float, height: float, poisson: float) -> Profile:
    """Solid rectangle; its torsion constant is Saint-Venant's series."""
    area = width * height
    long, short = max(width, height), min(width, height)
    n = np.arange(1, 60, 2)
    series = float(np.sum(np.tanh(n * np.pi * long / (2 * short)) / n**5))
    torsion = long * short**3 / 3 * (1 - 192 / np.pi**5 * short / long * series)
    shear = 10 * (1 + poisson) / (12 + 11 * poisson)
    return Profile(area, width * height**3 / 12, height * width**3 / 12, torsion, shear, shear)


def box(width: float, height: float, wall: float, poisson: float) -> Profile:
    """Rectangular hollow section, outer sizes and the thickness of its wall in m.

    Area and second moments are exact. Torsion is Bredt's, 4 A² t/U along the middle line of the wall, with that of the
    open wall, U t³/3; sharp corners add 2 % to it at a wall of a twentieth of the sides, 6 % at a fifth. Shear is
    that of Cowper's thin-walled box.
    """
    inner_width, inner_height = width - 2 * wall, height - 2 * wall
    area = width * height - inner_width * inner_height
    second_2 = (width * height**3 - inner_width * inner_height**3) / 12
    second_3 = (height * width**3 - inner_height * inner_width**3) / 12
    b, h = width - wall, height - wall
    around = 2 * (b + h)
    torsion = 4 * (b * h) ** 2 * wall / around + around * wall**3 / 3
    return Profile(area, second_2, second_3, torsion, _box_shear(h / b, poisson), _box_shear(b / h, poisson))


def _box_shear(m: float, poisson: float) -> float:
    """κ for a force along one side of a thin-walled box, the other side m times as long (Cowper 1966).

    His m (flange over web by area) and n (flange over web by length) are one where all walls are alike.
    """
    plain = 12 + 72 * m + 150 * m**2 + 90 * m**3
    contracted = 11 + 66 * m + 135 * m**2 + 90 * m**3
    across = 10 * m**2 * ((3 + poisson) * m + 3 * m**2)
    return 10 * (1 + poisson) * (1 + 3 * m) ** 2 / (plain + poisson * contracted + across)
