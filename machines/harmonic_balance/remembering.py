"""Forces of laws with memory over a steady cycle, and how they follow its harmonics."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import Motion

from ..indices import Mask
from ..statics.mean_force import SLOW
from .creeping import look_ahead
from .cycle import Cycle, slope_by_frequency, slopes_of_harmonics, tangent

_CYCLES = 200
_REPEATS, _ROUNDING = 1e-10, 1e-14
_NUDGE = 1e-6


def with_memory(
    joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array, slopes: bool
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
    """Force and derivatives, by frequency the last; without slopes they are 0.

    Where the law never leaves the state in which it was put on, as a slider that sticks, it has no memory; elsewhere
    derivatives are by small changes of every part, all stepped side by side.
    """
    cases, nh = z.shape
    out = np.empty_like(z), *np.zeros((2, cases, nh, nh), dtype=complex), np.zeros_like(z)
    motion = cycle.motion(z, omega)
    x = motion.displacement
    still = stays(joint, np.max(x, axis=1), np.min(x, axis=1))
    if np.any(still):
        part = Motion(motion.displacement[still], motion.velocity[still])
        start = joint.initial_state(np.zeros_like(part.displacement))
        out[0][still] = cycle.project(joint.step(part, start)[0])
        if slopes:
            own = tuple(cycle.harmonics.astype(int).tolist())
            tangents = tangent(joint, cycle, part, 2 * max(own), start)
            out[1][still], out[2][still] = slopes_of_harmonics(tangents, own, omega[still])
            out[3][still] = slope_by_frequency(tangents, own, z[still])
    moving = np.flatnonzero(~still)
    if len(moving):
        for whole, stepped in zip(out, _stepped(joint, cycle, z[moving], omega[moving], slopes), strict=True):
            whole[moving] = stepped
    return out


def stays(joint: Joint, high: Array, low: Array) -> Mask:
    """Where laws that may be stepped from turn to turn stay, between two displacements (m), as they were put on."""
    if not all(law.by_turns for law in joint.laws):
        return np.zeros(len(high), dtype=bool)
    start, fine = joint.initial_state(np.zeros(len(high))), np.ones(len(high), dtype=bool)
    for turn in (high, low):
        state = joint.step(Motion(turn, np.zeros(len(high)), SLOW), start)[1]
        fine &= np.all(state == start, axis=1)
    return fine


def _stepped(
    joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array, slopes: bool
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
    """Force and derivatives from steps through whole cycles."""
    cases, nh = z.shape
    if not slopes:
        none = np.zeros((cases, nh, nh), dtype=complex)
        return cycle.project(_steady_force(joint, cycle, z, omega)), none, none, np.zeros_like(z)
    size = np.maximum(np.max(np.abs(z), axis=1), 1e-300)
    nudges, faster = np.zeros((2 * nh + 2, nh), dtype=complex), np.ones(2 * nh + 2)
    nudges[1 : nh + 1], nudges[nh + 1 : -1], faster[-1] = _NUDGE * np.eye(nh), 1j * _NUDGE * np.eye(nh), 1 + _NUDGE
    moved = z[:, None] + size[:, None, None] * nudges
    steady = _steady_force(joint, cycle, moved.reshape(-1, nh), (omega[:, None] * faster).ravel())
    g = cycle.project(steady).reshape(cases, 2 * nh + 2, nh)
    change = (g[:, 1:] - g[:, :1]) / _NUDGE
    by_omega, change = change[:, -1] / omega[:, None], change[:, :-1] / size[:, None, None]
    by_real, by_imaginary = (np.swapaxes(part, 1, 2) for part in (change[:, :nh], change[:, nh:]))
    return g[:, 0], (by_real - 1j * by_imaginary) / 2, (by_real + 1j * by_imaginary) / 2, by_omega


def _steady_force(joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array) -> Array:
    """Force over the steady cycle, (cases, samples); nan where it does not repeat."""
    return _steady(joint, cycle, z, omega)[0]


def steady_states(joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array) -> Array:
    """States before the step to every sample of the steady cycle, (cases, samples, states); nan as for the force."""
    remembering, _ = joint.parted(lambda law: bool(law.states))
    if not remembering.laws:
        return np.empty((len(z), len(cycle.angle), 0))
    return _steady(remembering, cycle, z, omega)[1]


def _steady(joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array) -> tuple[Array, Array]:
    """Force at the samples and states before them, begun at the largest displacement, slowly loaded from 0.

    So a slider that sticks all along holds no force in the mean of a motion about 0.
    """
    motion, n = cycle.motion(z, omega), len(cycle.angle)
    begin = np.argmax(motion.displacement, axis=1)
    order = (begin[:, None] + np.arange(n)) % n
    x, v = (np.take_along_axis(part, order, axis=1) for part in (motion.displacement, motion.velocity))
    step = 2 * np.pi / n / omega
    state = joint.step(Motion(x[:, 0], np.zeros(len(x)), SLOW), joint.initial_state(np.zeros(len(x))))[1]
    # Samples first, and a single law without the detour over the sum: the step is what all this waits for.
    advance = joint.laws[0].step if len(joint.laws) == 1 else joint.step
    x, v = np.ascontiguousarray(x.T), np.ascontiguousarray(v.T)
    rolled, states = np.full_like(x, np.nan), np.full((n + 1, *state.shape), np.nan)
    left, before = np.arange(len(z)), np.full(state.shape, np.nan)
    pulled = np.full_like(x, np.nan)
    for _ in range(_CYCLES):
        past, pulled, through = pulled, np.empty_like(x), np.empty((n + 1, *state.shape))
        through[0] = state
        for i in range(n):
            pulled[i], state = advance(Motion(x[i], v[i], step), state)
            through[i + 1] = state
        moved, spread = state - through[0], np.ptp(through, axis=0)
        closing = _REPEATS * spread + _ROUNDING * np.max(np.abs(through), axis=0)
        # A slider that barely slips goes on moving by what rounding makes of displacements; its force repeats.
        repeats = np.max(np.abs(pulled - past), axis=0) <= _ROUNDING * np.max(np.abs(pulled), axis=0)
        open_ = np.any(np.abs(moved) > closing, axis=1) & ~repeats
        closed = left[~open_]
        rolled[:, closed], states[:, closed] = pulled[:, ~open_], through[:, ~open_]
        left = left[open_]
        if not len(left):
            break
        x, v, step, pulled = x[:, open_], v[:, open_], step[open_], pulled[:, open_]
        state, before = look_ahead(state[open_], moved[open_], before[open_])
    force, at = np.empty((len(z), n)), np.empty((len(z), n, state.shape[-1]))
    np.put_along_axis(force, order, rolled.T, axis=1)
    np.put_along_axis(at, order[:, :, None], np.swapaxes(states[:-1], 0, 1), axis=1)
    return force, at
