"""How large a simulated vibration is from window to window, and how fast it grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from .delay_simulation import Run

_PERIODS = 16
_SETTLING = 0.4
_EARLY = 0.15
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Envelope:
    """Chatter amplitude in m of each motion in windows, (windows, batch); ``time`` of their middles in s."""

    time: Array
    amplitude: Array

    @property
    def _settled(self) -> slice:
        return slice(min(int(_SETTLING * len(self.time)), max(0, len(self.time) - 4)), None)

    @property
    def rate(self) -> Array:
        """Growth in 1/s once the start has settled, (batch,): the slope of the logarithm of the amplitude."""
        return _slope(self.time[self._settled], self.amplitude[self._settled])

    @property
    def early(self) -> Array:
        """Amplitude in m after the first transients, (batch,)."""
        return np.asarray(self.amplitude[int(_EARLY * len(self.time))])

    @property
    def typical(self) -> Array:
        """Geometric mean of the amplitude in m over the same time, (batch,)."""
        return np.asarray(np.exp(np.mean(np.log(np.maximum(self.amplitude[self._settled], _TINY)), axis=0)))


def _slope(time: Array, amplitude: Array) -> Array:
    if len(time) < 2:
        return np.zeros(amplitude.shape[1])
    t, y = (time - time.mean())[:, None], np.log(np.maximum(amplitude, _TINY))
    return np.asarray(np.sum(t * (y - y.mean(axis=0)), axis=0) / np.sum(t**2))


def envelope(run: Run, frequency: float, waves: float, forced: bool) -> Envelope:
    """√2 times the effective value of the motion under a Hann window of so many waves, the larger of x and y.

    For one line that is its amplitude; where several beat, the window must be long against the beats. What repeats in
    every tooth period is no chatter and is taken out where the cut forces such a motion; elsewhere the mean is.
    ``frequency`` in Hz says how long a wave is.
    """
    periods = len(run.motion)
    length = int(np.ceil(waves / (frequency * run.period)))
    length = min(max(length, _PERIODS if forced else 1), periods)
    starts = np.arange(0, periods - length + 1, max(1, length // 2))
    share = np.diff(np.append(run.time, run.period))
    phase = (np.arange(length)[:, None] + (run.time + share / 2) / run.period) / length
    weight = (np.sin(np.pi * phase) ** 2 * share)[:, :, None, None]
    found = np.empty((len(starts), run.motion.shape[3]))
    for i, first in enumerate(starts):
        x = run.motion[first : first + length]
        axis = 0 if forced else (0, 1)
        x = x - np.sum(weight * x, axis=axis, keepdims=True) / np.sum(weight, axis=axis, keepdims=True)
        square = np.sum(weight * x**2, axis=(0, 1)) / np.sum(weight)
        found[i] = np.sqrt(2 * np.max(square, axis=0))
    return Envelope(np.asarray((starts + length / 2) * run.period, dtype=float), found)


def strongest_line(run: Run, column: int, forced: bool) -> float:
    """Frequency in Hz of the strongest line of one motion, over the second half of a run."""
    periods, nodes = run.motion.shape[:2]
    x = run.motion[periods // 2 :, :, :, column]
    if forced:
        x = x - x.mean(axis=0)
    count = len(x) * nodes
    time = (np.arange(len(x))[:, None] * run.period + run.time).ravel()
    even = np.arange(count) * run.period / nodes
    axis = int(np.argmax(np.var(x, axis=(0, 1))))
    y = np.interp(even, time, x[:, :, axis].ravel())
    spectrum = np.log(np.maximum(np.abs(np.fft.rfft((y - y.mean()) * np.hanning(count))), _TINY))
    k = int(np.argmax(spectrum[1:-1])) + 1
    left, top, right = spectrum[k - 1 : k + 2]
    bend = left - 2 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float((k + shift) / (count * run.period / nodes))
