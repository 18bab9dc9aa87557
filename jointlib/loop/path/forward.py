"""A fitted model run forward under the measured force: a prediction, where the residual is only an equation error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.preparation import Run, finer

STEPS = 4
"""Of Runge–Kutta in every sample."""
_MOST_SAMPLES = 20000
"""Samples of a record that are run."""


def forward_check(before: Fitted, after: Fitted, sealed: Evidence | None) -> dict[str, dict[str, Any]]:
    """Relative rms error of the displacement before and after, or null and the reason.

    M z̈ = F(t) − f(z, ż) − F0 from the measured state at the first sample that counts, ``displacement`` on the fit
    records and ``displacement_sealed`` on the sealed ones. Without inertia the force along the measured path is
    itself the prediction. A path without a restoring force (a drive) drifts off under its force alone.
    """
    if before.evidence.carriage is None:
        reason = "no inertia in the balance: the force along the measured path is itself the forward prediction"
        return {"force": {"before": before.in_sample, "after": after.in_sample, "reason": reason}}
    groups = {"displacement": before.evidence} | ({"displacement_sealed": sealed} if sealed else {})
    out: dict[str, dict[str, Any]] = {name: {"before": None, "after": None} for name in groups}
    for word, fitted in (("before", before), ("after", after)):
        if word == "after" and after is before:
            for row in out.values():
                row["after"] = row["before"]
            continue
        if not _restores(fitted):
            for row in out.values():
                row["reason"] = "no restoring force: under its force alone the path drifts off; run it with its control"
            continue
        those = [evidence.without(fitted.model.faults) for evidence in groups.values()]
        runs = [run for evidence in those for run in evidence.runs]
        offset = np.concatenate([_offset(fitted, evidence) for evidence in those])
        found, first = free_run(runs, fitted.joint, _mass(fitted), offset), 0
        for name, evidence in groups.items():
            count = len(evidence.recorded)
            error = _relative(found[first : first + count], runs[first : first + count])
            first += count
            out[name][word] = error
            if error is None:
                out[name]["reason"] = f"the model {word} leaves the measured path altogether"
    return out


def free_run(runs: Sequence[Run], joint: Joint, mass: float, offset: float | Array) -> list[Array]:
    """Displacement (m) of every record under its measured force (band-limited between samples), from its first sample
    that counts: classical Runge–Kutta, all records side by side."""
    spans = [slice(run.begin, min(len(run.force) - run.preparation.edge, run.begin + _MOST_SAMPLES)) for run in runs]
    lengths = [s.stop - s.start for s in spans]
    drive = np.zeros((2 * STEPS * (max(lengths) - 1) + 1, len(runs)))
    for i, (run, span, n) in enumerate(zip(runs, spans, lengths, strict=True)):
        drive[: 2 * STEPS * (n - 1) + 1, i] = finer(run.recorded.force, 2 * STEPS)[
            2 * STEPS * span.start : 2 * STEPS * (span.stop - 1) + 1
        ]
    drive = (drive - offset) / mass
    z = np.array([run.path.displacement[span.start] for run, span in zip(runs, spans, strict=True)])
    v = np.array([run.path.velocity[span.start] for run, span in zip(runs, spans, strict=True)])
    h, state = runs[0].path.time_step / STEPS, joint.initial_state(z)
    path = np.empty((max(lengths), len(runs)))
    path[0] = z

    def rate(u: Array, z: Array, v: Array, after: float) -> Array:
        return np.asarray(u - joint.step(Motion(z, v, after), state)[0] / mass)

    with np.errstate(all="ignore"):
        for i in range(STEPS * (max(lengths) - 1)):
            begin, middle, end = drive[2 * i], drive[2 * i + 1], drive[2 * i + 2]
            a1 = rate(begin, z, v, 0.0)
            v2 = v + h / 2 * a1
            a2 = rate(middle, z + h / 2 * v, v2, h / 2)
            v3 = v + h / 2 * a2
            a3 = rate(middle, z + h / 2 * v2, v3, h / 2)
            v4 = v + h * a3
            a4 = rate(end, z + h * v3, v4, h)
            z, v = z + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            if joint.states:
                state = joint.step(Motion(z, v, h), state)[1]
            if (i + 1) % STEPS == 0:
                path[(i + 1) // STEPS] = z
    return [path[:n, k] for k, n in enumerate(lengths)]


def _mass(fitted: Fitted) -> float:
    known = fitted.evidence.mass
    return known if known is not None else dict(zip(fitted.names, fitted.plant, strict=False))["mass"]


def _offset(fitted: Fitted, evidence: Evidence) -> Array:
    """N, of each record."""
    if evidence.own_offsets:
        return evidence.offsets(fitted.joint)
    return np.full(len(evidence.recorded), dict(zip(fitted.names, fitted.plant, strict=False))["offset"])


def _restores(fitted: Fitted) -> bool:
    """True if the mass is positive and the joint pulls back wherever it is within its motion."""
    reach = fitted.evidence.scale.displacement * np.array([-1.0, -0.5, -0.1, 0.1, 0.5, 1.0])
    still = np.zeros_like(reach)
    force = fitted.joint.step(Motion(reach, still), fitted.joint.initial_state(still))[0]
    return _mass(fitted) > 0 and bool(np.all(force * reach > 0))


def _relative(found: Sequence[Array], runs: Sequence[Run]) -> float | None:
    """Of the displacement's rms; None where it is as large as the displacement itself."""
    measured = [run.path.displacement[run.begin : run.begin + len(z)] for z, run in zip(found, runs, strict=True)]
    with np.errstate(all="ignore"):
        wrong = sum(float(np.sum((z - m) ** 2)) for z, m in zip(found, measured, strict=True))
    error = float(np.sqrt(wrong / sum(float(np.sum(m**2)) for m in measured)))
    return error if np.isfinite(error) and error < 1 else None
