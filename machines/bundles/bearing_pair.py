"""Pair of angular-contact ball bearings on a shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from jointlib.io.toml import Section
from jointlib.joint import Joint
from jointlib.laws.hertz_contact import HertzContact

from ..shapes.solid import Solid, ring
from .bundle import Bundle, Row, assumed_value, positive
from .hertz import groove_contact
from .shared import guide_of, guide_row

_POINTS = 6
"""Three already have the stiffness of any number evenly spread; six keep the contact loss of few balls apart."""


@dataclass(frozen=True, eq=False)
class BearingPair(Bundle):
    """Rows ``a1``… (towards −axis) and ``b1``…; axis: the shaft, which is the first side; the housing is the second.

    A ball presses along n = cos α radially ± sin α along the axis, as its inner ring moves out and towards it: with
    "O" (back to back) the contact lines of the pair meet the axis outside the pair, with "X" (face to face) inside,
    in "tandem" both carry the same way and the preload must come from elsewhere. Each contact stands for
    ``balls/points`` balls; κ is that of both grooves in series (Hertz). At rest, with k one ball's stiffness and Z
    the balls of the pair: axial Z k sin²α, radial Z k cos²α/2.

    Parameters
    ----------
    balls
        In one bearing.
    preload
        Axial load in N on each bearing.
    spacing
        m between the two ball planes.
    conformity
        Groove radius over ball diameter, both rings.
    measured
        The pair's joint along its axis, in "O" or "X" a ``hertz-guide`` whose rows 1 and 2 are one bearing; then only
        pitch diameter, spacing, arrangement and points count besides.
    """

    balls: int
    ball_diameter: float
    pitch_diameter: float
    contact_angle: float
    preload: float
    spacing: float
    arrangement: str
    conformity: float = 0.52
    points: int = _POINTS
    measured: Joint | None = None
    assumed: tuple[str, ...] = ()

    kind: ClassVar[str] = "bearing-pair"
    main: ClassVar[tuple[float, float, float]] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.measured is not None:
            guide_of(self.measured, self.kind)
            if self.arrangement == "tandem":
                raise InputError(f"{self.kind}: joint is given for a tandem, expected it for a pair that is preloaded")
        keys = ("ball_diameter", "pitch_diameter", "contact_angle", "preload", "spacing")
        positive(self.kind, **{key: getattr(self, key) for key in keys})
        if not self.contact_angle < np.pi / 2:
            raise InputError(f"{self.kind}: contact_angle is {self.contact_angle:g} rad, expected 0 to 90 deg")
        if not self.conformity > 0.5:
            raise InputError(f"{self.kind}: conformity is {self.conformity:g}, expected more than 0.5")
        if not self.ball_diameter < self.pitch_diameter:
            raise InputError(f"{self.kind}: the balls do not fit on the pitch circle, expected smaller ones")

    @classmethod
    def from_section(cls, section: Section) -> BearingPair:
        if section.has("joint"):
            return cls._as_measured(section, read_joint(section.path("joint")))
        said = ["rings and balls of steel (208 GPa)"]
        balls = section.integer("balls", lower=3, upper=1000)
        ball, pitch = section.number("ball_diameter", "m"), section.number("pitch_diameter", "m")
        angle, preload = section.number("contact_angle", "rad"), section.number("preload", "N")
        spacing = section.number("spacing", "m")
        arrangement = section.text("arrangement", choices=("O", "X", "tandem"))
        conformity = assumed_value(section, said, "conformity", "1", 0.52, "0.52")
        points = section.integer("points", min(balls, _POINTS), lower=3, upper=1000)
        return cls(balls, ball, pitch, angle, preload, spacing, arrangement, conformity, points, None, tuple(said))

    @classmethod
    def _as_measured(cls, section: Section, joint: Joint) -> BearingPair:
        law = guide_of(joint, cls.kind)
        pitch, spacing = section.number("pitch_diameter", "m"), section.number("spacing", "m")
        arrangement = section.text("arrangement", choices=("O", "X", "tandem"))
        points = section.integer("points", _POINTS, lower=3, upper=1000)
        axial = 2 * law.preload * np.sin(law.contact_angle)
        return cls(points, pitch / 4, pitch, law.contact_angle, axial, spacing, arrangement, 0.52, points, joint)

    @property
    def kappa(self) -> float:
        """Compliance of one ball between both rings in m/N^(2/3)."""
        D, gamma = self.ball_diameter, self.ball_diameter * np.cos(self.contact_angle) / self.pitch_diameter
        inner = groove_contact(D, self.conformity, 2 / D * gamma / (1 - gamma))
        return inner + groove_contact(D, self.conformity, -2 / D * gamma / (1 + gamma))

    def _joint(self) -> Joint:
        """The joint of one contact: Q = preload/(Z sin α) on a ball, balls/points of them."""
        each = self.balls / self.points
        load = self.preload / (self.balls * np.sin(self.contact_angle))
        return Joint((HertzContact(load * each, self.kappa * each ** (-2 / 3)),))

    def rows(self) -> tuple[Row, ...]:
        cos, sin = np.cos(self.contact_angle), np.sin(self.contact_angle)
        joint = self._joint() if self.measured is None else guide_row(self.measured, self.kind, 2 / self.points)
        towards = {"O": (1.0, -1.0), "X": (-1.0, 1.0), "tandem": (1.0, 1.0)}[self.arrangement]
        out = []
        for letter, place, sign in zip("ab", (-0.5, 0.5), towards, strict=True):
            for number in range(self.points):
                angle = 2 * np.pi * number / self.points
                radial = np.array([0.0, np.cos(angle), np.sin(angle)])
                at = radial * self.pitch_diameter / 2 + [place * self.spacing, 0.0, 0.0]
                direction = cos * radial + [sign * sin, 0.0, 0.0]
                out.append(Row(f"{letter}{number + 1}", at, direction, joint))
        return tuple(out)

    def solids(self) -> tuple[Solid, ...]:
        """Inner and outer rings with the balls' row between them, in proportions that bearings have."""
        middle, ball = self.pitch_diameter / 2, self.ball_diameter
        out = []
        for place in (-self.spacing / 2, self.spacing / 2):
            ends = place - 0.75 * ball, place + 0.75 * ball
            out.append(ring(*ends, middle - 0.25 * ball, max(middle - ball, 0.1 * middle), frame=0))
            out.append(ring(*ends, middle + ball, middle + 0.25 * ball, frame=1))
        return tuple(out)
