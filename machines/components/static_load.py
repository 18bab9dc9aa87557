"""What a machine carries while it vibrates: weight, constant forces, and offsets that preload its joints."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section

STANDARD_GRAVITY = (0.0, 0.0, -9.80665)
"""m/s², downwards along z."""
_AXIS = re.compile(r"u?([xyz])(?:[_\d].*)?")


@dataclass(frozen=True)
class StaticLoad:
    """The ``[static]`` section of a machine.

    Parameters
    ----------
    gravity
        Acceleration in m/s², machine axes; None: weight is left out.
    force
        Constant forces in N by ``component.dof``, such as the mean of a cutting force; moments in N m on rotations.
    offset
        m, by connection: the joint is at z + offset where its sides do not move, as by thermal growth or a shim.
    """

    gravity: tuple[float, float, float] | None = None
    force: Mapping[str, float] = field(default_factory=dict)
    offset: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def from_section(cls, section: Section) -> StaticLoad:
        """From ``[static]``; ``gravity = true`` is standard gravity downwards along z."""
        raw = section.take("gravity", False)
        gravity: tuple[float, ...] | None
        if isinstance(raw, bool):
            gravity = STANDARD_GRAVITY if raw else None
        else:
            gravity = section.within({"gravity": raw}).numbers("gravity", "m/s^2", length=3)
        tables = [_table(section.section("force"), "N"), _table(section.section("offset"), "m")]
        section.done()
        return cls(None if gravity is None else (gravity[0], gravity[1], gravity[2]), *tables)

    def check(self, dofs: Sequence[str], flexible: Sequence[str], where: str) -> None:
        """Refuse a dof or connection that the machine does not have, and what is not finite."""
        for what, table, known in (("force", self.force, dofs), ("offset", self.offset, flexible)):
            for name, value in table.items():
                if name not in known:
                    wanted = "a dof" if what == "force" else "a connection with a joint"
                    raise InputError(f"{where}: {what} names {name!r}, expected {wanted}, {nearest(name, known)}")
                if not np.isfinite(value):
                    raise InputError(f"{where}: {what} of {name!r} is {value!r}, expected a finite value")
        if self.gravity is not None and not (len(self.gravity) == 3 and np.all(np.isfinite(self.gravity))):
            raise InputError(f"{where}: gravity is {self.gravity!r}, expected three finite components in m/s^2")


def _table(table: Section, unit: str) -> dict[str, float]:
    names = table.keys()
    found = {name: table.number(name, f"{unit} m" if turns(name) else unit) for name in names}
    table.done()
    return found


def turns(dof: str) -> bool:
    """Whether a ``component.dof`` is a rotation of a rigid body, on which a moment acts."""
    return dof.rpartition(".")[2] in ("rx", "ry", "rz")


def axis_of(dof: str) -> int | None:
    """Machine axis 0, 1 or 2 along which a dof moves by its name: x, uy, z_2, x3; None for every other name."""
    match = _AXIS.fullmatch(dof)
    return "xyz".index(match[1]) if match else None
