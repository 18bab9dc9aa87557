"""Borders of stability of many samples at the speeds and arcs of test cuts.

1 + b·λ = 0 for an eigenvalue of [(1 − e^(−jωτ))·D + jω·(C/v)·E]·G, D the mean stiffness of the cut per depth (zero
order, Altintas & Budak 1995) and E the mean of v·vᵀ over the teeth: flanks that rub damp along the chip's thickness.
What the mean of the teeth misses, flips above all, is told by `exactness`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.cuts.tried_cut import TriedCut
from jointlib.errors import InputError

from ..cutting.loops.regeneration import loop_eigenvalues
from ..cutting.process.cutter import Cutter
from ..cutting.process.cutting import Cutting
from ..cutting.process.zero_order import loop_stiffness
from ..indices import Index

UNIT = 1e9
"""N/m², a coefficient to which those of samples are factors."""
_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Condition:
    """A speed in rpm and an arc of cut, at which a border is one number for each sample.

    ``stiffness`` are D per K_t and per K_n, ``rubbing`` is E, ``delays`` the times in s from a tooth to the next.
    """

    speed: float
    cutting: Cutting
    stiffness: tuple[Array, Array]
    rubbing: Array
    delays: Array

    @property
    def tooth_frequency(self) -> float:
        """Hz."""
        return self.cutting.cuts_per_revolution * self.speed / 60

    @cached_property
    def tangential_alone(self) -> Cutting:
        """The cut with a K_t of `UNIT` and no K_n; milling."""
        return replace(self.cutting, tangential=UNIT, normal=0.0)

    @property
    def surface_speed(self) -> float:
        """m/s; nan without a diameter."""
        return np.pi * (self.cutting.diameter or np.nan) * self.speed / 60


def condition(cutting: Cutting, speed: float, axes: tuple[str, ...]) -> Condition:
    """A condition of one operation."""
    rows = ["xy".index(axis) for axis in axes]
    cutter = Cutter.of(cutting)
    if cutting.process == "milling":
        alone = replace(cutting, tangential=UNIT, normal=0.0), replace(cutting, tangential=UNIT, normal=UNIT)
        first, both = (loop_stiffness(one, axes) / UNIT for one in alone)
        of_tooth = cutter.harmonics(np.zeros(1))[1][0].real
        rubbing = cutting.cuts_per_revolution / (2 * np.pi) * of_tooth[np.ix_(rows, rows)]
        behind = np.array([flute.behind for flute in cutter.flutes])
        return Condition(speed, cutting, (first, both - first), rubbing, behind / (2 * np.pi) * 60 / speed)
    along = cutting.rotation[0][rows]
    D = np.outer(along, along)
    return Condition(speed, cutting, (D, 0 * D), D, np.array([60 / speed]))


def conditions_of(cuts: Sequence[TriedCut], table: Cutting, axes: tuple[str, ...]) -> tuple[list[Condition], Index]:
    """The different conditions of cuts, and which is that of each."""
    found: dict[tuple[object, ...], int] = {}
    rows, index = list[Condition](), list[int]()
    for cut in cuts:
        key = cut.speed, cut.mode, cut.immersion
        if key not in found:
            found[key] = len(rows)
            rows.append(condition(of_cut(cut, table), cut.speed, axes))
        index.append(found[key])
    return rows, np.array(index, dtype=np.intp)


def of_cut(cut: TriedCut, table: Cutting) -> Cutting:
    """The operation of the machine with the mode and immersion that a cut says of its own."""
    if table.process != "milling" or (cut.mode is None and cut.immersion is None):
        return table
    mode = cut.mode or table.mode
    if mode == "slot" and cut.immersion not in (None, 1.0):
        raise InputError(f"{cut.name}: immersion is {cut.immersion:g}, but a slot is cut at 1; expected mode as well")
    return replace(table, mode=mode, immersion=None if mode == "slot" else cut.immersion or table.immersion)


def border(
    G: ComplexArray, lines: Array, at: Condition, tangential: Array, normal: Array, damping: Array
) -> tuple[Array, Array]:
    """Depth in m and frequency in Hz of every sample, (samples,), at one condition.

    ``G`` is (samples, lines, axes, axes), ``damping`` C in N/m of each sample. Between lines the eigenvalue runs
    straight.
    """
    if not np.any(damping):
        return met(still(G, at, tangential, normal), lines, at)
    D = _stiffness(at, tangential, normal)
    # What the flanks add to the waves where D and E are alike, as in turning; elsewhere only between the lines.
    rubs = damping / at.surface_speed * np.trace(at.rubbing) / np.linalg.norm(D, axis=(1, 2))
    K = _waves(lines, at)[:, None, None] * D[:, None] + _rubs(lines, damping, at)
    factor = _waves(lines, at) + 2j * np.pi * lines * rubs[:, None]
    return met([branch / factor for branch in _branches(K, G)], lines, at, rubs)


def still(G: ComplexArray, at: Condition, tangential: Array, normal: Array) -> list[ComplexArray]:
    """Eigenvalues of D·G, branches of (samples, lines), which all conditions with one arc of cut share."""
    D = _stiffness(at, tangential, normal)[:, None]
    return _branches(np.broadcast_to(D, G.shape), G)


def met(branches: list[ComplexArray], lines: Array, at: Condition, rubs: Array | None = None) -> tuple[Array, Array]:
    """`border` from the eigenvalues of D·G, to which the waves are a factor, with jω·``rubs`` of each sample added.

    Between the lines the inverse eigenvalue runs straight, as the dynamic stiffness nearly does, and the waves turn as
    they do; where both meet is found by false position.
    """
    samples = len(branches[0])
    rubbing = np.zeros(samples) if rubs is None else rubs
    depth, frequency = np.full(samples, np.inf), np.full(samples, np.nan)
    for branch in branches:
        turned = branch * (_waves(lines, at) + 2j * np.pi * lines * rubbing[:, None])
        above = turned.imag > 0
        row, column = np.nonzero((above[:, :-1] != above[:, 1:]) & (turned.real[:, :-1] + turned.real[:, 1:] < 0))
        first, last = 1 / branch[row, column], 1 / branch[row, column + 1]
        low, high = np.zeros(len(row)), np.ones(len(row))
        at_low, at_high = turned.imag[row, column], turned.imag[row, column + 1]
        for _ in range(_ROUNDS):
            share = low + (high - low) * at_low / (at_low - at_high)
            f = lines[column] + share * (lines[column + 1] - lines[column])
            value = (_waves(f, at) + 2j * np.pi * f * rubbing[row]) / (first + share * (last - first))
            left = (value.imag > 0) == (at_low > 0)
            low, at_low = np.where(left, share, low), np.where(left, value.imag, at_low)
            high, at_high = np.where(left, high, share), np.where(left, at_high, value.imag)
        _keep_lowest(depth, frequency, row, f, value.real)
    return depth, frequency


def _keep_lowest(depth: Array, frequency: Array, row: Index, f: Array, real: Array) -> None:
    """Put the depths −1/λ of crossings into those of their samples, where they are the lowest."""
    valid = real < 0
    found = -1 / real[valid]
    np.minimum.at(depth, row[valid], found)
    lowest = found == depth[row[valid]]
    frequency[row[valid][lowest]] = f[valid][lowest]


def _stiffness(at: Condition, tangential: Array, normal: Array) -> Array:
    return np.asarray(tangential[:, None, None] * at.stiffness[0] + normal[:, None, None] * at.stiffness[1])


def _waves(lines: Array, at: Condition) -> ComplexArray:
    """1 − e^(−jωτ), the mean over the flutes."""
    return np.asarray(1 - np.mean(np.exp(-2j * np.pi * lines[:, None] * at.delays), axis=1))


def _branches(K: ComplexArray, G: ComplexArray) -> list[ComplexArray]:
    samples, n, a = G.shape[0], G.shape[1], G.shape[2]
    return _followed(loop_eigenvalues(K.reshape(-1, a, a), G.reshape(-1, a, a)).reshape(samples, n, -1))


def _rubs(lines: Array, damping: Array, at: Condition) -> ComplexArray:
    """jω·(C/v)·E, (samples, lines, axes, axes)."""
    return np.asarray(
        2j * np.pi * lines[:, None, None] * (damping / at.surface_speed)[:, None, None, None] * at.rubbing
    )


def _followed(value: ComplexArray) -> list[ComplexArray]:
    """Branches (samples, lines) of one or two eigenvalues, each running on smoothly."""
    if value.shape[2] == 1:
        return [value[:, :, 0]]
    before, after = value[:, :-1], value[:, 1:]
    straight = np.sum(np.abs(after - before), axis=2)
    crossed = np.sum(np.abs(after[:, :, ::-1] - before), axis=2)
    turned = np.cumsum(crossed < straight, axis=1) % 2 == 1
    swapped = np.concatenate([np.zeros((len(value), 1), dtype=bool), turned], axis=1)
    first = np.where(swapped, value[:, :, 1], value[:, :, 0])
    return [first, np.where(swapped, value[:, :, 0], value[:, :, 1])]
