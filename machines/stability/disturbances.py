"""Whether small disturbances of a vibration die out, wherever that can be known and is worth its price."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint

from ..coupling.second_order import MachineEquations, machine_equations
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.harmonics import is_odd, jumps
from ..model.machine import Machine
from ..operating.branches import Stability
from .hill import grows, growth
from .monodromy import Poised, largest_multiplier

_SMOOTH, _REMEMBERING = 128, 256
"""Samples of a cycle."""
_MARGIN = 1e-5
AFFORDABLE = 3e10
"""Multiplications that a whole response may cost unasked: some ten seconds."""


@dataclass(frozen=True, eq=False)
class Disturbances:
    """The equations that small disturbances of a machine's vibrations obey."""

    equations: MachineEquations
    joints: tuple[Joint, ...]
    remembering: bool
    odd: bool

    @classmethod
    def of(cls, machine: Machine) -> Disturbances | str:
        """Those of a machine, or a sentence on why there are none."""
        for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
            for law in joint.laws:
                if not law.in_time:
                    return (
                        f"{connection.name}: {law.kind} exists in the frequency domain only, so stability is not told"
                    )
            if jumps(joint):
                return f"{connection.name}: its force jumps with the velocity, so stability beyond folds is not told"
        try:
            equations = machine_equations(machine)
        except InputError as error:
            return f"{error}, so stability beyond folds is not told"
        joints = machine.joints()
        return cls(equations, joints, any(joint.states for joint in joints), all(is_odd(joint) for joint in joints))

    def labels(self, z: ComplexArray, omega: Array, harmonics: Harmonics, error: Array) -> list[Stability]:
        """Of motions z in m, shape (points, nh, joints), at ω in rad/s, known but for these shares of them."""
        if self._by_hill(harmonics):
            found = grows(growth(self.equations, self.joints, z, omega, harmonics), omega)
            return [Stability.UNSTABLE if bad else Stability.STABLE for bad in found]
        poised = self._poised(z, omega, harmonics)
        fine = largest_multiplier(poised, z, omega, harmonics, self._samples)
        doubt = _MARGIN + error
        if self.remembering:
            # Between samples a slider may stop or start, which moves a multiplier by a share of a step.
            doubt += np.abs(fine - largest_multiplier(poised, z, omega, harmonics, self._samples // 2))
        return [
            Stability.UNSTABLE if size > 1 + d else Stability.STABLE if size < 1 - d else Stability.UNKNOWN
            for size, d in zip(fine, doubt, strict=True)
        ]

    def price(self, z: ComplexArray, omega: Array, harmonics: Harmonics) -> float:
        """Multiplications per point, roughly."""
        if self._by_hill(harmonics):
            return 100.0 * (2 * len(self.equations.mass) * len({*harmonics, *(-h for h in harmonics)})) ** 3
        poised = self._poised(z, omega, harmonics)
        m, r, size = 2 * len(poised.squared), len(poised.rows), poised.size
        return 1.5 * self._samples * size * (size * size + 4.0 * m * r + 500.0) + 25.0 * size**3

    @property
    def _samples(self) -> int:
        return _REMEMBERING if self.remembering else _SMOOTH

    def _by_hill(self, harmonics: Harmonics) -> bool:
        """One harmonic of joints that pull alike both ways: what folds of the describing functions agree with.

        A tangent of another joint varies at ω too, and that Hill's lowest block does not see.
        """
        return harmonics == (1,) and self.odd and not self.remembering

    def _poised(self, z: ComplexArray, omega: Array, harmonics: Harmonics) -> Poised:
        rest = z[0, -1].real if harmonics[-1] == 0 else np.zeros(len(self.joints))
        return Poised.of(self.equations, self.joints, float(np.max(omega)), rest)
