"""The static working point: all joints in balance with weight, constant forces and offsets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..coupling.second_order import MachineEquations, machine_equations
from ..model.machine import Machine
from .asked_together import same_joints
from .mean_force import MeanForce

_ITERATIONS = 200
_SETTLED = 1e-12
_FREE = 1e-11
_UNHELD = 1e-9
_STANDS = (2 * np.pi * 0.01) ** 2
"""(rad/s)² below which a motion is free: no part swings in minutes."""
_SUM = 1e-13
"""Share of what a sum is made of that rounding leaves of it."""
NO_EQUILIBRIUM = "static: no equilibrium under the static load"
UNHELD = "static: nothing holds"
_ROUNDED = 50 * np.finfo(float).eps
_FURTHEST = 1.0
"""m; a joint that would go further has no equilibrium."""
_HOLDS = 0.1
"""Share of a force that the tangent stiffness explains, from which on a joint still holds."""
_PROBE = np.concatenate([[0.0], np.geomspace(1e-9, 1e-3, 13)])
_CURVED = 0.3
"""Share of the slope along a step that may be left at its end."""


@dataclass(frozen=True, eq=False)
class Balance:
    """K p + Jᵀ f(J p + offset) = F in coordinates y of unit mass, p = T y, in which all that is held moves."""

    stiffness: Array
    rows: Array
    load: Array
    transform: Array
    """p = transform · y."""
    means: tuple[MeanForce, ...]
    offset: Array

    @classmethod
    def of(cls, machine: Machine) -> tuple[Balance, MachineEquations]:
        equations = machine_equations(machine)
        means = tuple(MeanForce(joint) for joint in machine.joints())
        load = equations.shapes.T @ static_forces(machine)
        L = np.linalg.cholesky(equations.mass)
        T = scipy.linalg.solve_triangular(L, np.eye(len(L)), lower=True).T
        K, J, F = T.T @ equations.stiffness @ T, equations.joints @ T, T.T @ load
        largest = max((float(np.linalg.norm(K[b, b], 2)) for b in equations.blocks if b.stop > b.start), default=0.0)
        held = K / max(largest, 1e-300)
        for row in J[[_holds(mean) for mean in means]]:
            held = held + np.outer(row, row) / (row @ row)
        value, vector = np.linalg.eigh(held)
        fixed = value > _FREE * max(float(value[-1]), 1e-300)
        held, loose = _apart(K, vector[:, ~fixed])
        unheld = loose @ (loose.T @ F)
        # What is held but softly mixes into the free motions, by as much as numbers round off.
        mixed = _ROUNDED * float(value[-1]) / float(np.min(value[fixed], initial=np.inf))
        if np.linalg.norm(unheld) > max(_UNHELD, mixed) * np.linalg.norm(F):
            moved = np.abs(equations.shapes @ (T @ unheld))
            dof = machine.dofs[int(np.argmax(moved))]
            raise InputError(
                f"{machine.where}: {UNHELD} {dof} against the static load; add a connection or a stiffness that does, "
                "or leave that load out"
            )
        Q = np.concatenate([held, vector[:, fixed]], axis=1)
        assert machine.static is not None
        offset = np.array([machine.static.offset.get(c.name, 0.0) for c in machine.flexible])
        return cls(Q.T @ K @ Q, J @ Q, Q.T @ F, T @ Q, means, offset), equations

    def joints(self, y: Array) -> tuple[Array, Array, Array]:
        """Displacement, force and tangent stiffness of every joint."""
        z = self.rows @ y + self.offset
        force, stiffness = np.empty((2, len(z)))
        for columns in self._alike:
            force[columns], stiffness[columns] = self.means[columns[0]].static(z[columns])
        return z, force, stiffness

    @cached_property
    def _alike(self) -> list[list[int]]:
        return same_joints([mean.joint for mean in self.means])

    def solve(self, where: str, names: tuple[str, ...]) -> Array:
        """y of the equilibrium, by Newton's method with a search along each step."""
        y = np.zeros(len(self.load))
        _, force, still = self.joints(y)
        reference = self.stiffness + self.rows.T @ (np.abs(still)[:, None] * self.rows)
        shift = 1e-9 * float(np.max(np.abs(np.diag(reference)), initial=1e-300))
        for _ in range(_ITERATIONS):
            z, force, k = self.joints(y)
            pull = self.stiffness @ y + self.rows.T @ force - self.load
            scale = np.linalg.norm(self.load) + np.linalg.norm(np.abs(self.rows).T @ np.abs(force))
            # A part far stiffer than what holds it rounds off more of the forces than that.
            rounded = _ROUNDED * np.linalg.norm(np.abs(self.stiffness) @ np.abs(y))
            settled, step = np.linalg.norm(pull) <= _SETTLED * scale + rounded, y
            if not settled:
                if np.max(np.abs(z), initial=0.0) > _FURTHEST:
                    break
                step = -_solve(self._tangent(k), pull, shift)
                # Long levers round off more of the forces than that, of the places not.
                settled = np.max(np.abs(step)) <= _SETTLED * np.max(np.abs(y))
            if settled:
                if len(y) and np.linalg.eigvalsh(self._tangent(k))[0] < -shift:
                    break
                return y
            y = y + self._along(y, step, float(step @ pull)) * step
        z, force, k = self.joints(y)
        worst = int(np.argmax(np.abs(z)))
        if still[worst] < 0:
            why = f"pushes away what moves, by {still[worst]:.4g} N/m; expected a stiffness above 0"
        elif k[worst] * abs(z[worst]) > _HOLDS * abs(force[worst]):
            why = f"moves by {abs(z[worst]) * 1e3:.3g} mm, under {force[worst]:.4g} N; is its stiffness right?"
        else:
            why = (
                f"gives way, its force stays at {force[worst]:.4g} N however far it moves; lower the load or raise the "
                "preload"
            )
        raise InputError(f"{where}: {NO_EQUILIBRIUM}: connection {names[worst]!r} {why}")

    def _tangent(self, k: Array) -> Array:
        return np.asarray(self.stiffness + self.rows.T @ (k[:, None] * self.rows))

    def _along(self, y: Array, step: Array, before: float) -> float:
        """Share of a step at which the force along it has mostly gone; the energy falls all the way."""

        def slope(share: float) -> float:
            at = y + share * step
            return float(step @ (self.stiffness @ at + self.rows.T @ self.joints(at)[1] - self.load))

        low, high, share = 0.0, np.inf, 1.0
        for _ in range(60):
            now = slope(share)
            if abs(now) <= _CURVED * abs(before):
                break
            if now < 0:
                low, share = share, 2 * share if np.isinf(high) else (share + high) / 2
            else:
                high, share = share, (low + share) / 2
            if np.isinf(high) and np.max(np.abs(self.rows @ (share * step)), initial=0.0) > 4 * _FURTHEST:
                break
        return share


