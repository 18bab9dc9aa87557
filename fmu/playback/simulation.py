"""A system with structure integrated in Python from the laws themselves: the second route to what its FMU does."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.law import JointLaw, Motion

from ..system.closed import is_integrated
from ..system.system import SLOW, System

_RELATIVE, _ABSOLUTE = 1e-11, 1e-13
"""Tolerances of the integration, relative to each state and to its usual size."""
_SHORT = 1e-8
"""Step in s by which a law tells its rates: its own errors fall with the third power of it."""
_TRAVEL = 1e-6
"""Usual size in m of what a law remembers."""
_MOST = 300_000
"""Evaluations of the forces in a run."""


def simulate(system: System, u: Array, step: float) -> Array:
    """Outputs (samples, outputs) where the inputs u[i] are held over the step that ends at sample i.

    The first sample is the start, at rest, with the joints virgin, or loaded as the system is; conditions stay what
    they are there. The method is Dormand
    and Prince's of order 8 (scipy's DOP853). Where a law's own step is exact along a path without reversal, what it
    remembers is held over a step of the solver, and steps end at reversals; the rest is integrated, by rates that short
    steps of the law tell.
    """
    run = _Run(system.under(u[0]) if system.conditions else system, u[0])
    out = [run.outputs(u[0])]
    # A law may overflow on the way to a bound that it keeps.
    with np.errstate(over="ignore"):
        for held in u[1:]:
            run.advance(held, step)
            out.append(run.outputs(held))
    return np.array(out)


@dataclass
class _Remembering:
    """One law with its state, and where in the integrated vector the state is, if it is there."""

    joint: int
    law: JointLaw
    state: Array
    place: slice | None

    def at(self, y: Array, z: Array) -> Array:
        """The state that goes with y; a position is where the joint is."""
        if self.place is None:
            return self.state
        state = y[self.place].copy()
        for i, name in enumerate(self.law.states):
            if name == "position":
                state[i] = z
        return state


class _Run:
    """The structure, and behind it what laws remember that is integrated."""

    def __init__(self, system: System, u: Array) -> None:
        self.system, self.n = system, len(system.states)
        x, sizes = system.start, [s.size for s in system.states]
        self.pushed, self.moved, self.shown = system.constants
        z = (system.C @ x + system.D @ u + self.moved)[0::2]
        self.laws: list[_Remembering] = []
        pieces, end = [x], self.n
        for j, (_, joint) in enumerate(system.joints):
            for law in joint.laws:
                state, place = law.initial_state(z[j]), None
                if law.states and system.load is not None:
                    virgin = law.initial_state(np.zeros(()))
                    state = law.step(Motion(z[j], np.zeros(()), SLOW), virgin)[1]
                if is_integrated(law):
                    place = slice(end, end + len(law.states))
                    pieces.append(state)
                    sizes += [_TRAVEL] * len(law.states)
                    end = place.stop
                self.laws.append(_Remembering(j, law, state, place))
        self.paths = sorted({entry.joint for entry in self.laws if entry.law.states and entry.place is None})
        self.y, self.atol = np.concatenate(pieces), _ABSOLUTE * np.array(sizes)
        self.count, self.stride = 0, np.inf

    def motion(self, y: Array, u: Array) -> Array:
        return np.asarray(self.system.C @ y[: self.n] + self.system.D @ u + self.moved)

    def forces(self, y: Array, motion: Array) -> Array:
        f = np.zeros(len(self.system.joints))
        for entry in self.laws:
            z, v = motion[2 * entry.joint : 2 * entry.joint + 2]
            f[entry.joint] += float(entry.law.step(Motion(z, v, 0.0), entry.at(y, z))[0])
        return f

    def outputs(self, u: Array) -> Array:
        s, y = self.system, self.y
        f = self.forces(y, self.motion(y, u))
        return np.asarray(s.E @ y[: self.n] + s.F @ u + s.H @ f + self.shown)

    def rates(self, u: Array, _time: float, y: Array) -> Array:
        s, motion = self.system, self.motion(y, u)
        self.count += 1
        rate = np.empty_like(y)
        rate[: self.n] = s.A @ y[: self.n] + s.B @ u + s.G @ self.forces(y, motion) + self.pushed
        for entry in self.laws:
            if entry.place is not None:
                z, v = motion[2 * entry.joint : 2 * entry.joint + 2]
                rate[entry.place] = _rates(entry.law, z, v, entry.at(y, z))
        return rate

    def advance(self, u: Array, step: float) -> None:
        """``step`` s at held inputs."""
        time = 0.0
        while time < step:
            time = self._until_reversal(u, time, step)

    def _until_reversal(self, u: Array, time: float, end: float) -> float:
        """To the end, or to where a joint that remembers its path reverses, and the time there in s."""
        solver = self._solver(u, time, self.y, end)
        while solver.status == "running":
            before, start = solver.y, solver.t
            self._step(solver)
            turn = self._reversal(u, solver, start) if self.paths else None
            if turn is not None:
                short = self._solver(u, start, before, turn)
                while short.status == "running":
                    self._step(short)
                self._arrive(short.y, u)
                return turn
            self._arrive(solver.y, u)
            self.stride = solver.h_abs
        return end

    def _reversal(self, u: Array, solver: Any, start: float) -> float | None:
        """Where in the solver's last step a joint first reverses; not where the step begins with that."""
        from scipy.optimize import brentq

        course, end, turns = solver.dense_output(), solver.t, []

        def speed(t: float, joint: int) -> float:
            return float(self.motion(course(t), u)[2 * joint + 1])

        for joint in self.paths:
            if speed(start, joint) * speed(end, joint) < 0:
                turns.append(float(brentq(speed, start, end, args=(joint,), xtol=1e-18, rtol=1e-14)))
        return min((t for t in turns if t - start > 1e-9 * (end - start)), default=None)

    def _solver(self, u: Array, time: float, y: Array, end: float) -> Any:
        from scipy.integrate import DOP853

        first = min(self.stride, end - time) if np.isfinite(self.stride) else None
        atol: Any = self.atol  # scipy takes one tolerance for each state
        return DOP853(partial(self.rates, u), time, y, end, rtol=_RELATIVE, atol=atol, first_step=first)

    def _step(self, solver: Any) -> None:
        said = solver.step()
        if solver.status == "failed" or self.count > _MOST or not np.all(np.isfinite(solver.y)):
            raise InputError(
                f"{self.system.name!r}: the reference run cannot be integrated ({said or 'too many steps'}), expected "
                "joints that hold the machine under small forces"
            )

    def _arrive(self, y: Array, u: Array) -> None:
        """The laws remember how they got here."""
        self.y = y
        motion = self.motion(y, u)
        for entry in self.laws:
            if entry.law.states and entry.place is None:
                z, v = motion[2 * entry.joint : 2 * entry.joint + 2]
                entry.state = entry.law.step(Motion(z, v, 0.0), entry.state)[1]


def _rates(law: JointLaw, z: Array, v: Array, state: Array) -> Array:
    """Quotients D of the law's own short steps along the motion, [8 D(h/4) − 6 D(h/2) + D(h)]/3."""
    D = [(law.step(Motion(z + v * h, v, h), state)[1] - state) / h for h in (_SHORT, _SHORT / 2, _SHORT / 4)]
    return np.asarray((8 * D[2] - 6 * D[1] + D[0]) / 3)
