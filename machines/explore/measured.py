"""What was measured of a machine over what is computed of a setting: responses of the tool point, and test cuts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from jointlib import read_measurement
from jointlib.cuts.judged import judged_cuts
from jointlib.cuts.tried_cut import TriedCut
from jointlib.frf import FRF

from ..compare.comparison import Comparison, paired
from ..compare.measured_peaks import Resonance, at_the_peaks, resonances
from ..compare.whole_curves import frac
from ..loop.records import LevelFRF, read_frfs
from ..model.machine import Machine
from .curves import Curves


@dataclass(frozen=True, eq=False)
class Measured:
    """A record of the tool point: the force on it along an axis, the motion along the same."""

    axis: str
    record: LevelFRF

    @property
    def moved(self) -> float:
        """Largest amplitude of the tool in m while it was measured."""
        return self.record.force * float(np.max(np.abs(self.record.receptance)))

    @cached_property
    def resonances(self) -> tuple[Resonance, ...]:
        """Those of the record, with standard errors."""
        return resonances(self.record.frequency, self.record.receptance, at_the_peaks(self.record))


def records_of(machine: Machine, files: Sequence[Path]) -> tuple[tuple[Measured, ...], tuple[str, ...]]:
    """Records of the tool point in measurement files of kind "frf", and a sentence on those of other places."""
    axes = {dof: axis for axis, dof in machine.tool.items()}
    every = [record for file in files for record in read_frfs(read_measurement(file), machine)]
    own = [r for r in every if r.drive == r.response and r.drive in axes]
    other = [f"{r.name} ({r.response} for a force on {r.drive})" for r in every if r not in own]
    said = (f"Measured, but not along one direction of the tool, so not drawn: {', '.join(other)}.",) if other else ()
    remarks = tuple(dict.fromkeys(remark for r in own for remark in r.remarks))
    return tuple(Measured(axes[r.drive], r) for r in sorted(own, key=lambda r: (r.drive, r.force))), (*said, *remarks)


def laid_over(measured: Measured, curves: Curves) -> Comparison:
    """A record over the receptance that is drawn, with the joints as they are at the chosen amplitude of the tool.

    Between the lines of the curve 1/H is taken as straight.
    """
    record, known, receptance = measured.record, curves.frequency, curves.receptance[measured.axis]
    there = (record.frequency >= known[0]) & (record.frequency <= known[-1])
    lines, theirs = record.frequency[there], record.receptance[there]
    predicted = theirs[:0]
    if len(lines):
        one = FRF(known, receptance[:, None, None], (record.response,), (record.drive,))
        predicted = one.on(lines).receptance[:, 0, 0]
    both = [r for r in measured.resonances if known[0] <= r.frequency <= known[-1]]
    # Read off the same lines, so that the same coarseness is in both.
    pairs = paired(both, resonances(lines, predicted) if len(lines) > 2 else ())
    said: tuple[str, ...] = ()
    if not there.all():
        said = (
            f"{record.name} runs from {record.frequency[0]:.4g} to {record.frequency[-1]:.4g} Hz, the page from "
            f"{known[0]:.4g} to {known[-1]:.4g} Hz: beyond it nothing is compared.",
        )
    return Comparison(record, lines, predicted, frac(theirs, predicted), pairs, said)


@dataclass(frozen=True)
class Tried:
    """A cut that somebody made, and whether it was made as the machine file cuts."""

    cut: TriedCut
    alike: bool
    """Whether mode, immersion, feed and teeth are those of ``[cutting]``."""


def tried_of(machine: Machine) -> tuple[Tried, ...]:
    """The cuts of every ``[[cuts]]`` that were judged, in order."""
    given = machine.cutting or {}
    return tuple(
        Tried(one.cut, _alike(one.cut, given))
        for path in machine.cuts
        for one in judged_cuts(read_measurement(path))
        if one.cut.verdict != "unknown"
    )


def _alike(cut: TriedCut, cutting: Mapping[str, object]) -> bool:
    own = {name: getattr(cut, name) for name in ("mode", "immersion", "feed")}
    same = all(value is None or cutting.get(name) in (None, value) for name, value in own.items())
    return same and cutting.get("teeth", cut.teeth) == cut.teeth
