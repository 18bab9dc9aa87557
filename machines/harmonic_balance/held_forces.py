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

from ..blocks import blocks
from ..deadline import in_time
from ..indices import Index
from ..solved import solve_each
from ..statics.asked_together import asked_together
from ..statics.mean_force import SLOW
from .aside import Laws, raised
from .assembly import Assembly
from .balance import Balance
from .cycle import Harmonics
from .frequency_reach import reached

_SAMPLES, _CYCLES = 64, 30
_PUSH = 1e3
"""Amplitudes by which a slider was pushed aside before."""
_BARELY = 1e-2
"""Of the lowest frequency: slow enough for inertia not to matter."""
_CHORDS = 8
_LONGEST = 0.5
"""Of the largest joint's motion, a chord."""
_FINE = 1e-4
"""Of the change, a chord after which the next ones tell nothing more."""
_SHRINKS = 0.5
"""From one chord to the next; where it does not, the slopes at the solution tell too little."""
_STEPS = 12
_SETTLED = 1e-6


def can_hold(assembly: Assembly) -> bool:
    """Whether a joint remembers and another law, there or elsewhere, has a gain that the mean can change."""
    laws = Laws.of(assembly.standing[i] for i in assembly.nonlinear)
    return bool(laws.sliders) and bool(np.any(laws.bends))


def held_changes(assembly: Assembly, omega: Array, force: Array, z: ComplexArray, own: Harmonics) -> Array:
    """How far the force that a slider may hold changes the first harmonic of solutions z (points, nh, nj) in m.

    (sliders, points), a row for every joint that remembers; together they change it by their sum at most.

    Relative to the largest joint. The means move from where they are by δ, δ + C (N(δ) − N(0)) = C R, with N the mean
    forces of the joints, C the static compliance with these open and R the held force, one joint and sign at a time.
    The slider that holds R pulls with nothing else; the others that stick are springs, up to what
    they may hold beside the vibration. The motion follows by Newton steps with the tangents of the solution, of first
    order alone where these do not settle. 0 where no slider sticks or all else is linear; nan where a receptance is
    not known at rest or no mean balances.

    Parameters
    ----------
    own
        The harmonics of z.
    """
    slow = np.array([_BARELY * np.min(omega)])
    if not np.all(reached(assembly.machine, slow, (1,))):
        return np.full((1, len(omega)), np.nan)
    laws = Laws.of(assembly.standing[i] for i in assembly.nonlinear)
    around = _Around.of(assembly, laws, Balance.of(assembly, omega, force, own), z, slow)
    each = len(omega) * around.start[0].size * around.start.shape[2]
    # Both signs of a slider stay in one block.
    sliders = np.array(laws.sliders)
    changes = [around.changed(sliders[some]) for some in blocks(len(sliders), 2 * each)]
    return np.concatenate(changes)


def held_force(joint: Joint, amplitude: Array, omega: float) -> Array:
    """Largest mean force in N that a joint with memory may hold while it vibrates by amplitudes (m) about 0.

    The law is stepped: slowly aside by a thousand amplitudes and back, then through cycles; the
    mean force of the last is what stays. An elastic slider of stiffness k and slip force S holds S − kA, or nothing
    once it slips.
    """
    A = np.asarray(amplitude, dtype=float)
    angle = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    state = joint.initial_state(np.zeros_like(A))
    for place in (_PUSH * A, A):
        _, state = joint.step(Motion(place, np.zeros_like(A), SLOW), state)
    for _ in range(_CYCLES):
        begun, total = state, np.zeros_like(A)
        for theta in angle:
            motion = Motion(A * np.cos(theta), -omega * A * np.sin(theta), 2 * np.pi / _SAMPLES / omega)
            found, state = joint.step(motion, state)
            total += found
        if np.array_equal(begun, state):  # so is every cycle from now on
            break
    return np.asarray(np.abs(total) / _SAMPLES)


