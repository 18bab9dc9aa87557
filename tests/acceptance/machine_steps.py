"""Steady motion of a machine under harmonic forces by steps in time: all lines and sizes of the force at once.

Runge–Kutta of fourth order with a whole number of steps in each period. The run begins near the steady motion (at that
of equivalent linear joints), rests for some periods, and is then brought to a motion that repeats by Newton's method on
the map of one period, whose slope is found by integrating neighbours. What repeats is looked at again over several
plain periods, and only stable motions are kept. Nothing here is shared with the program under test.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from machine_forces import Array, ComplexArray, Term, first_harmonic

_REST = 10
_SETTLING = 24
_NEWTON, _RENEWED = 30, 5
_REPEATS = 1e-7
_PROBE = 1e-5
_BRANCH = 1e-3


class NoMotion(RuntimeError):
    """No motion that repeats was found on some line."""


@dataclass(frozen=True)
class Structure:
    """M ẍ + C ẋ + K x + Σ b_j f_j(b_jᵀx, b_jᵀẋ) = d F cos ωt, in SI; K and C hold the straight parts of the joints."""

    mass: Array
    damping: Array
    stiffness: Array
    rows: Array
    """b_j, (joints, n)."""
    terms: tuple[tuple[Term, ...], ...]
    """What is not straight, one tuple per joint."""
    drive: Array
    """d, (n,)."""

    @property
    def fastest(self) -> float:
        """Largest rate of the motion at rest, rad/s: of an oscillation, or of a friction that has not yet slipped."""
        K, C = self.stiffness.copy(), self.damping.copy()
        for row, terms in zip(self.rows, self.terms, strict=True):
            gain = _tangent(terms)
            K, C = K + gain.real * np.outer(row, row), C + gain.imag * np.outer(row, row)
        n = len(K)
        free = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(self.mass, np.hstack([K, C]))]])
        return float(np.max(np.abs(np.linalg.eigvals(free))))


def _tangent(terms: tuple[Term, ...]) -> complex:
    """Stiffness + j damping (N/m, N s/m) of the smallest motion."""
    return complex(first_harmonic(terms, np.array([1e-12]), np.array([1.0]))[0]) if terms else 0j


@dataclass
class Columns:
    """Points (a line with a size of the force) that are integrated together."""

    omega: Array
    force: Array
    x: Array
    """(n, columns)."""
    v: Array
    sliders: list[list[Array]]

    def at(self, index: Array | NDArrayInt) -> Columns:
        return Columns(
            self.omega[index],
            self.force[index],
            self.x[:, index],
            self.v[:, index],
            [[s[:, index] for s in joint] for joint in self.sliders],
        )

    def put(self, index: NDArrayInt, other: Columns) -> None:
        self.x[:, index], self.v[:, index] = other.x, other.v
        for mine, theirs in zip(self.sliders, other.sliders, strict=True):
            for a, b in zip(mine, theirs, strict=True):
                a[:, index] = b


NDArrayInt = np.ndarray


def equivalent(s: Structure, omega: Array, force: Array) -> ComplexArray:
    """x of joints that are replaced by their first harmonic, (columns, n), by an under-relaxed iteration."""
    D = s.stiffness - omega[:, None, None] ** 2 * s.mass + 1j * omega[:, None, None] * s.damping
    push = (force[:, None] * s.drive)[:, :, None].astype(complex)
    rest = np.array([_tangent(t) for t in s.terms])
    gains = rest.real + 1j * omega[:, None] * rest.imag
    for i in range(_SETTLING):
        x = np.linalg.solve(D + np.einsum("jn,cj,jm->cnm", s.rows, gains, s.rows), push)[:, :, 0]
        z = np.abs(x @ s.rows.T)
        new = np.stack([first_harmonic(t, z[:, j], omega) if t else gains[:, j] for j, t in enumerate(s.terms)], axis=1)
        gains = gains + (0.6 if i < _SETTLING // 2 else 0.3) * (new - gains)
    return np.asarray(x)


def period(s: Structure, c: Columns, steps: int, count: int = 1) -> tuple[Columns, ComplexArray]:
    """The columns after some periods, and the first harmonic of x over the last one, (n, columns)."""
    inverse = np.linalg.inv(s.mass)
    MK, MC, MB, Md = inverse @ s.stiffness, inverse @ s.damping, inverse @ s.rows.T, (inverse @ s.drive)[:, None]
    h = 2 * np.pi / c.omega / steps
    x, v, sliders = c.x.copy(), c.v.copy(), [[a.copy() for a in joint] for joint in c.sliders]
    busy = [j for j, terms in enumerate(s.terms) if terms]
    MB, rows = MB[:, busy], s.rows[busy]
    push = Md * c.force

    def acceleration(x: Array, v: Array, share: float) -> Array:
        z, w = rows @ x, rows @ v
        f = np.empty_like(z)
        for i, j in enumerate(busy):
            f[i] = sum(t.force(z[i], w[i], a) for t, a in zip(s.terms[j], sliders[j], strict=True))
        return np.asarray(share * push - MK @ x - MC @ v - MB @ f)

    harmonic = np.zeros(x.shape, dtype=complex)
    for i in range(count * steps):
        if i >= (count - 1) * steps:
            harmonic += x * np.exp(-2j * np.pi * i / steps)
        angles = 2 * np.pi * (i + np.array([0.0, 0.5, 1.0])) / steps
        p0, p1, p2 = np.cos(angles)
        a1 = acceleration(x, v, p0)
        v2 = v + h / 2 * a1
        a2 = acceleration(x + h / 2 * v, v2, p1)
        v3 = v + h / 2 * a2
        a3 = acceleration(x + h / 2 * v2, v3, p1)
        v4 = v + h * a3
        a4 = acceleration(x + h * v3, v4, p2)
        x, v = x + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        for j in busy:
            z = s.rows[j] @ x
            sliders[j] = [t.carried(z, a) for t, a in zip(s.terms[j], sliders[j], strict=True)]
    return Columns(c.omega, c.force, x, v, sliders), harmonic * 2 / steps


def _scaled(c: Columns) -> Array:
    """Displacements and velocities over the size of the displacements, (2n, columns)."""
    return np.concatenate([c.x, c.v / c.omega])


def _size(c: Columns) -> Array:
    return np.maximum(np.sqrt(np.sum(c.x**2 + (c.v / c.omega) ** 2, axis=0)), 1e-15)


def _mapped(s: Structure, c: Columns, steps: int) -> tuple[Columns, Array]:
    """After one period: the columns, and the slope of the map (columns, 2n, 2n)."""
    n, m = len(s.mass), len(c.omega)
    size = _size(c)
    eps = _PROBE * size
    many = c.at(np.tile(np.arange(m), 2 * n + 1))
    for i in range(2 * n):
        part = slice((i + 1) * m, (i + 2) * m)
        if i < n:
            many.x[i, part] += eps
        else:
            many.v[i - n, part] += eps * c.omega
    after, _ = period(s, many, steps)
    ends = _scaled(after).reshape(2 * n, 2 * n + 1, m)
    slope = (ends[:, 1:] - ends[:, :1]) / eps
    first = np.arange(m)
    return after.at(first), np.transpose(slope, (2, 0, 1))


def settle(s: Structure, c: Columns, steps: int) -> tuple[Columns, Array]:
    """The motion that repeats, and the largest multiplier of each column."""
    n = len(s.mass)
    c, _ = period(s, c, steps, _REST)
    left, largest = np.arange(len(c.omega)), np.full(len(c.omega), np.inf)
    slope = np.zeros((len(left), 2 * n, 2 * n))
    for i in range(_NEWTON):
        part = c.at(left)
        if i % _RENEWED == 0:
            after, slope[left] = _mapped(s, part, steps)
            largest[left] = np.max(np.abs(np.linalg.eigvals(slope[left])), axis=1)
        else:
            after, _ = period(s, part, steps)
        change = _scaled(after) - _scaled(part)
        slid = np.zeros(len(left))
        for mine, theirs in zip(part.sliders, after.sliders, strict=True):
            for a, b in zip(mine, theirs, strict=True):
                slid = np.maximum(slid, np.max(np.abs(a - b), axis=0, initial=0.0))
        gap = (np.linalg.norm(change, axis=0) + slid) / _size(part)
        step = np.linalg.solve(np.eye(2 * n) - slope[left], change.T[:, :, None])[:, :, 0].T
        length = np.linalg.norm(step, axis=0) / _size(part)
        step *= np.minimum(1.0, 0.3 / np.maximum(length, 1e-300))
        moved = Columns(part.omega, part.force, part.x + step[:n], part.v + step[n:] * part.omega, after.sliders)
        c.put(left, moved)
        left = left[gap > _REPEATS]
        if not len(left):
            break
    largest[left] = np.inf
    return c, largest


def _steps_for(s: Structure, omega: Array) -> NDArrayInt:
    """Steps a period: 96 at least, and within the stability of the rule (2.78 for decays, 2.83 for oscillations)."""
    need = np.maximum(96.0, 2 * np.pi * s.fastest / omega / 2.2)
    return np.asarray(3 * 2 ** np.ceil(np.log2(need / 3)), dtype=int)


def first_harmonics(s: Structure, omega: Array, forces: Array) -> tuple[ComplexArray, float]:
    """First harmonic of x under F cos ωt, (forces, lines, n), and how well the last periods repeat.

    ``forces`` are one a level, or (levels, lines).

    Where a motion jumps between neighbouring lines, the line above is tried from the motion of the line below, so
    that one branch is kept as long as it is there, as in a test that steps up.
    """
    lines, levels, n = len(omega), len(forces), len(s.mass)
    at = np.broadcast_to(forces if forces.ndim == 2 else forces[:, None], (levels, lines))
    out = np.zeros((levels, lines, n), dtype=complex)
    worst = 0.0
    need = _steps_for(s, omega)
    for steps in np.unique(need):
        members = np.flatnonzero(need == steps)
        W, F = np.tile(omega[members], levels), at[:, members].ravel()
        X = equivalent(s, W, F)
        sliders = [[np.zeros((len(t.springs), len(W))) for t in terms] for terms in s.terms]
        c = Columns(W, F, X.real.T.copy(), (1j * W[:, None] * X).real.T.copy(), sliders)
        c, largest = settle(s, c, int(steps))
        bad = np.flatnonzero(largest >= 1)
        if len(bad):
            part, _ = period(s, c.at(bad), int(steps), 150)
            part, again = settle(s, part, int(steps))
            c.put(bad, part)
            largest[bad] = again
        if np.any(largest >= 1):
            lost = int(np.argmax(largest))
            raise NoMotion(f"no stable motion at {W[lost] / 2 / np.pi:.1f} Hz under {F[lost]:g} N")
        c = _stepped_up(s, c, int(steps), len(members), levels)
        before = _size(c)
        after, H = period(s, c, int(steps), 4)
        worst = max(worst, float(np.max(np.linalg.norm(_scaled(after) - _scaled(c), axis=0) / before)))
        out[:, members] = H.T.reshape(levels, len(members), n)
    return out, worst


def _stepped_up(s: Structure, c: Columns, steps: int, lines: int, levels: int) -> Columns:
    for _ in range(12):
        shape = _scaled(c).reshape(-1, levels, lines)
        reach = np.linalg.norm(shape, axis=0) / c.force.reshape(levels, lines)
        jump = np.abs(np.diff(reach, axis=1)) > 0.35 * np.maximum(reach[:, 1:], reach[:, :-1])
        level, line = np.nonzero(jump)
        below = level * lines + line
        if not len(below):
            return c
        above = below + 1
        tried = c.at(below)
        ratio = c.omega[above] / tried.omega
        tried = Columns(c.omega[above], c.force[above], tried.x, tried.v * ratio, tried.sliders)
        tried, largest = settle(s, tried, steps)
        gap = np.linalg.norm(_scaled(tried) - _scaled(c.at(above)), axis=0) / _size(tried)
        other = (largest < 1) & (gap > _BRANCH)
        if not np.any(other):
            return c
        c.put(above[other], tried.at(np.flatnonzero(other)))
    return c
