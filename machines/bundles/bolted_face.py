"""Two bolted faces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from jointlib.io.toml import Section
from jointlib.joint import Joint

from ..shapes.solid import Solid, block
from .bundle import Bundle, Row, gauss, positive
from .contact_patch import Face
from .shared import shared


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
    face
        Contact of what no joint stands for; None where both do.
    grid
        Patches along length and width.
    normal, tangential
        Joints of the whole face, as identified: each patch has its share of the area. Across the normal the same one
        acts in both directions, each by itself. z > 0 presses.
    """

    length: float
    width: float
    preload: float
    face: Face | None
    grid: tuple[int, int] = (2, 2)
    normal: Joint | None = None
    tangential: Joint | None = None
    assumed: tuple[str, ...] = ()

    kind: ClassVar[str] = "bolted-face"
    main: ClassVar[tuple[float, float, float]] = (1.0, 0.0, 0.0)

    @classmethod
    def from_section(cls, section: Section) -> BoltedFace:
        said: list[str] = []
        length, width = section.number("length", "m"), section.number("width", "m")
        positive(cls.kind, length=length, width=width)
        normal = read_joint(section.path("normal_joint")) if section.has("normal_joint") else None
        tangential = read_joint(section.path("tangential_joint")) if section.has("tangential_joint") else None
        face, preload = None, 0.0
        if normal is None or tangential is None:
            if section.has("bolts"):
                preload = section.integer("bolts", lower=1) * section.number("bolt_force", "N")
            else:
                preload = section.number("preload", "N")
            positive(cls.kind, preload=preload)
            pressure = preload / (length * width)
            face = Face.from_section(section, said, lambda _: pressure, normal is None, tangential is None)
        grid = section.take("grid", [2, 2])
        if not (isinstance(grid, list) and len(grid) == 2 and all(type(n) is int and 0 < n <= 20 for n in grid)):
            raise InputError(f"{section.where}: grid is {grid!r}, expected two whole numbers from 1 to 20")
        return cls(length, width, preload, face, (grid[0], grid[1]), normal, tangential, tuple(said))

    def rows(self) -> tuple[Row, ...]:
        out, joints = [], dict[float, tuple[Joint, Joint]]()
        for i, (along, one) in enumerate(gauss(self.grid[0], self.length), start=1):
            for j, (across, other) in enumerate(gauss(self.grid[1], self.width), start=1):
                at, share = np.array([0.0, along, across]), one * other
                # Patches that are alike share one joint.
                pressed, rubbed = joints.setdefault(round(share, 12), self._joints(share))
                out.append(Row(f"normal_{i}{j}", at, np.array([1.0, 0.0, 0.0]), pressed))
                out.append(Row(f"first_{i}{j}", at, np.array([0.0, 1.0, 0.0]), rubbed))
                out.append(Row(f"second_{i}{j}", at, np.array([0.0, 0.0, 1.0]), rubbed))
        return tuple(out)

    def _joints(self, share: float) -> tuple[Joint, Joint]:
        """Those of a patch along the normal and across it."""
        whole = self.length * self.width
        area, pressure = share * whole, self.preload / whole
        found = []
        for measured, own in ((self.normal, Face.pressed), (self.tangential, Face.rubbed)):
            if measured is not None:
                found.append(shared(measured, share))
            else:
                assert self.face is not None
                found.append(own(self.face, area, pressure))
        return found[0], found[1]

    def solids(self) -> tuple[Solid, ...]:
        """The two faces, as plates."""
        thick = 0.04 * max(self.length, self.width)
        size = thick, self.length, self.width
        return block((-thick / 2, 0.0, 0.0), size, frame=0), block((thick / 2, 0.0, 0.0), size, frame=1)
