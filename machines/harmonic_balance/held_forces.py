"""A force that a slider holds since it last slipped: how far it can put the mean aside, and what that does to a motion.

A slider that sticks through a vibration of amplitude A may hold any force up to its slip force less kA. Which one is
decided by what went before: balanced by what else is in the machine it moves the mean of every joint, and where
another law is not linear its gain changes with the mean. Neither harmonic knows of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import Motion

from ..deadline import in_time
from ..indices import Mask
from ..statics.mean_force import SLOW
from .assembly import Assembly, is_linear
from .balance import Balance, solve_complex, solve_each
from .frequency_reach import reached
from .harmonics import Harmonics

_SAMPLES, _CYCLES = 64, 30
_PUSH = 1e3
"""Amplitudes by which a slider was pushed aside before."""
_BARELY = 1e-2
"""Of the lowest frequency: slow enough for inertia not to matter."""
_CHORDS = 8
_LONGEST = 0.5
"""Of the largest joint's motion, a chord."""
_RAMP, _STEPS = 6, 12
_SETTLED = 1e-6


def can_hold(assembly: Assembly) -> bool:
    """Whether a joint remembers and another law, there or elsewhere, has a gain that the mean can change."""
    laws = [_Parts.of(assembly.standing[i]) for i in assembly.nonlinear]
    return any(part.remembering.laws for part in laws) and any(part.bends for part in laws)


def held_change(assembly: Assembly, omega: Array, force: Array, z: ComplexArray, own: Harmonics) -> Array:
    """Bound of how far held forces change the first harmonic of solutions z (points, nh, nj) in m, (points,).

    Relative to the largest joint. The means move from where they are by δ, δ + C (N(δ) − N(0)) = C R, with N the mean
    forces of the laws without memory, C the static compliance with these joints open and R the held force, one joint
    and sign at a time, and the changes add. The motion follows by Newton steps with the tangents of the solution, of
    first order alone where these do not settle. 0 where no slider sticks or all else is linear; nan where a receptance
    is not known at rest or no mean balances.

    Parameters
    ----------
    own
        The harmonics of z.
    """
    laws = [_Parts.of(assembly.standing[i]) for i in assembly.nonlinear]
    sliders = [j for j, part in enumerate(laws) if part.remembering.laws]
    out = np.zeros(len(omega))
    slow = np.array([_BARELY * np.min(omega)])
    if not np.all(reached(assembly.machine, slow, (1,))):
        return np.full(len(omega), np.nan)
    coordinates = assembly.coordinates
    C = (coordinates.T @ assembly.at(slow).Hzz[0] @ coordinates.T.T).real
    first = own.index(1)
    A = np.abs(z[:, first])
    mean = z[:, own.index(0)].real if 0 in own else np.zeros_like(A)
    balance = Balance.of(assembly, omega, force, own)
    start = coordinates.of_motions(z)
    forces = balance.forces(start, _SAMPLES)
    J, left = balance.jacobian(forces), balance.residual(start, forces.force)
    size = np.maximum(np.max(A, axis=1), 1e-300)

    def moved(
        to: ComplexArray, g: ComplexArray, j: int, sign: float, aside: Array | None = None
    ) -> tuple[ComplexArray, Array]:
        """The chord step from motions to which joint j holds what it may, and how far it puts the means aside."""
        in_time()
        Z = coordinates.motions(to)[:, first]
        A, pull = np.abs(Z), np.zeros(Z.shape)
        pull[:, j] = sign * held_force(laws[j].remembering, A[:, j], float(np.median(omega)))
        aside = _aside(laws, C, A, omega, mean, pull, aside)
        change = g.copy()
        for k, part in enumerate(laws):
            change[:, first, k] += part.change(A[:, k], omega, mean[:, k], aside[:, k]) * Z[:, k]
        return solve_complex(J, left - balance.residual(to, change)), aside

    for j in sliders:
        change = np.zeros(len(omega))
        for sign in (-1.0, 1.0):
            step, aside = moved(start, forces.force, j, sign)
            to = start + step
            once = np.max(np.abs(coordinates.motions((to - start)[:, first])), axis=1)
            for _ in range(_CHORDS):
                step, aside = moved(to, balance.forces(to, _SAMPLES, slopes=False).force, j, sign, aside)
                length = np.max(np.abs(step), axis=(1, 2)) / size
                to = to + step / np.maximum(1.0, length / _LONGEST)[:, None, None]
            far = np.max(np.abs(coordinates.motions((to - start)[:, first])), axis=1)
            settled = np.max(np.abs(step), axis=(1, 2)) <= 0.1 * far
            change = np.maximum(change, np.where(settled, far, once) / size)
        out += change
    return out


