"""Branches of the loop over a tooth period: its eigenvalues over ν, where they close on themselves, and how closely.

The equations are those of `critical_depth`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from math import isfinite, sqrt

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ...indices import Mask

Loop = Callable[[Array], ComplexArray]
"""ν, shape (g,) → the matrices of the loop in 1/m, shape (g, m, m)."""


class Iterated(ABC):
    """A loop too large for its matrices: it finds its own eigenvalues."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Rows of its matrices."""

    @abstractmethod
    def nearest(self, fraction: float, guess: complex) -> tuple[complex, ComplexArray]:
        """The eigenvalue nearest to a guess and its vector."""

    @abstractmethod
    def crossing(self, guess: Crossing) -> Crossing | None:
        """The Hopf crossing close to a guess; None where its eigenvalue has to be followed."""


LOOKED = 0.5
"""Share of the level: an eigenvalue that closes at ν lies at −1/depth there, and by so much to the left beside it."""
_STEP = 0.35
_APART = 0.5
_TOLERANCE = 1e-12
_HALVINGS = 60
_FLIP = 1e-12
"""Within so much of 1/2 a crossing is the flip there: numbers cannot tell the two."""
HALF = 1e-9
"""The same of one that is followed from another, which two flips may be the end of."""


@dataclass(frozen=True)
class Crossing:
    """Depth in m (inf where there is none), ν = ω/ω_T in [0, 1/2], and the eigenvalue of the loop there in 1/m.

    ``carried`` is what the loop carries round, (m,), where it came with the depth.
    """

    depth: float
    fraction: float
    eigenvalue: complex
    carried: ComplexArray | None = field(default=None, compare=False, repr=False)

    @property
    def kind(self) -> str:
        """``"flip"`` at half the tooth frequency, ``"hopf"`` below it, empty where there is no crossing.

        With unequal pitches ν counts in the frequency of the pattern, and ``"fold"`` is at 0: a vibration that repeats
        with the pattern, which a cutter with one pitch cannot hold.
        """
        if not np.isfinite(self.depth):
            return ""
        if self.fraction == 0:
            return "fold"
        return "flip" if self.fraction == 0.5 else "hopf"


NONE = Crossing(np.inf, np.nan, complex(np.nan))


def regeneration(fraction: Array) -> ComplexArray:
    """1 − e^(−2πjν)."""
    return np.asarray(1 - np.exp(-2j * np.pi * fraction))


@dataclass(frozen=True)
class Bracket:
    """Two neighbouring ν with their eigenvalues between which Im changes sign, and the lowest depth possible."""

    floor: float
    left: float
    right: float
    start: complex
    end: complex


def brackets(
    fraction: Array, values: ComplexArray, matters: Mask, level: float, looked: float = LOOKED
) -> tuple[list[Bracket], Mask]:
    """The crossings between neighbours, and which intervals are too coarse to tell.

    Only eigenvalues that may close at a depth of at most 1/level near by are looked at, each beside the nearest one at
    the other end.
    """
    rows = np.flatnonzero(matters)
    coarse = np.zeros(len(matters), dtype=bool)
    left, right, turn = values[rows], values[rows + 1], regeneration(fraction)[:, None]
    at_left, at_right = left * turn[rows], right * turn[rows + 1]
    found = []
    for flipped in (False, True):
        own, other = (at_right, at_left) if flipped else (at_left, at_right)
        row, column = np.nonzero(own.real <= -looked * level)
        size = np.abs((right if flipped else left)[row, column])
        apart = np.abs(left[row] - right[row, column, None] if flipped else left[row, column, None] - right[row])
        partner = np.argmin(apart, axis=1)
        two = np.partition(apart, 1, axis=1) if apart.shape[1] > 1 else np.column_stack([apart, apart + np.inf])
        wide = (two[:, 0] > _STEP * size) | ((two[:, 0] > _APART * two[:, 1]) & (two[:, 0] > 0.02 * size))
        coarse[rows[row[wide]]] = True
        a, b = own[row, column], other[row, partner]
        crossed = (a.imag * b.imag < 0) & (np.minimum(a.real, b.real) < 0)
        row, column, partner, a, b = (part[crossed] for part in (row, column, partner, a, b))
        strongest = np.maximum(-a.real, -b.real) + np.abs(b - a)
        first, last = (partner, column) if flipped else (column, partner)
        found += [
            Bracket(1 / reach, fraction[rows[i]], fraction[rows[i] + 1], complex(left[i, p]), complex(right[i, q]))
            for reach, i, p, q in zip(strongest.tolist(), row, first, last, strict=True)
        ]
    return found, coarse


