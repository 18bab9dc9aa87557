"""The machine with its nonlinear joints open or at rest as one sum over poles: cheap at one line and at thousands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..components.mode_sum import ModeSum, Motions, Residues
from ..coupling.second_order import machine_equations
from ..model.machine import Machine
from .view import View

_PROBE = np.array([1.0, 1e3, 1e5])
_SAME = 1e-13
_AGREES = 1e-9
_SLOW, _FAST = 1e-2, 5.0
"""Of the ends of the range: where means are balanced, and a further harmonic."""


@dataclass(frozen=True, eq=False)
class LinearPart:
    """H(ω) in m/N between motions and forces, held joints coupled (k + jωc in M p̈ + C ṗ + K p = Φᵀ f)."""

    joints: Residues
    """From the coordinates of the nonlinear joints and then the inputs to these coordinates."""
    seen: Array
    """Rows of all joints and then of the outputs over the modes."""
    acting: Array
    """Those of the coordinates of the nonlinear joints and then of the inputs."""

    @cached_property
    def motions(self) -> Residues:
        """From the same to all joints and then the outputs."""
        return self.joints.poles.in_modes(self.seen, self.acting)

    @cached_property
    def _under(self) -> Motions:
        return self.joints.poles.under(self.seen, self.acting)

    def moved(self, omega: Array, force: ComplexArray) -> ComplexArray:
        """Motions of all joints and then of the outputs in m, (nf, motions), under such forces in N, (nf, forces)."""
        return self._under.at(omega, force)

    @classmethod
    def of(
        cls,
        machine: Machine,
        held: Sequence[int],
        gain: Callable[[Array], ComplexArray],
        ports: Array,
        motions: Array,
        inputs: Array,
    ) -> LinearPart | None:
        """From rows over the dofs; None where a part has no such equations or the sum would lose accuracy.

        ``held`` are the joints to be coupled, by their place in `Machine.flexible`, ``gain`` theirs in N/m at
        frequencies, (nf, held).
        """
        if any(component.second_order() is None for component in machine.components):
            return None
        try:
            equations = machine_equations(machine)
        except InputError:
            return None
        M, C, K = equations.mass, equations.damping, equations.stiffness
        if held:
            coefficients = _coefficients(gain(_PROBE))
            if coefficients is None:
                return None
            (k, c), B = coefficients, equations.joints[list(held)]
            K, C = K + B.T @ (k[:, None] * B), C + B.T @ (c[:, None] * B)
        poles = ModeSum.of(M, C, K)
        if poles is None:
            return None
        rows, seen, driven = (part @ equations.shapes @ poles.shapes for part in (ports, motions, inputs))
        acting = np.concatenate([rows, driven])
        return cls(poles.in_modes(rows, acting), seen, acting)

    def agrees(self, view: Callable[[Array], View], low: float, high: float) -> bool:
        """Whether it is what a view of the machine says between two frequencies (rad/s), next to resonances as well,
        and far below and above; of motions where the view tells them."""
        poles = self.joints.poles
        size = np.sort(np.abs(np.concatenate([poles.pairs, poles.real])))
        inside = size[(low < size) & (size < high)]
        picked = inside[[0, len(inside) // 2, -1]] if len(inside) else inside
        omega = np.unique(np.concatenate([1.001 * picked, 0.7 * picked, [_SLOW * low, low, high, _FAST * high]]))
        # Free bodies move by 1/ω², and what rounding makes of their differences grows alike.
        known, most = view(omega), _AGREES * (1 + (low / omega[:, None, None]) ** 2)
        for left, right in ((known.Hzz, known.Hzf), (known.Hoz, known.Hof)):
            H = np.concatenate([left, right], axis=2)
            if not H.size:
                continue
            part = self.joints if left is known.Hzz else self.motions
            apart, size = np.abs(part.at(omega) - H), np.abs(H)
            # An entry is measured by the largest of its row and of its column.
            own = np.sqrt(
                np.max(size, axis=1, keepdims=True, initial=0.0) * np.max(size, axis=2, keepdims=True, initial=0.0)
            )
            if not np.all(apart <= most * own):
                return False
        return True


def _coefficients(gain: ComplexArray) -> tuple[Array, Array] | None:
    """Stiffness in N/m and damping in N s/m of joints with these gains at the probes, (probes, joints); None where one
    is not k + jωc."""
    k, c = gain[0].real, gain[-1].imag / _PROBE[-1]
    same = np.abs(gain - (k + 1j * _PROBE[:, None] * c)) <= _SAME * np.abs(gain)
    return (k, c) if np.all(same) else None
