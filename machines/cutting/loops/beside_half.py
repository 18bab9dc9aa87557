"""Crossings at and beside ν = 1/2 that a finer loop has and a coarser one lacks.

Two flips are born where two eigenvalues meet at ν = 1/2, a flip and a Hopf crossing part where a branch turns round
there. Close to that a small change of the loop moves the lowest depth by much more than itself, or takes it away.
"""

from __future__ import annotations

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from .loop_branches import Bracket, Crossing, Iterated, Loop, closed, nearest, regeneration

_MET = 0.05
"""Share of themselves by which eigenvalues of a coarser loop may be off."""
_BESIDE = 0.49
TURNED = 0.5 - 1e-5
"""ν up to which a branch that is real at 1/2 is told from one that crosses beside it."""
_REAL, _CLOSED = 1e-8, 1e-8
_KNOWN = 1e-6
"""Share of themselves up to which two eigenvalues are the same."""
_SMALL = 120
"""Rows up to which all eigenvalues cost little beside a search."""
_BASIS, _ROUNDS, _SETTLED = 8, 40, 1e-11


def parted(finer: Loop, coarse: Loop, depth: float) -> list[Crossing]:
    """Crossings of a finer loop up to about a depth in m where two of a coarser one are about to meet, or have met.

    Of a finer loop of few rows all flips are among them; of a large one that is iterated no Hopf crossing is.
    """
    nu = np.array([_BESIDE, 0.5])
    values = np.linalg.eigvals(coarse(nu))
    turned = values * regeneration(nu)[:, None]
    strong = turned.real <= -(1 - _MET) / depth
    found = _flips(finer, values[1, strong[1]], depth)
    if isinstance(finer, Iterated):
        return found
    beside = values[0, strong[0] & (np.abs(turned[0].imag) <= _MET * np.abs(turned[0]))]
    for guess in beside.tolist():
        start, _ = nearest(finer, _BESIDE, guess)
        end, _ = nearest(finer, TURNED, complex(values[1, np.argmin(np.abs(values[1] - guess))]))
        sides = (np.array([start, end]) * regeneration(np.array([_BESIDE, TURNED]))).imag
        one = closed(finer, Bracket(0.0, _BESIDE, TURNED, start, end)) if sides[0] * sides[1] < 0 else None
        # Where the ends are of two branches it comes to a jump between them, and closes on nothing.
        if one is not None and abs(1 + one.depth * one.eigenvalue * regeneration(np.array(one.fraction))) < _CLOSED:
            found.append(one)
    return found


def flips_known(coarse: Loop, finer: Loop, same: float, depth: float) -> bool:
    """Whether a still finer loop has no other flips up to a depth in m than this one.

    Each eigenvalue at ν = 1/2 that may be one lies within a share ``same`` of one of the coarser loop, and where it is
    not real it has moved by less than what it lacks to it.
    """
    few, many = (np.linalg.eigvals(loop(np.array([0.5]))[0]) for loop in (coarse, finer))
    many = many[many.real <= -(1 - same) / (2 * depth)]
    moved = np.min(np.abs(many[:, None] - few), axis=1, initial=np.inf)
    real = np.abs(many.imag) <= _REAL * np.abs(many)
    return bool(np.all((moved <= same * np.abs(many)) & (real | (moved <= np.abs(many.imag)))))


def _flips(loop: Loop, guesses: ComplexArray, depth: float) -> list[Crossing]:
    """Those up to a depth in m: all of few rows, else those of two eigenvalues wherever two ``guesses`` are close."""
    apart = np.abs(guesses[:, None] - guesses) + np.diag(np.full(len(guesses), np.inf))
    pairs = np.sort(guesses.real[np.any(apart <= 2 * _MET * np.abs(guesses), axis=1)])
    first = pairs[np.diff(pairs, prepend=-np.inf) > _MET * np.abs(pairs)]
    if isinstance(loop, Iterated) and not len(first):
        return []
    if isinstance(loop, Iterated) and loop.size > _SMALL:
        values = np.concatenate([_led_to(loop, near) for near in _around(guesses, first)])
    else:
        matrix = loop(np.array([0.5]))[0]
        few = len(matrix) <= _SMALL
        values = (
            np.linalg.eigvals(matrix) if few else np.concatenate([[], *(_two(matrix, one) for one in first.tolist())])
        )
    size = float(np.max(np.abs(values), initial=0.0))
    real = values.real[(np.abs(values.imag) <= _REAL * size) & (values.real <= -0.5 / depth)]
    return [Crossing(-0.5 / value, 0.5, complex(value)) for value in real.tolist()]


def _around(guesses: ComplexArray, first: Array) -> list[ComplexArray]:
    """The guesses that are close to each of some."""
    return [guesses[np.abs(guesses - one) <= 2 * _MET * abs(one)] for one in first.tolist()]


def _led_to(loop: Loop, guesses: ComplexArray) -> ComplexArray:
    """The eigenvalues at ν = 1/2 to which guesses close to each other lead; all that lie there if two of them lead to
    one.

    One that is not real comes with its conjugate, so that two guesses have led to two eigenvalues.
    """
    led = np.array([nearest(loop, 0.5, guess)[0] for guess in guesses.tolist()])
    lone = np.abs(led.imag) <= _REAL * np.abs(led)
    apart = np.abs(led[:, None] - led) + np.diag(np.full(len(led), np.inf))
    if len(led) == 2 and (not lone.any() or np.all(apart > _KNOWN * np.abs(led))):
        return led
    return _two(loop(np.array([0.5]))[0], complex(np.mean(guesses.real)))


def _two(matrix: ComplexArray, guess: complex) -> ComplexArray:
    """The two eigenvalues of a matrix nearest to a guess, which may lie midway, by inverse iteration of a subspace."""
    size, shift = len(matrix), guess * (1 + 1e-9)
    factors, pivots, _ = scipy.linalg.lapack.zgetrf(matrix - shift * np.eye(size))
    basis = np.linalg.qr(np.exp(1j * np.arange(size)[:, None] ** 2 * np.arange(1, 1 + _BASIS)))[0]
    before = np.full(2, np.nan + 0j)
    for _ in range(_ROUNDS):
        grown, _ = scipy.linalg.lapack.zgetrs(factors, pivots, basis)
        inverse = np.linalg.eigvals(basis.conj().T @ grown)
        values = np.sort_complex(shift + 1 / inverse[np.argsort(-np.abs(inverse))[:2]])
        if np.max(np.abs(values - before)) <= _SETTLED * abs(guess):
            return np.asarray(values)
        before, basis = values, np.linalg.qr(grown)[0]
    values = np.linalg.eigvals(matrix)
    return np.asarray(values[np.argsort(np.abs(values - guess))[:2]])
