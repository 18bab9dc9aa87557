"""A structure with its joints closed at their tangents: the linear part, moved exactly, and the forces that bend."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, lru_cache

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.parameter import Role, parameters_of

from .system import SLOW, System

_NOTHING = 1e-10
_SOUND = 1e-7
"""Largest error of the modes, relative, as the matrix that they put together again has it."""
_CONDITION = 1e11
_STIFF = 3.0
"""Radians of the fastest motion in a communication step from which on explicit steps are bound by stability."""


@dataclass(frozen=True, eq=False)
class Closed:
    """x' = A x + B u + G δ + c with δ = f − K z − C v: the linear part has the tangents of the joints in it.

    δ has an entry for each joint that bends; of a joint whose damping is viscous alone its damping is in A, and its
    other laws are asked at v = 0.
    """

    system: System
    stiffness: Array
    """K of each joint in N/m at the start."""
    damping: Array
    """C of each joint in N s/m."""
    bent: tuple[int, ...]
    """Joints whose force is more than K z + C v."""
    by_velocity: tuple[int, ...]
    """Those of them whose laws are asked with their velocity."""
    remembering: tuple[int, ...] = ()
    """Those of them that remember."""
    halved: bool = False
    """A law's step is not exact along an even path, so that two halves of it differ from the whole."""

    @cached_property
    def A(self) -> Array:
        """The matrix of the structure with its joints closed."""
        k, c = self.stiffness[:, None], self.damping[:, None]
        return np.asarray(self.system.A + self.system.G @ (k * self.system.C[0::2] + c * self.system.C[1::2]))

    @cached_property
    def constant(self) -> Array:
        """c: what the static load does, and the tangents' part of it."""
        pushed, moved, _ = self.system.constants
        return np.asarray(pushed + self.system.G @ (self.stiffness * moved[0::2]))

    @property
    def stiff(self) -> bool:
        """True if the fastest motion is far below what a communication step resolves."""
        fastest = float(np.max(np.abs(self.poles), initial=0.0))
        return self.system.step is not None and fastest * self.system.step > _STIFF

    @cached_property
    def poles(self) -> Array:
        return np.asarray(np.linalg.eigvals(self.A))

    @cached_property
    def basis(self) -> tuple[int, ...]:
        """Bent joints whose displacements give those of all, as contacts on stiff bodies depend on each other."""
        rows = self.system.C[0::2][list(self.bent)]
        if not len(rows):
            return ()
        size = np.maximum(np.linalg.norm(rows, axis=1), np.finfo(float).tiny)
        _, R, order = scipy.linalg.qr((rows / size[:, None]).T, mode="economic", pivoting=True)
        rank = int(np.sum(np.abs(np.diag(R)) > _NOTHING * abs(R[0, 0])))
        return tuple(self.bent[i] for i in order[:rank])

    @cached_property
    def spread(self) -> Array:
        """Displacement of each bent joint over those of the basis, (bent, basis)."""
        rows = self.system.C[0::2]
        if not self.bent:
            return np.zeros((0, 0))
        found = np.linalg.lstsq(rows[list(self.basis)].T, rows[list(self.bent)].T, rcond=None)[0].T
        return np.asarray(np.where(np.abs(found) < 1e-12 * np.max(np.abs(found)), 0.0, found))


@lru_cache(maxsize=8)
def closed(system: System) -> Closed | None:
    """The structure with its joints closed at the start; None where nothing moves."""
    if not system.states or np.any(system.D):
        return None
    moved = system.constants[1]
    start = (system.C @ system.start + moved)[0::2]
    K, C = np.zeros(len(start)), np.zeros(len(start))
    bent, by_velocity, remembering = [], [], []
    halved: dict[str, bool] = {}
    for j, (_, joint) in enumerate(system.joints):
        K[j], C[j] = _tangent(joint, start[j], system.load is not None)
        followed = {m.role for m in joint.modulations}
        rest = [law for law in joint.laws if not _is_tangent(law, followed)]
        for law in rest:
            if law.kind not in halved:
                halved[law.kind] = _is_halved(law)
        if rest:
            bent.append(j)
            if any(law.states for law in rest):
                remembering.append(j)
            if any(_feels_velocity(law, start[j]) for law in rest):
                by_velocity.append(j)
    return Closed(system, K, C, tuple(bent), tuple(by_velocity), tuple(remembering), any(halved.values()))


def _is_tangent(law: JointLaw, followed: Collection[Role]) -> bool:
    """The law is its tangent, which no condition moves."""
    return isinstance(law, Linear | Viscous) and not any(p.role in followed for p in parameters_of(law))


def stiff_closed(system: System) -> Closed | None:
    """The closed structure where it is stiff and modes span it: what an FMU does not integrate by explicit steps."""
    of = closed(system)
    return of if of is not None and of.stiff and modes(of) is not None else None


def _tangent(joint: Joint, z: float, loaded: bool) -> tuple[float, float]:
    at, still = np.asarray(z), np.zeros(())
    state = joint.initial_state(at)
    if loaded and joint.states:
        state = joint.step(Motion(at, still, SLOW), joint.initial_state(still))[1]
    k, c = joint.jacobian(Motion(at, still), state)
    return float(k), float(c)


