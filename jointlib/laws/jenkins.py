"""Jenkins element: a joint face that sticks elastically and then slips."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import JointLaw, Motion
from jointlib.parameter import Role, parameter
from jointlib.pieces import dragged


@dataclass(frozen=True)
class Jenkins(JointLaw):
    """Spring in series with a Coulomb slider: f = clip(stiffness·(z − s), ±slip_force), slider position s in m.

    The return map is exact for any path that is monotone between steps. With a ``clearance`` (half the play in
    series) the spring takes no load while its elongation lies within the play.
    """

    stiffness: float = parameter("N/m", role=Role.STIFFNESS, above=0.0)
    slip_force: float = parameter("N", role=Role.SLIP_FORCE, lower=0.0)
    clearance: float = parameter("m", role=Role.CLEARANCE, lower=0.0, default=0.0)

    kind: ClassVar[str] = "jenkins"
    by_turns: ClassVar[bool] = True
    states: ClassVar[tuple[str, ...]] = ("slider",)

    def initial_state(self, displacement: Array) -> Array:
        """The virgin slider sits where the joint is."""
        return np.array(displacement, dtype=float)[..., None]

    def _reach(self) -> float:
        """Largest elongation of play and spring together, m."""
        return self.slip_force / self.stiffness + self.clearance

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        reach = self._reach()
        # np.clip costs three times as much.
        stretch = np.minimum(np.maximum(motion.displacement - state[..., 0], -reach), reach)
        return self._pull(stretch), (motion.displacement - stretch)[..., None]

    def states_after(self, begin: Array, z: Array, v: Array, time_step: float) -> Array:
        """All steps at once, see :func:`jointlib.pieces.dragged`."""
        return dragged(z, self._reach(), begin[..., 0])[..., None]

    def _pull(self, stretch: Array) -> Array:
        """Force of an elongation of play and spring together."""
        if isinstance(self.clearance, float) and self.clearance == 0.0:
            return self.stiffness * stretch
        return self.stiffness * (np.sign(stretch) * np.maximum(np.abs(stretch) - self.clearance, 0.0))

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        stretch = np.abs(motion.displacement - state[..., 0])
        stuck = (stretch < self._reach()) & (stretch >= self.clearance)
        return np.where(stuck, self.stiffness, 0.0), np.zeros_like(stretch)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        """After each reversal the spring unloads, crosses the play and slips, at fixed travels from the reversal."""
        A = np.broadcast_arrays(amplitude, omega, bias)[0]
        reach = self._reach()
        first = np.minimum(reach, A)
        travels = (first - self.clearance, first + self.clearance, 2 * reach + 0 * A)
        cosines = [1 - np.maximum(t, 0) / np.maximum(A, 1e-300) for t in travels]
        angles = [np.arccos(np.clip(c, -1, 1)) for c in cosines]
        return np.stack([*angles, *(np.pi + a for a in angles)], axis=-1)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Masing loop, a = slip_force/(stiffness·A) < 1, ψ = arccos(1 − 2a):

        Re G = (stiffness/π)(ψ − ½ sin 2ψ), Im G = 4 slip_force (A − slip_force/stiffness)/(πA²); stuck: G = stiffness.
        With a clearance: by quadrature.
        """
        if self.clearance:
            return super().first_harmonic(amplitude, omega, bias)
        A, _, _ = broadcast(amplitude, omega, bias)
        slip = self.slip_force / self.stiffness
        slides = slip < A
        size = np.where(slides, A, 1.0)
        a = np.where(slides, slip / size, 1.0)
        psi = np.arccos(1 - 2 * a)
        gain = self.stiffness * ((psi - np.sin(2 * psi) / 2) / np.pi + 4j / np.pi * a * (1 - a))
        # d/da of the real part is (4/π)√... via dψ/da = 1/√(a(1−a)) and 1 − cos 2ψ = 8a(1−a).
        by_a = self.stiffness * (8 / np.pi * np.sqrt(a * (1 - a)) + 4j / np.pi * (1 - 2 * a))
        slope = np.where(slides, -a / size * by_a, 0.0)
        return closed_form(gain, slope, 0.0, 0.0, A.shape)
