"""Forced vibration of a milling cut: what the tool does between chatters, tooth after tooth.

A stable cut leaves one motion, that of the tooth. Its force is known (`PatternForces`), as a motion that repeats with
the tooth meets its own surface and changes no chip. Where the joints are springs and dampers, q_k = G(kω_T)·F_k. Where
they are not, their forces and the motion agree in the harmonics of the tooth and the mean: Newton's method on the
motions of the nonlinear joints, with their laws over a tooth period in time, memory included (`joint_forces`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError

from ...components.static_load import StaticLoad
from ...harmonic_balance.assembly import Assembly, is_linear
from ...harmonic_balance.balance import Balance
from ...harmonic_balance.cycle import Harmonics
from ...harmonic_balance.harmonics import jumps
from ...indices import Mask
from ...model.machine import Machine
from ...model.spindle_speed import at_speed, depends_on_speed
from ..process.cutter import Cutter
from ..process.cutting import Cutting
from .balanced import SAMPLES, balanced
from .pattern_forces import PatternForces

_HARMONICS = 64
_FEWEST, _MOST = 6, 24
_LEFT = 1e-3
"""Share of the motion of a joint that harmonics beyond those of the balance may have."""
_MANY = 12
_BLOCK = 64
"""Cuts balanced side by side."""
_ANGLES = 1024
_STILL = 1e-3
"""rad/s at which a tool answers as it does at rest."""


def too_many(machine: Machine) -> int:
    """Joints that depend on amplitude where they are too many to balance under the teeth in bearable time, else 0."""
    bent = sum(not is_linear(joint) for joint in machine.joints())
    return bent if bent > _MANY else 0


def unforced(machine: Machine) -> str:
    """Why the vibration that the teeth of a machine force is not computed, in words; empty where it is."""
    cutting = Cutting(**dict(machine.cutting or {}))
    unlike = " and ".join(word for word in (cutting.unlike, "run-out" if cutting.runout else "") if word)
    if not unlike or all(map(is_linear, machine.joints())):
        return ""
    return f"not computed with {unlike} where joints depend on amplitude"


@dataclass(frozen=True, eq=False)
class ForcedVibration:
    """The steady motion of a stable cut, for several cuts side by side; harmonics are those of the tooth frequency,
    or of the frequency at which the pattern of unlike flutes passes.

    Parameters
    ----------
    speed, depth
        rpm and m, (cuts,).
    axes
        Of the tool: ``("x", "y")`` or one of them.
    tool
        Phasors of the tool in m at the harmonics 1 …, (cuts, harmonics, axes); at time 0 tooth 0 stands at φ = 0.
    connections
        Names of the flexible connections.
    joints
        Their phasors, (cuts, 1 + harmonics, connections); the first is the mean that their forces leave.
    reach
        Amplitude in m up to which each was identified; inf where nothing is known.
    settled
        Whether motion and joints agree; where they do not, the entries are nan.
    """

    speed: Array
    depth: Array
    axes: tuple[str, ...]
    tool: ComplexArray
    connections: tuple[str, ...]
    joints: ComplexArray
    reach: Array
    settled: Mask
    mean: Array = field(default_factory=lambda: np.zeros(0))
    """Where the mean force of the cut holds the tool, in m, (cuts, axes); nan where its stiffness at rest is not known,
    or joints that depend on amplitude take part in it."""
    patterns: float = 1.0
    """How often the motion repeats in a revolution."""

    @property
    def peak_to_peak(self) -> Array:
        """Of the tool in m, (cuts, axes)."""
        return _span(np.concatenate([np.zeros_like(self.tool[:, :1]), self.tool], axis=1))

    @property
    def rms(self) -> Array:
        """Effective value of the tool's motion in m, (cuts, axes)."""
        return np.asarray(np.sqrt(np.sum(np.abs(self.tool) ** 2, axis=1) / 2))

    @property
    def amplitude(self) -> Array:
        """Half the larger peak-to-peak of x and y in m, (cuts,)."""
        return np.asarray(np.max(self.peak_to_peak, axis=1) / 2)

    @property
    def joint_amplitude(self) -> Array:
        """Half the peak-to-peak of each connection in m, (cuts, connections)."""
        return _span(self.joints) / 2

    @property
    def beyond(self) -> Array:
        """Share by which each connection moves beyond its identified range, (cuts, connections); 0 inside."""
        return np.asarray(np.maximum(self.joint_amplitude / self.reach - 1, 0.0))

    def at(self, index: int) -> ForcedVibration:
        """One cut alone."""
        keys = ("speed", "depth", "tool", "joints", "settled", "mean")
        return replace(self, **{key: getattr(self, key)[[index]] for key in keys})


