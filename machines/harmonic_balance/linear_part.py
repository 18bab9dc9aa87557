"""The machine with its nonlinear joints open or at rest as one sum over poles: cheap at one line and at thousands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..components.mode_sum import ModeSum, Motions, Residues
from ..coupling.parts import Parts
from ..coupling.second_order import MachineEquations, machine_equations
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
        found = equations_of(machine, held, gain)
        poles = None if found is None else ModeSum.of(found.mass, found.damping, found.stiffness)
        if found is None or poles is None:
            return None
        rows, seen, driven = (part @ found.shapes @ poles.shapes for part in (ports, motions, inputs))
        acting = np.concatenate([rows, driven])
        return cls(poles.in_modes(rows, acting), seen, acting)

    def agrees(self, view: Callable[[Array], View], low: float, high: float) -> bool:
        """Whether it is what a view of the machine says; of motions where the view tells them (`agree`)."""
        poles = self.joints.poles
        size = np.sort(np.abs(np.concatenate([poles.pairs, poles.real])))
        return agree(size, (self.joints.at, lambda omega: self.motions.at(omega)), view, low, high)


def parts_of(
    machine: Machine,
    held: Sequence[int],
    gain: Callable[[Array], ComplexArray],
    rows: tuple[Array, Array, Array],
    view: Callable[[Array], View],
    swept: tuple[float, float],
) -> Parts | None:
    """The machine taken apart at its nonlinear joints; None where that does not pay or is not what a view says.

    Arguments are those of `LinearPart`; ``rows`` over the dofs are of the nonlinear joints, the inputs and all motions.
    """
    found = equations_of(machine, held, gain)
    if found is None:
        return None
    parts = Parts.of((found.mass, found.damping, found.stiffness), *(part @ found.shapes for part in rows))
    return parts if parts is not None and agree(parts.sizes, (parts.full, parts.motions_at), view, *swept) else None


def equations_of(
    machine: Machine, held: Sequence[int], gain: Callable[[Array], ComplexArray]
) -> MachineEquations | None:
    """Equations of motion with the held joints of these gains coupled in; None where a part or a joint has none."""
    if any(component.second_order() is None for component in machine.components):
        return None
    try:
        equations = machine_equations(machine)
    except InputError:
        return None
    if not held:
        return equations
    coefficients = _coefficients(gain(_PROBE))
    if coefficients is None:
        return None
    (k, c), B = coefficients, equations.joints[list(held)]
    K, C = (part + B.T @ (each[:, None] * B) for part, each in ((equations.stiffness, k), (equations.damping, c)))
    return replace(equations, stiffness=K, damping=C)


Receptances = Callable[[Array], ComplexArray]
"""At angular frequencies, (nf, motions, forces)."""


def agree(
    sizes: Array, sums: tuple[Receptances, Receptances], view: Callable[[Array], View], low: float, high: float
) -> bool:
    """Whether sums over poles of these sizes (1/s, ascending) are what a view of the machine says between two
    frequencies (rad/s), next to resonances as well, and far below and above.

    The first is of the nonlinear joints, the second of all motions, where the view tells them; forces are those of
    these joints and then the inputs.
    """
    inside = sizes[(low < sizes) & (sizes < high)]
    picked = inside[[0, len(inside) // 2, -1]] if len(inside) else inside
    omega = np.unique(np.concatenate([1.001 * picked, 0.7 * picked, [_SLOW * low, low, high, _FAST * high]]))
    # Free bodies move by 1/ω², and what rounding makes of their differences grows alike.
    known, most = view(omega), _AGREES * (1 + (low / omega[:, None, None]) ** 2)
    for receptances, left, right in zip(sums, (known.Hzz, known.Hoz), (known.Hzf, known.Hof), strict=True):
        H = np.concatenate([left, right], axis=2)
        if not H.size:
            continue
        apart, size = np.abs(receptances(omega) - H), np.abs(H)
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