def closed(loop: Loop, bracket: Bracket) -> Crossing | None:
    """The crossing between two ν, by the Illinois variant of false position along the chord of λ."""
    left, right, start, end = bracket.left, bracket.right, bracket.start, bracket.end
    origin, chord = left, (end - start) / (right - left)
    below = (start * complex(regeneration(np.array(left)))).imag
    above = (end * complex(regeneration(np.array(right)))).imag
    for _ in range(80):
        nu = right - above * (right - left) / (above - below)
        nu = min(max(nu, min(left, right)), max(left, right))
        value, _ = nearest(loop, float(nu), start + chord * (nu - origin))
        turned = value * complex(regeneration(np.array(nu)))
        if abs(turned.imag) <= _TOLERANCE * abs(turned):
            at = 0.5 if 0.5 - nu <= _FLIP else float(nu)
            return Crossing(-1 / turned.real, at, value) if turned.real < 0 else None
        if abs(right - left) <= 4e-15 * nu:
            break
        if np.sign(turned.imag) == np.sign(above):
            below /= 2
        else:
            left, below = right, above
        right, above = nu, turned.imag
    return _halved(loop, bracket)


def _halved(loop: Loop, bracket: Bracket) -> Crossing | None:
    """The crossing between two ν by halving; none where the loop jumps past it, as where a band ends on a line."""
    nu, guess = [bracket.left, bracket.right], [bracket.start, bracket.end]
    sign = [np.sign((v * complex(regeneration(np.array(x)))).imag) for x, v in zip(nu, guess, strict=True)]
    for _ in range(_HALVINGS):
        middle = sum(nu) / 2
        mean = sum(guess) / 2
        value, _ = nearest(loop, middle, mean)
        turned = value * complex(regeneration(np.array(middle)))
        end = int(np.sign(turned.imag) == sign[1])
        nu[end], guess[end] = middle, value
    if abs(guess[1] - guess[0]) > _APART * max(abs(one) for one in guess):
        return None
    return Crossing(-1 / turned.real, middle, value) if turned.real < 0 else None


def nearest(loop: Loop, fraction: float, guess: complex) -> tuple[complex, ComplexArray]:
    """The eigenvalue of a loop nearest to a guess and its vector."""
    if isinstance(loop, Iterated):
        return loop.nearest(fraction, guess)
    return nearest_of(loop(np.array([fraction]))[0], guess)


def nearest_of(matrix: ComplexArray, guess: complex) -> tuple[complex, ComplexArray]:
    """The eigenvalue of a matrix nearest to a guess and its vector, by inverse iteration."""
    size, shift = len(matrix), guess * (1 + 1e-9)
    shifted = np.array(matrix, dtype=complex, order="F")
    shifted.flat[:: size + 1] -= shift
    factors, pivots, _ = scipy.linalg.lapack.zgetrf(shifted, overwrite_a=True)
    vector = _unlike_any(size)
    value = complex(np.nan)
    for _ in range(60):
        grown, _ = scipy.linalg.lapack.zgetrs(factors, pivots, vector)
        length = sqrt(np.vdot(grown, grown).real)
        if not isfinite(length):
            break  # the shift is an eigenvalue to the last digit
        share = np.vdot(vector, grown)
        vector = grown / length
        new = shift + 1 / complex(share)
        if abs(new - value) <= 1e-14 * abs(new):
            return new, vector
        value = new
    values, vectors = np.linalg.eig(matrix)
    at = int(np.argmin(np.abs(values - guess)))
    return complex(values[at]), np.asarray(vectors[:, at])


@lru_cache(maxsize=64)
def _unlike_any(size: int) -> ComplexArray:
    """A unit vector with a share of every eigenvector of a matrix, to begin with."""
    return np.asarray(np.exp(1j * np.arange(size) ** 2) / np.sqrt(size))
