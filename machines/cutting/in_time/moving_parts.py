"""A machine in time: its linear part carried exactly from step to step, its joints and the cut as forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion

from ...coupling.state_equations import machine_states
from ...model.machine import Machine
from ...statics.working_point import at_working_point

_JUMP = 1e-9
_CYCLE = 400
_BARELY_MOVING = 1e-12


@dataclass(frozen=True, eq=False)
class MovingParts:
    """u̇ = A u + B f with f the forces of the joints and then those on the tool, y = P u.

    The joints' linear laws, and for the others a spring and a damper close to them, are part of A; what is left of
    each force is computed in time. ``rest`` holds the joints whose force is not linear, with that spring (N/m) and
    damper (N s/m); y holds their displacements and velocities, then those of the tool.
    """

    A: Array
    B: Array
    P: Array
    free: Array
    """A with every joint of ``rest`` open, for a state in harmonic motion."""
    rest: tuple[Joint, ...]
    index: tuple[int, ...]
    """Which of the machine's connections they are."""
    spring: Array
    damper: Array

    @property
    def tool(self) -> int:
        """Number of tool axes."""
        return int(self.B.shape[1]) - len(self.rest)

    def harmonic(self, omega: float, gains: ComplexArray, force: ComplexArray) -> ComplexArray:
        """State phasor at a force phasor on the tool with the joints at these gains in N/m."""
        j = len(self.rest)
        pull = self.B[:, :j] @ (gains[:, None] * self.P[:j])
        return np.asarray(np.linalg.solve(1j * omega * np.eye(len(self.A)) - self.free + pull, self.B[:, j:] @ force))

    def memories(self, displacement: ComplexArray, omega: float) -> list[Array]:
        """States of the joints at time 0 after they moved as Re z e^(jωt) for more than a cycle; z is (joints, n)."""
        angle = np.linspace(-2.5 * np.pi, 0, _CYCLE)
        found = []
        for joint, z in zip(self.rest, displacement, strict=True):
            turned = z * np.exp(1j * angle)[:, None]
            path, speed = turned.real, (1j * omega * turned).real
            state = joint.initial_state(path[0])
            if joint.states:
                for x, v in zip(path[1:], speed[1:], strict=True):
                    state = joint.step(Motion(x, v, (angle[1] - angle[0]) / omega), state)[1]
            found.append(state)
        return found


def moving_parts(machine: Machine, amplitudes: Array, omega: float) -> MovingParts:
    """Equations of a machine about its working point.

    ``amplitudes`` of the connections in m and ``omega`` in rad/s say where the spring and damper of each joint are
    taken; they decide how well conditioned the steps are, not what they converge to.
    """
    machine = at_working_point(machine)
    for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
        for name, law in zip(joint.part_names, joint.laws, strict=True):
            if not law.in_time:
                raise InputError(
                    f"{machine.where}: connection {connection.name!r}: {name} exists in the frequency domain only, "
                    "a simulation needs laws in time"
                )
    states = machine_states(machine)
    A, B = scipy.linalg.block_diag(*(b.A for b in states.blocks)), np.concatenate([b.B for b in states.blocks])
    C = np.concatenate([b.C for b in states.blocks], axis=1)
    scale = np.linalg.norm(C, axis=1)[:, None] * np.linalg.norm(B, axis=0)
    if np.any(np.abs(C @ B) > _JUMP * scale) or any(np.any(b.D) for b in states.blocks):
        raise InputError(f"{machine.where}: a motion that jumps with a force cannot be simulated; give the part a mass")
    to_velocity = C @ A
    rows = states.joints
    tool = machine.dof_rows(machine.tool_dofs, "[tool]")
    rest, index, spring, damper = [], [], [], []
    for i, joint in enumerate(machine.joints()):
        bent = tuple(law for law in joint.laws if not law.linear or law.states)
        k, c = _tangent(Joint(tuple(law for law in joint.laws if law.linear and not law.states)))
        A = A - np.outer(B @ rows[i], rows[i] @ (k * C + c * to_velocity))
        if bent:
            part = Joint(bent, joint.name)
            gain = complex(part.first_harmonic(max(float(amplitudes[i]), _BARELY_MOVING), omega).gain)
            rest.append(part)
            index.append(i)
            spring.append(gain.real)
            damper.append(gain.imag / omega)
    K, D, bent_rows = np.array(spring), np.array(damper), rows[index]
    Z, V = bent_rows @ C, bent_rows @ to_velocity
    closed = A - B @ bent_rows.T @ (K[:, None] * Z + D[:, None] * V)
    return MovingParts(
        closed,
        np.concatenate([B @ bent_rows.T, B @ tool.T], axis=1),
        np.concatenate([Z, V, tool @ C, tool @ to_velocity]),
        A,
        tuple(rest),
        tuple(index),
        K,
        D,
    )


def _tangent(part: Joint) -> tuple[float, float]:
    """Stiffness (N/m) and damping (N s/m) of a linear joint."""
    zero = np.zeros(())
    k, c = part.jacobian(Motion(zero, zero), part.initial_state(zero))
    return float(k), float(c)


@dataclass(frozen=True, eq=False)
class Step:
    """One step of the exponential fourth-order method of Cox & Matthews (2002), for y = P u and forces f.

    With E = e^(Ah): y_a = (PE½)u + (PQ)f, y_b = (PE½)u + (PQ)f_a, y_c = (PE)u + R f + 2(PQ)f_b and
    u ← E u + F₁f + F₂(f_a + f_b) + F₃f_c. Fast modes cost no stability.
    """

    propagate: Array
    """[PE½; PE; E] stacked."""
    half: Array
    """P Q."""
    end: Array
    """R = P E½ Q − P Q."""
    first: Array
    middle: Array
    last: Array


def step_of(parts: MovingParts, h: float) -> Step:
    """Matrices of a step of h seconds."""
    E, phi = _phi(parts.A, parts.B, h)
    E2, phi2 = _phi(parts.A, parts.B, h / 2)
    Q = phi2[0]
    f1, f2, f3 = phi
    return Step(
        np.concatenate([parts.P @ E2, parts.P @ E, E]),
        parts.P @ Q,
        parts.P @ (E2 @ Q - Q),
        f1 - 3 * f2 + 4 * f3,
        2 * f2 - 4 * f3,
        4 * f3 - f2,
    )


def _phi(A: Array, B: Array, h: float) -> tuple[Array, list[Array]]:
    """e^(Ah), and h·φ_k(Ah)·B for k = 1, 2, 3 from one exponential of an augmented matrix."""
    n, m = B.shape
    big = np.zeros((n + 3 * m, n + 3 * m))
    big[:n, :n], big[:n, n : n + m] = A * h, B * h
    big[n : n + 2 * m, n + m :] = np.eye(2 * m)
    E = scipy.linalg.expm(big)
    return E[:n, :n], [E[:n, n + k * m : n + (k + 1) * m] for k in range(3)]
