"""A machine as a master of FMUs runs it, computed without any: what a system of FMUs is held against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import Motion

from ..loop_step import Loop


@dataclass(frozen=True, eq=False)
class LoopRun:
    """What the FMUs give out at the end of every step; first axis: steps."""

    motion: Array
    """Displacement (m) of the ports to the outside, shape (steps, ports)."""
    velocity: Array
    """m/s, shape (steps, ports)."""
    relative: Array
    """Relative displacement of the joints in m at the end of a step, shape (steps, joints)."""
    force: Array
    """What the joints give out then in N: their answer to the motion at the beginning of the step."""


def jacobi_run(loop: Loop, joints: Sequence[Joint], outside: Array, force: Array, step: float) -> LoopRun:
    """All parts step at once from rest, then values are exchanged; every force is held over a step of ``step`` s.

    The bodies of ``loop`` move exactly under held forces; the joints follow their own laws, not its tangents.
    ``outside`` has a row over the coordinates for each column of ``force``, which holds the forces (N) step by step.
    During the first step the joints' forces are zero, as no FMU has given anything out before.
    """
    n, m = len(loop.mass), len(joints)
    inverse = np.linalg.inv(loop.mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ loop.stiffness, -inverse @ loop.damping]])
    B = np.concatenate([np.zeros((n, m + len(outside))), inverse @ np.concatenate([-loop.joints, outside]).T])
    inputs = B.shape[1]
    held = expm(np.block([[A, B], [np.zeros((inputs, 2 * n + inputs))]]) * step)[: 2 * n]
    states = [joint.initial_state(0.0) for joint in joints]
    x, given = np.zeros(2 * n), np.zeros(m)
    rows: list[tuple[Array, ...]] = []
    for applied in force:
        z, v = loop.joints @ x[:n], loop.joints @ x[n:]
        x = held @ np.concatenate([x, given, applied])
        answers = [j.step(Motion(z[i], v[i], step), states[i]) for i, j in enumerate(joints)]
        given, states = np.array([float(f) for f, _ in answers]), [state for _, state in answers]
        rows.append((outside @ x[:n], outside @ x[n:], loop.joints @ x[:n], given))
    return LoopRun(*(np.array(column) for column in zip(*rows, strict=True)))