def forced_vibration(machine: Machine, speed: ArrayLike, depth: ArrayLike) -> ForcedVibration:
    """The motion that the teeth force on the tool and on every joint, at speeds (rpm) and depths (m) that broadcast.

    Machines without a `[cutting]` that mills with a ``feed`` have none and are refused. A joint that a force of the
    cut holds away from zero stands where `[static]` puts it; the mean cutting force is not added. Joints whose force
    jumps with the velocity, and parts that are only known as measured receptances beyond their band, are not covered.
    """
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], expected one for the vibration that it forces")
    cutting = Cutting(**machine.cutting)
    if cutting.process != "milling" or cutting.feed is None:
        raise InputError(f"{machine.where}: forced vibration is that of milling with a feed per tooth")
    if left := unforced(machine):
        raise InputError(f"forced vibration: {left}")
    n, b = (np.ravel(part) for part in np.broadcast_arrays(np.asarray(speed, float), np.asarray(depth, float)))
    if not (np.all(np.isfinite(n) & (n > 0)) and np.all(np.isfinite(b) & (b >= 0))):
        raise InputError("forced vibration: expected speeds above 0 and depths of at least 0, finite")
    own = np.unique(n) if depends_on_speed(machine) else np.zeros(0)
    solver = _Cuts.of(machine, cutting, n)
    turning = {rpm: _Cuts.of(at_speed(machine, rpm), cutting, n[n == rpm]) for rpm in own.tolist()}
    lots = [np.flatnonzero(n == rpm) for rpm in own] if turning else [np.arange(len(n))]
    blocks = [lot[first : first + _BLOCK] for lot in lots for first in range(0, len(lot), _BLOCK)]
    parts = [turning.get(float(n[rows[0]]), solver).at(n[rows], b[rows]) for rows in blocks]
    back = np.argsort(np.concatenate(blocks)) if blocks else np.arange(0)
    tool, joints, settled, mean = (np.concatenate(same)[back] for same in zip(*parts, strict=True))
    reach = np.array([joint.validity.get("amplitude", (0.0, np.inf))[1] for joint in machine.joints()])
    names = tuple(c.name for c in machine.flexible)
    patterns = solver.forces.cutter.patterns
    return ForcedVibration(n, b, machine.tool_axes, tool, names, joints, reach, settled, mean, patterns)


