"""The machine with its nonlinear joints open as one sum over poles: cheap at one frequency and at thousands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint

from ..components.mode_sum import ModeSum, Residues
from ..coupling.second_order import machine_equations
from ..model.machine import Machine

if TYPE_CHECKING:
    from .assembly import View

_PROBE = np.array([1.0, 1e3, 1e5])
_SAME = 1e-13
_AGREES = 1e-9
_SLOW, _FAST = 1e-2, 5.0
"""Of the ends of the range: where means are balanced, and a further harmonic."""


@dataclass(frozen=True, eq=False)
class LinearPart:
    """H(ω) in m/N between motions and forces, all linear joints coupled (k + jωc in M p̈ + C ṗ + K p = Φᵀ f)."""

    joints: Residues
    """From the coordinates of the nonlinear joints and then the inputs to these coordinates."""
    motions: Residues
    """From the same to all joints and then the outputs."""
    ports: int
    """Number of these coordinates."""

    @classmethod
    def of(
        cls, machine: Machine, linear: dict[int, Joint], ports: Array, motions: Array, inputs: Array
    ) -> LinearPart | None:
        """From rows over the dofs; None where a part has no such equations or the sum would lose accuracy.

        ``linear`` are the joints to be coupled, by their place in `Machine.flexible`.
        """
        if any(component.second_order() is None for component in machine.components):
            return None
        try:
            equations = machine_equations(machine)
        except InputError:
            return None
        M, C, K = equations.mass, equations.damping, equations.stiffness
        if linear:
            known = {id(joint): _coefficients(joint) for joint in linear.values()}
            found = [known[id(joint)] for joint in linear.values()]
            if not all(found):
                return None
            B = equations.joints[list(linear)]
            k, c = np.array(found, dtype=float).T
            K, C = K + B.T @ (k[:, None] * B), C + B.T @ (c[:, None] * B)
        poles = ModeSum.of(M, C, K)
        if poles is None:
            return None
        rows, seen, driven = (part @ equations.shapes for part in (ports, motions, inputs))
        forces = np.concatenate([rows, driven])
        return cls(poles.between(rows, forces), poles.between(seen, forces), len(ports))

    def agrees(self, view: Callable[[Array], View], low: float, high: float) -> bool:
        """Whether it is what a view of the machine says between two frequencies (rad/s), next to resonances as well,
        and far below and above."""
        poles = self.joints.poles
        size = np.sort(np.abs(np.concatenate([poles.pairs, poles.real])))
        inside = size[(low < size) & (size < high)]
        picked = inside[[0, len(inside) // 2, -1]] if len(inside) else inside
        omega = np.unique(np.concatenate([1.001 * picked, 0.7 * picked, [_SLOW * low, low, high, _FAST * high]]))
        # Free bodies move by 1/ω², and what rounding makes of their differences grows alike.
        known, most = view(omega), _AGREES * (1 + (low / omega[:, None, None]) ** 2)
        for part, left, right in ((self.joints, known.Hzz, known.Hzf), (self.motions, known.Hoz, known.Hof)):
            H = np.concatenate([left, right], axis=2)
            apart, size = np.abs(part.at(omega) - H), np.abs(H)
            # An entry is measured by the largest of its row and of its column.
            own = np.sqrt(
                np.max(size, axis=1, keepdims=True, initial=0.0) * np.max(size, axis=2, keepdims=True, initial=0.0)
            )
            if not np.all(apart <= most * own):
                return False
        return True


def _coefficients(joint: Joint) -> tuple[float, float] | None:
    """Stiffness in N/m and damping in N s/m of a linear joint; None where its gain is not k + jωc."""
    gain = joint.first_harmonic(np.zeros(len(_PROBE)), _PROBE).gain
    k, c = float(gain[0].real), float(gain[-1].imag / _PROBE[-1])
    same = np.abs(gain - (k + 1j * _PROBE * c)) <= _SAME * np.abs(gain)
    return (k, c) if np.all(same) else None
