"""Modes in one decay, told apart by filters whose transients are left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.ringdown.decay import Decay, spectrum

_VISIBLE = 0.01
"""Of the largest line; what is smaller is no mode."""
_CLEAR = 12.0
"""Times the middle of the spectrum around."""
_SPREAD = 0.2
"""Of the frequency, within which a mode may move with amplitude; what lies there is the mode itself."""
_HARMONICS = 9
_TRANSIENT = 4.0
"""Deviations of the kernel in time after which a filter has settled."""
_WIDEST = 0.4
"""Of the frequency; a wider band would let the mean and the image at −f through."""
_LOST = 0.5
"""Of the decay that a filter may cost."""


@dataclass(frozen=True)
class OneMode:
    """One mode of a decay, filtered where others are there too."""

    frequency: float
    """Hz."""
    signal: Array
    start: float
    """s from the beginning of the decay."""
    width: float | None
    """s, deviation of the kernel in time; None where nothing was filtered."""
    message: str = ""

    def amplitude_factor(self, growth: Array) -> Array:
        """|H(s)| of the filter at s = −δ + jω (rad/s): what it makes of a decaying line."""
        if self.width is None:
            return np.ones(len(growth))
        away = growth - 2j * np.pi * self.frequency
        return np.asarray(np.abs(np.exp(self.width**2 * away**2 / 2)))


def modes_of(decay: Decay, band: Sequence[float] | None) -> tuple[OneMode, ...]:
    """The modes that stand out, the largest first; with a band those in it alone."""
    lines = [decay.frequency, *_others(decay)]
    if len(lines) == 1 and band is None:
        return (OneMode(decay.frequency, decay.signal, 0.0, None),)
    wanted = [f for f in lines if band is None or band[0] <= f <= band[1]]
    made = []
    for f in wanted:
        apart = [abs(f - other) for other in lines if other != f]
        apart += [] if band is None or f != decay.frequency else [f - band[0], band[1] - f]
        made.append(_filtered(decay, f, float(np.clip(min(apart), 0.02 * f, _WIDEST * f))))
    return tuple(made)


def _others(decay: Decay) -> list[float]:
    """Hz of further lines that are neither the mode itself nor a multiple of it."""
    f, size = spectrum(decay.signal, decay.rate)
    peaks = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
    largest, found = float(np.max(size)), list[float]()
    for k in sorted(peaks, key=lambda k: -size[k]):
        if size[k] < _VISIBLE * largest:
            break
        near = size[max(0, k - 200) : k + 200]
        own = [decay.frequency * n for n in range(1, _HARMONICS)] + found
        wide = [_SPREAD * decay.frequency, *[0.06 * g for g in own[1:]]]
        if f[k] < 0.1 * decay.frequency or size[k] < _CLEAR * np.median(near):
            continue
        if all(abs(f[k] - g) > w for g, w in zip(own, wide, strict=True)):
            found.append(float(f[k]))
    return found


def _filtered(decay: Decay, frequency: float, apart: float) -> OneMode:
    """One line through a Gaussian band, down to 3·10⁻⁴ at the nearest other; both its ends left out."""
    width = 4 / (2 * np.pi * apart)
    half = int(np.ceil(_TRANSIENT * width * decay.rate))
    if 2 * half > _LOST * len(decay.signal):
        raise InputError(
            f"{decay.name}: modes at {frequency:.4g} Hz and {apart:.3g} Hz beside it: a filter that separates them "
            f"takes {2 * half / decay.rate:.3g} of {len(decay.signal) / decay.rate:.3g} s; they lie too close to be "
            "told apart"
        )
    t = np.arange(-half, half + 1) / decay.rate
    kernel = np.exp(-0.5 * (t / width) ** 2)
    kernel = kernel / np.sum(kernel) * 2 * np.cos(2 * np.pi * frequency * t)
    n = len(decay.signal) + 2 * half
    x = decay.signal - np.mean(decay.signal[len(decay.signal) // 2 :])
    y = np.fft.irfft(np.fft.rfft(x, n) * np.fft.rfft(kernel, n), n)[2 * half : len(decay.signal)]
    said = (
        f"{decay.name}: the mode at {frequency:.4g} Hz is separated by a band of ±{apart:.3g} Hz; the filter's own "
        f"transients, {half / decay.rate:.3g} s at either end, are left out."
    )
    return OneMode(frequency, y, half / decay.rate, width, said)