@dataclass(frozen=True, eq=False)
class _Cuts:
    """A machine under the forces of its teeth; ``moves`` says whether its means can be balanced."""

    assembly: Assembly
    cutting: Cutting
    moves: bool

    @classmethod
    def of(cls, machine: Machine, cutting: Cutting, speed: Array) -> _Cuts:
        """Under cuts at speeds in rpm."""
        tool = machine.tool_dofs
        for where, joint in zip(machine.flexible, machine.joints(), strict=True):
            for law in joint.laws:
                if not law.in_time and not law.linear:
                    raise InputError(
                        f"{machine.where}: connection {where.name!r}: {law.kind} exists in the frequency domain only"
                    )
            if jumps(joint):
                raise InputError(
                    f"{machine.where}: connection {where.name!r}: its force jumps with the velocity, so its harmonics "
                    "cannot be solved for; give the friction a smoothing_velocity"
                )
        bare = Assembly(machine, tool, tool)
        if not bare.nonlinear:
            return cls(replace(bare, swept=_swept(cutting, speed)), cutting, False)
        standing = machine if machine.static is not None else replace(machine, static=StaticLoad())
        placed = Assembly(standing, tool, tool)
        try:
            moves = placed.biased is not None and placed.nonlinear == bare.nonlinear
        except InputError:  # no equations of motion, so no static compliance
            moves = False
        return cls(placed if moves else bare, cutting, moves)

    @cached_property
    def forces(self) -> PatternForces:
        """Those of the teeth."""
        flutes = len(Cutter.of(self.cutting, runout=True).flutes)
        return PatternForces(self.cutting, self.assembly.machine.tool_axes, _HARMONICS * flutes)

    def at(self, speed: Array, depth: Array) -> tuple[ComplexArray, ComplexArray, Mask, Array]:
        """Phasors of the tool, of all connections with their means, what settled, and where the mean force holds it."""
        assembly, nj = self.assembly, len(self.assembly.joints)
        k = np.arange(1, self.forces.count + 1)
        omega = 2 * np.pi * self.forces.cutter.patterns * speed / 60
        lines, place = np.unique(k[:, None] * omega, return_inverse=True)
        try:
            view = assembly.at(lines)
        except FrequencyMismatch as error:
            raise InputError(f"forced vibration: {error}, harmonics of the tooth frequency ask for more") from None
        every = view.at(place.ravel())
        G = every.Hof[:, nj:].reshape(len(k), len(speed), *every.Hof[:, nj:].shape[1:])
        whole = np.stack([self.forces.steady(*one, G[:, i]) for i, one in enumerate(zip(speed, depth, strict=True))], 1)
        force, held = whole[1:], whole[0].real @ self._at_once.T
        column = force.reshape(-1, force.shape[2], 1)
        moved = (every.Hof @ column)[..., 0].reshape(*force.shape[:2], -1)
        settled, mean = np.ones(len(speed), dtype=bool), np.zeros((1, len(speed), moved.shape[2]), dtype=complex)
        if assembly.nonlinear:
            c = view.coordinates
            driven = (every.Hzf @ column)[..., 0].reshape(*force.shape[:2], -1)
            count = self._needed(omega, driven)
            harmonics: Harmonics = (*range(1, count + 1), *([0] if self.moves else []))
            at_rest = self._at_rest(lines)
            resting = view.at_rest(at_rest)
            balance = Balance.of(assembly, omega, np.zeros(len(omega)), harmonics, resting)
            linear = (resting.at(place.ravel()).Hzf @ column)[..., 0].reshape(driven.shape)
            target = np.zeros(balance.H.shape[:3], dtype=complex)
            target[:, :count] = np.swapaxes(linear[:count], 0, 1)
            z, settled = balanced(balance, target)
            found = balance.forces(z, SAMPLES, slopes=False)
            pull = c.together(at_rest[place.ravel()] * c.motions(linear.reshape(len(every.omega), -1)))
            pull = pull.reshape(*force.shape[:2], -1)
            pull[:count] = np.swapaxes(c.together(found.force[:, :count]), 0, 1)
            moved = moved - (every.Hoz @ pull.reshape(len(every.omega), -1, 1))[..., 0].reshape(moved.shape)
            moved[:, ~settled] = np.nan
            if self.moves:
                mean[0, :, list(assembly.nonlinear)] = c.motions(z[:, -1].real).T
        joints = np.concatenate([mean[..., :nj], moved[..., :nj]])
        return np.moveaxis(moved[..., nj:], 0, 1), np.moveaxis(joints, 0, 1), settled, held

    @cached_property
    def _at_once(self) -> Array:
        """Static compliance of the tool in m/N, nan where it is not known."""
        many = len(self.assembly.machine.tool_axes)
        unknown = np.full((many, many), np.nan)
        if self.assembly.nonlinear:
            return unknown
        try:
            static = self.assembly.at(np.array([_STILL])).Hof[0, len(self.assembly.joints) :].real
        except (FrequencyMismatch, np.linalg.LinAlgError):
            return unknown
        return np.where(np.isfinite(static), static, np.nan)

    def _at_rest(self, omega: Array) -> ComplexArray:
        """Gains of the nonlinear joints at rest in N/m, (lines, joints)."""
        if self.moves and (biased := self.assembly.biased) is not None:
            return biased.about_rest(np.zeros((len(omega), len(biased.members))), omega)
        parts = [self.assembly.joints[i].first_harmonic(0.0, omega).gain for i in self.assembly.nonlinear]
        return np.stack(parts, axis=-1)

    def _needed(self, omega: Array, driven: ComplexArray) -> int:
        """Harmonics of the balance: those without which a joint would move by a thousandth less."""
        size = np.max(np.abs(driven), axis=2)
        tail = np.cumsum(size[::-1], axis=0)[::-1] / np.maximum(np.sum(size, axis=0), 1e-300)
        least = int(np.argmax(np.all(tail < _LEFT, axis=1))) if np.any(np.all(tail < _LEFT, axis=1)) else _MOST
        return int(np.clip(least, _FEWEST, _MOST))


def _swept(cutting: Cutting, speed: Array) -> tuple[float, float]:
    """From the slowest to the fastest harmonic of the teeth in rad/s, at speeds in rpm."""
    cutter = Cutter.of(cutting, runout=True)
    turning = 2 * np.pi * cutter.patterns * speed / 60
    return float(np.min(turning)), _HARMONICS * len(cutter.flutes) * float(np.max(turning))


def _span(phasors: ComplexArray) -> Array:
    """Peak-to-peak of Re Σ z_k e^(jkθ), k from 0, (cuts, harmonics, motions) → (cuts, motions)."""
    theta = 2 * np.pi * np.arange(_ANGLES) / _ANGLES
    wave = np.exp(1j * np.arange(phasors.shape[1])[:, None] * theta)
    return np.asarray(np.ptp(np.einsum("ckm,kt->cmt", phasors, wave).real, axis=2))


def worst_joint(found: ForcedVibration, index: int = 0) -> tuple[str, float, float] | None:
    """The connection furthest beyond its identified range: its name, amplitude and range in m; None where none is."""
    beyond = found.beyond[index]
    if not np.any(beyond > 0):
        return None
    i = int(np.argmax(beyond))
    return found.connections[i], float(found.joint_amplitude[index, i]), float(found.reach[i])
