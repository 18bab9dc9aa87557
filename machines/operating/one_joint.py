"""One joint at a prescribed amplitude of the tool: every amplitude of the joint is laid out, the smallest counts."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.joint import Joint

from ..indices import Index
from ..model.limits import Limit
from .amplitude_map import admissible, gain_table

BARELY_MOVING = 1e-10
"""m; the amplitude of a joint that is held as one at rest."""
_STUCK = 1e-13
_AXIS = 120
_DECADES = 6.0
_COARSE = np.geomspace(1e-12, 1.0, 61)
_STEPS = 60
_SETTLED = 1e-11
_SLOW = 0.5


@dataclass(frozen=True, eq=False)
class OneJoint:
    """A machine's one nonlinear joint on some lines; its gains are tabulated once, whatever the vibration."""

    joint: Joint
    limit: Limit
    omega: Array
    """rad/s, (nf,)."""
    _tables: dict[float, _Table] = field(default_factory=dict, init=False, repr=False)

    def vibrating(
        self,
        h: ComplexArray,
        driven: ComplexArray,
        direct: ComplexArray,
        through: ComplexArray,
        amplitude: float,
        lines: Index,
    ) -> tuple[Array, ComplexArray, tuple[Outcome, ...]]:
        """Amplitude A in m and gain G of the joint while the tool vibrates with ``amplitude``, and what was met.

        A is the given quantity, tool amplitude and force follow from it: A max_a abs(direct_a (1 + h G) −
        through_a G driven) reaches ``amplitude`` abs(driven) where the tool does. Where it does not up to the limit
        of the joint, A is that limit.

        Parameters
        ----------
        h, driven, direct, through
            Receptances in m/N with the joint open: of the joint, from the force to it, from the force to the tool,
            from the joint to the tool; the last two are (nf, axes).
        lines
            Which of the lines the receptances are of.
        """
        tip = _Tip(direct, h[:, None] * direct - through * driven[:, None], amplitude * np.abs(driven))
        ceiling = min(self.limit.amplitude, self._reach(tip, lines))
        if ceiling not in self._tables:
            self._tables[ceiling] = _Table.of(self.joint, self.limit, self.omega, ceiling)
        table = self._tables[ceiling]
        A, ends, omega = table.amplitude, table.ends[lines], self.omega[lines]
        excess = tip.excess(A, table.gain[lines])
        over = (excess >= 0) & (ends[:, None] >= A)
        hit = np.any(over, axis=1)
        k = np.argmax(over, axis=1)
        low, high = np.where(k > 0, A[k - 1], 0.0), np.where(hit, A[k], ends)
        at_low = np.where(k > 0, np.take_along_axis(excess, np.maximum(k - 1, 0)[:, None], 1)[:, 0], -tip.wanted)
        at_high = np.take_along_axis(excess, k[:, None], 1)[:, 0]
        # The last admissible amplitude may still hold a solution beyond the last point of the axis.
        rest = np.flatnonzero(~hit)
        if len(rest):
            under = np.searchsorted(A, ends[rest], side="right") - 1
            low[rest] = np.where(under >= 0, A[np.maximum(under, 0)], 0.0)
            at_low[rest] = np.where(under >= 0, excess[rest, np.maximum(under, 0)], -tip.wanted[rest])
            at_high[rest] = tip.at(rest).exact(self.joint, ends[rest], omega[rest])[0]
            hit[rest] = at_high[rest] >= 0
        final = np.where(hit, high, ends)
        todo = np.flatnonzero(hit)
        final[todo] = _root(tip.at(todo), self.joint, omega[todo], low[todo], high[todo], at_low[todo], at_high[todo])
        G = self.joint.first_harmonic(np.maximum(final, _STUCK), omega).gain
        G = np.where(np.isfinite(G), G, self.joint.first_harmonic(BARELY_MOVING, omega).gain)
        return final, G, tuple(Outcome.CONVERGED if ok else table.reasons[i] for i, ok in zip(lines, hit, strict=True))

    @cached_property
    def _coarse(self) -> ComplexArray:
        return gain_table(self.joint, self.omega, _COARSE)[0]

    def _reach(self, tip: _Tip, lines: Index) -> float:
        """An amplitude in m at which the tool moves more than asked for on every line."""
        over = np.all(tip.excess(_COARSE, self._coarse[lines]) >= 0, axis=0)
        return float(_COARSE[int(np.argmax(over))] if np.any(over) else _COARSE[-1])


