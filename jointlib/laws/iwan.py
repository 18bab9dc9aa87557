"""Iwan model: several Jenkins elements in parallel, which slip one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import JointLaw, Motion
from jointlib.laws.jenkins import Jenkins
from jointlib.parameter import Role, parameter
from jointlib.pieces import dragged


@dataclass(frozen=True)
class Iwan(JointLaw):
    """f = Σ clip(stiffness[i]·(z − s[i]), ±slip_force[i]): gradual slip, one slider after the other (Iwan 1966).

    Exact for any path that is monotone between steps; follows Masing's rule. With a ``clearance`` (half the play)
    every element takes load only past it, as in a Jenkins element.
    """

    stiffness: tuple[float, ...] = parameter("N/m", role=Role.STIFFNESS, above=0.0, listed=True)
    slip_force: tuple[float, ...] = parameter("N", role=Role.SLIP_FORCE, lower=0.0, listed=True)
    clearance: float = parameter("m", role=Role.CLEARANCE, lower=0.0, default=0.0)

    kind: ClassVar[str] = "iwan"
    by_turns: ClassVar[bool] = True
    states: ClassVar[tuple[str, ...]] = ("slider",)

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.stiffness)
        if len(self.slip_force) != count:
            raise InputError(f"iwan: {len(self.slip_force)} entries of slip_force, expected {count}, as of stiffness")
        # One slider an element: the names belong to the object here.
        object.__setattr__(self, "states", tuple(f"slider[{i}]" for i in range(count)))

    def elements(self) -> Iterator[Jenkins]:
        """The Jenkins elements that add up to it."""
        for k, F in zip(self.stiffness, self.slip_force, strict=True):
            yield Jenkins(k, F, self.clearance)

    def initial_state(self, displacement: Array) -> Array:
        """Virgin sliders sit where the joint is."""
        return np.repeat(np.asarray(displacement, dtype=float)[..., None], len(self.stiffness), axis=-1)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        z, total, after = motion.displacement, None, []
        for i, (k, F) in enumerate(zip(self.stiffness, self.slip_force, strict=True)):
            reach = F / k + self.clearance
            stretch = np.minimum(np.maximum(z - state[..., i], -reach), reach)
            after.append(z - stretch)
            if not (isinstance(self.clearance, float) and self.clearance == 0.0):
                stretch = stretch - np.minimum(np.maximum(stretch, -self.clearance), self.clearance)
            total = k * stretch if total is None else total + k * stretch
        sliders = np.empty((*np.shape(after[0]), len(after)))
        for i, s in enumerate(after):
            sliders[..., i] = s
        return np.asarray(total), sliders

    def states_after(self, begin: Array, z: Array, v: Array, time_step: float) -> Array:
        """All steps at once, see :func:`jointlib.pieces.dragged`."""
        reach = (F / k + self.clearance for k, F in zip(self.stiffness, self.slip_force, strict=True))
        return np.stack([dragged(z, r, begin[..., i]) for i, r in enumerate(reach)], axis=-1)

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        parts = [e.jacobian(motion, state[..., i : i + 1])[0] for i, e in enumerate(self.elements())]
        stiffness = np.asarray(sum(parts))
        return stiffness, np.zeros_like(stiffness)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        return np.concatenate([e.kink_angles(amplitude, omega, bias) for e in self.elements()], axis=-1)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """The sum over the elements, each in closed form; with a clearance by quadrature."""
        total = closed_form(0.0, 0.0, 0.0, 0.0, broadcast(amplitude, omega, bias)[0].shape)
        for element in self.elements():
            total = total + element.first_harmonic(amplitude, omega, bias)
        return total
