"""The machine as its nonlinear joints see it: everything linear coupled, one receptance between ports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from jointlib.joint import Joint

from ..coupling.coordinates import Coordinates
from ..coupling.coupling import joined
from ..coupling.joint_chain import JointChain
from ..coupling.parts import FEW, Parts
from ..model.limits import Limit, amplitude_limit
from ..model.machine import Machine
from ..statics.asked_together import Several, asked_together
from ..statics.bias import Biased, Drifting, Together, keeps_mean
from ..statics.working_point import at_working_point
from .linear_part import LinearPart, parts_of
from .newton import at_rest
from .view import View

_PROBE = np.geomspace(1e-10, 1e-1, 46)
_SINGULAR = 1e13
_TOGETHER = 32
"""Lines coupled at once, few enough for the receptances of a large machine to stay in the processor's cache."""
_PASSES = 4
"""Arrays as large as the Jacobian of a chain of joints, that should stay there together."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """What is needed to view a machine from its nonlinear joints, between given outputs and inputs.

    Rigid connections are locked and joints whose gain depends on no amplitude are coupled before anything
    nonlinear begins.
    """

    machine: Machine
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    swept: tuple[float, float] | None = None
    """Range in rad/s in which so many lines will be asked for that poles of the whole machine pay."""

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints, linear or not, in the order of `Machine.flexible`; under a static load about where they stand."""
        if self.biased is None:
            return self.standing
        joints = list(self.standing)
        if len(self.biased.members) == 1:
            i = self.biased.members[0]
            joints[i] = replace(joints[i], laws=(Drifting(self.biased),))
        return tuple(joints)

    @cached_property
    def standing(self) -> tuple[Joint, ...]:
        """All joints about where they stand under a static load, as if their means did not move."""
        return at_working_point(self.machine).joints()

    @cached_property
    def biased(self) -> Biased | None:
        """How the means of the nonlinear joints balance a static load; None without one."""
        if self.machine.static is None or not self.nonlinear:
            return None
        return Biased.of(self.machine, self.nonlinear, self.coordinates)

    @cached_property
    def moving(self) -> Sequence[Joint]:
        """The nonlinear joints, as the solvers take them."""
        joints = tuple(self.joints[i] for i in self.nonlinear)
        return Several(joints) if self.biased is None or len(joints) == 1 else Together(joints, self.biased)

    @cached_property
    def sampled(self) -> Several:
        """The nonlinear joints one by one, about where they stand."""
        return Several(tuple(self.joints[i] for i in self.nonlinear))

    @cached_property
    def carrying(self) -> Several:
        """The nonlinear joints as they carry a static load, from where nothing is loaded."""
        assert self.biased is not None
        return Several(tuple(mean.joint for mean in self.biased.means))

    @cached_property
    def nonlinear(self) -> tuple[int, ...]:
        """Indices of the joints whose gain depends on amplitude."""
        joints = self.standing
        resting = self.machine.static is None
        return tuple(i for i, joint in enumerate(joints) if not (is_linear(joint) and (resting or keeps_mean(joint))))

    @cached_property
    def limits(self) -> tuple[Limit, ...]:
        """Up to where each nonlinear joint may be used."""
        limits = tuple(amplitude_limit(self.joints[i]) for i in self.nonlinear)
        if self.biased is None or len(limits) != 1 or limits[0].amplitude <= self.biased.limit:
            return limits
        return (Limit(self.biased.limit, Outcome.NO_EQUILIBRIUM),)

    @cached_property
    def coordinates(self) -> Coordinates:
        """The independent ones of the nonlinear joints' motions."""
        return independent(self.machine, self.nonlinear)

    @cached_property
    def _rigid(self) -> Array:
        return self.machine.rows([c for c in self.machine.connections if c.rigid])

    def _free(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        """Receptance (nf, rows, columns) over the dofs, with rigid connections locked and every joint open."""
        locked = len(self._rigid)
        R, C = np.concatenate([self._rigid, rows]), np.concatenate([self._rigid, columns])
        H = np.zeros((len(omega), len(R), len(C)), dtype=complex)
        start = 0
        for component in self.machine.components:
            dofs = slice(start, start + len(component.dofs))
            i, k = (np.flatnonzero(np.any(part[:, dofs], axis=1)) for part in (R, C))
            if len(i) and len(k):
                H[:, i[:, None], k] += component.between(omega, R[i, dofs], C[k, dofs])
            start += len(component.dofs)
        if locked:
            self._check_lock(H[len(omega) // 2, :locked, :locked])
            z = slice(None, locked)
            H = joined(H[:, z, z], H[:, z, locked:], H[:, locked:, z], H[:, locked:, locked:], np.inf)
        return H

    @property
    def entries(self) -> int:
        """Of the largest array that one line needs: its receptances, or the Jacobian of the joints."""
        if self._parts:
            return _PASSES * self.tangent_entries(1)
        r, motions = len(self.coordinates.rows), len(self.joints) + len(self.outputs)
        ports = len(self._rigid) + motions - len(self.nonlinear) + r
        return max(ports * (ports + len(self.inputs)), 4 * r**2, motions * (r + len(self.inputs)))

    def tangent_entries(self, harmonics: int) -> int:
        """Of the Jacobian of the joints at a point in so many harmonics."""
        full = (2 * harmonics * len(self.coordinates.rows) + 1) ** 2
        return full if self._parts is None else self._parts.entries(harmonics)

    def free(self, omega: Array) -> ComplexArray:
        """Receptance (nf, ports, ports) with every joint open; ports are the joints, the outputs and the inputs."""
        ports = np.concatenate(self._rows)
        return self._free(omega, ports, ports)

    def _check_lock(self, Hzz: ComplexArray) -> None:
        own = np.sqrt(np.abs(np.diag(Hzz)))
        if not np.all(own > 0) or np.linalg.cond(Hzz / own[:, None] / own) > _SINGULAR:
            names = ", ".join(repr(c.name) for c in self.machine.connections if c.rigid)
            raise InputError(
                f"{self.machine.where}: the rigid connections {names} ask for motions that the components cannot make; "
                "give the modal ones more modes, or hold less"
            )

    def _by_poles(
        self, held: Sequence[int], gain: Callable[[Array], ComplexArray], view: Callable[[Array], View]
    ) -> LinearPart | None:
        """All that is linear as one sum over poles, some joints held at gains of the frequency; None where it is not
        what a view says line by line."""
        if self.swept is None:
            return None
        (own, shown, driven), coordinates = self._rows, self.coordinates
        ports = own[[self.nonlinear[k] for k in coordinates.rows]]
        own[list(self.nonlinear)] = coordinates.T @ ports
        found = LinearPart.of(self.machine, held, gain, ports, np.concatenate([own, shown]), driven)
        return found if found is not None and found.agrees(view, *self.swept) else None

    @cached_property
    def _parts(self) -> Parts | None:
        """The machine taken apart at its nonlinear joints; None where these are few, do not move independently, or most
        of them share a part."""
        if self.swept is None or len(self.nonlinear) < FEW or not self.coordinates.complete or self.biased is not None:
            return None
        own, shown, driven = self._rows
        rows = own[list(self.nonlinear)], driven, np.concatenate([own, shown])
        return parts_of(self.machine, self._plain, self._plain_gains, rows, self.by_components, self.swept)

    @property
    def _rows(self) -> tuple[Array, Array, Array]:
        """Rows over the dofs of all joints, of the outputs and of the inputs."""
        shown, driven = (self.machine.dof_rows(dofs, "receptance") for dofs in (self.outputs, self.inputs))
        return self.machine.rows(self.machine.flexible), shown, driven

    @cached_property
    def _whole(self) -> LinearPart | None:
        """The machine with its nonlinear joints open; None where it is taken apart instead."""
        return None if self._parts else self._by_poles(self._plain, self._plain_gains, self.by_components)

    @cached_property
    def _resting(self) -> LinearPart | None:
        """The machine with its nonlinear joints at their gains at rest."""
        if self._whole is None or not self.nonlinear:
            return self._whole
        return self._by_poles(
            [*self._plain, *self.nonlinear],
            lambda omega: np.concatenate([self._plain_gains(omega), self._gains_at_rest(omega)], axis=1),
            lambda omega: self.by_components(omega).at_rest(self._gains_at_rest(omega)),
        )

    @cached_property
    def _plain(self) -> list[int]:
        """Indices of the joints that are coupled before anything nonlinear begins."""
        return [i for i in range(len(self.joints)) if i not in self.nonlinear]

    def _plain_gains(self, omega: Array) -> ComplexArray:
        """Their gains in N/m, (nf, joints)."""
        gain = np.empty((len(omega), len(self._plain)), dtype=complex)
        for joint, columns in asked_together([self.joints[i] for i in self._plain]):
            gain[:, columns] = joint.first_harmonic(np.zeros(len(columns)), omega[:, None]).gain
        return gain

    def _gains_at_rest(self, omega: Array) -> ComplexArray:
        """Of the nonlinear joints, N/m, (nf, nj)."""
        return at_rest(self.moving, len(self.nonlinear), omega)

    def at(self, omega: Array, motions: bool = True) -> View:
        """The view at angular frequencies in rad/s; without ``motions`` that of the nonlinear joints alone."""
        whole = self._whole
        if whole is None:
            return self.by_components(omega)
        H, r = whole.joints.at(omega), len(self.coordinates.rows)
        if not motions:
            return View.alone(omega, H, self.coordinates)
        moved = whole.motions.at(omega)
        return View(omega, H[:, :, :r], H[:, :, r:], moved[:, :, :r], moved[:, :, r:], self.coordinates)

    def at_rest(self, omega: Array) -> View:
        """The view of the nonlinear joints about their gains at rest, where solvers begin."""
        base = self._gains_at_rest(omega)
        if self._parts is not None:
            return View.of_chain(omega, *JointChain.of(self._parts, omega, base), self.coordinates)
        resting = self._resting
        if resting is None:
            return self.at(omega, motions=False).at_rest(base)
        return View.alone(omega, resting.joints.at(omega), self.coordinates, base)

    def moved(self, omega: Array, force: Array, pull: ComplexArray) -> ComplexArray:
        """Motions of all joints and then of the outputs in m, (nf, motions), under forces in N: of the first input,
        (nf,), and those by which the nonlinear joints pull back, in the coordinates, (nf, r)."""
        whole = self._parts or self._whole
        if whole is not None:
            return whole.moved(omega, np.concatenate([-pull, force[:, None]], axis=1))
        view = self.by_components(omega)
        return np.asarray(view.Hof[:, :, 0] * force[:, None] - (view.Hoz @ pull[:, :, None])[:, :, 0])

    def by_components(self, omega: Array) -> View:
        """The view from the components' receptances line by line, from no more columns than it has."""
        (own, shown, driven), joints, coordinates = self._rows, self.joints, self.coordinates
        linear = self._plain
        chosen = [*linear, *(self.nonlinear[k] for k in coordinates.rows)]
        ports = own[chosen]
        R, C = np.concatenate([ports, shown]), np.concatenate([ports, driven])
        H, first, last = self._free(omega, R, C), len(linear), len(chosen)
        if linear:
            z, rest = slice(None, first), slice(first, None)
            held = joined(H[:, z, z], H[:, z, rest], H[:, :, z], H[:, :, rest], self._plain_gains(omega))
            H = np.concatenate([H[:, :, :first], held], axis=2)
        motions = np.empty((len(omega), len(joints) + len(self.outputs), H.shape[2] - first), dtype=complex)
        motions[:, linear] = H[:, :first, first:]
        motions[:, list(self.nonlinear)] = coordinates.T @ H[:, first:last, first:]
        motions[:, len(joints) :] = H[:, last:, first:]
        H, r = H[:, first:last, first:], last - first
        return View(omega, H[:, :, :r], H[:, :, r:], motions[:, :, :r], motions[:, :, r:], coordinates)

    def coupled(self, omega: Array, gains: ComplexArray) -> ComplexArray:
        """Receptance outputs × inputs with all joints held at these gains, (nf, number of joints)."""
        ports, shown, driven = self._rows
        R, C, n = np.concatenate([ports, shown]), np.concatenate([ports, driven]), len(ports)
        parts = []
        for first in range(0, len(omega), _TOGETHER):
            some = slice(first, first + _TOGETHER)
            H = self._free(omega[some], R, C)
            parts.append(joined(H[:, :n, :n], H[:, :n, n:], H[:, n:, :n], H[:, n:, n:], gains[some]) if n else H)
        return np.concatenate(parts)


def is_linear(joint: Joint) -> bool:
    """Whether the gain is the same at every amplitude from 0.1 nm to 0.1 m."""
    found = joint.first_harmonic(_PROBE[:, None], np.array([1.0, 1e3, 1e5]))
    return bool(np.all(found.d_amplitude == 0) and np.all(found.gain == found.gain[0]))


def independent(machine: Machine, joints: Sequence[int]) -> Coordinates:
    """The independent ones of the motions of some joints, told by their places among the flexible connections."""
    rows = machine.rows([machine.flexible[i] for i in joints])
    parts, start = [], 0
    for component in machine.components:
        part = rows[:, start : start + len(component.dofs)]
        model = component.second_order()
        parts.append(part if model is None else part @ model.shapes)
        start += len(component.dofs)
    return Coordinates.of(np.concatenate(parts, axis=1))
