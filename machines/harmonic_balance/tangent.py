"""The tangent of the equations of harmonic balance: solved directly where small, else by products with it alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..blocks import blocks
from ..deadline import in_time
from ..indices import Index, Mask
from .balance import Balance
from .harmonics import Forces
from .newton import Jacobian

_DIRECT = 120
"""Real unknowns up to which elimination is the quicker way."""
_LONGEST = 40
_SETTLED = 1e-9
"""Of the right side, what is left of it at most: a chord of Newton's method, or an estimate, asks for no more."""


@dataclass(frozen=True, eq=False)
class Tangent:
    """J δ = δ_h + H_h Tᵀ Σ_m (∂g_h/∂Z_m T δ_m + ∂g_h/∂Z_m* T δ_m*) less what is coupled in H, at motions of points."""

    balance: Balance
    forces: Forces
    """At the motions, with their derivatives."""

    def at(self, points: Index | Mask | slice) -> Tangent:
        f = self.forces
        by_omega = None if f.by_omega is None else f.by_omega[points]
        some = Forces(f.force[points], f.by_z[points], f.by_conjugate[points], f.travel[points], by_omega)
        return Tangent(self.balance.at(points), some)

    def solve(self, r: ComplexArray) -> ComplexArray:
        """δ with J δ = r, both (points, nh, r); nan where there is none.

        The gain at rest is coupled in H, so J differs from the unit matrix by what amplitude changes alone, which in
        most joints is little: then J δ is formed a few times only (GMRES, Saad and Schultz, SIAM J. Sci. Stat. Comput.
        7 (1986) 856), where elimination would take the cube of all unknowns.
        """
        points, nh, n = r.shape
        if self.balance.chain is not None or 2 * nh * n <= _DIRECT:
            return self._direct.solve(r)
        out = np.empty_like(r)
        for some in blocks(points, 2 * nh * n * _LONGEST):
            part = self.at(some)
            found, done = part._by_products(r[some])
            left = np.flatnonzero(~done)
            for few in blocks(len(left), (2 * nh * n) ** 2):
                now = left[few]
                here = part.at(now)
                found[now] = here._direct.solve(r[some][now])
            out[some] = found
        return out

    @cached_property
    def _direct(self) -> Jacobian:
        return self.balance.tangent(self.forces)

    @cached_property
    def _slopes(self) -> tuple[ComplexArray, ComplexArray]:
        """∂g/∂Z and ∂g/∂Z* less the gain at rest, (points, nh, nh, nj)."""
        base, by_z, by_conjugate = self.balance.base, self.forces.by_z.copy(), self.forces.by_conjugate.copy()
        every, mean = np.arange(base.shape[1]), np.array(self.balance.harmonics)[:, None] == 0
        by_z[:, every, every] -= np.where(mean, 0.5, 1.0) * base
        by_conjugate[:, every, every] -= np.where(mean, 0.5, 0.0) * base
        return by_z, by_conjugate

    def times(self, change: ComplexArray) -> ComplexArray:
        """J δ, (points, nh, r)."""
        c, (by_z, by_conjugate) = self.balance.coordinates, self._slopes
        moved = c.motions(change)
        pull = np.einsum("phmj,pmj->phj", by_z, moved) + np.einsum("phmj,pmj->phj", by_conjugate, moved.conj())
        return np.asarray(change + self.balance.times(c.together(pull)))

    def _by_products(self, r: ComplexArray) -> tuple[ComplexArray, Mask]:
        """δ from a basis of products, real and imaginary parts apart, and where it solves."""
        points, shape = len(r), r.shape

        def apply(v: Array) -> Array:
            half = v.shape[1] // 2
            return _real(self.times((v[:, :half] + 1j * v[:, half:]).reshape(shape)))

        right = _real(r)
        size = np.linalg.norm(right, axis=1)
        scale = np.where(size > 0, size, 1.0)
        basis = [right / scale[:, None]]
        table = np.zeros((points, _LONGEST + 1, _LONGEST))
        target = np.zeros((points, _LONGEST + 1, 1))
        target[:, 0, 0] = size
        weight, left = np.zeros((points, 0, 1)), np.where(size > 0, np.inf, 0.0)
        for k in range(_LONGEST):
            in_time()
            new = apply(basis[k])
            for i, v in enumerate(basis):
                table[:, i, k] = np.sum(v * new, axis=1)
                new = new - table[:, i, k, None] * v
            length = np.linalg.norm(new, axis=1)
            table[:, k + 1, k] = length
            basis.append(new / np.where(length > 0, length, 1.0)[:, None])
            Q, R = np.linalg.qr(np.nan_to_num(table[:, : k + 2, : k + 1]))
            own = np.swapaxes(Q, 1, 2) @ target[:, : k + 2]
            # A row of zeros is a point that was solved before.
            diagonal = np.arange(k + 1)
            R[:, diagonal, diagonal] += np.where(R[:, diagonal, diagonal] == 0, 1.0, 0.0)
            weight = np.linalg.solve(R, own)
            left = np.linalg.norm(target[:, : k + 2, 0] - (table[:, : k + 2, : k + 1] @ weight)[:, :, 0], axis=1)
            if np.all((left <= _SETTLED * size) | ~np.isfinite(left)):
                break
        x = np.sum(np.array(basis[:-1]) * np.moveaxis(weight, 1, 0), axis=0) if weight.shape[1] else right
        half = x.shape[1] // 2
        return (x[:, :half] + 1j * x[:, half:]).reshape(shape), np.asarray(left <= _SETTLED * size)


def _real(z: ComplexArray) -> Array:
    flat = z.reshape(len(z), -1)
    return np.concatenate([flat.real, flat.imag], axis=1)
