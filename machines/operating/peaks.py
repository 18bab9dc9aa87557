"""Peaks between the lines: the largest response is solved for, not read off a grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import Outcome
from jointlib.joint import Joint

from ..harmonic_balance.assembly import Assembly
from ..indices import Index, Mask
from ..model.limits import Limit, feeds_energy
from .branches import Stability
from .chebyshev import Minimum, minimum, window

_NARROWEST = 1e-5
"""Smallest half width of a window relative to its frequency; below it rounding hides the curvature."""
_PASSES = 40
_INSIDE = 0.95
_MIDDLE = 0.5
_RESOLVED = 2e-11
"""What the polynomial of a window leaves, over its minimum, at which the window need not close in further."""
_SETTLED = 1e-10


@dataclass(frozen=True)
class Peak:
    """A resonance of one connection at one force; the amplitude is that of the relative displacement."""

    force: float
    """N, peak."""
    connection: str
    amplitude: float
    """m."""
    frequency: float
    """Hz."""
    outcome: Outcome
    """CONVERGED, or why the resonance could not be followed to its top."""
    harmonics: int = 1
    """Number of harmonics in the solution."""
    width: float = 0.0
    """Half of the half-power bandwidth in Hz; 0 where it was not found."""
    stability: Stability = Stability.UNKNOWN
    """Of the motion at the top."""


@dataclass(eq=False)
class _Search:
    """Windows that close in on a peak each: angular frequency, half width of the window, of the resonance."""

    omega: Array
    half: Array
    band: tuple[float, float]
    narrow_enough: float
    """Half width of a window, in widths of its resonance, at which the search stops closing in."""
    widest: Array
    width: Array
    steady: Mask
    edge: Mask
    group: Index
    """Neighbours of one group share a window as long as their peaks lie in the middle of it."""

    @classmethod
    def begin(
        cls, omega: Array, half: Array, band: tuple[float, float], narrow_enough: float, group: Index | None = None
    ) -> _Search:
        none, n = np.zeros(len(omega), dtype=bool), len(omega)
        half = np.minimum(half, (band[1] - band[0]) / 2)
        group = np.arange(n) if group is None else group
        return cls(omega.astype(float), half, band, narrow_enough, half.copy(), np.zeros(n), none, none.copy(), group)

    def windows(self, i: Index) -> Array:
        """Lines of the searches i, shape (searches, points), inside the band."""
        self._share(i)
        return window(self._centre(i), self.half[i])

    def _share(self, i: Index) -> None:
        """One window for neighbours of a group: within half of it from its middle, and of half to all its width."""
        size = np.floor(np.log2(self.half[i]))
        order = i[np.lexsort((self.omega[i], size, self.group[i]))]
        size = np.floor(np.log2(self.half[order]))
        omega, group = self.omega[order], self.group[order]
        first = 0
        for n in range(1, len(order) + 1):
            here = slice(first, n)
            if (
                n < len(order)
                and group[n] == group[first]
                and size[n] == size[first]
                and omega[n] - omega[first] < 2 * _MIDDLE * np.max(self.half[order[here]])
            ):
                continue
            self.omega[order[here]] = (omega[first] + omega[n - 1]) / 2
            self.half[order[here]] = np.max(self.half[order[here]])
            first = n

    def _centre(self, i: Index) -> Array:
        return np.asarray(np.clip(self.omega[i], self.band[0] + self.half[i], self.band[1] - self.half[i]))

    def narrow(self, i: Index, low: Minimum, resolved: Mask | None = None) -> None:
        """Move to the minimum of each window, and close in where it lies well inside."""
        self.omega[i] = self._centre(i) + self.half[i] * low.x
        curved = np.where(low.curvature > 0, low.curvature, np.inf)
        self.width[i] = self.half[i] * np.sqrt(2 * np.maximum(low.value, 0.0) / curved)
        ends = np.abs(self.omega[i, None] - np.array(self.band)) <= 1e-9 * self.band[1]
        self.edge[i] = np.any(ends, axis=1)
        central = (np.abs(low.x) < _INSIDE) | self.edge[i]
        floor = np.maximum(self.narrow_enough * self.width[i], _NARROWEST * self.omega[i])
        done = self.half[i] <= floor * 1.01 if resolved is None else (self.half[i] <= floor * 1.01) | resolved
        self.steady[i] = central & done
        closer = np.where(done, self.half[i], np.minimum(np.maximum(self.half[i] / 4, floor), self.half[i]))
        self.half[i] = np.where(central, closer, np.minimum(2 * self.half[i], self.widest[i]))


def tips(
    assembly: Assembly,
    joint: Joint,
    limit: Limit,
    force: Array,
    start: Array,
    amplitude: Array,
    half: Array,
    band: tuple[float, float],
) -> tuple[Array, Array, Array, list[Outcome]]:
    """Tops of the resonances of a single joint: angular frequency, amplitude, half-power half width, outcome.

    With ψ(ω, A) = A·abs(1 + Hzz G)/abs(Hzf), the force that holds an amplitude A at ω, a top is where
    m(A) = min over ω of ψ equals F; there ∂ψ/∂ω = 0 and, by the envelope theorem, m'(A) = ∂ψ/∂A. However far a
    resonance leans over, m is a function, so no fold is in the way. Arrays have one entry per resonance; ``start``
    and ``band`` are in rad/s.
    """
    count = len(force)
    search = _Search.begin(start, half, band, 0.4)
    ends = np.full(count, limit.amplitude)
    reasons: list[Outcome] = [limit.outcome] * count
    A = np.minimum(amplitude, ends)
    outcomes: list[Outcome] = [Outcome.STALLED] * count
    left = np.arange(count)
    for _ in range(_PASSES):
        if not len(left):
            break
        omega, a = search.windows(left), A[left]
        psi, rise = _holding_force(assembly, joint, omega, a)
        low = minimum(psi**2)
        search.narrow(left, low)
        slope = low.of(rise)
        missing = force[left] - np.sqrt(np.maximum(low.value, 0.0))
        step = np.where(slope > 0, missing / np.where(slope > 0, slope, 1.0), np.sign(missing) * a)
        new = np.minimum(a + np.clip(step, -a / 2, a), ends[left])
        for k in np.flatnonzero(feeds_energy(joint.first_harmonic(new, search.omega[left]).gain)):
            i = left[k]
            ends[i] = new[k] = _damping_limit(joint, float(search.omega[i]), float(a[k]), float(new[k]))
            reasons[i] = Outcome.NEGATIVE_DAMPING
        A[left] = new
        settled = search.steady[left] & (np.abs(new - a) <= _SETTLED * a)
        for k in np.flatnonzero(settled):
            i = left[k]
            beyond = new[k] >= ends[i] and missing[k] > 0
            outcomes[i] = reasons[i] if beyond else Outcome.PEAK_AT_EDGE if search.edge[i] else Outcome.CONVERGED
        left = left[~settled]
    return search.omega, A, search.width, outcomes


def _holding_force(assembly: Assembly, joint: Joint, omega: Array, amplitude: Array) -> tuple[Array, Array]:
    """ψ in N and ∂ψ/∂A in N/m on windows of lines, one amplitude per window."""
    view = assembly.at(omega.ravel())
    h, driven = (part[:, 0, 0].reshape(omega.shape) for part in (view.Hzz, view.Hzf))
    found = joint.first_harmonic(amplitude[:, None], omega)
    D = 1 + h * found.gain
    size = np.maximum(np.abs(D), 1e-300)
    rise = size + amplitude[:, None] * (D.conj() * h * found.d_amplitude).real / size
    return amplitude[:, None] * size / np.abs(driven), rise / np.abs(driven)


def _damping_limit(joint: Joint, omega: float, low: float, high: float) -> float:
    """Largest amplitude in m between two at which Im G is not negative."""
    for _ in range(60):
        middle = (low + high) / 2
        fed = bool(feeds_energy(joint.first_harmonic(middle, omega).gain))
        low, high = (low, middle) if fed else (middle, high)
    return low


def maxima(
    motion: Callable[[Index, Array], tuple[Array, Mask]],
    start: Array,
    half: Array,
    band: tuple[float, float],
    group: Index | None = None,
) -> tuple[Array, Array, Array, list[Outcome]]:
    """Maxima over frequency of amplitudes that can be computed anywhere: as `tips`, for any number of joints.

    ``motion(searches, omega)`` returns amplitudes (searches, points) and which searches could be computed;
    searches of one ``group`` have windows in common as far as they can.
    """
    # Near a fold the curve is a parabola only close to its top.
    search = _Search.begin(start, half, band, 0.03, group)
    amplitude = np.zeros(len(start))
    outcomes: list[Outcome] = [Outcome.STALLED] * len(start)
    left = np.arange(len(start))
    for _ in range(_PASSES):
        if not len(left):
            break
        value, known = motion(left, search.windows(left))
        left, value = left[known], value[known]
        low = minimum(1 / np.maximum(value, 1e-150) ** 2)
        resolved = low.rest <= _RESOLVED * low.value
        search.narrow(left, low, resolved)
        before, amplitude[left] = amplitude[left], 1 / np.sqrt(np.maximum(low.value, 1e-300))
        known_well = resolved | (np.abs(amplitude[left] - before) <= _SETTLED * before)
        settled = search.steady[left] & known_well & (low.value > 0)
        for i in left[settled]:
            outcomes[i] = Outcome.PEAK_AT_EDGE if search.edge[i] else Outcome.CONVERGED
        left = left[~settled]
    return search.omega, amplitude, search.width, outcomes


def local_maxima(value: Array) -> Index:
    """Indices of interior maxima, of the middle of flat ones; values that are not known (nan) count as nothing."""
    filled = np.where(np.isfinite(value), value, -np.inf)
    if not len(filled):
        return np.zeros(0, dtype=int)
    change = np.flatnonzero(filled[1:] != filled[:-1])
    first, last = np.concatenate([[0], change + 1]), np.concatenate([change, [len(filled) - 1]])
    level = filled[first]
    inner = np.arange(1, len(level) - 1)
    top = inner[(level[inner] > level[inner - 1]) & (level[inner] > level[inner + 1])]
    return np.asarray((first[top] + last[top]) // 2)
