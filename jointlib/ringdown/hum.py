"""Hum of the mains in a record: lines at multiples of 50 or 60 Hz that do not decay."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

_MAINS = 50.0, 60.0
"""Hz."""
_MOST = 20
"""Multiples that are looked at."""
_OFF = 2e-3
"""Of its frequency, by which a grid may be off."""
_CLEAR = 12.0
"""Times the middle of the spectrum around."""
_STEADY = 0.05
"""Of its amplitude, by which hum differs from one quarter of a record to the next."""
_MOTION = 0.3
"""Of half of the swing, from which on a line is a motion that hardly decays."""
_LEAST = 8
"""Half lines below which a record resolves no hum."""
_STEPS = 3
_AROUND = 200
"""Half lines to either side that tell the middle of a spectrum."""


def without_hum(x: Array, rate: float) -> tuple[Array, tuple[tuple[float, float], ...]]:
    """A record without its hum, and frequency in Hz and amplitude of each line that was taken out.

    The second half tells, where the motion is smallest. A mode whose frequency is that of the mains may decay as slowly
    as hum does; it is told by its size.
    """
    lines = [f for nominal in _candidates(x, rate) if (f := _steady(x, rate, nominal)) is not None]
    lines = [f for f in lines if abs(_phasor(x[len(x) // 2 :], rate, f)) < _MOTION * np.ptp(x) / 2]
    if not lines:
        return x, ()
    t = np.arange(len(x)) / rate
    columns = np.array([part(2 * np.pi * f * t) for f in lines for part in (np.cos, np.sin)]).T
    late = slice(len(x) // 2, len(x))
    weight = np.hanning(len(t[late]))
    J = np.column_stack([columns[late], np.ones(len(t[late]))]) * weight[:, None]
    solved = np.linalg.lstsq(J, x[late] * weight, rcond=None)[0][:-1]
    return x - columns @ solved, tuple(zip(lines, np.hypot(solved[::2], solved[1::2]).tolist(), strict=True))


def _candidates(x: Array, rate: float) -> list[float]:
    """Hz of what stands out of the second half at a multiple of the mains."""
    late = x[len(x) // 2 :]
    n = 2 * len(late)
    size = np.abs(np.fft.rfft((late - np.mean(late)) * np.hanning(len(late)), n))
    found = list[float]()
    for nominal in sorted({m * k for m in _MAINS for k in range(1, _MOST + 1) if m * k < 0.45 * rate}):
        middle = nominal * n / rate
        reach = max(2, round(_OFF * middle))
        first = round(middle) - reach
        if first < _LEAST:
            continue
        k = first + int(np.argmax(size[first : first + 2 * reach + 1]))
        top = size[k] >= np.max(size[k - 1 : k + 2])
        if top and size[k] > _CLEAR * np.median(size[max(0, k - _AROUND) : k + _AROUND]):
            found.append(k * rate / n)
    return found


def _steady(x: Array, rate: float, frequency: float) -> float | None:
    """Hz of a line, by its phases in the last two quarters; None where its amplitudes differ there."""
    n = len(x) // 4
    ratio = 1.0 + 0.0j
    for _ in range(_STEPS):
        third, last = (_phasor(part, rate, frequency) for part in (x[2 * n : 3 * n], x[3 * n : 4 * n]))
        ratio = last / third * np.exp(-2j * np.pi * frequency * n / rate)
        frequency += float(np.angle(ratio)) * rate / (2 * np.pi * n)
    return frequency if abs(abs(ratio) - 1) < _STEADY else None


def _phasor(x: Array, rate: float, frequency: float) -> complex:
    """Of a line, from the first sample on."""
    window = np.hanning(len(x))
    turn = np.exp(-2j * np.pi * frequency * np.arange(len(x)) / rate)
    return complex(2 * np.sum(window * (x - np.mean(x)) * turn) / np.sum(window))
