"""A stiff structure in Python, from the laws themselves: the second route to what its FMU does by modes."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from jointlib.arrays import Array
from jointlib.law import JointLaw, Motion
from jointlib.laws.viscous import Viscous

from ..system.closed import Closed
from ..system.system import SLOW

_FEWEST, _MOST, _WORK = 16, 256, 500
"""Steps of the integration within one of the run, fewer where many joints bend."""


def simulate_closed(of: Closed, u: Array, step: float) -> Array:
    """Outputs (samples, outputs) where the inputs u[i] are held over the step that ends at sample i.

    x' = A x + B u + G d + c moves exactly, by the exponential of the whole matrix and of its integrals. What the joints
    are more than their tangents, d, changes linearly over a step; it is asked where the motion would be with d as
    before, and again where that leads.
    """
    system = of.system
    substeps = int(np.clip(_WORK // max(len(of.bent), 1), _FEWEST, _MOST))
    h = step / substeps
    n = len(of.A)
    # The exponential of a chain of blocks holds e^(Ah) and its first two integrals (Van Loan, 1978).
    chain = np.zeros((3 * n, 3 * n))
    chain[:n, :n], chain[:n, n : 2 * n], chain[n : 2 * n, 2 * n :] = of.A * h, np.eye(n), np.eye(n)
    whole = expm(chain)[:n]
    move, hold, ramp = whole[:, :n], h * whole[:, n : 2 * n], h * whole[:, 2 * n :]
    forces = _Forces(of)
    x = system.start.copy()
    d = forces.beyond(x)
    out = [forces.outputs(x, u[0])]
    G = system.G[:, list(of.bent)]
    pulled, pushed = hold @ G, ramp @ G
    for held in u[1:]:
        steady = hold @ (system.B @ held + of.constant)
        for _ in range(substeps):
            free = move @ x + steady + pulled @ d
            first = forces.beyond(free)
            second = forces.beyond(free + pushed @ (first - d))
            x = free + pushed @ (second - d)
            d = forces.beyond(x, keep=True)
        out.append(forces.outputs(x, held))
    return np.array(out)


class _Forces:
    """The joints with what they remember."""

    def __init__(self, of: Closed) -> None:
        self.of = of
        system = of.system
        z = (system.C @ system.start + system.constants[1])[0::2]
        self.laws: list[list[JointLaw]] = [list(joint.laws) for _, joint in system.joints]
        self.states: list[list[Array]] = []
        for laws, at in zip(self.laws, z, strict=True):
            states = [law.initial_state(np.asarray(at)) for law in laws]
            if system.load is not None:
                virgin = [law.initial_state(np.zeros(())) for law in laws]
                loaded = Motion(np.asarray(at), np.zeros(()), SLOW)
                states = [law.step(loaded, s)[1] for law, s in zip(laws, virgin, strict=True)]
            self.states.append(states)

    def beyond(self, x: Array, keep: bool = False) -> Array:
        """δ of the bent joints in N at x; ``keep`` lets them remember the way there."""
        system, of = self.of.system, self.of
        motion = system.C @ x + system.constants[1]
        out = np.empty(len(of.bent))
        for i, j in enumerate(of.bent):
            z, v = motion[2 * j], motion[2 * j + 1]
            fast = j in of.by_velocity
            force = -of.stiffness[j] * z - (of.damping[j] * v if fast else 0.0)
            for k, law in enumerate(self.laws[j]):
                if not fast and isinstance(law, Viscous):
                    continue
                f, state = law.step(Motion(np.asarray(z), np.asarray(v if fast else 0.0), 0.0), self.states[j][k])
                force += float(f)
                if keep and law.states:
                    self.states[j][k] = state
            out[i] = force
        return out

    def outputs(self, x: Array, u: Array) -> Array:
        system = self.of.system
        motion = system.C @ x + system.constants[1]
        f = np.zeros(len(system.joints))
        for j, (laws, states) in enumerate(zip(self.laws, self.states, strict=True)):
            at = Motion(np.asarray(motion[2 * j]), np.asarray(motion[2 * j + 1]), 0.0)
            f[j] = sum(float(law.step(at, s)[0]) for law, s in zip(laws, states, strict=True))
        return np.asarray(system.E @ x + system.F @ u + system.H @ f + system.constants[2])