@dataclass(frozen=True, eq=False)
class StaticPoint:
    """Where every joint stands under the static load; arrays have one entry per flexible connection."""

    connections: tuple[str, ...]
    displacement: Array
    """z0 in m, the offset included."""
    force: Array
    """Joint force f(z0) in N; beyond its preload where a law counts from there."""
    stiffness: Array
    """Tangent stiffness there in N/m."""
    dofs: Array
    """Static displacement of every degree of freedom of the machine in m or rad."""
    warnings: tuple[str, ...]
    """A sentence for every joint that has lost contact or stands outside the range it was identified on."""

    balance: Balance
    """The equations it solves."""
    coordinates: Array
    """Generalised coordinates p of `machine_equations`; those that nothing holds are 0."""

    @property
    def table(self) -> tuple[tuple[str, ...], list[float], list[float]]:
        """Names, displacements in m and forces in N."""
        return self.connections, self.displacement.tolist(), self.force.tolist()

    def of(self, connection: str) -> tuple[float, float]:
        """Displacement in m and force in N of one connection."""
        i = self.connections.index(connection)
        return float(self.displacement[i]), float(self.force[i])


def _holds(mean: MeanForce) -> bool:
    """Whether a joint resists a constant displacement of any size."""
    return bool(np.any(mean.static(np.concatenate([-_PROBE, _PROBE]))[1] != 0))


def _apart(K: Array, loose: Array) -> tuple[Array, Array]:
    """Motions that look free beside what is very stiff: those that bend a part although softly, and those that do not.

    As sums of what each coordinate stores, energies of soft ones are known far below what rounding leaves of the whole.
    """
    own = loose.T @ K @ loose
    own = np.where(np.abs(own) > _SUM * (np.abs(loose).T @ np.abs(K) @ np.abs(loose)), own, 0.0)
    value, turned = np.linalg.eigh((own + own.T) / 2)
    return np.asarray(loose @ turned[:, value > _STANDS]), np.asarray(loose @ turned[:, value <= _STANDS])


def _solve(H: Array, g: Array, shift: float) -> Array:
    """A direction that goes down: with H as it is, or where it is not positive with its eigenvalues made so."""
    try:
        return np.asarray(scipy.linalg.cho_solve(scipy.linalg.cho_factor(H), g))
    except np.linalg.LinAlgError:
        value, vector = np.linalg.eigh(H)
        return np.asarray(vector @ ((vector.T @ g) / np.maximum(np.abs(value), shift)))


def static_forces(machine: Machine) -> Array:
    """Weight and constant forces on every dof of the machine, N (N m on rotations)."""
    static = machine.static
    assert static is not None
    pieces = []
    for component in machine.components:
        if static.gravity is None:
            pieces.append(np.zeros(len(component.dofs)))
            continue
        weight = component.weight(np.array(static.gravity))
        if weight is None:
            raise InputError(
                f"{machine.where}: static: the weight of component {component.name!r} is not known; give its mass, or "
                "leave gravity out and give the weights as forces"
            )
        pieces.append(weight)
    total = np.concatenate(pieces)
    for dof, force in static.force.items():
        total[machine.dofs.index(dof)] += force
    return total


@lru_cache(maxsize=2)  # one computation of a machine asks for it many times
def static_point(machine: Machine) -> StaticPoint:
    """Solve the static balance of a machine with a `[static]` section; without an equilibrium, one sentence.

    K p + Σ bᵢ fᵢ(bᵢᵀ p + offsetᵢ) = weight + forces over all parts and joints at once, from rest, by Newton's method
    with the tangent. Joints with memory are loaded once, slowly. Motions that nothing holds, such as the travel of a
    carriage without a drive, are left out where no load acts along them.
    """
    names = tuple(c.name for c in machine.flexible)
    balance, equations = Balance.of(machine)
    y = balance.solve(machine.where, names)
    z, force, stiffness = balance.joints(y)
    said = []
    for name, mean, at, k in zip(names, balance.means, z, stiffness, strict=True):
        rest = float(mean.static(np.array(0.0))[1])
        if rest > 0 and k <= 1e-9 * rest:
            said.append(f"{name}: has lost contact or slips under the static load, at {at * 1e6:.4g} um.")
        valid = mean.joint.validity.get("amplitude", (0.0, np.inf))[1]
        if abs(at) > valid:
            said.append(
                f"{name}: stands at {at * 1e6:.4g} um under the static load, identified up to {valid * 1e6:.4g} um."
            )
    p = balance.transform @ y
    return StaticPoint(names, z, force, stiffness, equations.shapes @ p, tuple(said), balance, p)
