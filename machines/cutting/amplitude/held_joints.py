"""The loop over a tooth period of a machine whose joints are held as its chatter makes them, in harmonics or in modes.

A joint that vibrates at ω_c with a gain g is held, at all frequencies, as the spring K = Re g and the damper
C = Im g/ω_c. In harmonics laws that depend on no amplitude are left as they are at each frequency.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

from ...harmonic_balance.assembly import Assembly, is_linear
from ...harmonic_balance.view import View
from ...model.machine import Machine
from ...tool.bounded_band import Shape, carried, shape
from ...tool.machine_model import OpenJoints
from ...tool.tool_model import ToolModel
from ...tool.tool_point import ToolPoint
from ..loops.collocation import FINER, MORE, MOST_SETTLED, ArcMap, arc_map
from ..loops.critical_depth import eigenvector
from ..loops.loop_branches import Crossing
from ..loops.multi_frequency import HarmonicLoop
from ..process.cutting import Cutting

Held = Callable[[Array], tuple[Array, ComplexArray]]
"""ν, (g,) → the frequency of the chatter in Hz, (g,), and the gains of all joints in N/m, (g, connections)."""

_PAST = 3
_FAR = 10.0
_REDUCED = 1e-5
_HALF = 0.5


@dataclass(frozen=True, eq=False)
class Constant:
    """The same joints at every ν, as they are at a frequency in Hz."""

    frequency: float
    gain: ComplexArray
    """N/m, (connections,)."""

    def __call__(self, fraction: Array) -> tuple[Array, ComplexArray]:
        return np.full(len(fraction), self.frequency), np.repeat(self.gain[None], len(fraction), axis=0)


class HeldLoop(ABC):
    """ν → the loop; and what a crossing of it looks like."""

    @abstractmethod
    def __call__(self, fraction: Array) -> ComplexArray: ...

    @abstractmethod
    def strongest(self, crossing: Crossing, order: int | None = None) -> tuple[int, ComplexArray]:
        """Order of the line at which the tool moves most, and the force on the tool there at a positive frequency.

        A given ``order`` is kept where the tool moves at least half as much.
        """


class HeldJoints(ABC):
    """A machine in a cut, with its joints held."""

    @property
    @abstractmethod
    def tolerance(self) -> float:
        """Share by which the depth may change from one level of resolution to the next."""

    @abstractmethod
    def loop(self, speed: float, level: int, held: Held, coarse: bool = False) -> HeldLoop:
        """The loop at a speed in rpm; ``level`` 0, 1, … resolves it ever finer, ``coarse`` suffices for a search."""

    @abstractmethod
    def resolved(self, frequency: float, gain: ComplexArray) -> Shape:
        """The tool point with the joints as they are while it vibrates at a frequency in Hz."""


@dataclass(frozen=True, eq=False)
class _Modes(HeldLoop):
    held: Held
    model: Callable[[float, ComplexArray], ToolModel]
    arc: Callable[[ToolModel], ArcMap]
    tooth: float
    known: dict[float, tuple[ToolModel, ArcMap]] = field(default_factory=dict)

    def _at(self, chatter: float, gain: ComplexArray) -> tuple[ToolModel, ArcMap]:
        if chatter not in self.known:
            model = self.model(chatter, gain)
            self.known[chatter] = model, self.arc(model)
        return self.known[chatter]

    def __call__(self, fraction: Array) -> ComplexArray:
        chatter, gain = self.held(fraction)
        if np.all(chatter == chatter[0]):
            return self._at(float(chatter[0]), gain[0])[1](fraction)
        parts = zip(chatter.tolist(), gain, fraction[:, None], strict=True)
        return np.concatenate([self._at(f, g)[1](nu) for f, g, nu in parts])

    def strongest(self, crossing: Crossing, order: int | None = None) -> tuple[int, ComplexArray]:
        chatter, gain = self.held(np.array([crossing.fraction]))
        model, arc = self._at(float(chatter[0]), gain[0])
        reach = int(np.ceil(model.fastest / np.pi / self.tooth)) + 1
        orders = np.arange(-reach - 1.0, reach + 1.0)
        force = arc.force(crossing.fraction, eigenvector(arc, crossing), orders)
        moved = np.einsum("qab,qb->qa", model((crossing.fraction + orders) * self.tooth), force)
        return _strongest(crossing, orders, force, moved, order)


@dataclass(frozen=True, eq=False)
class HeldInModes(HeldJoints):
    """By collocation.

    Modes more than `_FAR` times above ``highest`` (Hz), the highest line that matters at the tool, act together, see
    `ToolModel.up_to`; each finer level doubles that reach.
    """

    machine: Machine
    cutting: Cutting
    highest: float
    tolerance: float = _REDUCED

    @cached_property
    def _open(self) -> OpenJoints:
        return OpenJoints.of(self.machine)

    @cached_property
    def _starts(self) -> dict[tuple[float, bytes, int], ToolModel]:
        return {}

    def model(self, frequency: float, gain: ComplexArray, level: int = 0) -> ToolModel:
        """Modes of the tool point."""
        return self._open.models(gain[None], frequency)[0].up_to(_FAR * self.highest * 2**level)

    def _start(self, frequency: float, gain: ComplexArray, level: int) -> ToolModel:
        """The same of joints at a resonance, which are asked for again at every speed."""
        key = (frequency, gain.tobytes(), level)
        if key not in self._starts:
            self._starts[key] = self.model(frequency, gain, level)
        return self._starts[key]

    def loop(self, speed: float, level: int, held: Held, coarse: bool = False) -> HeldLoop:
        more, share = (MORE // 2, 0.6) if coarse else (MORE, 1.0)
        tooth = self.cutting.cuts_per_revolution * speed / 60
        model_of = self._start if isinstance(held, Constant) else self.model
        return _Modes(
            held,
            lambda frequency, gain: model_of(frequency, gain, level),
            lambda model: arc_map(model, self.cutting, speed, more + FINER * level, share, MOST_SETTLED),
            tooth,
        )

    def resolved(self, frequency: float, gain: ComplexArray) -> Shape:
        model = self.model(frequency, gain)
        return shape(ToolPoint(model, model.lines, model.axes, sampled=False))


@dataclass(frozen=True, eq=False)
class _Harmonics(HeldLoop):
    loop: HarmonicLoop

    def __call__(self, fraction: Array) -> ComplexArray:
        return self.loop(fraction)

    def strongest(self, crossing: Crossing, order: int | None = None) -> tuple[int, ComplexArray]:
        force = self.loop.force(eigenvector(self.loop, crossing))
        moved = np.einsum("qab,qb->qa", self.loop.lines(np.array([crossing.fraction]))[0], force)
        return _strongest(crossing, self.loop.orders, force, moved, order)


@dataclass(frozen=True, eq=False)
class HeldInHarmonics(HeldJoints):
    """By multi-frequency; ``lines`` in Hz is where the search for resonances starts, ``highest``
    in Hz is the last frequency that matters.

    A machine of which ``modes`` are known is seen by them where its joints are held alike at every ν, which is where
    crossings are looked for: a sum of modes costs a hundredth of coupling all its parts on every line.
    """

    machine: Machine
    cutting: Cutting
    lines: Array
    highest: float
    carried_on: bool = True
    tolerance: float = 1e-4
    modes: bool = False

    @cached_property
    def assembly(self) -> Assembly:
        """The machine between its tool point and its nonlinear joints."""
        tool = self.machine.tool_dofs
        return Assembly(self.machine, tool, tool)

    @cached_property
    def _steady(self) -> dict[int, Joint | None]:
        """Of every nonlinear joint the laws that depend on no amplitude."""
        found: dict[int, Joint | None] = {}
        for i in self.assembly.nonlinear:
            laws = tuple(law for law in self.assembly.joints[i].laws if is_linear(Joint((law,))))
            found[i] = Joint(laws) if laws else None
        return found

    def loop(self, speed: float, level: int, held: Held, coarse: bool = False) -> HeldLoop:
        tooth = self.cutting.cuts_per_revolution * speed / 60
        P = (int(np.ceil(self.highest / tooth)) + _PAST) * 2 ** (level if coarse else level + 1)

        def receptance(frequency: Array) -> ComplexArray:
            return self.receptance(frequency, *held(frequency[:, frequency.shape[1] // 2] / tooth))

        if self.modes and isinstance(held, Constant):
            receptance = self._model(held)
        axes = tuple("xy".index(axis) for axis in self.machine.tool_axes)
        return _Harmonics(HarmonicLoop(receptance, self.cutting, axes, tooth, P))

    def resolved(self, frequency: float, gain: ComplexArray) -> Shape:
        at = Constant(frequency, gain)
        if self.modes:
            model = self._model(at)
            return shape(ToolPoint(model, model.lines, model.axes, sampled=False))

        def receptance(f: Array) -> ComplexArray:
            return self.receptance(f[:, None], *at(f))[:, 0]

        return shape(ToolPoint(receptance, self.lines, self.machine.tool_axes, sampled=False))

    @cached_property
    def _open(self) -> OpenJoints:
        return OpenJoints.of(self.machine)

    @cached_property
    def _models(self) -> dict[tuple[float, bytes], ToolModel]:
        return {}

    def _model(self, at: Constant) -> ToolModel:
        """The tool with these joints; one start is asked for again at every speed."""
        key = (at.frequency, at.gain.tobytes())
        if key not in self._models:
            self._models[key] = self._open.models(at.gain[None], at.frequency)[0]
        return self._models[key]

    def receptance(self, frequency: Array, chatter: Array, gain: ComplexArray) -> ComplexArray:
        """G in m/N at frequencies in Hz of either sign, (g, lines), shape (g, lines, n, n).

        Outside the frequencies known it is carried on as in `Spectrum`, unless ``carried_on`` is false.
        """
        f, (low, high) = np.abs(frequency), self.machine.known_band
        G = self._held(np.clip(f, low, high), chatter, gain)
        for outside, edge, inward in ((f > high, high, 1 / 1.1), (f < low, low, 1.1)):
            if not outside.any():
                continue
            rows, columns = np.nonzero(outside)
            ends = self._held(np.tile(np.array([edge, inward * edge]), (len(f), 1)), chatter, gain).real[rows]
            if self.carried_on:
                G[rows, columns] = carried(ends[:, 0], ends[:, 1], f[rows, columns] / edge, inward)
            else:
                G[rows, columns] = 0.0 if inward < 1 else ends[:, 0]
        return np.where((frequency < 0)[:, :, None, None], G.conj(), G)

    def _held(self, frequency: Array, chatter: Array, gain: ComplexArray) -> ComplexArray:
        lines = frequency.shape[1]
        omega, turning = 2 * np.pi * frequency.ravel(), 2 * np.pi * chatter
        held = np.empty((len(omega), len(self._steady)), dtype=complex)
        for j, (i, steady) in enumerate(self._steady.items()):
            fixed, bent = np.zeros(len(omega), dtype=complex), gain[:, i]
            if steady is not None:
                fixed = steady.first_harmonic(0.0, omega).gain
                bent = bent - steady.first_harmonic(0.0, turning).gain
            held[:, j] = fixed + np.repeat(bent.real, lines) + 1j * omega * np.repeat(bent.imag / turning, lines)
        G = _coupled(self.assembly.at(omega), held, len(self.assembly.joints))
        return G.reshape(*frequency.shape, *G.shape[1:])


def _coupled(view: View, gain: ComplexArray, joints: int) -> ComplexArray:
    """Receptance from the forces to the outputs with the nonlinear joints at these gains, (lines, outputs, inputs)."""
    if gain.shape[1] == 1:
        g = gain[:, :, None]
        return np.asarray(view.Hof[:, joints:] - view.Hoz[:, joints:] * (g / (1 + view.Hzz * g)) * view.Hzf)
    return view.coupled(gain, joints)


def _strongest(
    crossing: Crossing, orders: Array, force: ComplexArray, moved: ComplexArray, order: int | None
) -> tuple[int, ComplexArray]:
    """The strongest line; of two alike the one of positive frequency."""
    size = np.linalg.norm(moved, axis=1)
    at = int(np.flatnonzero(size >= (1 - 1e-9) * np.max(size))[-1])
    kept = at if order is None else int(np.flatnonzero(orders == order)[0])
    at = kept if size[kept] >= _HALF * size[at] else at
    return int(orders[at]), force[at] if crossing.fraction + orders[at] > 0 else force[at].conj()
