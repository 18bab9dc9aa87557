"""A machine held against records: its answer at every line, what is known to be missing of it, and the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint

from ..indices import Index
from ..model.machine import Machine
from .fit import Fitting
from .forward import Answer, Forward
from .quick import quick
from .records import LevelFRF
from .truncated import correction

_CAP = 2.0


@dataclass(frozen=True, eq=False)
class Setting:
    """A machine and records; lines without an answer of the machine are left out."""

    fitting: Fitting
    base: Answer
    """With every joint's motion, in the order of the machine."""
    rows: Index
    """Lines that are used, of all lines of all records."""
    lines: int

    @classmethod
    def of(cls, machine: Machine, frfs: Sequence[LevelFRF]) -> Setting:
        forward = Forward.of(machine, frfs)
        held: dict[int, Joint] = {}
        joints = [held.setdefault(id(j), quick(j)) for j in machine.joints()]
        base = forward.answer(joints, tuple(range(len(joints))), ramp=True)
        if not np.any(base.fine):
            raise InputError(f"{machine.where}: no response is found at the measured lines and forces")
        cap = _CAP * np.max(np.abs(base.z[base.fine]), axis=0)
        forward = forward.with_caps(np.where(cap > 0, cap, np.inf))
        further, doubt = correction(forward, machine, base)
        points = forward.points
        rows = np.flatnonzero(base.fine & np.isfinite(points.measured) & (points.deviation > 0))
        sigma = np.sqrt(points.deviation**2 + doubt**2)[rows]
        base = Answer(base.z[rows], base.receptance[rows], base.fine[rows])
        return cls(Fitting(forward.on(rows), sigma, further[rows]), base, rows, len(points))

    @property
    def residual(self) -> ComplexArray:
        """(measured − machine)/deviation."""
        return self.fitting.residual(self.base)