def _feels_velocity(law: JointLaw, z: float) -> bool:
    """The velocity changes the force somewhere in the neighbourhood."""
    state = law.initial_state(np.asarray(z))
    for far in (0.0, 1e-6, -1e-6, 1e-5, -1e-5):
        still, moving = (
            float(law.step(Motion(np.asarray(z + far), np.asarray(v), 1e-9), state)[0]) for v in (0.0, 0.013)
        )
        if still != moving:
            return True
    return False


def _is_halved(law: JointLaw) -> bool:
    """True if two parts of an even path make another whole."""
    if not law.states:
        return False
    h, v = 1e-6, np.asarray(0.1)
    for travel in np.geomspace(1e-9, 1e-4, 21):
        begun = law.step(Motion(-travel, -v, h), law.initial_state(np.zeros(())))[1]
        once = law.step(Motion(travel, v, h), begun)[1]
        for part in (-0.8, -0.4, 0.1, 0.6):
            share = h * (1 + part) / 2
            half = law.step(Motion(part * travel, v, share), begun)[1]
            twice = law.step(Motion(travel, v, h - share), half)[1]
            if not np.allclose(once, twice, rtol=0.0, atol=1e-12 * travel):
                return True
    return False


def is_integrated(law: JointLaw) -> bool:
    """True if a law's step is not exact along a path: it depends on its duration, or two parts make another whole."""
    if not law.states:
        return False
    v = np.asarray(0.1)
    for travel in np.geomspace(1e-9, 1e-4, 21):
        back = law.step(Motion(-travel, -v, 1e-6), law.initial_state(np.zeros(())))[1]
        once, slowly = (law.step(Motion(travel, v, h), back)[1] for h in (1e-6, 1e-2))
        if not np.array_equal(once, slowly):
            return True
    return _is_halved(law)


class Kind(IntEnum):
    """What a pair of coordinates is: a complex mode, two real ones, or a free motion with its speed."""

    SWING = 0
    REAL = 1
    FREE = 2


@dataclass(frozen=True, eq=False)
class Modes:
    """y with x = W y, pair by pair: c = y1 + i y2 with c' = λ c, two real motions, or y1' = y2."""

    W: Array
    inverse: Array
    blocks: Array
    """(pairs, 2): σ and ω of λ = σ + iω, two real poles, or zeros."""
    kinds: tuple[Kind, ...]


@lru_cache(maxsize=8)
def modes(of: Closed) -> Modes | None:
    """Complex modes of the closed structure; None where they do not span it well."""
    A = of.A
    values, vectors = np.linalg.eig(A)
    fastest = max(float(np.max(np.abs(values))), 1.0)
    size = np.where(np.arange(len(A)) % 2, fastest, 1.0)[:, None]
    free = _free(A, fastest)
    # A free motion has a double pole at zero, and one direction for both.
    taken = np.argsort(np.abs(values), kind="stable")[2 * free.shape[1] :]
    columns: list[Array] = []
    blocks: list[tuple[float, float]] = []
    kinds: list[Kind] = []
    for motion in free.T:
        for rate in (0, 1):
            column = np.zeros(len(A))
            column[rate::2] = motion
            columns.append(column)
        blocks.append((0.0, 0.0))
        kinds.append(Kind.FREE)
    unit = vectors / np.linalg.norm(vectors / size, axis=0)
    for i in taken[values[taken].imag > 0]:
        columns += [2 * unit[:, i].real, -2 * unit[:, i].imag]
        blocks.append((float(values[i].real), float(values[i].imag)))
        kinds.append(Kind.SWING)
    alone = taken[values[taken].imag == 0]
    for a, b in zip(alone[0::2], alone[1::2], strict=False):
        columns += [unit[:, a].real, unit[:, b].real]
        blocks.append((float(values[a].real), float(values[b].real)))
        kinds.append(Kind.REAL)
    if len(columns) != len(A):
        return None
    W = np.array(columns).T
    if np.linalg.cond(W / size) > _CONDITION:
        return None
    inverse: Array = np.asarray(np.linalg.solve(W / size, np.diag(1 / size[:, 0])), dtype=np.float64)
    found = Modes(W, inverse, np.array(blocks), tuple(kinds))
    wrong, whole = ((matrix * size.T / size) for matrix in (W @ _turned(found) @ inverse - A, A))
    return found if np.max(np.abs(wrong)) <= _SOUND * np.max(np.abs(whole)) else None


def _free(A: Array, fastest: float) -> Array:
    """Motions of the structure that neither stiffness nor damping hold, one per column."""
    held = np.concatenate([A[1::2, 0::2] / fastest**2, A[1::2, 1::2] / fastest])
    return np.asarray(scipy.linalg.null_space(held, rcond=1e-13))


def _turned(of: Modes) -> Array:
    """The block-diagonal matrix of the modes."""
    out = np.zeros_like(of.W)
    for i, ((a, b), kind) in enumerate(zip(of.blocks, of.kinds, strict=True)):
        block = {Kind.SWING: [[a, -b], [b, a]], Kind.REAL: [[a, 0], [0, b]], Kind.FREE: [[0, 1], [0, 0]]}[kind]
        out[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = block
    return out
