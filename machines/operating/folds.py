"""Folds: frequencies at which two solutions of one joint meet and vanish."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

from ..harmonic_balance.assembly import Assembly
from .solutions import Solutions

_PASSES = 30
_SETTLED = 1e-11
_INSIDE = 1e-6
_STEP_OMEGA = 1e-6
_STEP_AMPLITUDE = 1e-4


def fold_lines(assembly: Assembly, forces: Array, found: Solutions) -> Array:
    """Lines in Hz just inside every fold between neighbouring lines, where both solutions still stand."""
    starts = _starts(found)
    if not starts:
        return np.empty(0)
    f, inside, outside = (np.array([s[n] for s in starts]) for n in range(3))
    A = np.array([s[3] for s in starts])
    low, high = (
        np.minimum(found.frequency[inside], found.frequency[outside]),
        found.frequency[np.maximum(inside, outside)],
    )
    omega = 2 * np.pi * found.frequency[inside]
    settled = np.zeros(len(A), dtype=bool)
    for _ in range(_PASSES):
        step_omega, step_A = _step(assembly, forces[f], omega, A)
        reach = 2 * np.pi * (high - low)
        step_omega = np.clip(step_omega, -reach, reach)
        A = A + np.clip(step_A, -0.2 * A, 0.2 * A)
        omega = omega + step_omega
        settled = np.abs(step_omega) <= _SETTLED * omega
        if np.all(settled):
            break
    at = omega / (2 * np.pi)
    near = settled & (at >= low) & (at <= high)
    inward = at + (found.frequency[inside] - at) * _INSIDE
    lines = np.unique(inward[near])
    return np.asarray(lines[~np.isin(lines, found.frequency)])


def _starts(found: Solutions) -> list[tuple[int, int, int, float]]:
    """Force, line with the pair, line without, and the amplitude between the two solutions that meet."""
    counts = found.counts()
    starts = []
    for f, i in zip(*np.nonzero(np.abs(np.diff(counts, axis=1)) == 2), strict=True):
        many, few = (i, i + 1) if counts[f, i] > counts[f, i + 1] else (i + 1, i)
        on = found.force == f
        pair, rest = (np.flatnonzero(on & (found.line == line)) for line in (many, few))
        # The pair that meets is the one whose removal leaves amplitudes nearest to those beyond.
        candidates = [
            (float(np.sum(np.abs(np.delete(found.size[pair], [k, k + 1]) - found.size[rest]))), k)
            for k in range(len(pair) - 1)
        ]
        k = min(candidates)[1]
        starts.append((int(f), int(many), int(few), float(np.mean(found.size[pair[k : k + 2]]))))
    return starts


def _step(assembly: Assembly, force: Array, omega: Array, A: Array) -> tuple[Array, Array]:
    """Newton step towards A·abs(D) = abs(Hzf)·F and ∂(A·abs(D))/∂A = 0, with differences for the derivatives."""
    dw, da = _STEP_OMEGA * omega, _STEP_AMPLITUDE * A
    at_omega = np.stack([omega, omega + dw, omega - dw, omega, omega])
    at_A = np.stack([A, A, A, A + da, A - da])
    view = assembly.at(at_omega.ravel())
    joint = assembly.joints[assembly.nonlinear[0]]
    h, driven = (part[:, 0, 0].reshape(at_omega.shape) for part in (view.Hzz, view.Hzf))
    found = joint.first_harmonic(at_A, at_omega)
    D = 1 + h * found.gain
    size = np.abs(D)
    r1 = at_A * size - np.abs(driven) * force
    r2 = size + at_A * (D.conj() * h * found.d_amplitude).real / size
    a, b = (r1[1] - r1[2]) / (2 * dw), (r1[3] - r1[4]) / (2 * da)
    c, d = (r2[1] - r2[2]) / (2 * dw), (r2[3] - r2[4]) / (2 * da)
    determinant = a * d - b * c
    determinant = np.where(determinant == 0, np.inf, determinant)
    return -(d * r1[0] - b * r2[0]) / determinant, -(a * r2[0] - c * r1[0]) / determinant
