"""Interpolation of measured receptances between their lines, with its error estimated by leaving lines out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ..indices import Mask

METHODS = ("none", "rational", "spline")
Curve = Callable[[Array], ComplexArray]
_POINTS = 4
_GAP = 3.0
_WEAK = 1e-2
_ON_AXIS = 0.05
"""A pole nearer to the line between two frequencies than this share of their distance is one of noise."""


@dataclass(frozen=True)
class LeftOut:
    """How well lines that were left out are predicted from the others, at twice the distance."""

    norm: float
    """Largest, over entries, of the norm of the error over that of the values."""
    worst: float
    """Frequency in Hz of the largest error."""


def curve(frequency: Array, value: ComplexArray, method: str) -> tuple[Curve, int]:
    """Values (first axis: lines) between the lines in Hz, and the number of pieces where a cubic stood in.

    "spline" is a cubic spline of real and imaginary part. "rational" is piecewise (a0 + a1 t + a2 t²)/(1 + b t)
    through the four nearest lines: one pole near a resonance, the rest a parabola; where noise puts the pole between
    two lines, the cubic through the four takes its place. Both go through every line.
    """
    if method == "spline":
        spline = scipy.interpolate.CubicSpline(frequency, value)
        return (lambda lines: np.asarray(spline(lines), dtype=complex)), 0
    n = len(frequency)
    points = min(_POINTS, n)
    first = np.clip(np.arange(n - 1) - 1, 0, n - points)
    stencil = first[:, None] + np.arange(points)
    width = np.diff(frequency)
    t = (frequency[stencil] - frequency[:-1, None]) / width[:, None]
    y = np.moveaxis(value.reshape(n, -1)[stencil], 2, 1)  # piece, entry, point
    size = np.max(np.abs(y), axis=2, keepdims=True)
    y = y / np.where(size > 0, size, 1.0)
    powers = np.broadcast_to((t[:, :, None] ** np.arange(points - 1))[:, None], (*y.shape, points - 1))
    rational = (
        np.linalg.pinv(np.concatenate([powers, -(y * t[:, None])[..., None]], axis=3), rcond=1e-13) @ y[..., None]
    )
    cubic = np.linalg.inv(t[:, None, :, None] ** np.arange(points)) @ y[..., None]
    pole = -1 / np.where(rational[..., -1, 0] == 0, 1e-300, rational[..., -1, 0])
    noise = (np.abs(pole.imag) < _ON_AXIS) & (pole.real > -_ON_AXIS) & (pole.real < 1 + _ON_AXIS)
    top = np.where(
        noise[..., None], cubic[..., 0], np.concatenate([rational[..., :-1, 0], 0 * pole[..., None]], axis=2)
    )
    bottom = np.where(noise, 0.0, rational[..., -1, 0])

    def at(lines: Array) -> ComplexArray:
        piece = np.clip(np.searchsorted(frequency, lines, side="right") - 1, 0, n - 2)
        s = ((lines - frequency[piece]) / width[piece])[:, None]
        number = np.zeros((len(lines), y.shape[1]), dtype=complex)
        for power in range(points - 1, -1, -1):
            number = number * s + top[piece, :, power]
        found = number / (1 + bottom[piece] * s) * np.where(size > 0, size, 1.0)[piece, :, 0]
        return np.asarray(found.reshape(len(lines), *value.shape[1:]))

    return at, int(np.sum(noise))


def gaps(frequency: Array) -> list[tuple[float, float]]:
    """Neighbouring lines in Hz that lie much further apart than those on either side: something is missing there."""
    width = np.diff(frequency)
    beside = np.maximum(np.append(width[1:], 0.0), np.append(0.0, width[:-1]))
    wide = np.flatnonzero((width > _GAP * beside) & (beside > 0))
    return [(float(frequency[i]), float(frequency[i + 1])) for i in wide]


def wide(value: ComplexArray) -> Mask:
    """Intervals between neighbouring lines that are wider than about half the half-power bandwidth of a mode.

    A phase of π/2 passes in a bandwidth. Where |value| is below a hundredth of the largest, nothing is called wide.
    """
    size = np.abs(value)
    turned = np.abs(np.angle(value[1:] * value[:-1].conj()))
    return np.asarray((turned > np.pi / 4) & (np.minimum(size[1:], size[:-1]) > _WEAK * np.max(size)))


def left_out(frequency: Array, value: ComplexArray, method: str) -> LeftOut:
    """Every second line is predicted from the rest, then the rest from those; the ends are not predicted."""
    error = np.zeros(value.shape)
    for start in (0, 1):
        kept = np.arange(start, len(frequency), 2)
        inside = np.arange(len(frequency))
        inside = inside[(inside % 2 != start) & (inside > kept[0]) & (inside < kept[-1])]
        if len(kept) > 1 and len(inside):
            error[inside] = np.abs(curve(frequency[kept], value[kept], method)[0](frequency[inside]) - value[inside])
    flat, size = error.reshape(len(frequency), -1), np.linalg.norm(value.reshape(len(frequency), -1), axis=0)
    share = np.linalg.norm(flat, axis=0) / np.where(size > 0, size, 1.0)
    entry = int(np.argmax(share))
    return LeftOut(float(share[entry]), float(frequency[int(np.argmax(flat[:, entry]))]))
