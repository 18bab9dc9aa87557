"""Three complex curves over frequency from what every line tells of them: a smoother that needs no shape."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray

from .end_receptance import Information

_UNKNOWN = (1e4, 1e2)
"""Variance at the first line over the square of the scale: of the value, and of its change from line to line."""
_VALUE = slice(0, 3)


def smoothed(told: Information, change: Array, size: Array, step: Array) -> tuple[ComplexArray, ComplexArray]:
    """Values whose slope is a random walk over frequency, given what is told on every line.

    Kalman's filter up the lines and Rauch, Tung and Striebel's smoother back down (AIAA J. 3, 1965), complex; the mean
    is the smoothing spline of Wahba. Of several sizes of the change the likeliest is taken.

    Parameters
    ----------
    change
        Variance of the change of slope from one line to the next, (lines, 3), for a step of 1.
    size
        Factors of that, (sizes,), among which the likelihood chooses.
    step
        Distance to the line before in mean distances, (lines,).

    Returns
    -------
    tuple
        Values (lines, 3) and their covariance (lines, 3, 3).
    """
    count, lines = len(size), len(change)
    scale = change.mean(axis=0)
    x = np.zeros((count, 6), dtype=complex)
    P = np.tile(np.diag(np.repeat(_UNKNOWN, 3) * np.tile(scale, 2)).astype(complex), (count, 1, 1))
    ahead, spread = np.empty((lines, count, 6), dtype=complex), np.empty((lines, count, 6, 6), dtype=complex)
    found, sure = np.empty_like(ahead), np.empty_like(spread)
    likelihood = np.zeros(count)
    forward = _forward(step)
    for k in range(lines):
        if k:
            F = forward[k]
            x, P = x @ F.T, F @ P @ F.T + size[:, None, None] * _walk(step[k], change[k])
        ahead[k], spread[k] = x, P
        x, P, gain = _informed(x, P, told.matrix[k], told.vector[k], float(told.constant[k]))
        likelihood += gain
        found[k], sure[k] = x, P
    best = int(np.argmax(np.where(np.isfinite(likelihood), likelihood, -np.inf)))
    x, P, ahead, spread = found[:, best], sure[:, best], ahead[:, best], spread[:, best]
    gains = _flipped(np.linalg.solve(_flipped(spread[1:]), _flipped(P[:-1] @ _flipped(_forward(step[1:])))))
    for k in range(lines - 2, -1, -1):
        G = gains[k]
        x[k] += G @ (x[k + 1] - ahead[k + 1])
        P[k] += G @ (P[k + 1] - spread[k + 1]) @ G.conj().T
    return x[:, _VALUE], P[:, _VALUE, _VALUE]


def _informed(
    x: ComplexArray, P: ComplexArray, J: ComplexArray, b: ComplexArray, c: float
) -> tuple[ComplexArray, ComplexArray, Array]:
    """State and covariance after a line has told J and b, and what it adds to the log likelihood; J may be singular."""
    M, m = P[:, _VALUE, _VALUE], x[:, _VALUE]
    system = np.eye(3) + J @ M
    new = b - m @ J.T
    solved = np.linalg.solve(system, np.concatenate([new[..., None], np.tile(J, (len(x), 1, 1))], axis=2))
    across = P[:, :, _VALUE]
    misfit = c - 2 * np.sum(m.conj() * b, axis=1).real + np.einsum("sa,ab,sb->s", m.conj(), J, m).real
    misfit -= np.einsum("sa,sab,sb->s", new.conj(), M, solved[:, :, 0]).real
    P = P - across @ solved[:, :, 1:] @ across.conj().swapaxes(1, 2)
    gain = -np.log(np.abs(np.linalg.det(system))) - misfit
    return x + (across @ solved[:, :, :1])[..., 0], (P + P.conj().swapaxes(1, 2)) / 2, gain


def _forward(step: Array) -> Array:
    """Value and slope one step further on a straight line, (lines, 6, 6)."""
    F = np.tile(np.eye(6), (len(step), 1, 1))
    F[:, :3, 3:] = step[:, None, None] * np.eye(3)
    return F


def _walk(step: float, change: Array) -> Array:
    """Covariance that a random walk of the slope adds over a step."""
    return np.kron(np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]]), np.diag(change))


def _flipped(matrix: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return matrix.swapaxes(1, 2)
