"""How much of what is left could any joint without memory explain: a number in the report, never an effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.spectra import Mask

_ORDERS = (0, 3, 5, 7)
"""Total orders of the surface in z and ż that are tried; 0 is the linear part alone."""
_DERIVATIVES = 4
_DETECTED = 6.0
"""Excess below so many standard deviations of noise is none."""


def ceiling(records: Sequence[Observed], whitened: Sequence[ComplexArray]) -> float | None:
    """Share of the excess of J that something smooth and without memory explains on lines left out of its fit.

    ``whitened`` holds the residuals B, R, J of each record, (lines, 3), of unit variance where nothing is missing.
    Fitted are a surface Σ c_ij T_i(z/z_max) T_j(ż/v_max), i + j up to an order, and (jω)^k Z for k = 0 … 3, on the
    lines of the period of all records together; the order that does best on left-out lines counts. Every second line
    is left out, not whole records: a polynomial says nothing beyond the level it was fitted to. The accelerations
    are no columns: with them J is explained whatever the joint. Much more than the accepted terms explain: the
    catalogue lacks something. No more: what is left has memory, comes from elsewhere, or is noise. None where there
    is no excess.
    """
    rows = [o.valid[:, 2] & o.on_period for o in records]
    left = [_real(r[use, 2]) for r, use in zip(whitened, rows, strict=True)]
    count = sum(int(use.sum()) for use in rows)
    excess = sum(float(y @ y) for y in left) - count
    if count == 0 or excess <= _DETECTED * np.sqrt(count):
        return None
    scale = [max(float(np.abs(o.path[i]).max()) for o in records) for i in (0, 1)]
    columns = [_columns(o, use, scale[0], scale[1]) for o, use in zip(records, rows, strict=True)]
    shares = [
        1 - (_left_out([c[: _DERIVATIVES + len(_powers(n))] for c in columns], left) - count) / excess for n in _ORDERS
    ]
    return float(np.clip(max(shares), 0.0, 1.0))


def _powers(order: int) -> list[tuple[int, int]]:
    """(i, j) of the terms T_i T_j of total order 2 … ``order``; z and ż themselves are among the linear columns."""
    return [(n - j, j) for n in range(2, order + 1) for j in range(n + 1)]


def _columns(o: Observed, use: Mask, z_max: float, v_max: float) -> Array:
    """Whitened real columns on the used lines, the linear ones first: shape (columns, 2 · lines)."""
    jw = 1j * o.omega
    linear = [np.where(o.on_period, jw**k * o.Z, 0) for k in range(_DERIVATIVES)]
    z, v, _ = o.path
    order = _ORDERS[-1]
    T_z, T_v = chebvander(z / z_max, order), chebvander(v / v_max, order)
    surface = o.lines_of(np.array([T_z[:, i] * T_v[:, j] for i, j in _powers(order)]))
    return _real(o.whitened_force(np.concatenate([np.array(linear), surface]))[:, use, 2])


def _real(x: ComplexArray) -> Array:
    return np.ascontiguousarray(x).view(float)


def _left_out(columns: Sequence[Array], left: Sequence[Array]) -> float:
    """Loss on every second line after a fit to the others, and the other way round."""
    X, y = np.concatenate(columns, axis=1), np.concatenate(left)
    X = X / np.maximum(np.linalg.norm(X, axis=1, keepdims=True), 1e-300)
    even = np.concatenate([np.arange(len(part)) // 2 % 2 == 0 for part in left])
    loss = 0.0
    for fit in (even, ~even):
        rest = y - np.linalg.lstsq(X[:, fit].T, y[fit], rcond=1e-9)[0] @ X
        loss += float(rest[~fit] @ rest[~fit])
    return loss
