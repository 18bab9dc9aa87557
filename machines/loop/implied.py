"""What a measured FRF says that one joint does, if all the rest is right: its motion and force, line by line.

x = Hof F − Hoz g and z = Hzf F − Hzz g are turned round: the measured x gives the force g of the joint in question,
and that its motion z. Nothing is solved for, no branch chosen and no start needed, and a joint force is linear in most
of its parameters; so every law is tried by plain least squares. Noise σ of x/F makes g − G z uncertain by
abs(1 + Hzz G) F σ/abs(Hoz), to first order. That is what starts a fit, not what judges it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..coupling.coupling import couple
from ..harmonic_balance.newton import gains
from .explanations.families import Family, Motion
from .explanations.hypothesis import Hypothesis
from .fit import Fitting

_STEP = 1e-5
_OUTLIER = 9.0
_SWEEPS = 3
_VAGUE = 0.2
"""Relative noise of an implied motion from which on a line counts little: its amplitude is mostly noise."""
_SHORT = 0.005
"""Share of what is to be explained that a step of 1 (a factor e) of an own parameter must pay for: parameters that do
much the same would else run apart."""
_LEAST = 0.05
"""Least factor that a linear step may give a parameter."""


@dataclass(frozen=True, eq=False)
class Implied:
    """Motion and force of one joint, implied by the records."""

    z: ComplexArray
    force: ComplexArray
    weight: Array
    """1/N: inverse deviation of force − G z, (points,)."""
    omega: Array
    motion: ComplexArray
    """Of all joints of the machine, where the records tell it, (points, joints)."""

    @classmethod
    def of(cls, fitting: Fitting, row: int, motion: ComplexArray) -> Implied:
        """Of the joint ``row``, the others as the machine has them; ``motion`` is that of all its joints in m."""
        forward, points = fitting.forward, fitting.forward.points
        moving = tuple(sorted({*forward.nonlinear, row}))
        view, p, m = forward.view(moving), moving.index(row), len(moving)
        o = [i for i in range(m) if i != p]
        H = np.concatenate(
            [np.concatenate([view.Hzz, view.Hzf], axis=2), np.concatenate([view.Hoz, view.Hof], axis=2)], axis=1
        )
        others = forward.movers(fitting.quick_joints, tuple(moving[i] for i in o))
        at, z, g = motion[:, [moving[i] for i in o]], motion[:, row], motion[:, row]
        for _ in range(_SWEEPS if o else 1):
            # Held at the gains of their own motions, the other joints are as linear as the rest.
            M = couple(H, np.eye(m + 1)[o], gains(others, np.abs(at), view.omega)[0]) if o else H
            Hop, Hpp = M[:, m, p], M[:, p, p]
            g = points.force * (M[:, m, m] - points.measured + fitting.correction) / np.where(Hop == 0, np.nan, Hop)
            z = M[:, p, m] * points.force - Hpp * g
            at = np.where(np.isfinite(g)[:, None], M[:, o, m] * points.force[:, None] - M[:, o, p] * g[:, None], at)
        weight = np.abs(Hop) / (points.force * fitting.sigma * np.maximum(np.abs(1 + Hpp * g / z), 1e-12))
        vague = np.abs(Hpp) * points.force * fitting.sigma / (np.abs(Hop) * np.abs(z))
        weight = weight / (1 + (vague / _VAGUE) ** 2)
        fine = np.isfinite(z) & np.isfinite(g) & np.isfinite(weight) & (np.abs(z) > 0)
        clear = fine & (vague < _VAGUE) & np.all(np.isfinite(at), axis=1)
        told = motion.copy()
        told[clear, row] = z[clear]
        for i, column in zip(o, at.T, strict=True):
            told[clear, moving[i]] = column[clear]
        return cls(np.where(fine, z, 1e-12), np.where(fine, g, 0.0), np.where(fine, weight, 0.0), view.omega, told)

    def tried(self, hypothesis: Hypothesis, linear: int, shapes: list[tuple[float, ...]]) -> list[tuple[float, Array]]:
        """For every shape of the further law the loss, robust against outliers, and where to begin; best first.

        ``linear`` of the added coordinates are sizes, in which the force is linear; the rest are shapes.
        """
        row = hypothesis.place.rows[0]
        n = len(hypothesis.own)
        bare = hypothesis.without()
        zero = np.zeros(n)
        base = self._gain(bare, row, zero)
        own = [(self._gain(bare, row, _STEP * e) - base) / _STEP for e in np.eye(n)]
        y = self.force - base * self.z
        found = []
        for shape in shapes:
            columns = [column * self.z for column in own]
            if hypothesis.laws is not None:
                values = [c.value(s) for c, s in zip(hypothesis.added[linear:], shape, strict=True)]
                sizes = np.array([c.reference for c in hypothesis.added[:linear]])
                for e in np.eye(linear):
                    laws = hypothesis.quick_laws(np.array([*(sizes * e), *values]))
                    gain = sum(law.first_harmonic(np.abs(self.z), self.omega).gain for law in laws)
                    columns.append(gain * self.z)
            fit = self._least_squares(np.array(columns).T, y, n)
            if fit is None:
                continue
            loss, x = fit
            u = self._start(hypothesis, x, n, linear, shape)
            if u is not None:
                found.append((loss, u))
        found.sort(key=lambda row: row[0])
        return found

    def _gain(self, hypothesis: Hypothesis, row: int, u: Array) -> ComplexArray:
        gain: ComplexArray = hypothesis.joints(u)[row].first_harmonic(np.abs(self.z), self.omega).gain
        return gain

    def _least_squares(self, columns: ComplexArray, y: ComplexArray, own: int) -> tuple[float, Array] | None:
        """Loss and coefficients; the first ``own`` of them are steps that should be short where little is gained."""
        weight, x = self.weight.copy(), np.zeros(columns.shape[1])
        short = np.eye(own, columns.shape[1]) * np.sqrt(_SHORT * float(np.sum(np.abs(y * weight) ** 2)))
        for _ in range(_SWEEPS):
            a, b = columns * weight[:, None], y * weight
            A, B = np.concatenate([a.real, a.imag, short]), np.concatenate([b.real, b.imag, np.zeros(own)])
            if not np.all(np.isfinite(A)):
                return None
            scale = np.linalg.norm(A, axis=0)
            scale[scale == 0] = 1.0
            x = np.linalg.lstsq(A / scale, B, rcond=1e-9)[0] / scale
            e = np.abs((y - columns @ x) * self.weight) ** 2
            weight = self.weight / np.sqrt(1 + e / max(_OUTLIER, 4 * float(np.median(e))))
        limit = max(_OUTLIER, 4 * float(np.median(e)))
        return float(np.sum(limit * np.log1p(e / limit))), x

    @staticmethod
    def _start(hypothesis: Hypothesis, x: Array, n: int, linear: int, shape: tuple[float, ...]) -> Array | None:
        """u from linear steps and sizes; None where a size has a sign that the law cannot have."""
        own = np.log(np.maximum(1 + x[:n], _LEAST))
        added = []
        for c, size in zip(hypothesis.added[:linear], x[n:].tolist(), strict=False):
            if c.log and size <= 0:
                return None
            added.append(float(np.log(size)) if c.log else size)
        return hypothesis.bounded(np.array([*own, *added, *shape]))


def shapes_of(family: Family, motion: Motion) -> list[tuple[float, ...]]:
    """Grid of the shape coordinates."""
    return list(product(*(grid for _, _, grid in family.sizes(motion)[family.linear :])))
