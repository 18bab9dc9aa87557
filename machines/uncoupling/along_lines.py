"""Three complex curves over frequency from what every line tells of them: a smoother that needs no shape."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from .end_receptance import Information

_UNKNOWN = (1e4, 1e2)
"""Variance at the first line over the square of the scale: of the value, and of its change from line to line."""
_VALUE = slice(0, 3)


def smoothed(told: Information, change: Array, size: Array, step: Array) -> tuple[ComplexArray, ComplexArray, Array]:
    """Values whose slope is a random walk over frequency, given what is told on every line.

    Kalman's filter up the lines and Rauch, Tung and Striebel's smoother back down (AIAA J. 3, 1965), complex; the mean
    is the smoothing spline of Wahba. Several sizes of the change are worked on side by side.

    Parameters
    ----------
    change
        Variance of the change of slope from one line to the next, (lines, 3), for a step of 1.
    size
        Factors α of that, squared, (sizes,).
    step
        Distance to the line before in mean distances, (lines,).

    Returns
    -------
    tuple
        Values (sizes, lines, 3), their covariance (sizes, lines, 3, 3), and the log likelihood (sizes,).
    """
    count, lines = len(size), len(change)
    scale = change.mean(axis=0)
    x = np.zeros((count, 6), dtype=complex)
    P = np.tile(np.diag(np.repeat(_UNKNOWN, 3) * np.tile(scale, 2)).astype(complex), (count, 1, 1))
    ahead, spread = np.empty((lines, count, 6), dtype=complex), np.empty((lines, count, 6, 6), dtype=complex)
    found, sure = np.empty_like(ahead), np.empty_like(spread)
    likelihood = np.zeros(count)
    for k in range(lines):
        if k:
            F = _forward(step[k])
            x, P = x @ F.T, F @ P @ F.T + size[:, None, None] * _walk(step[k], change[k])
        ahead[k], spread[k] = x, P
        x, P, gain = _informed(x, P, told.matrix[k], told.vector[k], float(told.constant[k]))
        likelihood += gain
        found[k], sure[k] = x, P
    for k in range(lines - 2, -1, -1):
        back = np.linalg.solve(_flipped(spread[k + 1]), _flipped(sure[k] @ _forward(step[k + 1]).T))
        G = _flipped(back)
        found[k] += (G @ (found[k + 1] - ahead[k + 1])[..., None])[..., 0]
        sure[k] += G @ (sure[k + 1] - spread[k + 1]) @ G.conj().swapaxes(1, 2)
    return found[..., _VALUE].swapaxes(0, 1), sure[..., _VALUE, _VALUE].swapaxes(0, 1), likelihood


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


def _forward(step: float) -> Array:
    """Value and slope one step further on a straight line."""
    F = np.eye(6)
    F[:3, 3:] = step * np.eye(3)
    return F


def _walk(step: float, change: Array) -> Array:
    """Covariance that a random walk of the slope adds over a step."""
    return np.kron(np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]]), np.diag(change))


def _flipped(matrix: ComplexArray) -> ComplexArray:
    return np.asarray(matrix.swapaxes(1, 2))
