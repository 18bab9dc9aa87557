"""Carriage of a linear guide: four rows of balls at their contact angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from jointlib.io.toml import Section
from jointlib.joint import Joint
from jointlib.laws.hertz_contact import HertzContact

from ..shapes.solid import Solid, block
from .bundle import Bundle, Row, assumed_value, gauss, positive
from .hertz import groove_contact
from .shared import guide_of, guide_row


@dataclass(frozen=True, eq=False)
class LinearGuide(Bundle):
    """Rows ``upper``/``lower``, ``left``/``right``; axes: travel, then the normal from rail to carriage.

    The carriage is the first side. Every row presses as the carriage moves towards the rail along its contact line:
    n = −cos φ sideways ± sin φ along the normal. With rows "X" the contact lines of one side meet near the rail, with
    "O" outside, which holds roll more stiffly. Along the travel each row stands for its load at Gauss points, so that
    force and moment of the even row are exact. Along the normal the four rows together are a ``hertz-guide``, of
    stiffness 6 sin²φ P0/d0 at rest (Dhupia et al. 2008, eqs 3–9); four of equal stiffness at (±ly, ±lx) are eq. 14.

    Parameters
    ----------
    preload, kappa
        Load on each row in N and its compliance in m/N^(2/3).
    contact_angle
        rad from the plane of the rail.
    width, height, length
        m: between left and right rows, between upper and lower rows, loaded length of a row.
    damping
        Viscous damping along the normal in N s/m that a measured joint has.
    """

    preload: float
    kappa: float
    contact_angle: float
    width: float
    length: float
    height: float = 0.0
    arrangement: str = "O"
    points: int = 2
    measured: Joint | None = None
    assumed: tuple[str, ...] = ()

    kind: ClassVar[str] = "linear-guide"
    main: ClassVar[tuple[float, float, float]] = (0.0, 1.0, 0.0)
    slides_with: ClassVar[int | None] = 0

    def __post_init__(self) -> None:
        positive(self.kind, preload=self.preload, kappa=self.kappa, width=self.width, length=self.length)
        if not 0 < self.contact_angle < np.pi / 2:
            raise InputError(f"{self.kind}: contact_angle is {self.contact_angle:g} rad, expected 0 to 90 deg")
        if self.height < 0:
            raise InputError(f"{self.kind}: height is {self.height:g} m, expected at least 0")

    @classmethod
    def from_section(cls, section: Section) -> LinearGuide:
        said: list[str] = []
        width, length = section.number("width", "m"), section.number("length", "m")
        points = section.integer("points", 2, lower=1, upper=1000)
        height = assumed_value(section, said, "height", "m", 0.0, "0 m")
        arrangement = "O"
        if section.has("arrangement"):
            arrangement = section.text("arrangement", choices=("O", "X"))
        elif height > 0:
            said.append("arrangement = O")
        if section.has("joint"):
            joint = read_joint(section.path("joint"))
            law = guide_of(joint, cls.kind)
            values = law.preload, law.kappa, law.contact_angle
            return cls(*values, width, length, height, arrangement, points, joint, tuple(said))
        preload = section.number("preload", "N")
        angle = assumed_value(section, said, "contact_angle", "rad", np.pi / 4, "45 deg")
        kappa = cls._compliance(section, said, preload, angle)
        return cls(preload, kappa, angle, width, length, height, arrangement, points, None, tuple(said))

    @staticmethod
    def _compliance(section: Section, said: list[str], preload: float, angle: float) -> float:
        """From itself, from the catalogue's rigidity along the normal, or from the balls."""
        ways = [key for key in ("kappa", "stiffness", "balls") if section.has(key)]
        if len(ways) != 1:
            found = " and ".join(ways) or "none of them"
            raise InputError(f"{section.where}: {found} given, expected one of kappa, stiffness or balls")
        positive(LinearGuide.kind, preload=preload)
        if ways == ["kappa"]:
            return float(section.number("kappa", "m/N^(2/3)"))
        if ways == ["stiffness"]:
            stiffness = section.number("stiffness", "N/m")
            positive(LinearGuide.kind, stiffness=stiffness)
            return float(6 * np.sin(angle) ** 2 * np.cbrt(preload) / stiffness)
        count, ball = section.integer("balls", lower=1), section.number("ball_diameter", "m")
        conformity = assumed_value(section, said, "conformity", "1", 0.53, "0.53")
        said.append("balls and grooves of steel (208 GPa)")
        # Both contacts of a ball, carriage and rail, in series; the balls of a row in parallel.
        return float(2 * groove_contact(ball, conformity, 0.0) / np.cbrt(count) ** 2)

    def rows(self) -> tuple[Row, ...]:
        cos, sin = np.cos(self.contact_angle), np.sin(self.contact_angle)
        outward = 1.0 if self.arrangement == "O" else -1.0
        out: list[Row] = []
        joints: dict[float, Joint] = {}
        for number, (along, share) in enumerate(gauss(self.points, self.length), start=1):
            # Even weights are equal but for rounding, and rows that are alike share one joint.
            joint = joints.setdefault(round(share, 12), self._joint(share))
            for level, height in (("upper", 1.0), ("lower", -1.0)):
                for side, lateral in (("left", 1.0), ("right", -1.0)):
                    at = np.array([along, height * self.height / 2, lateral * self.width / 2])
                    direction = np.array([0.0, outward * height * sin, -lateral * cos])
                    out.append(Row(f"{level}_{side}_{number}", at, direction, joint))
        return tuple(out)

    def solids(self) -> tuple[Solid, ...]:
        """Carriage and rail, in proportions that carriages have."""
        rows = max(self.height, self.width / 3)
        carriage = block((0.0, 0.3 * rows, 0.0), (1.3 * self.length, 2.2 * rows, 1.9 * self.width))
        rail = block((0.0, -0.9 * rows, 0.0), (1.3 * self.length, 2.4 * rows, 0.9 * self.width), frame=1, runs=True)
        return carriage, rail

    def _joint(self, share: float) -> Joint:
        """The joint of one point, which carries this share of its row."""
        if self.measured is not None:
            return guide_row(self.measured, self.kind, share)
        return Joint((HertzContact(self.preload * share, self.kappa * share ** (-2 / 3)),))
