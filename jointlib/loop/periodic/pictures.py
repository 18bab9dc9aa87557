"""Arrays for the pictures of a rig trace: the loop; the residual over frequency, over time and over the motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.balance.equations import EQUATIONS, Observed
from jointlib.loop.balance.excess import CLASSES, line_classes
from jointlib.loop.contest.fitted import Fitted

_BINS, _FEWEST = 12, 20
"""Bins of the motion, and the samples below which a bin is left out."""
_MOTION = {"joint": "displacement", "balance": "a1", "redundancy": "a2"}
"""What the residual of each equation is shown over: the motion that drives it."""


def pictures(before: Fitted, after: Fitted) -> dict[str, Array]:
    """Arrays for the pictures; what is of one record is of the one with the largest joint force.

    Residuals are |r_i L_ii|: each equation with what the noise in the earlier ones tells removed, as in the table of
    excess, beside their floor L_ii.

    ``loop_displacement`` (m), ``loop_measured``, ``loop_before``, ``loop_after`` (N): force over displacement, one
    averaged period, on the lines of the joint equation. ``residual_frequency`` (Hz) and ``residual_class`` (place in
    `jointlib.loop.balance.excess.CLASSES`) of every line; ``joint_before``, ``joint_after``, ``joint_floor`` in N,
    ``balance_…`` (N) and ``redundancy_…`` (m/s²): peak amplitude, nan where an equation does not hold. ``time`` (s)
    with ``time_joint_before`` … ``time_joint_floor`` (rms), and so for each equation: the residual over one averaged
    period. ``motion_joint`` (size of z, m), ``motion_balance`` (of a1, m/s²), ``motion_redundancy`` (of a2, m/s²) with
    ``…_before``, ``…_after``, ``…_floor``: rms of the residual over bins of that motion, all records together.
    """
    records = before.records
    at = int(np.argmax([np.linalg.norm(r.joint_force[r.valid[:, 2]]) / r.spectra.samples for r in records]))
    o = records[at]
    use = o.on_period & o.valid[:, 2]
    out = {
        "loop_displacement": _period(o, o.Z),
        "loop_measured": _period(o, np.where(use, o.joint_force, 0)),
        "time": np.arange(o.spectra.period_samples) / o.spectra.sample_rate,
        "residual_frequency": o.frequency,
        "residual_class": _classes(o),
    }
    for word, fitted in (("before", before), ("after", after)):
        seen = fitted.records[at]
        out[f"loop_{word}"] = _period(o, np.where(use, seen.model_force(fitted.joint), 0))
    residuals = {word: _residuals(fitted) for word, fitted in (("before", before), ("after", after))}
    for i, equation in enumerate(EQUATIONS):
        if not o.valid[:, i].any():
            continue
        floors = [np.where(r.valid[:, i], r.triangle[:, i, i].real, 0) for r in records]
        holds = o.valid[:, i]
        peak = 2 / o.spectra.samples
        out[f"{equation}_floor"] = np.where(holds, floors[at] * peak, np.nan)
        out[f"time_{equation}_floor"] = np.array(_rms(o, floors[at]))
        signals = {}
        for word, found in residuals.items():
            of_equation = [r[:, i] for r in found]
            out[f"{equation}_{word}"] = np.where(holds, np.abs(of_equation[at]) * peak, np.nan)
            signals[word] = [_period(r, X) for r, X in zip(records, of_equation, strict=True)]
            out[f"time_{equation}_{word}"] = signals[word][at]
        signals["floor"] = [np.full(r.spectra.period_samples, _rms(r, f)) for r, f in zip(records, floors, strict=True)]
        motion = [np.abs(_period(r, _moved(r, equation))) for r in records]
        out |= {f"motion_{equation}{k}": v for k, v in _over(motion, signals).items()}
    return out


def _residuals(fitted: Fitted) -> list[ComplexArray]:
    """r_i L_ii of each record, shape (lines, 3)."""
    records = zip(fitted.records, fitted.whitened(), strict=True)
    return [r * np.einsum("lii->li", o.triangle).real for o, r in records]


def _classes(o: Observed) -> Array:
    """The class of every line, as its place among the classes."""
    masks = line_classes(o)
    return np.select([masks[name] for name in CLASSES], np.arange(len(CLASSES)), len(CLASSES)).astype(float)


def _moved(o: Observed, equation: str) -> ComplexArray:
    name = _MOTION[equation]
    return o.Z if name == "displacement" else o.channel(name)


def _rms(o: Observed, floor: Array) -> float:
    """Noise over one averaged period: its rms from the floor of the period lines."""
    return float(np.sqrt(2 * np.sum(floor[o.on_period] ** 2))) / o.spectra.samples


def _over(motion: Sequence[Array], signals: dict[str, list[Array]]) -> dict[str, Array]:
    """Root mean square of signals over equally wide bins of a motion, all records together."""
    x = np.concatenate(motion)
    edges = np.linspace(0.0, float(x.max()), _BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    count = np.bincount(place, minlength=_BINS)
    full = count >= _FEWEST
    out = {"": ((edges[1:] + edges[:-1]) / 2)[full]}
    for word, values in signals.items():
        power = np.bincount(place, weights=np.concatenate(values) ** 2, minlength=_BINS)
        out[f"_{word}"] = np.sqrt(power[full] / count[full])
    return out


def _period(o: Observed, X: ComplexArray) -> Array:
    return o.spectra.averaged_period(X[o.on_period])
