"""A machine as a master of FMUs runs it, computed without any: what a system of FMUs is held against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import Motion

from ..loop_step import Loop
from ..system.under_conditions import UnderConditions


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


def jacobi_run(
    loop: Loop,
    joints: Sequence[Joint],
    outside: Array,
    force: Array,
    step: float,
    conditions: Sequence[Mapping[str, float]] | None = None,
    start: Mapping[str, float] | None = None,
) -> LoopRun:
    """All parts step at once from rest, then values are exchanged; every force is held over a step of ``step`` s.

    The bodies of ``loop`` move exactly under held forces; the joints follow their own laws, not its tangents.
    ``outside`` has a row over the coordinates for each column of ``force``, which holds the forces (N) step by step.
    During the first step the joints' forces are zero, as no FMU has given anything out before. ``conditions`` are those
    of each step, for joints that depend on them, ``start`` those at rest before.
    """
    n, m = len(loop.mass), len(joints)
    inverse = np.linalg.inv(loop.mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ loop.stiffness, -inverse @ loop.damping]])
    B = np.concatenate([np.zeros((n, m + len(outside))), inverse @ np.concatenate([-loop.joints, outside]).T])
    inputs = B.shape[1]
    held = scipy.linalg.expm(np.block([[A, B], [np.zeros((inputs, 2 * n + inputs))]]) * step)[: 2 * n]
    states = [joint.initial_state(0.0) for joint in joints]
    under = [UnderConditions(joint) for joint in joints]
    behind = [each.begun(start or {}) for each in under]
    x, given = np.zeros(2 * n), np.zeros(m)
    rows: list[tuple[Array, ...]] = []
    for at, applied in zip(conditions or [{}] * len(force), force, strict=True):
        z, v = loop.joints @ x[:n], loop.joints @ x[n:]
        x = held @ np.concatenate([x, given, applied])
        answers = [u.step(Motion(z[i], v[i], step), at, states[i], behind[i]) for i, u in enumerate(under)]
        given = np.array([float(f) for f, *_ in answers])
        states, behind = [state for _, state, _ in answers], [late for *_, late in answers]
        rows.append((outside @ x[:n], outside @ x[n:], loop.joints @ x[:n], given))
    return LoopRun(*(np.array(column) for column in zip(*rows, strict=True)))
