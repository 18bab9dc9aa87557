"""The loop of `side_lines` with so many harmonics that it is applied, not formed: it settles what a march has found.

What a flute does is a convolution over lines, so that A·x takes a few Fourier transforms. Where the delay changes along
the depth, a Gauss rule over the depth stands for it, each of its heights a convolution. A crossing is where 1 + b·A is
singular, i.e. where g is zero in

    [1 + b·A  c; cᴴ  0]·[x; g] = [0; 1],

which is regular there if c is like x (a minimally augmented system; Griewank & Reddien 1984).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import ComplexArray
from jointlib.errors import CheckFailed

from .side_lines import SideLines, over_depth

_SOLVED = 1e-11
_TURNS, _RESTARTS = 120, 10
_POWER = 4
_HEIGHTS = 12
"""Gauss heights of a flute whose delay changes, beside those that its phase asks for."""


@dataclass(frozen=True, eq=False)
class WideLines:
    """`SideLines` that are applied."""

    lines: SideLines

    def applied(self, fraction: float, depth: float) -> Callable[[ComplexArray], ComplexArray]:
        """x → b·A·x at a ν and a depth in m; x by lines, (lines·n,)."""
        many, n = len(self.lines.orders), len(self.lines.axes)
        turning = 2 * np.pi * self.lines.speed / 60
        omega = 2 * np.pi * self.lines.frequency * (fraction + self.lines.orders)
        G = self.lines.receptance((fraction + self.lines.orders) * self.lines.frequency)
        backs, kernels = list[ComplexArray](), list[ComplexArray]()
        force, rub = self.lines.of_cut
        r = self.lines.apart
        for flute in self.lines.cutter.flutes:
            place = np.exp(-1j * r * flute.place)
            held = place * over_depth(r * flute.lag * depth)
            kernels.append(self._kernel(force * held[:, None, None]))
            if not flute.spread:
                backs.append(1.0 - np.exp(-1j * omega * flute.behind / turning))
            else:
                backs.append(np.ones(many, dtype=complex))
                phase = np.max(np.abs(r * flute.lag * depth)) + np.max(np.abs(omega * flute.spread * depth / turning))
                x, w = np.polynomial.legendre.leggauss(_HEIGHTS + int(phase / 2))
                for z, share in zip((depth * (x + 1) / 2).tolist(), (w / 2).tolist(), strict=True):
                    backs.append(-share * np.exp(-1j * omega * (flute.behind + flute.spread * z) / turning))
                    kernels.append(self._kernel(force * (place * np.exp(-1j * r * flute.lag * z))[:, None, None]))
            if self.lines.cutter.rubbing(self.lines.speed):
                backs.append(np.asarray(1j * omega * self.lines.cutter.rubbing(self.lines.speed)))
                kernels.append(self._kernel(rub * held[:, None, None]))
        back, kernel = np.stack(backs), np.stack(kernels)

        def applied(x: ComplexArray) -> ComplexArray:
            moved = back[:, :, None] * (G @ x.reshape(many, n, 1))[:, :, 0]
            turned = kernel @ scipy.fft.fft(moved, self._length, axis=1)[..., None]
            return np.asarray(depth * scipy.fft.ifft(np.sum(turned[..., 0], axis=0), axis=0)[:many].ravel())

        return applied

    @property
    def _length(self) -> int:
        return int(scipy.fft.next_fast_len(2 * len(self.lines.orders) - 1))

    def _kernel(self, of_cut: ComplexArray) -> ComplexArray:
        """The transform of H_r, r = p − q, arranged for a convolution over lines."""
        many, n = len(self.lines.orders), len(self.lines.axes)
        arranged = np.zeros((self._length, n, n), dtype=complex)
        arranged[np.arange(1 - many, many)] = of_cut
        return np.asarray(scipy.fft.fft(arranged, axis=0))

    def carried(self, fraction: float, depth: float) -> ComplexArray:
        """What the loop carries round at a crossing, (lines·n,), by inverse iteration."""
        applied = self.applied(fraction, depth)
        x = np.random.default_rng(0).standard_normal(len(self.lines.orders) * len(self.lines.axes)) + 0j
        for _ in range(_POWER):
            x = _solve(lambda v: v + applied(v), np.asarray(x / np.linalg.norm(x)), 1e-6)
        x /= np.linalg.norm(x)
        if fraction in (0.0, 0.5):  # the vibration is real: lines of opposite sign are conjugates
            own = x.reshape(-1, len(self.lines.axes))[1 if fraction == 0 else 0 :]
            x *= np.exp(-0.5j * np.angle(np.sum(own * own[::-1])))
        return np.asarray(x)

    def gap(self, like: ComplexArray) -> Callable[[float, float], complex]:
        """g at a ν and a depth in m, zero at a crossing whose vector is ``like``."""

        def at(fraction: float, depth: float) -> complex:
            applied = self.applied(fraction, depth)

            def bordered(v: ComplexArray) -> ComplexArray:
                x, g = v[:-1], v[-1]
                return np.append(x + applied(x) + g * like, np.vdot(like, x))

            return complex(_solve(bordered, np.append(np.zeros(len(like)), 1.0 + 0j), _SOLVED)[-1])

        return at


def _solve(operator: Callable[[ComplexArray], ComplexArray], right: ComplexArray, to: float) -> ComplexArray:
    size = len(right)
    whole = scipy.sparse.linalg.LinearOperator((size, size), matvec=operator, dtype=complex)
    x, failed = scipy.sparse.linalg.gmres(whole, right, rtol=to, restart=min(size, _TURNS), maxiter=_RESTARTS)
    if failed and to < 1e-6:
        raise CheckFailed("multi-frequency: the loop of so many harmonics does not settle; use collocation")
    return np.asarray(x)
