"""Restoring-force surface in two-dimensional Chebyshev polynomials, its order chosen on held-out data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.identification.estimate import sandwich
from jointlib.identification.force_balance import ForceBalance, Groups, stacked_extra, stacked_groups
from jointlib.laws.chebyshev import Chebyshev
from jointlib.laws.polynomial import Polynomial

HIGHEST = (7, 3)
"""Largest orders in displacement and velocity that are tried."""
FOLDS = 5
_MARGIN = 2.0
"""Standard errors by which a larger order must beat a smaller one."""


@dataclass(frozen=True)
class OrderTrial:
    """One order (of displacement, of velocity) and its held-out error in N."""

    order: tuple[int, int]
    held_out: float


@dataclass(frozen=True)
class SurfaceFit:
    """A fitted surface; ``covariance`` is over its table row by row, then over the further unknowns."""

    law: Chebyshev
    covariance: Array
    unknowns: Array
    rms: tuple[float, ...]
    """Root mean square residual of every balance, N."""
    trials: tuple[OrderTrial, ...]
    """Every order that was tried; empty where it was given."""
    mean_seen: bool = True
    """False where the records hold no mean force."""

    def polynomial(self) -> tuple[Polynomial, Array]:
        """The surface in powers of z and ż with the covariance of its table, an exact change of basis (eq. 16)."""
        shape = np.shape(self.law.coefficients)
        width = shape[0] * shape[1]
        change = np.eye(len(self.covariance))
        for k in range(width):
            one = np.eye(width)[k].reshape(shape)
            table = Chebyshev(tuple(map(tuple, one)), self.law.displacement_scale, self.law.velocity_scale)
            change[:width, k] = np.ravel(table.polynomial().coefficients)
        return self.law.polynomial(), np.asarray(change @ self.covariance @ change.T)


def fit_surface(
    balances: tuple[ForceBalance, ...], order: tuple[int, int] | None = None, velocity: bool = True
) -> SurfaceFit:
    """f = Σ C_ij T_i(z/z_max) T_j(ż/ż_max) by linear least squares (Dhupia et al. 2008, eq. 12).

    Without ``order`` every order up to ``HIGHEST`` is fitted to four fifths of the data (interleaved lines or
    stretches of time) and judged on the last, five times over; the smallest whose error lies within two standard
    errors of the best is taken. Where the records do not hold the mean force, the constant is set so that the joint
    at rest is free of force. A static curve has no ``velocity`` and takes order 0 in it.
    """
    z_scale = max(float(np.max(np.abs(b.z))) for b in balances)
    v_scale = max(float(np.max(np.abs(b.v))) for b in balances) if velocity else 1.0
    groups, extra = stacked_groups(balances), stacked_extra(balances)
    target = np.concatenate([b.target for b in balances])
    if order is not None and not velocity and order[1]:
        raise InputError(f"surface fit: order {order[1]} in velocity, the static records hold none, expected 0")
    largest = order or (HIGHEST if velocity else (HIGHEST[0], 0))
    blocks = [_table(b, largest, z_scale, v_scale) for b in balances]
    design = np.concatenate(blocks)
    mean_seen = not _constant_is_lost(blocks, balances)
    if len(target) <= (largest[0] + 1) * (largest[1] + 1) * 2:
        raise InputError(f"surface fit: {len(target)} rows for order {largest}, expected more data")
    trials: tuple[OrderTrial, ...] = ()
    if order is None:
        order, trials = _choose(design, extra, target, groups, largest)
    X = np.column_stack([design[:, _columns(order, largest)], extra])
    # With a free offset the constant of the surface cannot be told from it and is left to the offset.
    known = slice(1, None) if extra.size or not mean_seen else slice(None)
    solved = np.zeros(X.shape[1])
    solved[known] = np.linalg.lstsq(X[:, known], target, rcond=None)[0]
    r = target - X @ solved
    covariance = np.zeros((X.shape[1], X.shape[1]))
    covariance[known, known] = sandwich(X[:, known], r, groups)
    width = X.shape[1] - extra.shape[1]
    mean_seen = mean_seen and not extra.size
    if not mean_seen:
        # The constant becomes minus the value of the other terms at rest.
        change = np.eye(X.shape[1])
        change[0, :width] = -np.polynomial.chebyshev.chebvander2d(0.0, 0.0, list(order)).ravel()
        change[0, 0] = 0.0
        rest = change @ solved
        covariance = change @ covariance @ change.T
    else:
        rest = solved
    table = rest[:width].reshape(order[0] + 1, order[1] + 1)
    law = Chebyshev(tuple(tuple(float(c) for c in row) for row in table), z_scale, v_scale)
    cuts = np.cumsum([len(b.target) for b in balances])[:-1]
    rms = tuple(float(np.sqrt(np.mean(part**2))) for part in np.split(r, cuts))
    return SurfaceFit(law, covariance, solved[width:], rms, trials, mean_seen)


def _table(balance: ForceBalance, order: tuple[int, int], z_scale: float, v_scale: float) -> Array:
    """Columns T_i T_j in rows of the balance, shape (rows, (i+1)(j+1))."""
    full = np.polynomial.chebyshev.chebvander2d(balance.z / z_scale, balance.v / v_scale, list(order))
    return np.column_stack([balance.rows(column) for column in full.T])


def _constant_is_lost(blocks: list[Array], balances: tuple[ForceBalance, ...]) -> bool:
    """True where the filter of the records swallows a constant force."""
    return all(
        float(np.linalg.norm(X[:, 0])) < 1e-6 * np.sqrt(len(b.target)) for X, b in zip(blocks, balances, strict=True)
    )


def _columns(order: tuple[int, int], largest: tuple[int, int]) -> Array:
    i, j = np.meshgrid(np.arange(order[0] + 1), np.arange(order[1] + 1), indexing="ij")
    return np.asarray((i * (largest[1] + 1) + j).ravel())


def _choose(
    design: Array, extra: Array, target: Array, groups: Groups, largest: tuple[int, int]
) -> tuple[tuple[int, int], tuple[OrderTrial, ...]]:
    """The smallest order that no larger one beats by more than chance."""
    fold = groups % FOLDS
    count = int(groups.max()) + 1
    full = np.column_stack([design, extra])
    grams = [(full[fold == k].T @ full[fold == k], full[fold == k].T @ target[fold == k]) for k in range(FOLDS)]
    total = sum(g for g, _ in grams), sum(y for _, y in grams)
    own = np.arange(design.shape[1], full.shape[1])
    orders = sorted(
        ((i, j) for i in range(1, largest[0] + 1) for j in range(largest[1] + 1)),
        key=lambda o: ((o[0] + 1) * (o[1] + 1), o[1]),
    )
    losses = []
    for order in orders:
        chosen = np.concatenate([_columns(order, largest), own])
        squares = np.zeros(count)
        for k, (gram, right) in enumerate(grams):
            A, y = (total[0] - gram)[np.ix_(chosen, chosen)], (total[1] - right)[chosen]
            size = np.sqrt(np.maximum(np.diag(A), 1e-300))
            theta = np.linalg.pinv(A / np.outer(size, size), rcond=1e-12, hermitian=True) @ (y / size) / size
            r = target[fold == k] - full[np.ix_(np.flatnonzero(fold == k), chosen)] @ theta
            squares += np.bincount(groups[fold == k], r**2, count)
        losses.append(squares)
    best = min(range(len(orders)), key=lambda k: float(losses[k].sum()))
    trials = tuple(
        OrderTrial(o, float(np.sqrt(loss.sum() / len(target)))) for o, loss in zip(orders, losses, strict=True)
    )
    rounding = 1e-22 * float(target @ target)
    for order, loss in zip(orders, losses, strict=True):
        gap = loss - losses[best]
        if gap.sum() <= _MARGIN * np.sqrt(count) * gap.std() + rounding:
            return order, trials
    return orders[best], trials
