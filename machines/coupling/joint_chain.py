"""Receptances of joints that share parts with their neighbours alone, about their gains at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray

from ..banded import Banded
from ..indices import Index, Mask
from .parts import Parts


@dataclass(frozen=True, eq=False)
class JointChain:
    """(I + H G0)⁻¹ H with H between open joints, a band, and their gains G0 at rest; leading axes as they are taken.

    What a full matrix would hold for every pair of joints is solved for instead: time grows with the joints.
    """

    order: Index
    """Of the joints, in which H is a band."""
    open: ComplexArray
    """H in m/N by columns, (..., nj, 2 reach + 1)."""
    base: ComplexArray
    """G0 in N/m, (..., nj), in order."""
    held: Banded
    """I + H G0."""

    @classmethod
    def of(cls, parts: Parts, omega: Array, base: ComplexArray) -> tuple[JointChain, ComplexArray]:
        """At frequencies (rad/s) with gains (nf, nj), and receptances from inputs to joints there, (nf, nj, inputs)."""
        H, driven = parts.at(omega)
        ordered = base[:, parts.order]
        system = np.pad(H * ordered[:, :, None], ((0, 0), (0, 0), (parts.reach, 0)))
        system[:, :, 2 * parts.reach] += 1.0
        chain = cls(parts.order, H, ordered, Banded.of(system))
        moved = np.empty_like(driven)
        for i in range(driven.shape[2]):
            moved[:, parts.order, i] = chain.held.solve(driven[:, :, i])
        return chain, moved

    def at(self, points: Index | Mask | slice) -> JointChain:
        return JointChain(self.order, self.open[points], self.base[points], self.held.at(points))

    def by_point(self, harmonics: int) -> JointChain:
        """Of harmonics one after the other (nh · points, …) those of each point together, (points, nh, …)."""

        def together(each: NDArray[Any]) -> NDArray[Any]:
            return np.ascontiguousarray(np.swapaxes(each.reshape(harmonics, -1, *each.shape[1:]), 0, 1))

        held = Banded(*(together(part) for part in (self.held.triangles, self.held.swapped, self.held.regular)))
        return JointChain(self.order, together(self.open), together(self.base), held)

    def times(self, force: ComplexArray) -> ComplexArray:
        """Motions in m that forces of the joints in N lead to, (..., nj)."""
        out = np.empty(force.shape, dtype=complex)
        out[..., self.order] = self.held.solve(self.opened(force[..., self.order]))
        return out

    def opened(self, force: ComplexArray) -> ComplexArray:
        """H f, both in order."""
        n, reach = force.shape[-1], self.open.shape[-1] // 2
        out = np.zeros(force.shape, dtype=complex)
        for d in range(-reach, reach + 1):
            first, last = max(0, -d), n - max(0, d)
            out[..., first + d : last + d] += self.open[..., first:last, reach + d] * force[..., first:last]
        return out

    def tangent(self, by_z: ComplexArray, by_conjugate: ComplexArray) -> ChainTangent:
        """δ → δ + (I + H G0)⁻¹ H ((∂g/∂Z − G0) δ + ∂g/∂Z* δ*) of chains (points, nh, …), with slopes
        (points, nh, nh, nj) in N/m of all that the joints carry; or of one harmonic alone, without these axes."""
        if self.open.ndim == 3:
            return replace(self.by_point(1).tangent(by_z[:, None, None], by_conjugate[:, None, None]), chain=self)
        points, nh, nj, width = self.open.shape
        reach = width // 2
        near = (reach + 1) * 2 * nh - 1
        long = 3 * near + 1
        columns = np.zeros((points, nj, nh * 2 * long))
        ahead, back = (np.moveaxis(slope[..., self.order], 3, 1) for slope in (by_z, by_conjugate))
        plus, minus = ahead + back, ahead - back
        for d in range(width):
            for a in range(nh):
                H, one = self.open[:, a, :, d, None], (np.arange(nh) == a) & (d == reach)
                # From the column of one harmonic to that of the next, a row stands two entries higher.
                first = 2 * near + 2 * nh * (d - reach) + 2 * a
                by_real, by_imaginary = H * plus[:, :, a] + one, H * minus[:, :, a] + one
                for value, at in (
                    (by_real.real, first),
                    (by_real.imag, first + 1),
                    (by_imaginary.real, first + long),
                    (-by_imaginary.imag, first + long - 1),
                ):
                    columns[:, :, at : at + nh * (2 * long - 2) : 2 * long - 2] = value
        return ChainTangent(self, Banded.of(columns.reshape(points, nj * nh * 2, long)))

    @property
    def full(self) -> ComplexArray:
        """The receptances of all pairs, (..., nj, nj)."""
        n = len(self.order)
        unit = np.broadcast_to(np.eye(n, dtype=complex), (*self.base.shape, n))
        each = [self.times(np.ascontiguousarray(unit[..., i])) for i in range(n)]
        return np.stack(each, axis=-1)


@dataclass(frozen=True, eq=False)
class ChainTangent:
    """What a chain's balance changes by with the motions, ready to be solved for these."""

    chain: JointChain
    whole: Banded
    """I + H ∂g/∂(Re Z, Im Z), over joints in order, harmonics, and real and imaginary parts."""

    def solve(self, right: ComplexArray) -> ComplexArray:
        """δ (points, nh, nj) that comes to ``right``; nan where there is none."""
        return self._back(self.whole.solve(self._opened(right)))

    def bordered(self, column: Array, row: Array, right: Array) -> Array:
        """Solutions of [J c; row] u = right, (points, 2m + 1, columns), over [Re Z, Im Z] and one unknown more.

        By solving with J and its transpose alone, stable where J is all but singular, as on a fold (Govaerts and Pryce,
        IMA J. Numer. Anal. 13 (1993) 161).
        """
        b, c, d = self._opened(self._complex(column)), self._flat(self._complex(row[:, :-1])), row[:, -1]
        w, v = self.whole.solve(c, transposed=True), self.whole.solve(b)
        first, second = d - np.sum(w * b, axis=1), d - np.sum(c * v, axis=1)
        out = np.empty(right.shape)
        for i in range(right.shape[2]):
            f, g = self._opened(self._complex(right[:, :-1, i])), right[:, -1, i]
            y = (g - np.sum(w * f, axis=1)) / first
            x = self.whole.solve(f - b * y[:, None])
            more = (g - d * y - np.sum(c * x, axis=1)) / second
            z = self._back(x - v * more[:, None]).reshape(len(x), -1)
            out[:, :, i] = np.concatenate([z.real, z.imag, (y + more)[:, None]], axis=1)
        return out

    def along(self, column: Array) -> Array:
        """Unit vectors u with [J c] u = 0, (points, 2m + 1)."""
        z = self.solve(-self._complex(column)).reshape(len(column), -1)
        u = np.concatenate([z.real, z.imag, np.ones((len(z), 1))], axis=1)
        return np.asarray(u / np.linalg.norm(u, axis=1, keepdims=True))

    def _complex(self, part: Array) -> ComplexArray:
        """[Re Z, Im Z] (points, 2m) as Z, of the shape of the chain."""
        half = part.shape[1] // 2
        return (part[:, :half] + 1j * part[:, half:]).reshape(self.chain.base.shape)

    def _opened(self, right: ComplexArray) -> Array:
        """What joints about their gains at rest are to come to, for open ones: (I + H G0) r."""
        chain, r = self.chain, right[..., self.chain.order]
        return self._flat(r + chain.opened(chain.base * r), ordered=True)

    def _flat(self, z: ComplexArray, ordered: bool = False) -> Array:
        """Joints in order, harmonics, and real and imaginary parts, (points, 2m)."""
        z = np.moveaxis(z if ordered else z[..., self.chain.order], -1, 1)
        return np.stack([z.real, z.imag], axis=-1).reshape(len(z), -1)

    def _back(self, x: Array) -> ComplexArray:
        """Z of what `_flat` lays out."""
        shape = self.chain.base.shape
        pairs = x.reshape(shape[0], shape[-1], *shape[1:-1], 2)
        out = np.empty(shape, dtype=complex)
        out[..., self.chain.order] = np.moveaxis(pairs[..., 0] + 1j * pairs[..., 1], 1, -1)
        return out

    def turned(self, points: Index | Mask | slice) -> Mask:
        """Where the determinant has another sign than at rest."""
        return self.whole.negative[points]
