"""The lines of a force record at the harmonics of the passing teeth, with the errors that their scatter tells."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

MOST_ORDERS = 16
_BLOCKS, _FEWEST = 20, 8
_WITHIN = 0.02
"""Share of the nominal speed within which the true one is looked for."""
_PADDED = 8
_ORDERS, _ROUNDS = 4, 3
"""Orders of the teeth that tell the speed, and how often it is corrected."""
_STANDS_OUT = 6.0
"""Deviations of its scatter from which on a line of the teeth is heard."""
_DRIFTS = 5.0
"""Standard errors from which on the means of blocks rise or fall along a record."""


@dataclass(frozen=True, eq=False)
class ToothLines:
    """Harmonics of the teeth in one record.

    Parameters
    ----------
    frequency
        Hz at which the teeth pass, as the record has it.
    value
        N, (orders, channels); F(t) = Σ over all k of F_k·e^(jkω_T t), order 0 first.
    variance
        E|error|² in N², alike in shape.
    heard
        Whether a line stands out of the noise; where none does, the speed found is one of the noise.
    """

    frequency: float
    value: ComplexArray
    variance: Array
    heard: bool
    turn: ComplexArray
    """N, (orders of the revolution, channels): those between the lines of the teeth too."""
    turn_variance: Array
    drift: Array
    """N by which the mean of each channel rises along the record; 0 where that is no more than its scatter."""


def tooth_lines(
    force: Array, rate: float, nominal: float, per_revolution: int, highest: float, where: str
) -> ToothLines:
    """Lines of a record, (channels, samples) in N, whose teeth pass at about ``nominal`` Hz, up to ``highest`` Hz.

    The spindle turns within 2 % of what was asked for; the speed is the one at which the lines of the teeth collect
    most, then that at which their phase stands still from block to block. Each block holds whole revolutions, so that
    run-out, which repeats with them, is in no line of the teeth; the scatter of the blocks gives the variance. Of
    a mean that drifts, as that of a piezo, nobody knows when its zero was right: half of the drift is an error of it.
    """
    revolutions = int(force.shape[1] / rate * nominal / per_revolution)
    if revolutions < _FEWEST:
        raise InputError(f"{where}: holds {revolutions} revolutions, expected at least {_FEWEST}")
    orders = min(MOST_ORDERS, int(highest / (nominal * (1 + _WITHIN))))
    told = np.arange(1.0, min(_ORDERS, orders) + 1)
    frequency = _loudest(force, rate, nominal, told) if orders else nominal
    for _ in range(_ROUNDS if orders else 0):
        frequency += _drift(*_blocks(force, rate, frequency, per_revolution, orders))
    if abs(frequency / nominal - 1) > 2 * _WITHIN:
        frequency = nominal
    found, _ = _blocks(force, rate, frequency, per_revolution, orders)
    blocks = len(found)
    value = np.mean(found, axis=0)
    spread = np.sum(np.abs(found - value) ** 2, axis=0) / (blocks * (blocks - 1))
    drift = _drift_of_means(found[:, 0].real)
    variance = _smooth(spread)
    variance[0] += drift**2 / 4
    heard = bool(np.any(np.abs(value[1:]) > _STANDS_OUT * np.sqrt(variance[1:])))
    turns, _ = _blocks(force, rate, frequency / per_revolution, 1, orders * per_revolution)
    turn = np.mean(turns, axis=0)
    scatter = np.sum(np.abs(turns - turn) ** 2, axis=0) / (len(turns) * (len(turns) - 1))
    turn_variance = _smooth(scatter)
    turn_variance[0] += drift**2 / 4
    return ToothLines(frequency, value, variance, heard, turn, turn_variance, drift)


def _blocks(
    force: Array, rate: float, frequency: float, per_revolution: int, orders: int
) -> tuple[ComplexArray, float]:
    """Lines of blocks of whole revolutions, (blocks, orders + 1, channels), and how long a block is in s."""
    turn = per_revolution / frequency
    revolutions = int(force.shape[1] / rate / turn)
    blocks = min(_BLOCKS, revolutions)
    length = revolutions // blocks * turn
    edges = np.round(np.arange(blocks + 1) * length * rate).astype(int)
    found = [_fitted(force[:, a:b], np.arange(a, b) / rate, frequency, orders) for a, b in pairwise(edges)]
    return np.array(found), length


def _fitted(force: Array, time: Array, frequency: float, orders: int) -> ComplexArray:
    """Lines of a block by least squares, (orders + 1, channels)."""
    angle = 2 * np.pi * frequency * time[:, None] * np.arange(1, orders + 1)
    columns = np.concatenate([np.ones((len(time), 1)), np.cos(angle), np.sin(angle)], axis=1)
    solved = np.linalg.lstsq(columns, force.T, rcond=None)[0]
    lines = (solved[1 : orders + 1] - 1j * solved[orders + 1 :]) / 2
    return np.concatenate([solved[:1].astype(complex), lines])


def _drift_of_means(means: Array) -> Array:
    """N from the first block to the last along a straight line through means, (blocks, channels); 0 within scatter."""
    at = np.linspace(-0.5, 0.5, len(means))
    slope = at @ means / (at @ at)
    rest = means - means.mean(axis=0) - at[:, None] * slope
    error = np.sqrt(np.sum(rest**2, axis=0) / (len(means) - 2) / (at @ at))
    return np.where(np.abs(slope) > _DRIFTS * error, slope, 0.0)


def _loudest(force: Array, rate: float, nominal: float, orders: Array) -> float:
    """The tooth frequency whose orders hold most."""
    n = force.shape[1]
    size = _PADDED * 2 ** int(np.ceil(np.log2(n)))
    spectrum = np.fft.rfft((force - force.mean(axis=1, keepdims=True)) * np.hanning(n), size, axis=1)
    power = np.sum(np.abs(spectrum) ** 2, axis=0)
    step = rate / size / orders[-1]
    reach = int(_WITHIN * nominal / step)
    tried = nominal + step * np.arange(-reach, reach + 1)
    held = np.sum(np.interp(orders[:, None] * tried, np.arange(len(power)) * rate / size, power), axis=0)
    return float(tried[np.argmax(held)])


def _drift(lines: ComplexArray, length: float) -> float:
    """Hz by which the teeth pass faster than was taken: the turn of their lines from block to block."""
    turn = np.sum(lines[1:, 1:] * lines[:-1, 1:].conj(), axis=(0, 2))[:_ORDERS]
    order = np.arange(1, len(turn) + 1)
    weight = np.abs(turn) * order
    return float(np.sum(weight * np.angle(turn)) / np.sum(weight * order) / length / (2 * np.pi))


def _smooth(variance: Array) -> Array:
    """The variance of each order above 0 as the mean of it and its neighbours: a scatter of blocks scatters itself."""
    inner = variance[1:]
    around = np.array([np.mean(inner[max(0, k - 1) : k + 2], axis=0) for k in range(len(inner))])
    return np.concatenate([variance[:1], around.reshape(inner.shape)])
