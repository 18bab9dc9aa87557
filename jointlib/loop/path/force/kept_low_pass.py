"""A low pass forward and backward of which a few samples are wanted: a product with a matrix and a short recursion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.identification.path_record import ORDER

_ENDS = 12.0
"""Periods of the cutoff frequency after which nothing tells any more how the filter began, but for 10⁻¹²."""
_GONE = 1e-17
"""Power of a pole that adds nothing."""


@dataclass(frozen=True)
class _Split:
    """H(p)·H(1/p) of a Butterworth filter H as through + Σ residue·Σ pole^n (p⁻ⁿ + pⁿ); one pole of each pair."""

    pole: ComplexArray
    residue: ComplexArray
    through: float
    powers: ComplexArray
    """Of each pole until they are nothing, (power, pole)."""
    ways: Array
    """What each sample between two kept ones adds to the sums at the later one, and at the earlier one: their real and
    their imaginary parts, (sum, sample)."""


@lru_cache(maxsize=16)
def _split(cutoff: float, stride: int) -> _Split:
    """Of the order of the low pass; the cutoff in halves of the sample rate."""
    zeros, poles, gain = scipy.signal.butter(ORDER, cutoff, output="zpk")
    every, pole = np.asarray(poles), np.asarray(poles)[np.imag(poles) > 0]

    def response(p: ComplexArray) -> ComplexArray:
        return np.asarray(gain * np.prod(p[:, None] - zeros, axis=1) / np.prod(p[:, None] - every, axis=1))

    others = np.array([np.prod([p - q for q in every if q != p]) for p in pole])
    own = gain * np.prod(pole[:, None] - zeros, axis=1) / (others * pole)
    through = gain * float(np.real(response(np.zeros(1, dtype=complex))[0]))
    powers = pole ** np.arange(int(np.log(_GONE) / np.log(np.max(np.abs(pole)))) + 1)[:, None]
    n = np.arange(stride)[:, None]
    ways = np.concatenate([pole ** (stride - 1 - n), pole ** (n + 1)], axis=1)
    return _Split(pole, own * response(1 / pole), through, powers, np.concatenate([ways.real.T, ways.imag.T]))


def low_pass_kept(x: Array, cutoff: float, sample_rate: float, keep: slice) -> Array:
    """Samples ``keep`` (its bounds and its stride given) of :func:`low_pass` of x, along the last axis.

    The filter both ways is a sum over poles p of Σ pⁿ (x[k − n] + x[k + n]). From one kept sample to the next these
    sums shrink by p^stride and gain what the samples between add, which is one product with a matrix. At its ends x is
    carried on, turned about them, until nothing tells any more what comes then.
    """
    begin, stride, n = keep.start, keep.step, x.shape[-1]
    count = len(range(*keep.indices(n)))
    split, end = _split(cutoff / (sample_rate / 2), stride), begin + (count - 1) * stride
    between = x[..., begin + 1 : end + 1].reshape(*x.shape[:-1], count - 1, stride)
    inside = np.matmul(split.ways, np.swapaxes(between, -1, -2))
    least = min(n - 1, int(_ENDS * sample_rate / cutoff) + 1)
    before = _ended(_carried(x[..., begin::-1], least - begin), split)
    after = _ended(_carried(x[..., end:], least - (n - 1 - end))[..., 1:], split) * split.pole
    out, poles = split.through * x[..., begin : end + 1 : stride], len(split.pole)
    y = np.empty((2, *out.shape))
    for i, (pole, size) in enumerate(zip(split.pole, split.residue, strict=True)):
        # 2 Re(size·u) with u[k] = shrink·u[k − 1] + sums[k], both ways, as a real recursion of second order.
        shrink = pole**stride
        here, last = 2 * size, -2 * size * np.conj(shrink)
        for row, k, first, way in ((y[0], i, before[..., i], 1), (y[1], i + poles, after[..., i], -1)):
            re, im = inside[..., k, ::way], inside[..., k + 2 * poles, ::way]
            row[..., 0] = (here * first).real
            row[..., 1:] = here.real * re - here.imag * im
            row[..., 1] += (last * first).real
            row[..., 2:] += last.real * re[..., :-1] - last.imag * im[..., :-1]
        found = scipy.signal.lfilter([1.0], [1.0, -2 * shrink.real, abs(shrink) ** 2], y, axis=-1)
        out = out + found[0] + found[1, ..., ::-1]
    return np.asarray(out)


def _carried(x: Array, more: int) -> Array:
    """x and, where ``more`` is above 0, so many samples of it turned about its last one, as far as there are."""
    more = min(more, x.shape[-1] - 1)
    return x if more <= 0 else np.concatenate([x, 2 * x[..., -1:] - x[..., -2 : -2 - more : -1]], axis=-1)


def _ended(x: Array, split: _Split) -> ComplexArray:
    """Σ x[n] poleⁿ for each pole, the last sample for ever."""
    x = x[..., : len(split.powers)]
    last = split.powers[x.shape[-1] - 1] * split.pole / (1 - split.pole)
    return np.asarray(x @ split.powers[: x.shape[-1]] + x[..., -1:] * last)