@dataclass(frozen=True, eq=False)
class _Around:
    """Solutions and what the machine makes of small changes there; arrays have one entry per point first."""

    laws: Laws
    balance: Balance
    start: ComplexArray
    """m, (points, nh, r)."""
    force: ComplexArray
    """Joint forces in N, (points, nh, nj)."""
    left: ComplexArray
    """What the solutions leave of the equations, m, (points, nh, r)."""
    inverse: Array
    """Of the Jacobian, (points, 2m, 2m)."""
    mean: Array
    """Where the joints stand, m, (points, nj)."""
    reference: Array
    """Stiffness in N/m that these joints are held by, (nj,): free bodies would outweigh all that is elastic."""
    compliance: Array
    """(I + C K)⁻¹ C in m/N with that stiffness, (nj, nj)."""
    back: Array
    """Inverse of I + that times (∂N/∂δ − K), (points, nj, nj)."""
    sticking: Array
    """What sliders add to ∂N/∂δ, N/m, (points, nj)."""

    @classmethod
    def of(cls, assembly: Assembly, laws: Laws, balance: Balance, z: ComplexArray, slow: Array) -> _Around:
        coordinates, own = assembly.coordinates, balance.harmonics
        # Line by line less is lost where free bodies move far.
        C = (coordinates.T @ assembly.by_components(slow).Hzz[0] @ coordinates.T.T).real
        start = coordinates.of_motions(z)
        forces = balance.forces(start, _SAMPLES)
        J = balance.jacobian(forces)
        A = np.abs(z[:, own.index(1)])
        mean = z[:, own.index(0)].real if 0 in own else np.zeros_like(A)
        one = np.broadcast_to(np.eye(J.shape[1]), J.shape)
        K, without = (laws.stiffness(A, balance.omega, mean, np.full(A.shape, kept)) for kept in (True, False))
        reference = np.maximum(np.mean(K, axis=0), 0.0)
        C = np.linalg.solve(np.eye(len(C)) + C * reference, C)
        still = np.broadcast_to(np.eye(len(C)), (len(A), *C.shape))
        back = solve_each(np.eye(len(C)) + C * (K - reference)[:, None, :], still)
        left = balance.residual(start, forces.force)
        return cls(laws, balance, start, forces.force, left, solve_each(J, one), mean, reference, C, back, K - without)

    def changed(self, sliders: Index) -> Array:
        """Largest relative change of the first harmonic by what each of these joints may hold, (sliders, points)."""
        points, coordinates = len(self.start), self.balance.coordinates
        joint = np.repeat(sliders, 2)  # both signs
        sign = np.tile([-1.0, 1.0], len(sliders))
        rows = np.tile(np.arange(points), len(joint))
        many, first = self.balance.at(rows), self.balance.harmonics.index(1)
        size = np.maximum(np.max(np.abs(coordinates.motions(self.start)[:, first]), axis=1), 1e-300)[rows]
        start, left = self.start[rows], self.left[rows]
        to, g, aside = start, self.force[rows], None
        once = far = np.zeros(len(rows))
        settled = np.zeros(len(rows), dtype=bool)
        for chord in range(_CHORDS + 1):
            in_time()
            Z = coordinates.motions(to)[:, first]
            pull = self._held(joint, sign, np.abs(Z))
            aside, gain = self._aside(np.abs(Z), rows, joint, pull, aside)
            bent = g.copy()
            bent[:, first] += gain * Z
            step = self._step(left - many.residual(to, bent))
            length = np.max(np.abs(step), axis=(1, 2))
            to = to + (step if chord == 0 else step / np.maximum(1.0, length / size / _LONGEST)[:, None, None])
            far = np.max(np.abs(coordinates.motions((to - start)[:, first])), axis=1)
            once = far if chord == 0 else once
            settled = length <= 0.1 * far
            if np.all(((length <= _FINE * far) & (chord > 0)) | (far <= _SETTLED * size)):
                break
            g = many.forces(to, _SAMPLES, slopes=False).force
        change = (np.where(settled, far, once) / size).reshape(len(sliders), 2, points)
        return np.asarray(np.max(change, axis=1))

    def _step(self, r: ComplexArray) -> ComplexArray:
        """The chord step in m that takes r away; rows are cases of all points, one case after another."""
        points = len(self.inverse)
        flat = r.reshape(-1, points, r[0].size)
        right = np.concatenate([flat.real, flat.imag], axis=2)
        x = np.moveaxis(self.inverse @ np.moveaxis(right, 0, 2), 2, 0)
        half = flat.shape[2]
        return np.asarray((x[:, :, :half] + 1j * x[:, :, half:]).reshape(r.shape))

    def _held(self, joint: Index, sign: Array, A: Array) -> Array:
        """Held forces in N at amplitudes A (rows, nj), of one joint in each case; (rows, nj)."""
        points = len(self.start)
        omega = float(np.median(self.balance.omega))
        each = A.reshape(len(joint), points, -1)[np.arange(len(joint)), :, joint]
        found = np.empty_like(each)
        for law, cases in asked_together([self.laws.remembering[j] for j in joint]):
            found[cases] = held_force(law, each[cases].T, omega).T
        pull = np.zeros((len(joint), points, A.shape[1]))
        pull[np.arange(len(joint)), :, joint] = sign[:, None] * found
        return pull.reshape(A.shape)

    def _aside(
        self, A: Array, rows: Index, joint: Index, pull: Array, near: Array | None
    ) -> tuple[Array, ComplexArray]:
        """δ in m under held forces (N), (rows, nj), nan where it does not settle; and what it makes of the gains.

        Chords with the slopes at the solution lead there where these hardly change on the way; elsewhere the force
        rises in steps from nothing, which tells one balance from others.
        """
        C, bends = self.compliance, self.laws.bends
        omega, mean = self.balance.omega[rows], self.mean[rows]
        kept = np.arange(A.shape[1]) != np.repeat(joint, len(self.start))[:, None]
        at_rest, gain = self.laws.carried(A, omega, mean, kept)
        aside = self._chord(-pull @ C.T, joint) if near is None else np.where(np.isfinite(near), near, 0.0)
        settled, before = np.zeros(len(A), dtype=bool), np.full(len(A), np.inf)
        going = np.ones(len(A), dtype=bool)
        pulled, bent = self.laws.carried(A, omega, mean + aside, kept)
        for _ in range(_STEPS):
            step = self._chord(aside + (pulled - at_rest - pull - aside * self.reference) @ C.T, joint)
            length = np.max(np.abs(step), axis=1)
            enough = _FINE * np.max(np.abs(aside), axis=1) + _SETTLED * np.max(A, axis=1)
            settled = going & (length <= enough)
            going &= length <= _SHRINKS * before
            if np.all(settled | ~going):
                break
            aside, before = np.where(going[:, None], aside + step, aside), length
            pulled, bent = self.laws.carried(A, omega, mean + aside, kept)
        lost = np.flatnonzero(~settled)
        if len(lost):
            part = A[lost], omega[lost], mean[lost], kept[lost]
            found, fine = raised(self.laws, C, self.reference, *part, pull[lost])
            aside[lost] = np.where(fine[:, None], found, np.nan)
            bent[lost] = self.laws.carried(*part[:2], mean[lost] + aside[lost], kept[lost])[1]
        return aside, np.where(bends, bent - gain, 0.0)

    def _chord(self, left: Array, joint: Index) -> Array:
        """The step of the means that takes ``left`` (rows, nj) away with the slopes at the solutions.

        These hold all sliders; that of the joint in each case is taken out again (Sherman and Morrison).
        """
        points = len(self.start)
        parts = np.moveaxis(left.reshape(-1, points, left.shape[1]), 0, 2)
        step = np.moveaxis(self.back @ parts, 2, 0)
        own = np.moveaxis(self.back @ self.compliance[:, joint], 2, 0)  # (cases, points, nj)
        case, k = np.arange(len(joint)), self.sticking[:, joint].T
        share = k * step[case, :, joint] / (1 - k * own[case, :, joint])
        return np.asarray(-(step + own * share[:, :, None]).reshape(left.shape))
