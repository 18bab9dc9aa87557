"""The stabilisation chart: poles of every order, those that stay from one order to the next, and where they gather."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from jointlib.arrays import Array, ComplexArray, Mask

_FREQUENCY = 0.01
_DAMPING = 0.1
"""Shares by which frequency and damping of a pole may differ from one order to the next and be called stable."""
_GATHER = 0.004
_FEWEST = 3


@dataclass(frozen=True, eq=False)
class Gathering:
    """Stable poles of several orders in one place."""

    pole: complex
    """1/s: the median of those of the highest orders."""
    orders: int


@dataclass(frozen=True, eq=False)
class Chart:
    """Poles over model order; arrays with an entry per pole."""

    order: Array
    frequency: Array
    """Hz."""
    damping_ratio: Array
    stable: Mask
    gatherings: tuple[Gathering, ...] = field(default=())


def chart_of(by_order: Sequence[ComplexArray]) -> Chart:
    """The chart of poles (1/s) of orders 1, 2, …"""
    rows: list[tuple[int, complex, bool]] = []
    before = np.zeros(0, dtype=complex)
    for order, poles in enumerate(by_order, 1):
        for p in poles.tolist():
            rows.append((order, p, bool(np.any(_same(p, before)))))
        before = poles
    poles = np.array([p for _, p, _ in rows], dtype=complex)
    size = np.maximum(np.abs(poles), 1e-300)
    stable = np.array([one for _, _, one in rows], dtype=bool)
    orders = np.array([n for n, _, _ in rows], dtype=float)
    return Chart(orders, size / (2 * np.pi), -poles.real / size, stable, _gathered(orders, poles, stable))


def _same(pole: complex, others: ComplexArray) -> Mask:
    near = np.abs(np.abs(others) - abs(pole)) < _FREQUENCY * abs(pole)
    return np.asarray(near & (np.abs(others.real - pole.real) < _DAMPING * abs(pole.real)))


def _gathered(order: Array, poles: ComplexArray, stable: Mask) -> tuple[Gathering, ...]:
    """Stable poles within 0.4 % of each other or half a decay, from the highest order down."""
    left = [int(k) for k in np.argsort(-order, kind="stable") if stable[k]]
    found = []
    while left:
        centre = poles[left[0]]
        reach = max(_GATHER * abs(centre), 0.5 * abs(centre.real))
        near = [k for k in left if abs(poles[k].imag - centre.imag) < reach]
        members = poles[near[: 2 * _FEWEST]]
        pole = complex(np.median(members.real), np.median(members.imag))
        orders = len({float(order[k]) for k in near})
        if orders >= _FEWEST:
            found.append(Gathering(pole, orders))
        left = [k for k in left if k not in set(near)]
    return tuple(sorted(found, key=lambda g: -g.orders))
