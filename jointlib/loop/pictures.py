"""Arrays for the pictures of a rig trace: the loop, the residual spectra, the residual in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.loop.equations import EQUATIONS, Observed
from jointlib.loop.spectra import Mask


def pictures(records: Sequence[Observed], before: Joint, after: Joint) -> dict[str, Array]:
    """Pictures of the record with the largest joint force.

    ``loop_displacement`` (m), ``loop_measured``, ``loop_before``, ``loop_after`` (N): force over displacement, one
    averaged period, on the lines of the joint equation. ``residual_frequency`` (Hz) with ``joint_before``,
    ``joint_after``, ``joint_floor`` (N), ``balance_…`` (N) and ``redundancy_…`` (m/s²): peak amplitude on the
    period lines. ``time`` (s), ``time_before``, ``time_after`` (N): joint residual over that period.
    """
    o = max(records, key=lambda r: float(np.linalg.norm(r.joint_force[r.valid[:, 2]])) / r.spectra.samples)
    n = o.spectra.period_samples
    use = o.on_period & o.valid[:, 2]
    measured = np.where(use, o.joint_force, 0)
    forces = {"before": o.model_force(before), "after": o.model_force(after)}
    out = {
        "loop_displacement": _period(o, o.Z, n),
        "loop_measured": _period(o, measured, n),
        "time": np.arange(n) / o.spectra.sample_rate,
        "residual_frequency": o.frequency[o.on_period],
    }
    amplitude = 2 / o.spectra.samples
    diagonal = np.sqrt(np.einsum("lij,lij->li", o.triangle, o.triangle.conj()).real)
    for word, joint in (("before", before), ("after", after)):
        F = np.where(use, forces[word], 0)
        out[f"loop_{word}"] = _period(o, F, n)
        out[f"time_{word}"] = _period(o, measured - F, n)
        size = np.abs(o.residuals(joint)) * amplitude
        for i, equation in enumerate(EQUATIONS):
            if o.valid[:, i].any():
                out[f"{equation}_{word}"] = _shown(size[:, i], o.valid[:, i], o.on_period)
                out[f"{equation}_floor"] = _shown(diagonal[:, i] * amplitude, o.valid[:, i], o.on_period)
    return out


def _shown(values: Array, valid: Mask, on_period: Mask) -> Array:
    """Values on the period lines, nan where the equation does not hold."""
    return np.asarray(np.where(valid, values, np.nan)[on_period])


def _period(o: Observed, X: ComplexArray, n: int) -> Array:
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    lines = X[o.on_period]
    spectrum[1 : len(lines) + 1] = lines * (n / o.spectra.samples)
    return np.asarray(np.fft.irfft(spectrum, n))
