"""Errors of measured FRFs before and after, in the words of the report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.arrays import ComplexArray

from .fit import Fitted, Fitting
from .forward import Forward
from .judge import Judged
from .records import LevelFRF


def relative(fitting: Fitting, residual: ComplexArray) -> float:
    """rms of the residual over rms of the measured FRF, by the levels' own sizes."""
    points = fitting.forward.points
    error = np.abs(residual * fitting.sigma) ** 2
    return float(np.sqrt(np.sum(error) / np.sum(np.abs(points.measured) ** 2)))


def per_record(fitting: Fitting, residual: ComplexArray, frfs: Sequence[LevelFRF]) -> list[dict[str, Any]]:
    """The same record by record."""
    points = fitting.forward.points
    out = []
    for i, frf in enumerate(frfs):
        rows = points.record == i
        if not np.any(rows):
            continue
        error = np.sqrt(np.sum(np.abs(residual[rows] * fitting.sigma[rows]) ** 2))
        size = np.sqrt(np.sum(np.abs(points.measured[rows]) ** 2))
        out.append(
            {
                "name": frf.name,
                "force": frf.force,
                "relative": float(error / size),
                "chi2": float(np.mean(np.abs(residual[rows]) ** 2)),
            }
        )
    return out


def errors(
    fitting: Fitting,
    residual: ComplexArray,
    frfs: Sequence[LevelFRF],
    judged: Judged | None,
    sealed: tuple[Fitting, ComplexArray, Sequence[LevelFRF]] | None,
) -> dict[str, Any]:
    """relative, in_sample, where, chi2 and per_record; sealed records decide, else left-out levels, else blocks.

    Without a fit (``judged`` is None) nothing was adjusted to any record, so every error is one on what was left out.
    """
    inside = relative(fitting, residual)
    if sealed is not None:
        where, bench, counted, records = "sealed", sealed[0], sealed[1], sealed[2]
    else:
        levels = len({f.force for f in frfs}) > 1
        where = "levels left out" if levels else "lines left out"
        bench, counted, records = fitting, residual if judged is None else judged.heldout(), frfs
    return {
        "relative": relative(bench, counted),
        "in_sample": inside,
        "heldout": relative(fitting, residual if judged is None else judged.heldout()),
        "where": where,
        "chi2": float(np.mean(np.abs(counted) ** 2)),
        "per_record": per_record(bench, counted, records),
    }


def on_sealed(machine_forward: Forward, fitted: Fitted | None, residual_of: Fitting) -> ComplexArray:
    """Residual on sealed records, of the fit or of the machine as it is."""
    if fitted is None:
        everything = tuple(range(len(machine_forward.standing)))
        return residual_of.residual(machine_forward.answer(machine_forward.machine.joints(), everything))
    return residual_of.residual(residual_of.answer(fitted.hypothesis, fitted.u))
