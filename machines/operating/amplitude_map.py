"""One joint: every solution from the map of force over frequency and amplitude; no start values, no continuation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.joint import Joint

from ..harmonic_balance.view import View
from ..indices import Index, Mask
from ..model.limits import Limit, feeds_energy

_DECADES = 6.0
_FURTHEST = 1.0
_NODES = (2, 3, 5, 9, 17, 33)
_TABLE_ERROR = 1e-8
_TURNING_STEPS = 12
_FLAT = 1e-6


@dataclass(frozen=True, eq=False)
class Roots:
    """All solutions, sorted by force, line and amplitude; one entry per solution in the first five."""

    force: Index
    """Index of the force."""
    line: Index
    """Index of the line."""
    amplitude: Array
    """Joint amplitude A in m."""
    gain: ComplexArray
    """G(A, ω) in N/m."""
    rising: Mask
    """True where the force that holds the amplitude rises with it, ∂F/∂A > 0."""
    limit: Array
    """Per line: largest admissible amplitude in m."""
    reasons: tuple[Outcome, ...]
    """Per line: what that limit is."""
    cut: Mask
    """(forces, lines): the force at the limit is still too small, so a solution lies beyond it or nowhere."""


@dataclass(frozen=True, eq=False)
class _Lines:
    """The scalar problem A·abs(1 + h G(A, ω)) = target on a set of lines."""

    joint: Joint
    h: ComplexArray
    omega: Array

    def at(self, index: Index | Mask) -> _Lines:
        return _Lines(self.joint, self.h[index], self.omega[index])

    def force(self, A: Array) -> tuple[Array, Array, ComplexArray]:
        """φ = A·abs(D), its slope S·abs(D)⁻¹ with S = abs(D)² + A Re(D* h G'), and G; D = 1 + h G."""
        found = self.joint.first_harmonic(A, self.omega)
        return *_map(self.h, A, found.gain, found.d_amplitude), found.gain


def _map(h: ComplexArray, A: Array, gain: ComplexArray, slope: ComplexArray) -> tuple[Array, Array]:
    D = 1 + h * gain
    size = np.abs(D)
    bent = A * (D.real * (h * slope).real + D.imag * (h * slope).imag)
    return A * size, size + bent / np.maximum(size, 1e-300)


def roots(view: View, joint: Joint, forces: Array, limit: Limit, count: int = 150) -> Roots:
    """All amplitudes at which A·abs(1 + Hzz G(A, ω)) = abs(Hzf)·F, for every line and force.

    The left side is laid out over an axis of ``count`` amplitudes for every line; it is split where it turns, so that
    each piece is monotone, and each crossing is then polished by Newton inside its bracket, with the exact gain.
    """
    lines = _Lines(joint, view.Hzz[:, 0, 0], view.omega)
    reach = np.abs(view.Hzf[:, 0, 0])
    target = forces[:, None] * reach
    A = _axis(lines, np.max(target, axis=0), limit.amplitude, count)
    gain, slope = gain_table(joint, view.omega, A)
    phi, rise = _map(lines.h[:, None], A, gain, slope)
    ends, reasons = admissible(joint, view.omega, A, gain, limit)

    inside = A[None, :] <= ends[:, None]
    # The first interval begins at rest, where no force is needed.
    grid = np.concatenate([[0.0], A])
    phi = np.concatenate([np.zeros((len(phi), 1)), phi], axis=1)
    turns = (rise[:, :-1] > 0) != (rise[:, 1:] > 0)
    plain = inside.copy()
    plain[:, 1:] &= ~turns
    pieces = [
        _turning_pieces(lines, grid, phi, rise, turns & inside[:, 1:], target),
        _last_pieces(lines, grid, phi, ends),
    ]
    line, low, high, at_low, at_high = (np.concatenate(parts) for parts in zip(*pieces, strict=True))

    found: list[tuple[Array, ...]] = []
    for f, wanted in enumerate(target):
        below = phi < wanted[:, None]
        i, k = np.nonzero((below[:, :-1] != below[:, 1:]) & plain)
        s = np.flatnonzero((at_low < wanted[line]) != (at_high < wanted[line]))
        found.append(
            (
                np.full(len(i) + len(s), f),
                np.concatenate([i, line[s]]),
                np.concatenate([grid[k], low[s]]),
                np.concatenate([grid[k + 1], high[s]]),
                np.concatenate([phi[i, k], at_low[s]]),
                np.concatenate([phi[i, k + 1], at_high[s]]),
            )
        )
    force, on, low, high, at_low, at_high = (np.concatenate(parts) for parts in zip(*found, strict=True))
    amplitude, final = _polish(lines.at(on), target[force, on], low, high, at_low, at_high)
    order = np.lexsort((amplitude, on, force))
    at_end = lines.force(np.where(np.isfinite(ends), ends, A[-1]))[0]
    return Roots(
        force[order],
        on[order],
        amplitude[order],
        final[order],
        (at_high > at_low)[order],
        ends,
        reasons,
        at_end < target,
    )


def _axis(lines: _Lines, target: Array, limit: float, count: int) -> Array:
    """Amplitudes in m, evenly spaced in the logarithm, up to the limit or to where no force reaches."""
    high = min(limit, _FURTHEST)
    if high < limit:
        coarse = np.geomspace(1e-10, high, 51)
        phi = _map(lines.h[:, None], coarse, *gain_table(lines.joint, lines.omega, coarse))[0]
        short = np.flatnonzero(np.any(phi < 1.2 * target[:, None], axis=0))
        high = coarse[min(short[-1] + 1, len(coarse) - 1)] if len(short) else coarse[0]
    return np.geomspace(high * 10**-_DECADES, high, count)


def gain_table(joint: Joint, omega: Array, A: Array) -> tuple[ComplexArray, ComplexArray]:
    """G and dG/dA on (lines, amplitudes), by interpolation over as few frequencies as serve.

    The table only has to bracket the solutions; polishing asks the joint itself.
    """
    low, high = float(np.min(omega)), float(np.max(omega))
    if len(omega) > _NODES[0] and high > low:
        probe = low + (high - low) * np.array([0.013, 0.37, 0.91])
        some = A[:: max(1, len(A) // 16)]
        exact = joint.first_harmonic(some, probe[:, None])
        for n in _NODES:
            if n >= len(omega):
                break
            x = np.cos(np.pi * (2 * np.arange(n) + 1) / (2 * n))
            nodes = (low + high) / 2 + (high - low) / 2 * x
            table = joint.first_harmonic(some, nodes[:, None])
            near = _barycentric(probe, nodes)
            errors = [
                np.max(np.abs(near @ have - want) / (np.max(np.abs(want), axis=0) + 1e-300))
                for have, want in ((table.gain, exact.gain), (table.d_amplitude, exact.d_amplitude))
            ]
            if max(errors) < _TABLE_ERROR or n == _NODES[-1]:
                full, W = joint.first_harmonic(A, nodes[:, None]), _barycentric(omega, nodes)
                return W @ full.gain, W @ full.d_amplitude
    direct = joint.first_harmonic(A, omega[:, None])
    return direct.gain, direct.d_amplitude


def _barycentric(at: Array, nodes: Array) -> Array:
    """Lagrange interpolation from Chebyshev nodes of the first kind, shape (len(at), len(nodes))."""
    n = len(nodes)
    weight = (-1.0) ** np.arange(n) * np.sin(np.pi * (2 * np.arange(n) + 1) / (2 * n))
    gap = at[:, None] - nodes
    exact = gap == 0
    share = weight / np.where(exact, 1.0, gap)
    share = np.where(np.any(exact, axis=1, keepdims=True), exact.astype(float), share)
    return np.asarray(share / np.sum(share, axis=1, keepdims=True))


def admissible(
    joint: Joint, omega: Array, A: Array, gain: ComplexArray, limit: Limit
) -> tuple[Array, tuple[Outcome, ...]]:
    """Per line the largest admissible amplitude in m: the joint's own limit, or where its Im G turns negative.

    ``gain`` is the table on lines and amplitudes ``A``.
    """
    ends = np.full(len(omega), min(limit.amplitude, A[-1]))
    reasons = np.full(len(omega), limit.outcome if np.isfinite(limit.amplitude) else Outcome.STALLED, dtype=object)
    feeding = feeds_energy(gain)
    rows = np.flatnonzero(np.any(feeding & (ends[:, None] >= A), axis=1))
    if len(rows):
        first = np.argmax(feeding[rows], axis=1)
        high = A[first]
        low = np.where(first > 0, A[first - 1], 0.0)
        for _ in range(50):
            middle = (low + high) / 2
            bad = feeds_energy(joint.first_harmonic(middle, omega[rows]).gain)
            low, high = np.where(bad, low, middle), np.where(bad, middle, high)
        ends[rows], reasons[rows] = low, Outcome.NEGATIVE_DAMPING
    return ends, tuple(reasons)


def _turning_pieces(
    lines: _Lines, grid: Array, phi: Array, rise: Array, turns: Mask, target: Array
) -> tuple[Index, Array, Array, Array, Array]:
    """Both monotone halves of every interval in which the map turns near a target: line, ends and values there."""
    row, k = np.nonzero(turns)
    ends = np.stack([phi[row, k + 1], phi[row, k + 2]])
    slopes = np.stack([rise[row, k], rise[row, k + 1]])
    room = np.max(np.abs(slopes), axis=0) * (grid[k + 2] - grid[k + 1])
    near = np.any(
        (target[:, row] > np.min(ends, axis=0) - room) & (target[:, row] < np.max(ends, axis=0) + room), axis=0
    )
    row, k, slopes = row[near], k[near], slopes[:, near]
    low, high = grid[k + 1].copy(), grid[k + 2].copy()
    part, (at_low, at_high) = lines.at(row), slopes
    top = (low + high) / 2
    for _ in range(_TURNING_STEPS if len(row) else 0):
        # Regula falsi; the weight of an end that stays is halved (Illinois).
        top = (low * at_high - high * at_low) / (at_high - at_low)
        here = part.force(top)[1]
        if np.all(np.abs(here) <= _FLAT * np.max(np.abs(slopes), axis=0)):
            break
        same = (here > 0) == (at_low > 0)
        low, high = np.where(same, top, low), np.where(same, high, top)
        at_low, at_high = np.where(same, here, at_low / 2), np.where(same, at_high / 2, here)
    value = part.force(top)[0] if len(row) else top
    return (
        np.concatenate([row, row]),
        np.concatenate([grid[k + 1], top]),
        np.concatenate([top, grid[k + 2]]),
        np.concatenate([phi[row, k + 1], value]),
        np.concatenate([value, phi[row, k + 2]]),
    )


def _last_pieces(lines: _Lines, grid: Array, phi: Array, ends: Array) -> tuple[Index, Array, Array, Array, Array]:
    """The interval that a limit cuts short, per line that has one."""
    row = np.flatnonzero((ends < grid[-1]) & (ends > 0))
    k = np.searchsorted(grid, ends[row], side="right") - 1
    value = lines.at(row).force(ends[row])[0] if len(row) else ends[row]
    return row, grid[k], ends[row], phi[row, k], value


def _polish(
    lines: _Lines, target: Array, low: Array, high: Array, at_low: Array, at_high: Array
) -> tuple[Array, ComplexArray]:
    """Newton inside each bracket, halving where it would leave it; the amplitude and the gain there."""
    up = at_high > at_low
    A = low + (target - at_low) / (at_high - at_low) * (high - low)
    gain = np.empty(len(A), dtype=complex)
    left, part = np.arange(len(A)), lines
    low, high = low.copy(), high.copy()
    for _ in range(80):
        if not len(left):
            break
        a = A[left]
        phi, slope, gain[left] = part.force(a)
        error = phi - target[left]
        above = (error > 0) == up[left]
        high[left], low[left] = np.where(above, a, high[left]), np.where(above, low[left], a)
        with np.errstate(divide="ignore", invalid="ignore"):
            new = a - error / slope
        inside = (new > low[left]) & (new < high[left])
        new = np.where(inside, new, (low[left] + high[left]) / 2)
        settled = (np.abs(error) <= 1e-14 * target[left]) | (np.abs(new - a) <= 4e-15 * a)
        A[left] = np.where(settled, a, new)
        left, part = left[~settled], part.at(~settled)
    return A, gain
