"""The line of a beam between its stations, for the eye."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointlib.arrays import Array

from .drawn import Drawn, Frame
from .solid import between_sections

_PIECES = 24
"""Pieces that a beam is drawn in, at least."""


def drawn_beam(
    start: Array, axes: Array, stations: Mapping[str, float], segments: Sequence[tuple[float, Array]]
) -> Drawn:
    """A straight bar over six degrees of freedom a station: x, y, z, rx, ry, rz in machine axes.

    Between two stations it bends as a slender bar does that nothing loads there (a cubic with the stations' motions
    and slopes), and stretches and twists evenly; beyond the outermost ones it goes on straight. A motion of all
    stations as one rigid body is drawn as that. What a mode does between stations beyond this the stations do not tell.

    Parameters
    ----------
    start, axes
        First end in m; axis, width and height of the bar as rows.
    stations
        m from the start.
    segments
        Length (m) and corners (k, 2) of the section in width and height, one after the other.
    """
    held = np.array(list(stations.values()))
    ends = np.concatenate([[0.0], np.cumsum([length for length, _ in segments])])
    even = np.linspace(0.0, ends[-1], _PIECES + 1)
    between = np.setdiff1d(np.round(np.concatenate([ends, even]), 9), np.round(held, 9))
    places = np.concatenate([held, between])
    frames = tuple(Frame(start + x * axes[0], _rows(x, held, axes[0])) for x in places)
    order = np.argsort(places)
    solids, along = [], places[order]
    for (length, section), first in zip(segments, ends, strict=False):
        within = order[(along >= first - 1e-9) & (along <= first + length + 1e-9)]
        rings = np.array([start + np.column_stack([np.full(len(section), places[i]), section]) @ axes for i in within])
        solids.append(between_sections(rings, [int(i) for i in within]))
    return Drawn(frames, tuple(stations), len(held), tuple(solids))


def _rows(x: float, held: Array, t: Array) -> Array:
    """u and ϑ (6, 6 n) of the section at x over those of n stations."""
    out = np.zeros((6, 6 * len(held)))
    order = np.argsort(held)
    after = int(np.searchsorted(held[order], x))
    for station in np.flatnonzero(held == x):
        out[:, 6 * station : 6 * station + 6] = np.eye(6)
        return out
    if after in (0, len(held)):
        near = order[0 if after == 0 else -1]
        out[:, 6 * near : 6 * near + 6] = np.eye(6)
        out[:3, 6 * near + 3 : 6 * near + 6] = _cross((x - held[near]) * t)
        return out
    a, b = order[after - 1], order[after]
    L = held[b] - held[a]
    s = (x - held[a]) / L
    along, across = np.outer(t, t), np.eye(3) - np.outer(t, t)
    # Hermite's cubics of displacement and slope ϑ × t at both ends, and their derivatives along the bar.
    shape = (1 - 3 * s**2 + 2 * s**3, L * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, L * (s**3 - s**2))
    slope = (6 * (s**2 - s) / L, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / L, 3 * s**2 - 2 * s)
    for station, share, (w, v), (dw, dv) in (
        (a, 1 - s, shape[:2], slope[:2]),
        (b, s, shape[2:], slope[2:]),
    ):
        at = slice(6 * station, 6 * station + 3), slice(6 * station + 3, 6 * station + 6)
        out[:3, at[0]] = share * along + w * across
        out[:3, at[1]] = v * _cross(t)
        out[3:, at[0]] = dw * _cross(t).T
        out[3:, at[1]] = share * along + dv * across
    return out


def _cross(arm: Array) -> Array:
    """The matrix of ϑ × arm."""
    x, y, z = arm
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
