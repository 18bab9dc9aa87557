"""Modes in one decay, told apart by filters whose transients are left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.ringdown.decay import Decay, spectrum

_VISIBLE = 0.01
"""Of the largest line; what is smaller is no mode."""
_CLEAR = 12.0
"""Times the middle of the spectrum around."""
_SPREAD = 0.2
"""Of the frequency, within which a line is the mode itself, which moves with amplitude, where nothing shows another."""
_NEAREST = 0.04
"""Of the frequency, within which no other mode is looked for."""
_TOLD_APART = 6.0
"""Lines between two frequencies in a window (Hann) that tells them apart."""
_GROWS, _STAYS = 2.0, 0.05
"""Times what it begins with, above which a line is where a mode comes to later; and the share in the window after the
first, below which it is where a mode was before."""
_HARMONICS = 8
_WIDE = 0.06
"""Of the frequency of a multiple, or of another mode, within which a line is that."""
_OF_FRICTION = tuple(range(9, 30, 2))
"""Odd multiples beyond, which acceleration that jumps where friction turns has."""
_BLUR = 3.0
"""Lines that a record resolves, by which one may lie beside its place."""
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

    def unfiltered(self, growth: ComplexArray, bend: ComplexArray) -> tuple[ComplexArray, Array]:
        """s = p' = −δ + jω (rad/s) of a line from what the filter H leaves of it, with ṡ; and |H(s)|.

        A line that moves leaves H(s) exp(p), which grows by s + ṡ d ln H/ds.
        """
        if self.width is None:
            return growth, np.ones(len(growth))
        centre = 2j * np.pi * self.frequency
        s = growth - self.width**2 * (growth - centre) * bend
        return s, np.asarray(np.abs(np.exp(self.width**2 * (s - centre) ** 2 / 2)))


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
    f, size = spectrum(decay.moving, decay.rate)
    peaks = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
    largest, found = float(np.max(size)), list[float]()
    blur = _BLUR * float(f[1])
    own = [(decay.frequency, max(_NEAREST * decay.frequency, blur))]
    own += [(n * decay.frequency, max(_WIDE * n * decay.frequency, blur)) for n in range(2, _HARMONICS + 1)]
    own += [(n * decay.frequency, blur + n * float(f[1]) / 4) for n in _OF_FRICTION]
    for k in sorted(peaks, key=lambda k: -size[k]):
        if size[k] < _VISIBLE * largest:
            break
        near = size[max(0, k - 200) : k + 200]
        if f[k] < 0.1 * decay.frequency or size[k] < _CLEAR * np.median(near):
            continue
        apart = all(abs(f[k] - g) > max(_WIDE * g, blur) for g in found) and all(abs(f[k] - g) > w for g, w in own)
        if apart and _are_two(decay, float(f[k])):
            found.append(float(f[k]))
    return found


def _are_two(decay: Decay, line: float) -> bool:
    """Whether a line is another mode than the largest, and not where that is at another amplitude: both are there from
    the beginning, and within the spread of a mode both stay."""
    x, apart = decay.signal, abs(line - decay.frequency)
    n = round(_TOLD_APART / apart * decay.rate)
    near = apart < _SPREAD * decay.frequency
    if 2 * n > len(x):
        return not near
    window = np.hanning(n)
    parts = np.lib.stride_tricks.sliding_window_view(x - np.mean(x), n)[:: max(1, n // 2)]
    for f in (line, decay.frequency):
        size = np.abs(parts @ (window * np.exp(-2j * np.pi * f * np.arange(n) / decay.rate)))
        if np.max(size) > _GROWS * size[0] or (near and size[2] < _STAYS * size[0]):
            return False
    return True


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
