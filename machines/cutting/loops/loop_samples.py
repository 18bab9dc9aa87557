"""The eigenvalues of a loop over ν as they are needed: all of a small one, the strongest of a large one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray

from ...deadline import in_time
from ...indices import Mask
from .iterated_loop import IteratedLoop
from .loop_branches import LOOKED, Loop, regeneration

SingleArray = NDArray[np.complex64]

_BESIDE = 0.25
"""Share of the level down to which eigenvalues of a large loop are known, so that none that matters lacks its mate."""
_KNOWN = 0.5
"""The same of matrices of many rows, whose branches are looked at nearer to the level."""
_NEARER = 0.75
_LARGE, _SHARE = 56, 0.37
"""Rows from which on only the strongest eigenvalues are sought, that share of all."""
_POWERS, _TOLD = 4, 1.2
"""Times that a subspace is taken through the eighth power, and how far above the least in it an eigenvalue is then told
to three digits."""
_SMALLEST, _ROUNDED = 1e-36, 1.0001
"""Least norm in single precision, and what its rounding is worth."""
_BLOCK = 2_000_000
"""Entries of matrices whose eigenvalues are computed together; between two blocks time may be up."""


class Samples(ABC):
    """A loop at ascending ν: ``values`` λ in 1/m, (g, k), and ``bound``, below which no crossing lies, (g,)."""

    fraction: Array
    values: ComplexArray
    bound: Array
    looked: float = LOOKED

    @abstractmethod
    def know(self, needed: Mask, level: float) -> None:
        """Find the eigenvalues at these ν, at least all that may close at a depth of 1/``level`` (m) near by."""

    @abstractmethod
    def halve(self, coarse: Mask, level: float) -> None:
        """Put the middles of coarse intervals among them."""


class _Dense(Samples):
    """With all eigenvalues, or the strongest of many, of matrices whose norm tells where none is needed."""

    def __init__(self, loop: Loop, fraction: Array) -> None:
        self._loop, self.fraction = loop, fraction
        self._matrices = loop(fraction)
        self._powers, largest = _eighth(self._matrices)
        self.looked = LOOKED if self._matrices.shape[1] < _LARGE else _NEARER
        self.bound = largest * np.abs(regeneration(fraction))
        self.values = np.full(self._matrices.shape[:2], np.nan, dtype=complex)
        self._down = np.full(len(fraction), np.inf)
        """Size of λ(1 − e^(−2πjν)) from which on all are known."""

    def know(self, needed: Mask, level: float) -> None:
        missing = needed & (self._down > _KNOWN * level)
        if missing.any():
            turn = np.abs(regeneration(self.fraction[missing]))
            # Whether one is real, which is a flip at ν = 1/2, only all digits tell.
            down_to = np.where(self.fraction[missing] == 0.5, 0.0, _KNOWN * level)
            found, down = _strongest(self._matrices[missing], self._powers[missing], down_to / turn)
            self.values[missing], self._down[missing] = found, down * turn

    def halve(self, coarse: Mask, level: float) -> None:
        middle = (self.fraction[:-1][coarse] + self.fraction[1:][coarse]) / 2
        order = np.argsort(np.concatenate([self.fraction, middle]), kind="stable")
        between, turn = self._loop(middle), np.abs(regeneration(middle))
        powers, _ = _eighth(between)
        values, down = _strongest(between, powers, _KNOWN * level / turn)
        reach = np.max(np.abs(values), axis=1) * turn
        self.fraction = np.concatenate([self.fraction, middle])[order]
        self._matrices = np.concatenate([self._matrices, between])[order]
        self._powers = np.concatenate([self._powers, powers])[order]
        self.values = np.concatenate([self.values, values])[order]
        self._down = np.concatenate([self._down, down * turn])[order]
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


def _strongest(matrices: ComplexArray, powers: SingleArray, level: Array) -> tuple[ComplexArray, Array]:
    """All eigenvalues of small matrices, of large ones the strongest, zero in the place of the others, (g, m).

    Beside them the size from which on none is left out, (g,), at most ``level`` (1/m).
    """
    size = matrices.shape[1]
    if size < _LARGE:
        return _eigenvalues(matrices), np.zeros(len(matrices))
    values, down = np.zeros(matrices.shape[:2], dtype=complex), np.full(len(matrices), np.inf)
    count = int(_SHARE * size)
    basis = np.broadcast_to(np.exp(1j * np.arange(size)[:, None] ** 2 * np.arange(1, count + 1)), (size, count))
    for _ in range(_POWERS):
        basis = np.linalg.qr(powers @ basis.astype(np.complex64))[0]
    basis = np.linalg.qr(basis.astype(complex))[0]
    found = np.linalg.eigvals(basis.conj().swapaxes(-1, -2) @ (matrices @ basis))
    down = _TOLD * np.min(np.abs(found), axis=1, initial=np.inf)
    values[:, :count] = np.where(np.abs(found) >= down[:, None], found, 0.0)
    more = down > level
    values[more], down[more] = _eigenvalues(matrices[more]), 0.0
    return values, down


def _eighth(matrices: ComplexArray) -> tuple[SingleArray, Array]:
    """The eighth powers of matrices over a norm, in single precision, and upper bounds of their eigenvalues from it."""
    powers, largest = np.empty(matrices.shape, dtype=np.complex64), np.empty(len(matrices))
    at = 0
    for some in _blocks(matrices):
        scale = np.linalg.norm(some, axis=(1, 2))
        power = (some / np.where(scale > 0, scale, 1.0)[:, None, None]).astype(np.complex64)
        for _ in range(3):
            power = power @ power
        part = slice(at, at := at + len(some))
        powers[part] = power
        largest[part] = scale * np.maximum(np.linalg.norm(power, axis=(1, 2)), _SMALLEST) ** (1 / 8) * _ROUNDED
    return powers, largest
