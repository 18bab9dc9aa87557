"""Stations of a beam that contacts slide along: redrawn where the contacts stand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.toml import Section

from ..components.beam import place_along

_ONE_PLACE = 1e-3
"""Share of the length: a contact so near to a station shares it, as its lever arm is known."""


class Stations:
    """The stations in the table of a beam, as contacts that slide along it ask for them.

    A contact asks for the station next to it, moved as the contact has. A station that all ask for alike is moved; to
    one that is wanted here and there, another is added.
    """

    def __init__(self, table: dict[str, Any], where: str, folder: Path) -> None:
        again = Section(table, where, folder)
        axis = np.array(again.numbers("axis", "1", (1.0, 0.0, 0.0), length=3))
        self._table, self._where = table, where
        self._along = axis / (np.linalg.norm(axis) or 1.0)
        self._start = np.array(again.numbers("start", "m", (0.0, 0.0, 0.0), length=3))
        self._length = sum(part.number("length", "m") for part in again.sections("segment"))
        parts = [(part.text("name"), place_along(part, self._length)) for part in again.sections("station")]
        self._at = dict(parts)
        self._wanted: dict[str, set[float]] = {name: set() for name in self._at}
        self._by_name: dict[str, float] = {}

    @property
    def named(self) -> tuple[str, ...]:
        """The names of the stations."""
        return tuple(self._at)

    def hold(self, points: Array, apart: Array) -> None:
        """Contacts at points (n, 3), as drawn, that have since moved by ``apart`` against the beam."""
        for point in points:
            places = {name: self._start + at * self._along for name, at in self._at.items()}
            near = min(places, key=lambda name: float(np.linalg.norm(places[name] - point)), default=None)
            if near is not None:
                self.use(near, apart)

    def use(self, station: str, apart: Array, by_name: bool = False) -> None:
        """A station that is wanted so far from where it is drawn, m; ``by_name``: a dof of it is named somewhere."""
        along = round(float(apart @ self._along), 12) + 0.0
        self._wanted[station].add(along)
        if by_name:
            self._by_name[station] = along

    def settle(self) -> None:
        """Put the stations where they are wanted, in the table."""
        if not any(any(wanted) for wanted in self._wanted.values()):
            return
        placed: list[tuple[str, float]] = []
        for name, at in self._at.items():
            own = self._by_name.get(name, 0.0)  # what is named somewhere keeps its name
            first, *further = sorted(self._wanted[name] or {0.0}, key=lambda by: (by != own, abs(by)))
            placed.append((name, at + first))
            placed += [(self._new(name, number), at + by) for number, by in enumerate(further, start=2)]
        for name, at in placed:
            if not -1e-9 <= at <= self._length + 1e-9:
                raise InputError(
                    f"{self._where}: an axis moves a contact at station {name!r} to {at:g} m of the beam, expected 0 "
                    f"to {self._length:g} m"
                )
        kept: list[tuple[str, float]] = []
        # Where two come to stand at one place, the one that is named somewhere stays.
        for name, at in sorted(placed, key=lambda item: item[0] not in self._by_name):
            if name in self._by_name or all(abs(at - other) >= _ONE_PLACE * self._length for _, other in kept):
                kept.append((name, at))
        order = [name for name, _ in placed]
        kept.sort(key=lambda item: order.index(item[0]))
        self._table["station"] = [{"name": name, "at": float(np.clip(at, 0.0, self._length))} for name, at in kept]

    def _new(self, name: str, number: int) -> str:
        new = f"{name}_{number}"
        while new in self._at:
            new += "_"
        return new
