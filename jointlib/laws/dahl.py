"""Dahl friction: elastic presliding that passes smoothly into sliding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import JointLaw, Motion
from jointlib.laws import play
from jointlib.laws.bouc_wen import loop_harmonic, loop_kinks
from jointlib.parameter import Role, parameter

_SERIES_BELOW = 0.1


@dataclass(frozen=True)
class Dahl(JointLaw):
    """df/dz = stiffness·(1 − f·sign(ż)/slip_force): slip that sets in gradually (Dahl 1976, exponent 1).

    The return map is exact for any path that is monotone between steps: with L = slip_force/stiffness, q = f/slip_force
    goes to s + (q − s)·e^(−abs(Δz)/L), s = sign Δz. With a ``clearance`` (half the play in series) the element sees
    no load and no motion while the joint crosses the play.
    """

    stiffness: float = parameter("N/m", role=Role.STIFFNESS, above=0.0)
    slip_force: float = parameter("N", role=Role.SLIP_FORCE, above=0.0)
    clearance: float = parameter("m", role=Role.CLEARANCE, lower=0.0, default=0.0)

    kind: ClassVar[str] = "dahl"
    by_turns: ClassVar[bool] = True
    states: ClassVar[tuple[str, ...]] = ("position", "stretch")

    def initial_state(self, displacement: Array) -> Array:
        """Unloaded, in the middle of the play."""
        return play.virgin(displacement)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        length = self.slip_force / self.stiffness
        move, q = motion.displacement - state[..., 0], state[..., 1]
        gap: float | Array = 0.0
        if not play.is_absent(self.clearance):
            q, gap = play.split(q, self.clearance)
            side, to_zero = self._unloading(move, q)
            lost = side * play.swallowed(side, np.abs(move), to_zero, gap, self.clearance)
            move, gap = move - lost, gap + lost
        q = q / length
        decay = np.expm1(-np.abs(move) / length)
        q = q + q * decay + np.copysign(decay, move)
        return self.slip_force * q, play.remembered(motion.displacement, length * q + gap)

    def _unloading(self, move: Array, deflection: Array) -> tuple[Array, Array]:
        """Sign of the motion, and the travel that unloads the element: L·ln(1 + abs(q)) where it is loaded against."""
        length, side = self.slip_force / self.stiffness, np.sign(move)
        return side, length * np.log1p(np.maximum(-side * deflection, 0.0) / length)

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        force, _ = self.step(motion, state)
        move = motion.displacement - state[..., 0]
        stiffness = self.stiffness * (1 - np.sign(move) * force / self.slip_force)
        if not play.is_absent(self.clearance):
            q, gap = play.split(state[..., 1], self.clearance)
            side, to_zero = self._unloading(move, q)
            stiffness = np.where(play.is_free(side, np.abs(move), to_zero, gap, self.clearance), 0.0, stiffness)
        return stiffness, np.zeros_like(stiffness)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        A = np.broadcast_arrays(amplitude, omega, bias)[0]
        return loop_kinks(self.stiffness, self.slip_force, 1.0, 0.0, self.clearance, A)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """The steady branch down is f/slip_force = e^(z/L)/cosh a − 1, a = A/L, so with Bessel functions I

        G = stiffness·[2 I₁(a)/(a cosh a) + j (4/(π a))(1 − tanh(a)/a)]. With a clearance: as a Bouc–Wen loop.
        """
        A = broadcast(amplitude, omega, bias)[0]
        if self.clearance:
            return loop_harmonic(self.stiffness, self.slip_force, 1.0, 0.0, self.clearance, A)
        length = self.slip_force / self.stiffness
        a = np.maximum(A / length, 1e-12)
        cosh = (1 + np.exp(-2 * a)) / 2
        real = 2 * scipy.special.i1e(a) / (a * cosh)
        d_real = 2 * (scipy.special.ive(2, a) - scipy.special.i1e(a) * np.tanh(a)) / (a * cosh)
        imag, d_imag = _loss(a)
        gain = self.stiffness * (real + 1j * imag)
        return closed_form(gain, self.stiffness / length * (d_real + 1j * d_imag), 0.0, 0.0, A.shape)


def _loss(a: Array) -> tuple[Array, Array]:
    """(4/(π a))(1 − tanh(a)/a) and its derivative; as a series where that cancels."""
    small = a < _SERIES_BELOW
    x = np.where(small, 1.0, a)
    t = np.tanh(x)
    direct = (1 - t / x) / x
    d_direct = -1 / x**2 + 2 * t / x**3 - (1 - t**2) / x**2
    y = np.where(small, a, 0.0)
    terms = np.array([1 / 3, -2 / 15, 17 / 315, -62 / 2835, 1382 / 155925])
    powers = np.arange(1, 10, 2)
    series = np.sum(terms * y[..., None] ** powers, axis=-1)
    d_series = np.sum(terms * powers * y[..., None] ** (powers - 1), axis=-1)
    return 4 / np.pi * np.where(small, series, direct), 4 / np.pi * np.where(small, d_series, d_direct)
