"""A stiff structure in Python, from the laws themselves: the second route to what its FMU does by modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.law import JointLaw, Motion
from jointlib.laws.viscous import Viscous

from ..system.closed import Closed
from ..system.system import SLOW, System

_FEWEST, _USUAL, _MOST = 16, 32, 256
"""Steps of the integration within one of the run."""
_TERMS = 24

_Memory = list[list[Array]]
"""What each law of each group of joints remembers, (joints, states)."""


def simulate_closed(of: Closed, u: Array, step: float, good: float, serves: float) -> tuple[Array, Array]:
    """Outputs (samples, outputs) where the inputs u[i] are held over the step that ends at sample i, and their errors.

    x' = A x + B u + G d + c moves exactly, by the exponential of the whole matrix and of its integrals. What the joints
    are more than their tangents, d, changes linearly over a step; it is asked where the motion would be with d as
    before, and again where that leads. Steps are halved until that changes no output by more than a share of ``good``
    of its largest value, or after a while of ``serves``; the errors are what the last halving changed. Conditions stay
    what they are in the first sample.
    """
    moves = _moves(of, step)
    parts = _FEWEST
    found = _simulated(of, moves[parts], u, parts)
    while True:
        parts *= 2
        before, found = found, _simulated(of, moves[parts], u, parts)
        error = np.max(np.abs(found - before), axis=0)
        share = good if parts < _USUAL else serves
        if parts >= _MOST or np.all(error <= share * np.max(np.abs(found), axis=0)):
            return found, error


def _simulated(of: Closed, moves: _Moves, u: Array, parts: int) -> Array:
    """Outputs with this many steps a sample."""
    forces, x = _Forces(of, of.system.under(u[0]) if of.system.conditions else of.system), of.system.start.copy()
    memory = forces.begun()
    d, memory = forces.beyond(x, memory, 0.0)
    out = [forces.outputs(x, u[0], memory)]
    pulled = moves.held[:, moves.inputs :]
    for held in u[1:]:
        steady = moves.held[:, : moves.inputs] @ np.append(held, 1.0)
        for _ in range(parts):
            free = moves.move @ x + steady + pulled @ d
            first, _ = forces.beyond(free, memory, moves.step)
            second, _ = forces.beyond(free + moves.begun @ (first - d), memory, moves.step)
            x = free + moves.begun @ (second - d)
            d, memory = forces.beyond(x, memory, moves.step)
        out.append(forces.outputs(x, held, memory))
    return np.array(out)


@dataclass(frozen=True, eq=False)
class _Moves:
    """A step of one length: e^(Ah), and its integrals on forces that are held and on forces that begin."""

    step: float
    """h in s."""
    move: Array
    held: Array
    """∫ e^(A(h − s)) ds on the columns of B, c and of G of the bent joints."""
    begun: Array
    """∫ e^(A(h − s)) s/h ds on the columns of G of the bent joints."""
    inputs: int

    def doubled(self) -> _Moves:
        """The same for twice the length, from two of these."""
        pulled = self.held[:, self.inputs :]
        begun = (self.move @ self.begun + pulled + self.begun) / 2
        return _Moves(2 * self.step, self.move @ self.move, self.held + self.move @ self.held, begun, self.inputs)

    @classmethod
    def lasting(cls, of: Closed, h: float) -> _Moves:
        """By Taylor's series, for a step that is short against the fastest motion."""
        system = of.system
        forces = system.G[:, list(of.bent)]
        columns = np.column_stack([system.B, of.constant, forces])
        held, begun, term = h * columns, h / 2 * forces, h * columns
        inputs = columns.shape[1] - forces.shape[1]
        for k in range(2, _TERMS):
            term = of.A @ term * (h / k)
            held = held + term
            begun = begun + term[:, inputs:] / (k + 1)
        return cls(h, scipy.linalg.expm(of.A * h), held, begun, inputs)


def _moves(of: Closed, step: float) -> dict[int, _Moves]:
    """Steps by how many of them fill one of the run."""
    fastest = float(np.max(np.abs(of.poles), initial=0.0))
    halvings = max(int(np.log2(_MOST)), int(np.ceil(np.log2(max(2 * fastest * step, 1.0)))))
    found = _Moves.lasting(of, step / 2**halvings)
    out = {}
    for k in range(halvings, int(np.log2(_FEWEST)) - 1, -1):
        if 2**k <= _MOST:
            out[2**k] = found
        found = found.doubled()
    return out


class _Forces:
    """The joints of a system, those of the same laws side by side, beyond their tangents in the closed one."""

    def __init__(self, of: Closed, system: System) -> None:
        self.of, self.system = of, system
        groups: dict[tuple[int, bool, bool], list[int]] = {}
        for j, (_, joint) in enumerate(system.joints):
            groups.setdefault((id(joint), j in of.bent, j in of.by_velocity), []).append(j)
        self.groups: list[tuple[list[JointLaw], list[int], bool, bool]] = [
            (list(system.joints[js[0]][1].laws), js, bent, fast) for (_, bent, fast), js in groups.items()
        ]
        place = {j: i for i, j in enumerate(of.bent)}
        self.places = [[place[j] for j in js] if bent else [] for _, js, bent, _ in self.groups]

    def begun(self) -> _Memory:
        """At the start: virgin, or loaded as the system is."""
        system = self.system
        z = (system.C @ system.start + system.constants[1])[0::2]
        out = []
        for laws, js, _, _ in self.groups:
            states = [law.initial_state(z[js]) for law in laws]
            if system.load is not None:
                virgin = [law.initial_state(np.zeros(len(js))) for law in laws]
                loaded = Motion(z[js], np.zeros(len(js)), SLOW)
                states = [law.step(loaded, s)[1] for law, s in zip(laws, virgin, strict=True)]
            out.append(states)
        return out

    def beyond(self, x: Array, memory: _Memory, h: float) -> tuple[Array, _Memory]:
        """δ of the bent joints in N at x, and what they remember of the way there, which took h seconds."""
        of, system = self.of, self.of.system
        motion = system.C @ x + system.constants[1]
        out, after = np.zeros(len(of.bent)), list(memory)
        for i, (laws, js, bent, fast) in enumerate(self.groups):
            if not bent:
                continue
            z, v = motion[0::2][js], motion[1::2][js]
            force = -of.stiffness[js] * z - (of.damping[js] * v if fast else 0.0)
            at, states = Motion(z, v if fast else np.zeros(len(js)), h), list(memory[i])
            for k, law in enumerate(laws):
                if not fast and isinstance(law, Viscous):
                    continue
                f, states[k] = law.step(at, memory[i][k])
                force = force + f
            out[self.places[i]], after[i] = force, states
        return out, after

    def outputs(self, x: Array, u: Array, memory: _Memory) -> Array:
        system: System = self.of.system
        motion = system.C @ x + system.constants[1]
        f = np.zeros(len(system.joints))
        for (laws, js, _, _), states in zip(self.groups, memory, strict=True):
            at = Motion(motion[0::2][js], motion[1::2][js], 0.0)
            for law, state in zip(laws, states, strict=True):
                f[js] += law.step(at, state)[0]
        return np.asarray(system.E @ x + system.F @ u + system.H @ f + system.constants[2])
