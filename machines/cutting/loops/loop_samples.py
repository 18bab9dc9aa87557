"""The eigenvalues of a loop over ν as they are needed: all of a small one, the strongest of a large one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...deadline import in_time
from ...indices import Mask
from .iterated_loop import IteratedLoop
from .loop_branches import LOOKED, Loop, regeneration

_BESIDE = 0.25
"""Share of the level down to which eigenvalues of a large loop are known, so that none that matters lacks its mate."""
_BLOCK = 2_000_000
"""Entries of matrices whose eigenvalues are computed together; between two blocks time may be up."""


class Samples(ABC):
    """A loop at ascending ν: ``values`` λ in 1/m, (g, k), and ``bound``, below which no crossing lies, (g,)."""

    fraction: Array
    values: ComplexArray
    bound: Array

    @abstractmethod
    def know(self, needed: Mask, level: float) -> None:
        """Find the eigenvalues at these ν, at least all that may close at a depth of 1/``level`` (m) near by."""

    @abstractmethod
    def halve(self, coarse: Mask, level: float) -> None:
        """Put the middles of coarse intervals among them."""


class _Dense(Samples):
    """With all eigenvalues, of matrices whose norm tells where none is needed."""

    def __init__(self, loop: Loop, fraction: Array) -> None:
        self._loop, self.fraction = loop, fraction
        self._matrices = loop(fraction)
        self.bound = _largest(self._matrices) * np.abs(regeneration(fraction))
        self.values = np.full(self._matrices.shape[:2], np.nan, dtype=complex)

    def know(self, needed: Mask, level: float) -> None:
        missing = np.isnan(self.values[:, 0]) & needed
        self.values[missing] = _eigenvalues(self._matrices[missing])

    def halve(self, coarse: Mask, level: float) -> None:
        middle = (self.fraction[:-1][coarse] + self.fraction[1:][coarse]) / 2
        order = np.argsort(np.concatenate([self.fraction, middle]), kind="stable")
        between = self._loop(middle)
        values = _eigenvalues(between)
        reach = np.max(np.abs(values), axis=1) * np.abs(regeneration(middle))
        self.fraction = np.concatenate([self.fraction, middle])[order]
        self._matrices = np.concatenate([self._matrices, between])[order]
        self.values = np.concatenate([self.values, values])[order]
        self.bound = np.concatenate([self.bound, reach])[order]


class _Iterated(Samples):
    """With the eigenvalues that lie farthest to the left, and zero in the place of the others."""

    def __init__(self, loop: IteratedLoop, fraction: Array) -> None:
        self._loop, self.fraction = loop, fraction
        self._found = [loop.leftmost(nu)[0] for nu in fraction.tolist()]
        self._arrange()

    def _arrange(self) -> None:
        width = max(len(found) for found in self._found)
        self.values = np.array([np.pad(found, (0, width - len(found))) for found in self._found])
        self.bound = -np.min((self.values * regeneration(self.fraction)[:, None]).real, axis=1) / LOOKED

    def know(self, needed: Mask, level: float) -> None:
        turn = regeneration(self.fraction)
        for row in np.flatnonzero(needed).tolist():
            if np.max((self._found[row] * turn[row]).real) <= -_BESIDE * level:
                more = 2 * len(self._found[row])
                self._found[row] = self._loop.leftmost(float(self.fraction[row]), -_BESIDE * level, more)[0]
        self._arrange()

    def halve(self, coarse: Mask, level: float) -> None:
        middle = (self.fraction[:-1][coarse] + self.fraction[1:][coarse]) / 2
        both = np.concatenate([self.fraction, middle])
        order = np.argsort(both, kind="stable")
        found = self._found + [self._loop.leftmost(nu, -_BESIDE * level)[0] for nu in middle.tolist()]
        self.fraction, self._found = both[order], [found[i] for i in order.tolist()]
        self._arrange()


def samples(loop: Loop, fraction: Array) -> Samples:
    """A loop at ascending ν, shape (g,)."""
    return _Iterated(loop, fraction) if isinstance(loop, IteratedLoop) else _Dense(loop, fraction)


def _eigenvalues(matrices: ComplexArray) -> ComplexArray:
    """All of them, shape (g, m)."""
    found = [np.empty((0, matrices.shape[1]), dtype=complex)]
    for some in _blocks(matrices):
        found.append(np.linalg.eigvals(some))
    return np.concatenate(found)


def _blocks(matrices: ComplexArray) -> Iterator[ComplexArray]:
    """The matrices, so many together as do not take long."""
    together = max(1, _BLOCK // matrices[0].size) if len(matrices) else 1
    for start in range(0, len(matrices), together):
        in_time()
        yield matrices[start : start + together]


def _largest(matrices: ComplexArray) -> Array:
    """An upper bound of the largest eigenvalue: the norm of the eighth power, to the power 1/8."""
    return np.concatenate([_norm_of_powers(some) for some in _blocks(matrices)])


def _norm_of_powers(matrices: ComplexArray) -> Array:
    scale = np.linalg.norm(matrices, axis=(1, 2))
    power = matrices / np.where(scale > 0, scale, 1.0)[:, None, None]
    for _ in range(3):
        power = power @ power
    return np.asarray(scale * np.linalg.norm(power, axis=(1, 2)) ** (1 / 8))
