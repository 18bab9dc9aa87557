"""Two bolted faces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.errors import InputError
from jointlib.io.toml import Section

from .bundle import Bundle, Row, gauss, positive
from .contact_patch import Face


@dataclass(frozen=True, eq=False)
class BoltedFace(Bundle):
    """Rows ``normal_ij``, ``first_ij`` and ``second_ij`` on a grid of patches; axes: the normal, from the first side to
    the second, and the direction of ``length``.

    Patches lie at Gauss points of the rectangle, so that a linear face has its exact stiffness in translation,
    rocking and twist. The pressure is that of the bolts, evenly spread; the bolts themselves are taken as soft.

    Parameters
    ----------
    length, width
        m.
    preload
        Force of all bolts together in N.
    grid
        Patches along length and width.
    """

    length: float
    width: float
    preload: float
    face: Face
    grid: tuple[int, int] = (2, 2)
    assumed: tuple[str, ...] = ()

    kind: ClassVar[str] = "bolted-face"
    main: ClassVar[tuple[float, float, float]] = (1.0, 0.0, 0.0)

    @classmethod
    def from_section(cls, section: Section) -> BoltedFace:
        said: list[str] = []
        length, width = section.number("length", "m"), section.number("width", "m")
        if section.has("bolts"):
            preload = section.integer("bolts", lower=1) * section.number("bolt_force", "N")
        else:
            preload = section.number("preload", "N")
        positive(cls.kind, length=length, width=width, preload=preload)
        face = Face.from_section(section, said, lambda _: preload / (length * width))
        grid = section.take("grid", [2, 2])
        if not (isinstance(grid, list) and len(grid) == 2 and all(type(n) is int and 0 < n <= 20 for n in grid)):
            raise InputError(f"{section.where}: grid is {grid!r}, expected two whole numbers from 1 to 20")
        return cls(length, width, preload, face, (grid[0], grid[1]), tuple(said))

    def rows(self) -> tuple[Row, ...]:
        area = self.length * self.width
        pressure = self.preload / area
        out = []
        for i, (along, one) in enumerate(gauss(self.grid[0], self.length), start=1):
            for j, (across, other) in enumerate(gauss(self.grid[1], self.width), start=1):
                at, share = np.array([0.0, along, across]), one * other * area
                out.append(Row(f"normal_{i}{j}", at, np.array([1.0, 0.0, 0.0]), self.face.pressed(share, pressure)))
                rubbed = self.face.rubbed(share, pressure)
                out.append(Row(f"first_{i}{j}", at, np.array([0.0, 1.0, 0.0]), rubbed))
                out.append(Row(f"second_{i}{j}", at, np.array([0.0, 0.0, 1.0]), rubbed))
        return tuple(out)
