"""The first crossing of the stability boundary where the cut varies in time, at one spindle speed.

Vibration e^(jωt)·(periodic with the tooth) keeps itself alive at depth w where

    1 + w·λ·(1 − e^(−jωτ)) = 0,   λ(ω) an eigenvalue of the loop over one tooth period.

Each λ is followed over ν = ωτ/2π in (0, 1/2]; w = −1/(λ(1 − e^(−2πjν))) belongs to the boundary where it is real and
positive. Inside the interval that is a Hopf crossing, at ν = 1/2 a flip (period doubling). The lowest w over all
branches is the first crossing from zero depth: no scan over depths is made, so islands and lenses do not hide it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.linalg.lapack import zgetrf, zgetrs

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed

from ..indices import Mask

Loop = Callable[[Array], ComplexArray]
"""ν, shape (g,) → the matrices of the loop in 1/m, shape (g, m, m)."""

_LEVELS = (0.6, 0.3, 0.15, 0.07, 0.02, 0.004, 5e-4)
"""Shares of the strongest loop down to which branches are followed, one after the other until a crossing is found."""
_ROUNDS = 10
_STEP = 0.35
_APART = 0.5
_REAL = 1e-8
_TOLERANCE = 1e-12
_CLOSE = 1.1


@dataclass(frozen=True)
class Crossing:
    """Depth in m (inf where there is none), ν = ω/ω_T in (0, 1/2], and the eigenvalue of the loop there in 1/m."""

    depth: float
    fraction: float
    eigenvalue: complex

    @property
    def kind(self) -> str:
        """``"flip"`` at half the tooth frequency, ``"hopf"`` below it, empty where there is no crossing."""
        if not np.isfinite(self.depth):
            return ""
        return "flip" if self.fraction == 0.5 else "hopf"


NONE = Crossing(np.inf, np.nan, complex(np.nan))


def regeneration(fraction: Array) -> ComplexArray:
    """1 − e^(−2πjν)."""
    return np.asarray(1 - np.exp(-2j * np.pi * fraction))


def first_crossings(
    loop: Loop, fraction: Array, accepted: Callable[[Crossing], bool] | None = None, ceiling: float = np.inf
) -> list[Crossing]:
    """The lowest depth at which an eigenvalue of the loop closes on itself, and those up to a tenth above it.

    Only those that are ``accepted`` count, by default all; depths over a tenth above ``ceiling`` (m) are not searched.

    ``fraction`` are the ν to begin with, ascending, the last one 1/2; intervals over which an eigenvalue that may hold
    the lowest crossing turns by more than a third of itself, or is not told from its neighbour, are halved. Where a
    norm of the loop shows that no eigenvalue can matter, none is computed.
    """
    matrices = loop(fraction)
    bound = _largest(matrices) * np.abs(regeneration(fraction))
    values = np.full(matrices.shape[:2], np.nan, dtype=complex)
    values[-1] = np.linalg.eigvals(matrices[-1])
    found = flips = _flips(values[-1], accepted)
    for share in _LEVELS:
        level = max(share * float(np.max(bound)), 1 / (_CLOSE * _lowest(found, ceiling)))
        for _ in range(_ROUNDS):
            matters = (bound[:-1] >= level) | (bound[1:] >= level)
            missing = np.isnan(values[:, 0]) & (np.append(matters, False) | np.insert(matters, 0, False))
            values[missing] = np.linalg.eigvals(matrices[missing])
            brackets, coarse = _brackets(fraction, values, matters, level)
            if not coarse.any():
                break
            fraction, matrices, values, bound = _halved(loop, coarse, fraction, matrices, values, bound)
        found = list(flips)
        for bracket in sorted(brackets, key=lambda one: one.floor):
            if bracket.floor > _CLOSE * _lowest(found, ceiling):
                break
            closed_at = _closed(loop, bracket)
            if closed_at is not None and (accepted is None or accepted(closed_at)):
                found.append(closed_at)
        if 1 / (_CLOSE * _lowest(found, ceiling)) >= level:
            break
    lowest = _lowest(found, ceiling)
    return sorted({one for one in found if one.depth <= _CLOSE * lowest}, key=lambda one: one.depth)


def _halved(
    loop: Loop, coarse: Mask, fraction: Array, matrices: ComplexArray, values: ComplexArray, bound: Array
) -> tuple[Array, ComplexArray, ComplexArray, Array]:
    """ν, the loop, its eigenvalues and the bound of them, with the middles of the coarse intervals among them."""
    middle = (fraction[:-1][coarse] + fraction[1:][coarse]) / 2
    order = np.argsort(np.concatenate([fraction, middle]), kind="stable")
    between = loop(middle)
    closed = np.linalg.eigvals(between)
    reach = np.max(np.abs(closed), axis=1) * np.abs(regeneration(middle))
    return (
        np.concatenate([fraction, middle])[order],
        np.concatenate([matrices, between])[order],
        np.concatenate([values, closed])[order],
        np.concatenate([bound, reach])[order],
    )


def _lowest(found: list[Crossing], ceiling: float) -> float:
    return min([ceiling, *(one.depth for one in found)])


def _largest(matrices: ComplexArray) -> Array:
    """An upper bound of the largest eigenvalue: the norm of the eighth power, to the power 1/8."""
    scale = np.linalg.norm(matrices, axis=(1, 2))
    power = matrices / np.where(scale > 0, scale, 1.0)[:, None, None]
    for _ in range(3):
        power = power @ power
    return np.asarray(scale * np.linalg.norm(power, axis=(1, 2)) ** (1 / 8))


def near(loop: Loop, crossing: Crossing) -> Crossing:
    """The same crossing of a finer loop; a loop that does not have it near by gives `NONE`."""
    nu = crossing.fraction
    if crossing.kind == "flip":
        value, _ = _nearest(loop(np.array([0.5]))[0], crossing.eigenvalue)
        if abs(value.imag) > _REAL * abs(value) or value.real >= 0:
            return NONE
        return Crossing(-0.5 / value.real, 0.5, complex(value.real))
    before, value = nu * (1 - 1e-6), crossing.eigenvalue
    past = _nearest(loop(np.array([before]))[0], value)[0] * complex(regeneration(np.array(before)))
    for _ in range(20):
        new, _ = _nearest(loop(np.array([nu]))[0], value)
        if abs(new - value) > _APART * abs(value):
            return NONE
        value, turned = new, new * complex(regeneration(np.array(nu)))
        if abs(turned.imag) <= 1e-11 * abs(turned) or nu == before:
            return Crossing(-1 / turned.real, nu, value) if turned.real < 0 else NONE
        slope = (turned.imag - past.imag) / (nu - before)
        before, past = nu, turned
        nu = nu - turned.imag / slope if slope else np.nan
        if not 0 < nu < 0.5:
            return NONE
    return NONE


def eigenvector(loop: Loop, crossing: Crossing) -> ComplexArray:
    """What the loop carries round at a crossing, shape (m,)."""
    return _nearest(loop(np.array([crossing.fraction]))[0], crossing.eigenvalue)[1]


def _nearest(matrix: ComplexArray, guess: complex) -> tuple[complex, ComplexArray]:
    """The eigenvalue nearest to a guess and its vector, by inverse iteration."""
    size, shift = len(matrix), guess * (1 + 1e-9)
    factors, pivots, _ = zgetrf(matrix - shift * np.eye(size))
    vector = np.exp(1j * np.arange(size) ** 2) / np.sqrt(size)
    value = complex(np.nan)
    for _ in range(60):
        grown, _ = zgetrs(factors, pivots, vector)
        share = np.vdot(vector, grown)
        vector = grown / np.linalg.norm(grown)
        new = shift + 1 / complex(share)
        if abs(new - value) <= 1e-14 * abs(new):
            return new, vector
        value = new
    values, vectors = np.linalg.eig(matrix)
    at = int(np.argmin(np.abs(values - guess)))
    return complex(values[at]), np.asarray(vectors[:, at])


def _flips(values: ComplexArray, accepted: Callable[[Crossing], bool] | None) -> list[Crossing]:
    """The two lowest period doublings, from the eigenvalues at ν = 1/2."""
    real = values.real[(np.abs(values.imag) <= _REAL * np.max(np.abs(values))) & (values.real < 0)]
    every = (Crossing(-0.5 / value, 0.5, complex(value)) for value in np.sort(real).tolist())
    return list(islice(every if accepted is None else filter(accepted, every), 2))


@dataclass(frozen=True)
class _Bracket:
    """Two neighbouring ν with their eigenvalues between which Im changes sign, and the lowest depth possible."""

    floor: float
    left: float
    right: float
    start: complex
    end: complex


def _brackets(fraction: Array, values: ComplexArray, matters: Mask, level: float) -> tuple[list[_Bracket], Mask]:
    """The crossings between neighbours, and which intervals are too coarse to tell.

    Only eigenvalues that may close at a depth of at most 1/level are looked at, each beside the nearest one at the
    other end.
    """
    rows = np.flatnonzero(matters)
    coarse = np.zeros(len(matters), dtype=bool)
    left, right = values[rows], values[rows + 1]
    at_left = left * regeneration(fraction[rows])[:, None]
    at_right = right * regeneration(fraction[rows + 1])[:, None]
    distance = np.abs(left[:, :, None] - right[:, None, :])
    found = []
    for flipped in (False, True):
        own, other = (at_right, at_left) if flipped else (at_left, at_right)
        size = np.abs(right if flipped else left)
        apart = np.swapaxes(distance, 1, 2) if flipped else distance
        mate = np.argmin(apart, axis=2)
        two = np.partition(apart, 1, axis=2)[:, :, :2] if apart.shape[2] > 1 else np.dstack([apart, apart + np.inf])
        looked = np.abs(own) >= level
        wide = (two[:, :, 0] > _STEP * size) | ((two[:, :, 0] > _APART * two[:, :, 1]) & (two[:, :, 0] > 0.02 * size))
        coarse[rows[np.any(wide & looked, axis=1)]] = True
        row, column = np.nonzero(looked)
        partner = mate[row, column]
        a, b = own[row, column], other[row, partner]
        crossed = (a.imag * b.imag < 0) & (np.minimum(a.real, b.real) < 0)
        row, column, partner, a, b = (part[crossed] for part in (row, column, partner, a, b))
        strongest = np.maximum(-a.real, -b.real) + np.abs(b - a)
        first, last = (partner, column) if flipped else (column, partner)
        found += [
            _Bracket(1 / reach, fraction[rows[i]], fraction[rows[i] + 1], complex(left[i, p]), complex(right[i, q]))
            for reach, i, p, q in zip(strongest.tolist(), row, first, last, strict=True)
        ]
    return found, coarse


def _closed(loop: Loop, bracket: _Bracket) -> Crossing | None:
    """The crossing between two ν, by the Illinois variant of false position along the chord of λ."""
    left, right, start, end = bracket.left, bracket.right, bracket.start, bracket.end
    origin, chord = left, (end - start) / (right - left)
    below = (start * complex(regeneration(np.array(left)))).imag
    above = (end * complex(regeneration(np.array(right)))).imag
    for _ in range(80):
        nu = right - above * (right - left) / (above - below)
        nu = min(max(nu, min(left, right)), max(left, right))
        value, _ = _nearest(loop(np.array([nu]))[0], start + chord * (nu - origin))
        turned = value * complex(regeneration(np.array(nu)))
        if abs(turned.imag) <= _TOLERANCE * abs(turned) or abs(right - left) <= 4e-15 * nu:
            return Crossing(-1 / turned.real, float(nu), value) if turned.real < 0 else None
        if np.sign(turned.imag) == np.sign(above):
            below /= 2
        else:
            left, below = right, above
        right, above = nu, turned.imag
    raise CheckFailed(f"lobes: a crossing near ν = {nu:g} of the tooth frequency did not settle")
