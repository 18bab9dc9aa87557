"""The force of a steady cut of any cutter on the tool, in harmonics of its pattern of flutes.

A tooth at φ cuts a chip of feed·sin φ and pushes with −b·(u(φ)·chip + its edge force), a series in the harmonics of
the pattern (Altintas, Manufacturing Automation, 2nd ed., 2012). Flutes that follow one another alike meet their own
surface and change no chip: q(t) = q(t − τ). Others meet what the motion was a pitch ago: with F the force of the feed,
of edges and of run-out, the cut holds x = b·F − b·A·x, A the loop of `SideLines` at multiples of the pattern's
frequency. A flute that stands out by ρ_j cuts a chip that is thicker by ρ_j − ρ_(j−1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..cutters.side_lines import SideLines, over_depth
from ..in_time.delay_simulation import Chip
from ..process.cutter import Cutter
from ..process.cutting import Cutting

_PANEL = np.polynomial.legendre.leggauss(64)
_WAVES = 8
"""Of the highest harmonic within a panel; 64 points integrate four times as many exactly."""
_MET = 16
"""Tooth harmonics in which waves of earlier flutes are met; beyond, the tool hardly moves."""
_SMALL = 1e-3


@dataclass(frozen=True)
class PatternForces:
    """Of one operation on a tool with given axes, up to a harmonic of its pattern."""

    cutting: Cutting
    axes: tuple[str, ...]
    count: int

    @cached_property
    def cutter(self) -> Cutter:
        """Its flutes up to where they repeat, run-out with them."""
        return Cutter.of(self.cutting, runout=True)

    @cached_property
    def _arc(self) -> tuple[Array, ComplexArray, Array, Array]:
        """Angles, the waves of all harmonics over them with their weights, and what tooth and edge push there."""
        first, last = self.cutter.arc
        n = self.cutter.patterns
        waves = (1 + self.count) * n * (last - first) / 2 / np.pi
        wide = (last - first) / (panels := 1 + int(waves / _WAVES))
        x, w = _PANEL
        angle = (first + wide * (np.arange(panels)[:, None] + (x + 1) / 2)).ravel()
        wave = np.exp(-1j * n * np.arange(self.count + 1)[:, None] * angle) * np.tile(w * wide / 2, panels)
        rows = ["xy".index(axis) for axis in self.axes]
        return angle, wave, self.cutting.tooth(angle)[0][:, rows], self.cutting.edge(angle)[:, rows]

    @cached_property
    def _pushed(self) -> Callable[[float, float], ComplexArray]:
        """What a flute pushes by the angle to the one before it and by how much it stands out beyond that one, in
        N/m, (1 + harmonics, axes); even, straight flutes are alike at all depths and speeds."""
        angle, wave, push, edge = self._arc
        assert self.cutting.feed is not None
        law = Chip(self.cutting.feed, self.cutting.exponent)
        share = self.cutting.feed * self.cutting.cuts_per_revolution / (2 * np.pi)

        @lru_cache(maxsize=64)
        def pushed(behind: float, beyond: float) -> ComplexArray:
            chip = share * behind * np.sin(angle) + beyond
            return np.asarray(wave @ -(push * law.force(chip)[:, None] + edge * (chip > 0)[:, None]))

        return pushed

    def feeds(self, depth: float) -> ComplexArray:
        """F_k in N/m without waves, (1 + harmonics, axes): F(t) = Σ F_k·e^(jkω_P·t) over all k, F_−k its conjugate."""
        cutter = self.cutter
        turns = cutter.patterns * np.arange(self.count + 1.0)
        total = np.zeros((self.count + 1, len(self.axes)), dtype=complex)
        for flute in cutter.flutes:
            tip, end = (self._pushed(flute.behind + flute.spread * b, flute.beyond) for b in (0.0, depth))
            lag = turns * flute.lag * depth
            along = over_depth(lag)[:, None] * tip + _rising(lag)[:, None] * (end - tip)
            total += np.exp(-1j * turns * flute.place)[:, None] * along
        return np.asarray(total / cutter.pattern)

    def steady(self, speed: float, depth: float, receptance: ComplexArray) -> ComplexArray:
        """The mean and the phasors at harmonics 1 … of the force on the tool in N, (1 + harmonics, axes).

        ``receptance`` in m/N at harmonics 1 … of the pattern at that speed (rpm), (harmonics, axes, axes).
        """
        force = depth * self.feeds(depth)
        if len(self.cutter.flutes) > 1 or self.cutting.process_damping:
            P = min(self.count - 1, _MET * len(self.cutter.flutes))
            G = np.concatenate([np.zeros_like(receptance[:1]), receptance])
            indices = tuple("xy".index(axis) for axis in self.axes)

            def seen(hertz: Array) -> ComplexArray:
                order = np.rint(hertz / self.cutter.frequency(speed)).astype(int)
                return np.asarray(np.where((order < 0)[..., None, None], G[np.abs(order)].conj(), G[np.abs(order)]))

            lines = SideLines(seen, self.cutter, indices, speed, P)
            closed = lines.closed(np.zeros(1), depth)[0]
            orders = lines.orders.astype(int)
            driven = np.where((orders < 0)[:, None], force[np.abs(orders)].conj(), force[np.abs(orders)])
            held = np.linalg.solve(np.eye(len(closed)) + closed, driven.ravel()).reshape(driven.shape)
            force[: P + 1] = held[orders >= 0]
        return np.asarray(np.concatenate([force[:1].real.astype(complex), 2 * force[1:]]))


def _rising(turn: Array) -> ComplexArray:
    """∫₀¹ t·e^(−jxt) dt."""
    x = np.where(np.abs(turn) < _SMALL, 1.0, turn)
    exact = (np.exp(-1j * x) * (1 + 1j * x) - 1) / x**2
    return np.asarray(np.where(np.abs(turn) < _SMALL, 0.5 - 1j * turn / 3, exact))
