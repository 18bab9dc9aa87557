"""The loop of a slow spindle: its strongest eigenvalues by iteration, without a matrix.

Many teeth pass in a wave of a fast mode only where the spindle is fast. At 500 rpm a mode at 3 kHz asks for hundreds of
harmonics of the tooth frequency, and the loop of `HarmonicLoop`,

    (A·x)_p = Σ_q H_(p−q)·G(ω + qω_T)·x_q,

is a product line by line followed by a convolution over lines, so that A·x takes a few Fourier transforms. A depth w
closes it where λ(1 − e^(−2πjν)) = −1/w, so that small depths belong to the eigenvalues of (1 − e^(−2πjν))·A that lie
farthest to the left, and those are what Arnoldi's iteration finds first (ARPACK).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ...deadline import in_time
from .folded_lines import folded_eigenvalue
from .followed_crossing import followed_crossing
from .loop_branches import Crossing, Iterated, nearest_of, regeneration
from .multi_frequency import HarmonicLoop, stiffest_direction
from .strong_lines import StrongLines

_FIRST = 6
"""Eigenvalues asked for to begin with."""
SEARCHED = 1e-4
"""Relative error of eigenvalues that only tell where to look."""
_BASIS = 24
_FORMED = 600
"""Rows up to which a product with the matrix is quicker than transforms."""
_FACTORED = 1000
"""Rows up to which inverse iteration finds one eigenvalue sooner than Arnoldi's."""
_SMALL = 100
"""Rows up to which nothing is folded."""
_FOLLOWS = 0.35
"""Gain round the loop up to which a line follows the others."""
_PART = 4
"""Part of all eigenvalues from which on the whole matrix is decomposed."""
_BESIDE = 0.3


@dataclass(frozen=True)
class IteratedLoop(Iterated):
    """A `HarmonicLoop` of which the matrix is applied, not formed."""

    loop: HarmonicLoop | StrongLines

    def __call__(self, fraction: Array) -> ComplexArray:
        """The matrices themselves, by lines, (g, m, m)."""
        return self.loop.by_lines(fraction)

    @property
    def size(self) -> int:
        """Lines times directions: rows of the matrix that is not formed."""
        return self.loop.size if isinstance(self.loop, StrongLines) else len(self.loop.orders) * len(self.loop.axes)

    def leftmost(
        self, fraction: float, bound: float = -np.inf, count: int = _FIRST, tolerance: float = SEARCHED
    ) -> tuple[ComplexArray, ComplexArray]:
        """All λ with Re λ(1 − e^(−2πjν)) ≤ ``bound`` (1/m) at one ν, some beyond it, and their vectors in columns.

        ``count`` are asked for to begin with, to a relative ``tolerance``; 0 is all that numbers can tell.
        """
        turn, applied = complex(regeneration(np.array(fraction))), self._applied(fraction)
        operator = scipy.sparse.linalg.LinearOperator(
            (self.size, self.size), matvec=lambda x: turn * applied(x), dtype=complex
        )
        while _PART * count < self.size:
            in_time()
            start = np.exp(1j * np.arange(self.size) ** 2)
            try:
                turned, vectors = scipy.sparse.linalg.eigs(
                    operator, count, which="SR", ncv=_BASIS + 2 * count, v0=start, maxiter=50, tol=tolerance
                )
            except (scipy.sparse.linalg.ArpackNoConvergence, scipy.sparse.linalg.ArpackError):
                break
            if np.max(turned.real) > bound:
                return turned / turn, vectors
            count *= 2
        return np.linalg.eig(self(np.array([fraction]))[0])

    def _applied(self, fraction: float) -> Callable[[ComplexArray], ComplexArray]:
        """x → A·x at one ν."""
        if self.size <= _FORMED or isinstance(self.loop, StrongLines):
            matrix = self(np.array([fraction]))[0]
            return lambda x: np.asarray(matrix @ x)
        return self.transformed(self.loop.lines(np.array([fraction]))[0])

    def transformed(self, lines: ComplexArray) -> Callable[[ComplexArray], ComplexArray]:
        """x → A·x by transforms, with G (lines, n, n)."""
        kernel, length = self._kernel

        def applied(x: ComplexArray) -> ComplexArray:
            moved = (lines @ x.reshape(len(lines), -1, 1))[:, :, 0]
            turned = kernel @ scipy.fft.fft(moved, length, axis=0)[:, :, None]
            return np.asarray(scipy.fft.ifft(turned[:, :, 0], axis=0)[: len(lines)].ravel())

        return applied

    def nearest(self, fraction: float, guess: complex) -> tuple[complex, ComplexArray]:
        """The eigenvalue nearest to a guess and its vector."""
        if (found := self._folded(fraction, guess)) is not None:
            return found
        if self.size <= _FACTORED:
            return nearest_of(self(np.array([fraction]))[0], guess)
        turned = guess * complex(regeneration(np.array(fraction)))
        values, vectors = self.leftmost(fraction, turned.real + _BESIDE * abs(turned), tolerance=0.0)
        at = int(np.argmin(np.abs(values - guess)))
        return complex(values[at]), np.asarray(vectors[:, at])

    def crossing(self, guess: Crossing) -> Crossing | None:
        """The Hopf crossing close to a guess; None where the weak lines do not just follow the strong ones."""
        if isinstance(self.loop, StrongLines) or self.size <= _SMALL:
            return None
        return followed_crossing(self.loop, self.transformed, guess)

    def _folded(self, fraction: float, guess: complex) -> tuple[complex, ComplexArray] | None:
        """The same where the weak lines only follow the strong ones."""
        if isinstance(self.loop, StrongLines) or self.size <= _SMALL:
            return None
        lines = self.loop.lines(np.array([fraction]))[0]
        stiffest = stiffest_direction(self.loop.cutting, self.loop.axes)
        strong = np.linalg.norm(lines, axis=1) * stiffest >= _FOLLOWS * abs(guess)
        if not 0 < np.count_nonzero(strong) <= strong.size / 2:
            return None
        among = StrongLines(self.loop, strong)(np.array([fraction]))[0]
        return folded_eigenvalue(self.transformed(lines), among, strong.ravel(), guess)

    def force(self, carried: ComplexArray) -> ComplexArray:
        """The force on the tool at ω + qω_T for an eigenvector, (lines, n)."""
        assert isinstance(self.loop, HarmonicLoop), "all lines and directions"
        return carried.reshape(-1, len(self.loop.axes))

    @cached_property
    def _kernel(self) -> tuple[ComplexArray, int]:
        """The transform of H_r, r = p − q, arranged for a convolution of ``length`` lines."""
        assert isinstance(self.loop, HarmonicLoop), "lines that follow each other"
        many = len(self.loop.orders)
        length = int(scipy.fft.next_fast_len(2 * many - 1))
        arranged = np.zeros((length, len(self.loop.axes), len(self.loop.axes)), dtype=complex)
        arranged[np.arange(1 - many, many)] = self.loop.of_cut(many - 1)
        return scipy.fft.fft(arranged, axis=0), length
