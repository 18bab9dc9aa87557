"""Errors of measured FRFs before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.arrays import ComplexArray

from ..model.machine import Machine
from .fit import Fitting
from .judge import Judged
from .records import LevelFRF
from .setting import Setting


def relative(fitting: Fitting, residual: ComplexArray) -> float:
    """rms of the residual over rms of the measured FRFs."""
    error = np.sum(np.abs(fitting.drift.error(residual) * fitting.sigma) ** 2)
    return float(np.sqrt(error / np.sum(np.abs(fitting.forward.points.measured) ** 2)))


def per_record(fitting: Fitting, residual: ComplexArray, frfs: Sequence[LevelFRF]) -> list[dict[str, Any]]:
    """The same record by record."""
    points = fitting.forward.points
    missed = fitting.drift.error(residual) * fitting.sigma
    out = []
    for i, frf in enumerate(frfs):
        rows = points.record == i
        if not np.any(rows):
            continue
        error = np.sum(np.abs(missed[rows]) ** 2)
        out.append(
            {
                "name": frf.name,
                "force": frf.force,
                "relative": float(np.sqrt(error / np.sum(np.abs(points.measured[rows]) ** 2))),
                "chi2": float(np.mean(np.abs(residual[rows]) ** 2)),
            }
        )
    return out


def harmonics_of(mended: Machine, search: Fitting, frfs: Sequence[LevelFRF], residual: ComplexArray) -> ComplexArray:
    """By how much a residual moves as further harmonics are those of the mended machine; 0 where that is unknown."""
    own = Setting.of(mended, frfs)
    if len(own.rows) != len(residual):
        return np.zeros(len(residual), dtype=complex)
    moved = (search.correction - own.fitting.correction) / search.sigma
    return search.drift.slopes(residual, moved[:, None])[:, 0]


def errors(
    fitting: Fitting,
    inside: ComplexArray,
    heldout: ComplexArray,
    frfs: Sequence[LevelFRF],
    sealed: tuple[Setting, Sequence[LevelFRF]] | None,
) -> dict[str, Any]:
    """relative, in_sample, heldout, where, chi2 and per_record.

    Sealed records decide; without any, left-out levels, or left-out lines where there is one level.
    """
    where = "levels left out" if len({f.level for f in frfs}) > 1 else "lines left out"
    bench, counted, records = fitting, heldout, frfs
    if sealed is not None:
        where, bench, counted, records = "sealed", sealed[0].fitting, sealed[0].residual, sealed[1]
    return {
        "relative": relative(bench, counted),
        "in_sample": relative(fitting, inside),
        "heldout": relative(fitting, heldout),
        "where": where,
        "chi2": float(np.mean(np.abs(counted) ** 2)),
        "per_record": per_record(bench, counted, records),
    }


def before_and_after(
    machine: Machine,
    mended: Machine,
    fitting: Fitting,
    residual: ComplexArray,
    named: Judged | None,
    training: Sequence[LevelFRF],
    sealed: Sequence[LevelFRF],
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of the machine as it came in and as it is mended; nothing was fitted for the first."""
    opened = (Setting.centred(machine, sealed), sealed) if sealed else None
    before = errors(fitting, residual, residual, training, opened)
    if named is None:
        return before, before
    moved = harmonics_of(mended, fitting, training, named.fitted.residual)
    opened = (Setting.centred(mended, sealed), sealed) if sealed else None
    inside, heldout = named.fitted.residual + moved, named.heldout() + moved
    return before, errors(fitting, inside, heldout, training, opened)
