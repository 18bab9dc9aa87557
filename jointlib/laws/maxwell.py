"""Maxwell element: a joint that holds for a short time and creeps for a long one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import JointLaw, Motion
from jointlib.laws import play
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Maxwell(JointLaw):
    """Spring and damper in series, df/dt = stiffness·(ż − f/damping): a force held relaxes over τ = damping/stiffness.

    A damper far below the corner frequency 1/(2πτ), a spring far above it; in between it is lossy (Maxwell 1867; grease
    films, rubber, adhesives). A step is exact where z is linear between samples, of second order in its length
    otherwise, and elastic where it has no duration.
    """

    stiffness: float = parameter("N/m", role=Role.STIFFNESS, above=0.0)
    damping: float = parameter("N s/m", role=Role.DAMPING, above=0.0)

    kind: ClassVar[str] = "maxwell"
    linear: ClassVar[bool] = True
    states: ClassVar[tuple[str, ...]] = ("position", "stretch")

    def initial_state(self, displacement: Array) -> Array:
        """Relaxed where the joint is."""
        return play.virgin(displacement)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        forgotten, followed = self._course(motion.duration)
        # In this form a step without duration is the spring alone, to the last bit.
        stretch = state[..., 1] - forgotten * state[..., 1] + followed * (motion.displacement - state[..., 0])
        return self.stiffness * stretch, play.remembered(motion.displacement, stretch)

    def along(self, displacement: Array, velocity: Array, time_step: float) -> Array:
        """All steps at once: the stretch is a recursion of first order over the travels."""
        forgotten, followed = (np.broadcast_to(x, displacement.shape[1:]) for x in self._course(time_step))
        travel, stretch = np.diff(displacement, axis=0, prepend=displacement[:1]), np.empty(displacement.shape)
        for at in np.ndindex(forgotten.shape):
            here = (slice(None), *at)
            band = np.vstack([np.ones(len(travel)), np.full(len(travel), forgotten[at] - 1.0)])
            stretch[here] = scipy.linalg.solve_banded((1, 0), band, followed[at] * travel[here])
        return self.stiffness * stretch

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        stiffness = self.stiffness * self._course(motion.duration)[1] + 0.0 * motion.displacement
        return stiffness, np.zeros_like(stiffness)

    def _course(self, duration: float | Array) -> tuple[Array, Array]:
        """Over a step of so many seconds: the share of the stretch that is lost, 1 − e^(−x) with x = duration/τ, and
        the share of an even travel that is stretch at its end, (1 − e^(−x))/x."""
        x = np.asarray(duration * self.stiffness / self.damping, dtype=float)
        forgotten = -np.expm1(-x)
        return forgotten, np.divide(forgotten, x, out=np.ones_like(x), where=x > 0)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = stiffness·jωτ/(1 + jωτ), at any amplitude."""
        A, w, _ = broadcast(amplitude, omega, bias)
        tau = self.damping / self.stiffness
        creep = 1 / (1 + 1j * w * tau)
        shape = np.broadcast_shapes(A.shape, np.shape(tau))
        return closed_form(1j * w * self.damping * creep, 0.0, 1j * self.damping * creep**2, 0.0, shape)
