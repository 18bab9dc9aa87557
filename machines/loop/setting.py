"""A machine held against records: its answer at every line, what is known to be missing of it, and the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint

from ..indices import Index
from ..model.machine import Machine
from .explanations.quick import quick
from .fit import Fitting
from .forward import Answer, Forward
from .judge import excess
from .noise.drift import FARTHEST, FREQUENCY
from .records import LevelFRF
from .truncated import correction

_CAP = 2.0
WHITE = 3.0
"""Mean square of what is left, in units of the noise, above which there is more to be found than was named."""
_CENTRED, _TRIED = 3, 65
"""Turns to the drift of every record, and drifts that are tried where no first order leads to it."""
_FINE = 0.01 * FREQUENCY
SETTLED = 0.3 * FREQUENCY
"""Drift that is small enough for its first order to hold."""


def undrifted(frfs: Sequence[LevelFRF], shift: Array) -> list[LevelFRF]:
    """Records at the frequencies that they would have been measured at without a drift of their natural ones."""
    return [replace(r, frequency=r.frequency / (1 + d)) for r, d in zip(frfs, shift.tolist(), strict=True)]


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
    def centred(cls, machine: Machine, frfs: Sequence[LevelFRF]) -> Setting:
        """The same with the frequencies of every record moved by what they have likeliest drifted."""
        setting, taken = cls.of(machine, frfs), np.zeros(len(frfs))
        if setting.loss > WHITE * len(setting.rows):
            # A peak narrower than its drift: no first order leads there.
            tried = np.linspace(-FARTHEST, FARTHEST, _TRIED) * FREQUENCY
            taken = tried[np.argmin([setting.losses_at(machine, frfs, drift) for drift in tried.tolist()], axis=0)]
            taken = cls.of(machine, frfs, taken).own_drift(len(frfs))
            setting = cls.of(machine, frfs, taken)
        for _ in range(_CENTRED):
            drift = setting.own_drift(len(frfs))
            left = float(np.max(np.abs(drift - taken)))
            if left <= _FINE or (left <= SETTLED and excess(setting.loss, len(setting.rows)) == 0):
                break
            taken = drift
            setting = cls.of(machine, frfs, taken)
        return setting

    @property
    def loss(self) -> float:
        """Σ abs(residual)²."""
        return float(np.sum(np.abs(self.residual) ** 2))

    def losses_at(self, machine: Machine, frfs: Sequence[LevelFRF], drift: float) -> Array:
        """Loss of the machine on every record as if all had drifted so."""
        fitting = self.fitting_at(machine, frfs, drift)
        joints = fitting.quick_joints
        answer = fitting.forward.answer(joints, tuple(range(len(joints))), self.base.z)
        return np.asarray(np.bincount(fitting.forward.points.record, np.abs(fitting.residual(answer)) ** 2, len(frfs)))

    def fitting_at(self, machine: Machine, frfs: Sequence[LevelFRF], drift: float) -> Fitting:
        """The same lines and noise as if all records had drifted so."""
        old, taken = self.fitting, np.full(len(frfs), drift)
        forward = Forward.of(machine, undrifted(frfs, taken)).with_caps(old.forward.cap).on(self.rows)
        return Fitting(forward, old.sigma, old.correction, taken, old.near)

    def drifts(self, residual: ComplexArray, records: int) -> Array:
        """By how much level and natural frequencies of each record are off, (records, 2), relative, by a residual."""
        out = np.zeros((records, 2))
        out[np.unique(self.fitting.forward.points.record)] = self.fitting.drift.likeliest(residual)
        return out

    def drifted(self, residual: ComplexArray, records: int) -> Array:
        """The natural frequencies alone, (records,), as far as a drift may go."""
        return np.clip(self.drifts(residual, records)[:, 1], -FARTHEST * FREQUENCY, FARTHEST * FREQUENCY)

    def own_drift(self, records: int) -> Array:
        """The same by the machine as it is."""
        return self.drifted(self.residual, records)

    @classmethod
    def of(cls, machine: Machine, frfs: Sequence[LevelFRF], taken: Array | None = None) -> Setting:
        """A machine held against records, the drift ``taken`` of each, relative, out of their frequencies."""
        forward = Forward.of(machine, frfs if taken is None else undrifted(frfs, taken))
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
        base = Answer(base.z[rows], base.receptance[rows], base.fine[rows], base.force[rows])
        return cls(Fitting(forward.on(rows), sigma, further[rows], taken), base, rows, len(points))

    @property
    def residual(self) -> ComplexArray:
        """(measured − machine)/deviation."""
        return self.fitting.residual(self.base)
