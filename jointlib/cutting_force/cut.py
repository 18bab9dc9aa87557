"""What the tool does while forces are recorded: teeth, arc of cut, feed, depth and speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from jointlib.cutting_force.possible import impossible
from jointlib.errors import InputError

PROCESSES = ("milling", "turning")
MODES = ("up", "down", "slot")
AXES = {"milling": ("Fx", "Fy", "Fz"), "turning": ("Fc", "Ff", "Fp")}
"""Forces by process. Milling: along the feed, normal to it, along the spindle; turning: along the cutting speed, along
the thickness of the chip (the feed), along the edge."""

_IN_RAD, _LEAST_HELIX, _WHOLE = 1.1, 9.5, 0.06
"""A helix below so many degrees that is a whole number of degrees, so large and so nearly, where it is read in rad."""


@dataclass(frozen=True)
class Cut:
    """One cut as it is recorded, SI with the speed in rpm.

    Parameters
    ----------
    speed
        Spindle speed in rpm.
    depth
        Axial depth of the edge in the cut, m.
    feed
        m per tooth (milling) or per revolution (turning).
    teeth, mode, immersion
        Milling: number of teeth, evenly spaced; ``"up"``, ``"down"`` or ``"slot"``; a/D.
    diameter, helix
        m and degrees: the lag of the edge along the depth is 2·tan(helix)/diameter.
    """

    process: str
    speed: float
    depth: float
    feed: float
    teeth: int = 1
    mode: str = "slot"
    immersion: float = 1.0
    diameter: float | None = None
    helix: float = 0.0

    def __post_init__(self) -> None:
        said = [
            f"{key} is {value:g}{unit}, expected more than 0"
            for key, value, unit in (
                ("speed", self.speed, " rpm"),
                ("depth", self.depth, " m"),
                ("feed", self.feed, " m"),
            )
            if not value > 0
        ]
        said += impossible(
            self.process,
            speed=self.speed,
            depth=self.depth,
            feed=self.feed,
            teeth=self.teeth,
            immersion=self.immersion,
            diameter=self.diameter,
        )
        if not 0 <= self.helix < 90:
            said.append(f"helix is {self.helix:g} degrees, expected from 0 to below 90")
        if self.helix and self.diameter is None:
            said.append("helix is given without a diameter, expected both")
        if said:
            raise InputError(*said)

    def strange(self) -> list[str]:
        """Sentences on what only looks wrong: a helix in rad."""
        meant = math.degrees(self.helix)
        if not (0 < self.helix < _IN_RAD and meant >= _LEAST_HELIX and abs(meant - round(meant)) < _WHOLE):
            return []
        return [f'helix is {self.helix:g} degrees; is it in rad? Then write {round(meant)}, or "{self.helix:g} rad"']

    @property
    def arc(self) -> tuple[float, float]:
        """Angles in rad, from the normal of the feed, at which a tooth enters and leaves the cut."""
        if self.mode == "up":
            return 0.0, math.acos(1 - 2 * self.immersion)
        return (math.acos(2 * self.immersion - 1), math.pi) if self.mode == "down" else (0.0, math.pi)

    @property
    def lag(self) -> float:
        """rad per m of depth by which the edge comes later."""
        return 0.0 if self.diameter is None else 2 * math.tan(math.radians(self.helix)) / self.diameter

    @property
    def frequency(self) -> float:
        """Hz at which the teeth pass, the revolutions in turning."""
        return self.teeth * self.speed / 60
