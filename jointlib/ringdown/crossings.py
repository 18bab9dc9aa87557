"""Zero crossings and peaks of a decay: another route to frequency and damping, which shares nothing with the first."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from jointlib.arrays import Array
from jointlib.ringdown.cosine_fits import Pieces
from jointlib.ringdown.decay import Decay
from jointlib.ringdown.modes import OneMode


def by_crossings(decay: Decay, mode: OneMode, pieces: Pieces) -> tuple[Array, Array]:
    """ω in rad/s and δ in 1/s at the times of the pieces; nan where too few cycles are near.

    Between two upward crossings lies one period; peak to peak within it, from parabolas through three samples at each
    extreme, is twice the amplitude, whatever the mean. Straight lines through the crossings and through ln A over time,
    over the length of a piece, give ω and δ.
    """
    x, rate = mode.signal, decay.rate
    level = x - np.mean(x[-max(len(x) // 4, 2) :])
    up = np.flatnonzero((level[:-1] < 0) & (level[1:] >= 0))
    at = up + level[up] / (level[up] - level[up + 1])
    keep = np.concatenate([[True], np.diff(at) > 0.5 * rate / mode.frequency]) if len(at) else np.zeros(0, dtype=bool)
    up, at = up[keep], at[keep]
    time = at / rate + mode.start
    size = np.array([0.5 * (_top(x[a : b + 2]) + _top(-x[a : b + 2])) for a, b in pairwise(up)])
    middle = 0.5 * (time[:-1] + time[1:])
    half = np.gradient(pieces.time) / 2 if len(pieces) > 1 else np.full(len(pieces), np.inf)
    omega, damping = np.full(len(pieces), np.nan), np.full(len(pieces), np.nan)
    for i, (t, h) in enumerate(zip(pieces.time, half, strict=True)):
        reach = max(h, 1.6 / mode.frequency)
        near, inside = np.abs(time - t) <= reach, np.abs(middle - t) <= reach
        if np.count_nonzero(near) >= 3 and np.count_nonzero(inside) >= 2:
            omega[i] = 2 * np.pi / np.polyfit(np.arange(np.count_nonzero(near)), time[near], 1)[0]
            damping[i] = -np.polyfit(middle[inside], np.log(size[inside]), 1)[0]
    return omega, damping


def _top(x: Array) -> float:
    """The largest value, by the parabola through it and its neighbours."""
    k = int(np.argmax(x))
    if k in (0, len(x) - 1):
        return float(x[k])
    a, b, c = x[k - 1 : k + 2]
    bend = a - 2 * b + c
    return float(b - (a - c) ** 2 / (8 * bend)) if bend < 0 else float(b)
