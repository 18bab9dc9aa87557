"""Component that several files tell, each at a speed of the spindle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.toml import Section

from ..components.component import Component, FirstOrder, SecondOrder
from ..components.modal import Modal
from ..shapes.drawn import Drawn

_LINES = 200


@dataclass(frozen=True, eq=False)
class BySpeed(Component):
    """A part as it was found at several spindle speeds, and between two of them in between.

    Modes of equal number are those in between, each by its frequency, damping, mass and shape, in the order of their
    frequencies. Else the dynamic stiffness is, H = A ((1 − w) B + w A)⁻¹ B with w from A to B, which is exact where a
    stiffness at the dofs changes in proportion; such a part has no equations of motion between the speeds. Below the
    lowest and above the highest speed it stays what it is there.

    Parameters
    ----------
    speeds
        rpm, ascending.
    parts
        One a speed, with the same dofs.
    speed
        rpm at which it is now.
    """

    name: str
    speeds: tuple[float, ...]
    parts: tuple[Component, ...]
    speed: float = 0.0
    dofs: tuple[str, ...] = ()

    kind: ClassVar[str] = "by-speed"

    def __post_init__(self) -> None:
        where = f"component {self.name!r}"
        if len(self.speeds) < 2 or len(self.speeds) != len(self.parts):
            raise InputError(
                f"{where}: {len(self.speeds)} speeds and {len(self.parts)} files, expected one file a speed, at "
                "least two"
            )
        if not np.all(np.isfinite(self.speeds)) or self.speeds[0] < 0 or np.any(np.diff(self.speeds) <= 0):
            raise InputError(f"{where}: speed is {list(self.speeds)} rpm, expected at least 0 and ascending")
        for part, speed in zip(self.parts, self.speeds, strict=True):
            if part.dofs != self.parts[0].dofs:
                raise InputError(
                    f"{where}: the file at {speed:g} rpm has dofs {', '.join(part.dofs)}, expected those of the first "
                    f"one, {', '.join(self.parts[0].dofs)}"
                )
        object.__setattr__(self, "dofs", self.parts[0].dofs)

    @classmethod
    def from_section(cls, section: Section) -> BySpeed:
        raise InputError(f"{section.where}: kind is 'by-speed', expected speed and file as lists instead")

    @property
    def known_speeds(self) -> tuple[float, float]:
        return self.speeds[0], self.speeds[-1]

    def at_speed(self, speed: float) -> BySpeed:
        """The same part at another speed in rpm."""
        return replace(self, speed=float(speed))

    @cached_property
    def _place(self) -> tuple[int, float]:
        """The file at or below the speed, and how far it is on the way to the next."""
        rpm = float(np.clip(self.speed, self.speeds[0], self.speeds[-1]))
        i = min(int(np.searchsorted(self.speeds, rpm, side="right")) - 1, len(self.speeds) - 2)
        return i, (rpm - self.speeds[i]) / (self.speeds[i + 1] - self.speeds[i])

    @cached_property
    def now(self) -> Component | None:
        """The part at this speed where it is one of its kind; None where its receptance alone is known."""
        i, w = self._place
        return in_between(self.parts[i], self.parts[i + 1], w)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        if self.now is not None:
            return self.now.between(omega, rows, columns)
        i, w = self._place
        return (
            rows
            @ stiffness_between(self.parts[i].receptance(omega), self.parts[i + 1].receptance(omega), w)
            @ (columns.T)
        )

    def second_order(self) -> SecondOrder | None:
        return None if self.now is None else self.now.second_order()

    def first_order(self) -> FirstOrder | None:
        return None if self.now is None else self.now.first_order()

    @property
    def band(self) -> tuple[float, float]:
        """Frequencies in Hz that all files know."""
        return max(part.band[0] for part in self.parts), min(part.band[1] for part in self.parts)

    def motion_at(self, point: Array, direction: Array) -> Array | None:
        return self.parts[0].motion_at(point, direction)

    def rotation_at(self, point: Array, direction: Array) -> Array | None:
        return self.parts[0].rotation_at(point, direction)

    def drawn(self) -> Drawn | None:
        return self.parts[0].drawn()

    def weight(self, gravity: Array) -> Array | None:
        return self.parts[0].weight(gravity)

    def remarks(self) -> tuple[str, ...]:
        """What each file has to tell, and how well the speeds between others are told by these."""
        said = dict.fromkeys(sentence for part in self.parts for sentence in part.remarks())
        said[f"{self.name}: at {self.speed:g} rpm where none is asked for."] = None
        error = self.left_out
        if not self.speeds[0] <= self.speed <= self.speeds[-1]:
            said[f"{self.name}: that lies beyond its files, so it is as at the nearest of them."] = None
        if error is None:
            return (*said, f"{self.name}: known at {self.speeds[0]:g} and {self.speeds[1]:g} rpm, in between by both.")
        size, rpm = error
        return (
            *said,
            f"{self.name}: known at {len(self.speeds)} speeds; with every one left out that lies between others, those "
            f"predict its receptance within {size:.2g} in norm, worst at {rpm:g} rpm.",
        )

    @cached_property
    def left_out(self) -> tuple[float, float] | None:
        """Largest relative error of an inner speed told by its neighbours, and where in rpm; None without an inner one.

        On lines over what the files know, or around their modes.
        """
        found = []
        for i in range(1, len(self.speeds) - 1):
            omega = self._lines(i)
            low, here, high = self.speeds[i - 1 : i + 2]
            pair = BySpeed(self.name, (low, high), (self.parts[i - 1], self.parts[i + 1]), here)
            true = self.parts[i].receptance(omega)
            found.append((float(np.linalg.norm(pair.receptance(omega) - true) / np.linalg.norm(true)), here))
        return max(found, default=None)

    def _lines(self, i: int) -> Array:
        """Angular frequencies at which a part is compared."""
        part = self.parts[i]
        if isinstance(part, Modal):
            return np.asarray(
                2 * np.pi * np.linspace(0.5 * np.min(part.frequency) + 1, 1.2 * np.max(part.frequency), _LINES)
            )
        low, high = self.band
        if np.isfinite(high):
            return np.asarray(2 * np.pi * np.linspace(low, high, _LINES))
        return np.asarray(2 * np.pi * np.geomspace(10.0, 5e3, _LINES))


def in_between(first: Component, second: Component, share: float) -> Component | None:
    """The part that lies a share on the way from one to the other; None where it is not known as a part."""
    if share in (0.0, 1.0):
        return second if share else first
    if not (isinstance(first, Modal) and isinstance(second, Modal)) or len(first.frequency) != len(second.frequency):
        return None
    one, other = (_by_frequency(part) for part in (first, second))
    turned = np.sign(np.sum(one["shapes"] * other["shapes"], axis=0))
    other["shapes"] = other["shapes"] * np.where(turned < 0, -1.0, 1.0)
    mixed: dict[str, Any] = {key: (1 - share) * one[key] + share * other[key] for key in one}
    return replace(first, frequency_error=None, damping_ratio_error=None, **mixed)


def _by_frequency(part: Modal) -> dict[str, Array]:
    order = np.argsort(part.frequency, kind="stable")
    assert part.modal_mass is not None
    return {
        "frequency": part.frequency[order],
        "damping_ratio": part.damping_ratio[order],
        "modal_mass": part.modal_mass[order],
        "shapes": part.shapes[:, order],
    }


def stiffness_between(first: ComplexArray, second: ComplexArray, share: float) -> ComplexArray:
    """((1 − w) A⁻¹ + w B⁻¹)⁻¹ = A ((1 − w) B + w A)⁻¹ B of receptances (nf, n, n); neither need be regular."""
    return np.asarray(first @ np.linalg.solve((1 - share) * second + share * first, second))
