"""How wrong a fitted model is: in sample, on what was left out, on sealed records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.preparation import Run


def unexplained(evidence: Evidence, fitted: Fitted) -> Array:
    """What a fitted model leaves of F along records, N: mass, offset and faults are those of the fit."""
    here = evidence.without(fitted.model.faults)
    names, columns = here.beside(fitted.joint)
    plant = dict(zip(fitted.names, fitted.plant, strict=False))
    return np.asarray(here.target - here.joint_force(fitted.joint) - np.array([plant[n] for n in names]) @ columns)


def errors(fitted: Fitted, sealed: Evidence | None) -> dict[str, Any]:
    """Relative errors as fractions: rms of the residual over rms of F.

    ``relative`` is the one that counts, ``where`` says on what: the sealed record, else condition folds, else block
    folds. Held-out figures are 100·sqrt(mean over blocks of squared error over the power of the record).
    """
    evidence = fitted.evidence
    condition = None if fitted.condition_loss is None else float(np.sqrt(fitted.condition_loss.mean()))
    block = float(np.sqrt(fitted.block_loss.mean()))
    out: dict[str, Any] = {
        "in_sample": fitted.in_sample,
        "heldout_condition": condition,
        "heldout_block": block,
        "per_record": _per_record(evidence.runs, evidence.force, fitted.residual),
        "per_condition": _per_condition(fitted),
    }
    if sealed is not None:
        residual = unexplained(sealed, fitted)
        relative = float(np.sqrt(np.mean(residual**2) / np.mean(sealed.force**2)))
        rows = _per_record(sealed.runs, sealed.force, residual)
        return {**out, "relative": relative, "where": "sealed", "sealed": relative, "per_sealed_record": rows}
    if condition is not None:
        return {**out, "relative": condition, "where": "condition folds", "sealed": None}
    return {**out, "relative": block, "where": "block folds", "sealed": None}


def _per_record(runs: Sequence[Run], force: Array, residual: Array) -> list[dict[str, Any]]:
    cuts = np.cumsum([len(run.time) for run in runs])[:-1]
    return [
        {"record": run.name, "relative": float(np.sqrt(np.mean(r**2) / np.mean(f**2)))}
        for run, f, r in zip(runs, np.split(force, cuts), np.split(residual, cuts), strict=True)
    ]


def _per_condition(fitted: Fitted) -> dict[str, float]:
    evidence = fitted.evidence
    folds, names = evidence.condition_folds, evidence.division.conditions
    return {name: float(np.sqrt(fitted.deciding_loss[folds == h].mean())) for h, name in enumerate(names)}


def blocks(before: Fitted, after: Fitted) -> list[dict[str, Any]]:
    """Where the error sits: held-out error of every block, before and after, beside its floor."""
    evidence = before.evidence
    rate = evidence.runs[0].preparation.sample_rate
    floor = np.sqrt(evidence.floor.power / evidence.block_power)
    return [
        {
            "record": evidence.runs[b.run].name,
            "condition": b.condition,
            "start_s": b.first / rate,
            "end_s": b.end / rate,
            "error_before": float(np.sqrt(before.deciding_loss[i])),
            "error_after": float(np.sqrt(after.deciding_loss[i])),
            "floor": float(floor[i]) if evidence.floor.known else None,
        }
        for i, b in enumerate(evidence.division.blocks)
    ]


def pictures(before: Fitted, after: Fitted) -> dict[str, Array]:
    """Arrays for the pictures, at most 4000 samples of the fit records laid end to end.

    ``time`` (s, records one after the other), ``displacement`` (m), ``velocity`` (m/s), ``force``, ``model_before``,
    ``model_after``, ``residual_before``, ``residual_after`` (N); per block ``block_before``, ``block_after``,
    ``block_floor`` (fractions, held out) and ``block_condition`` (number of the condition).
    """
    evidence = before.evidence
    runs, step = evidence.runs, evidence.runs[0].path.time_step
    starts = np.cumsum([0.0, *(len(run.force) * step for run in runs)])
    every = slice(None, None, -(-len(evidence.force) // 4000))
    full = {
        "time": np.concatenate([start + run.time for start, run in zip(starts, runs, strict=False)]),
        "displacement": np.concatenate([run.path.displacement[run.keep] for run in runs]),
        "velocity": np.concatenate([run.path.velocity[run.keep] for run in runs]),
        "force": evidence.force,
        "model_before": evidence.force - before.residual,
        "model_after": evidence.force - after.residual,
        "residual_before": before.residual,
        "residual_after": after.residual,
    }
    return {name: values[every] for name, values in full.items()} | {
        "block_before": np.sqrt(before.deciding_loss),
        "block_after": np.sqrt(after.deciding_loss),
        "block_floor": np.sqrt(evidence.floor.power / evidence.block_power),
        "block_condition": evidence.condition_folds.astype(float),
    }
