"""Characteristic polynomials Π(1 − μ_i·z) = Σ a_k·z^k of many maps at once, and the largest |μ| from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...indices import Index

_SQUARINGS, _NORMALISED = 30, 3
_ZERO, _VANISHED = -(10**7), -300
"""Binary exponents: of 0, and of what counts for nothing beside 1."""
_SURE = 10.0


def coefficients(mu: ComplexArray) -> Array:
    """a_k of multipliers of real maps, shape (…, n) → (n + 1, …)."""
    a = np.zeros((mu.shape[-1] + 1, *mu.shape[:-1]), dtype=complex)
    a[0] = 1
    for i in range(mu.shape[-1]):
        a[1 : i + 2] -= mu[..., i] * a[: i + 1]
    return np.asarray(a.real)


def largest_multiplier(a: Array) -> Array:
    """Largest |μ| of Σ a_k·z^k, shape (n + 1, …) → (…), by squaring all μ over and over (Graeffe).

    p(√z)·p(−√z) has the multipliers μ². With g = max |a_k|^(1/k), g/n ≤ max |μ| ≤ 2g; after 30 squarings both bounds
    are the same to eight digits, and no error of a step counts for more than its 2^stage-th part.
    """
    size = np.zeros(a.shape[1:])
    for stage in range(_SQUARINGS):
        if stage % _NORMALISED == 0:
            # Powers of two, so nothing is rounded.
            k = _along(np.arange(1, len(a)), a.ndim)
            exponent = np.where(a[1:] == 0, _ZERO, np.frexp(a[1:])[1])
            shift = np.max(-(-exponent // k), axis=0)
            size += shift / 2.0**stage
            exponent -= shift * k
            n = 1 + int(np.flatnonzero(np.max(exponent.reshape(len(k), -1), axis=1) > _VANISHED)[-1])
            a = np.concatenate([a[:1], np.ldexp(a[1 : n + 1], -shift * k[:n])])
            sign = 1 - 2 * _along(np.arange(n + 1) % 2, a.ndim)
        turned, squared = sign * a, np.empty_like(a)
        for j in range(n + 1):
            low = max(0, 2 * j - n)
            np.multiply(a[j], turned[j], out=squared[j])
            if low < j:
                squared[j] += 2 * np.einsum("i...,i...->...", turned[low:j], a[2 * j - low : j : -1])
        a = squared
    g = np.max(np.abs(a[1:]) ** (1 / _along(np.arange(1, len(a)), a.ndim)), axis=0)
    return np.asarray(np.exp2(size + np.log2(g) / 2.0**_SQUARINGS))


def decided(sizes: Sequence[Array]) -> Array | None:
    """Sizes of multipliers, finer and finer, to the digits that all share; None where one may be on either side of 1.

    Whether a vibration grows needs no more: the last |μ| must be `_SURE` times further from 1 than from any before it.
    """
    apart = np.max(np.abs(np.array(sizes) - sizes[-1]), axis=0)
    if np.any(_SURE * apart >= np.abs(sizes[-1] - 1)):
        return None
    unit = 10.0 ** np.ceil(np.log10(np.maximum(apart, 1e-12)))
    return np.asarray(np.round(sizes[-1] / unit) * unit)


def _along(values: Index, dimensions: int) -> Index:
    """Whole numbers along the first axis."""
    return values.reshape(-1, *(1,) * (dimensions - 1))