def held_force(joint: Joint, amplitude: Array, omega: float) -> Array:
    """Largest mean force in N that a joint with memory may hold while it vibrates by amplitudes (m) about 0.

    The law is stepped: slowly aside by a thousand amplitudes and back, then through cycles; the
    mean force of the last is what stays. An elastic slider of stiffness k and slip force S holds S − kA, or nothing
    once it slips.
    """
    A = np.asarray(amplitude, dtype=float)
    angle = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    state, total = joint.initial_state(np.zeros_like(A)), np.zeros_like(A)
    for place in (_PUSH * A, A):
        _, state = joint.step(Motion(place, np.zeros_like(A), SLOW), state)
    for n in range(_CYCLES):
        for theta in angle:
            motion = Motion(A * np.cos(theta), -omega * A * np.sin(theta), 2 * np.pi / _SAMPLES / omega)
            found, state = joint.step(motion, state)
            total += found if n == _CYCLES - 1 else 0.0
    return np.asarray(np.abs(total) / _SAMPLES)


@dataclass(frozen=True)
class _Parts:
    """The laws of a joint with memory, and those without."""

    remembering: Joint
    rest: Joint
    bends: bool
    """Whether what does not remember has a gain that the mean can change."""

    @classmethod
    def of(cls, joint: Joint) -> _Parts:
        remembering, rest = joint.parted(lambda law: bool(law.states) and not law.linear)
        return cls(remembering, rest, bool(rest.laws) and not is_linear(rest))

    def mean(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        """Mean force in N of what does not remember."""
        if not self.rest.laws:
            return np.zeros_like(amplitude)
        return np.asarray(self.rest.first_harmonic(amplitude, omega, bias).mean)

    def change(self, amplitude: Array, omega: Array, mean: Array, aside: Array) -> ComplexArray:
        """What a mean moved aside makes of the gain, N/m."""
        if not self.bends:
            return np.zeros(len(amplitude), dtype=complex)
        after, before = (self.rest.first_harmonic(amplitude, omega, place).gain for place in (mean + aside, mean))
        return np.asarray(after - before)


def _aside(
    laws: list[_Parts], C: Array, A: Array, omega: Array, mean: Array, pull: Array, near: Array | None = None
) -> Array:
    """δ of all joints in m, (points, nj), under held forces ``pull`` (N); nan where it does not settle.

    The force rises in steps from nothing, which tells one balance from others; from ``near``, the balance at motions
    nearly the same, none is needed.
    """
    if near is not None and np.all(np.isfinite(near)):
        aside, settled = _balanced(laws, C, A, omega, mean, pull, near, 1)
        if np.all(settled):
            return aside
    aside, settled = _balanced(laws, C, A, omega, mean, pull, np.zeros_like(A), _RAMP)
    return np.where(settled[:, None], aside, np.nan)


def _balanced(
    laws: list[_Parts], C: Array, A: Array, omega: Array, mean: Array, pull: Array, aside: Array, ramp: int
) -> tuple[Array, Mask]:
    """δ from where it starts, with the held forces in so many steps, and whether it settled."""
    beside = np.array([0.0, 1.0, -1.0])[:, None, None]
    A3, omega3 = np.tile(A, (3, 1)), np.tile(omega, 3)

    def carried(place: Array) -> Array:
        """Mean forces at places (3, points, nj)."""
        flat = place.reshape(A3.shape)
        return np.stack([part.mean(A3[:, k], omega3, flat[:, k]) for k, part in enumerate(laws)], 1).reshape(
            place.shape
        )

    nudge = 1e-4 * np.maximum(A, 1e-3 * np.max(A, axis=1, keepdims=True))
    at_rest = carried(mean + 0.0 * beside)[0]
    length = np.full(len(A), np.inf)
    for share in np.arange(1, ramp + 1) / ramp:
        for _ in range(_STEPS):
            here, up, down = carried(mean + aside + nudge * beside)
            K = (up - down) / (2 * nudge)
            left = aside + (here - at_rest - share * pull) @ C.T
            step = solve_each(np.eye(len(C)) + C * K[:, None, :], -left[:, :, None])[:, :, 0]
            aside = aside + step
            length = np.max(np.abs(step), axis=1)
            if np.all(length <= _SETTLED * np.maximum(np.max(nudge, axis=1), np.max(np.abs(aside), axis=1))):
                break
    return aside, length <= 1e-3 * np.max(np.abs(aside), axis=1) + _SETTLED * np.max(A, axis=1)