@dataclass(frozen=True, eq=False)
class _Table:
    """Gains of the joint over its amplitudes (m), per line where it must stop and why."""

    amplitude: Array
    gain: ComplexArray
    ends: Array
    reasons: tuple[Outcome, ...]

    @classmethod
    def of(cls, joint: Joint, limit: Limit, omega: Array, ceiling: float) -> _Table:
        A = np.geomspace(ceiling * 10**-_DECADES, ceiling, _AXIS)
        gain = gain_table(joint, omega, A)[0]
        return cls(A, gain, *admissible(joint, omega, A, gain, limit))


@dataclass(frozen=True, eq=False)
class _Tip:
    """How far the tool is beyond the wanted amplitude: A max_a abs(direct_a + G bent_a) − wanted, times abs(driven)."""

    direct: ComplexArray
    bent: ComplexArray
    wanted: Array

    def at(self, lines: Index) -> _Tip:
        return _Tip(self.direct[lines], self.bent[lines], self.wanted[lines])

    def excess(self, A: Array, gain: ComplexArray) -> Array:
        """On (lines, amplitudes)."""
        squares = np.zeros(gain.shape)
        for direct, bent in zip(self.direct.T, self.bent.T, strict=True):
            tip = gain * bent[:, None]
            tip += direct[:, None]
            squares = np.maximum(squares, tip.real**2 + tip.imag**2)
        return np.asarray(A * np.sqrt(squares) - self.wanted[:, None])

    def exact(self, joint: Joint, A: Array, omega: Array) -> tuple[Array, Array]:
        """At one amplitude per line, with the slope over it; nan where the joint is rigid at rest."""
        found = joint.first_harmonic(A, omega)
        with np.errstate(invalid="ignore", divide="ignore"):
            every = self.direct + found.gain[:, None] * self.bent
            axis = np.argmax(np.abs(every), axis=1)
            number = np.arange(len(axis))
            t = every[number, axis]
            size = np.abs(t)
            turned = (t.conj() * found.d_amplitude * self.bent[number, axis]).real / size
            return A * size - self.wanted, size + A * turned


def _root(tip: _Tip, joint: Joint, omega: Array, low: Array, high: Array, at_low: Array, at_high: Array) -> Array:
    """Newton's method from the chord of each bracket, halved where that leads out of it or hardly on.

    At rest a joint may be rigid; that end counts as too small.
    """
    low, high, before = low.copy(), high.copy(), np.full(len(low), np.inf)
    x = low + np.clip(at_low / np.where(at_low < at_high, at_low - at_high, -1.0), 0.0, 1.0) * (high - low)
    left = np.arange(len(x))
    for _ in range(_STEPS):
        if not len(left):
            break
        at = x[left]
        f, slope = tip.exact(joint, at, omega)
        short = ~(f >= 0)
        low[left], high[left] = np.where(short, at, low[left]), np.where(short, high[left], at)
        with np.errstate(invalid="ignore", divide="ignore"):
            new = at - f / slope
        good = (new >= low[left]) & (new <= high[left]) & (np.abs(f) <= _SLOW * before[left])
        new = np.where(good, new, (low[left] + high[left]) / 2)
        before[left], x[left] = np.abs(f), new
        go = ~(np.abs(new - at) <= _SETTLED * new)
        left, tip, omega = left[go], tip.at(np.flatnonzero(go)), omega[go]
    return x
