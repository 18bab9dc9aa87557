"""Machines of a study: the base with some values changed, each made once and kept while it is needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jointlib.arrays import ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint

from ..components.component import Component
from ..components.static_load import axis_of
from ..cutting.process.cutting import Cutting
from ..files.machine_file import cutting_table, read_cutting, read_machine
from ..model.joint_places import changed_joints
from ..model.machine import Machine
from ..statics.working_point import tangents
from ..tool.chatter_band import chatter_band, modes_at_rest
from ..tool.machine_model import OpenJoints
from ..tool.tool_model import ToolModel, Undamped
from ..uncertainty.drawn_machines import drawn_cut, sampled_machines
from .settings import Setting, plain
from .study import Study

_KEPT = 24
_CUTS = 256


@dataclass(frozen=True, eq=False)
class Variant:
    """A machine whose joints may still be changed."""

    machine: Machine
    _drawn: dict[tuple[int, int], list[Machine]] = field(default_factory=dict)

    @cached_property
    def cutting(self) -> Cutting:
        """The cut of the machine file."""
        if self.machine.cutting is None:
            raise InputError(f"{self.machine.where}: no [cutting], a study of depths needs a cutting operation")
        return Cutting(**self.machine.cutting)

    @cached_property
    def weight(self) -> float:
        """Mass of the components in kg; those whose file tells no mass are left out."""
        return sum(max(_moved(component, axis) for axis in range(3)) for component in self.machine.components)

    def drawn(self, sample: int, count: int, seed: int) -> Machine:
        """One of ``count`` machines with joints and measured FRFs drawn from what is known of their errors.

        The draws of a connection or component are told by its name: designs are compared over the same ones.
        """
        key = count, seed
        if key not in self._drawn:
            self._drawn[key], _ = sampled_machines(self.machine, count, seed)
        return self._drawn[key][sample]

    @cached_property
    def modes(self) -> ToolModel | None:
        """The tool point at rest as a sum of modes, if it is one: a decomposition tells it at every frequency."""
        return modes_at_rest(self.machine)

    @cached_property
    def _open(self) -> OpenJoints:
        return OpenJoints.of(self.machine)

    @cached_property
    def _middle(self) -> float:
        return chatter_band(self.machine).middle

    @cached_property
    def _gains(self) -> ComplexArray:
        gains: ComplexArray = tangents(self.machine, self._middle)[0]
        return gains

    def changed(self, of: Setting, samples: int, seed: int) -> Machine:
        """The machine of a configuration: as drawn, and with the parameters of its joints."""
        machine = self.machine if of.sample is None else self.drawn(of.sample, samples, seed)
        return with_joints(machine, changed_joints(machine, of.joints)) if of.joints else machine

    def models(self, settings: Sequence[Setting], samples: int, seed: int) -> list[ToolModel | None]:
        """Tool points at rest as modes, of configurations that differ in their joints; None where there are no modes.

        The equations of motion with every joint open are those of all of them, and are decomposed together.
        """
        models = [self.modes] * len(settings)
        other = [i for i, of in enumerate(settings) if of.joints or of.sample is not None]
        if self.modes is None or not other:
            return models
        gains = np.array([self._changed_gains(settings[i], samples, seed) for i in other])
        try:
            found: list[ToolModel | None] = [*self._open.models(gains, self._middle)]
        except InputError:
            found = [self._alone(gain) for gain in gains]
        for i, model in zip(other, found, strict=True):
            models[i] = model
        return models

    def _alone(self, gain: ComplexArray) -> ToolModel | None:
        try:
            return self._open.models(gain[None], self._middle)[0]
        except Undamped as error:
            if error.unstable:
                raise
            return None
        except InputError:
            return None

    def _changed_gains(self, of: Setting, samples: int, seed: int) -> ComplexArray:
        if of.sample is not None or self.machine.static is not None:
            gains: ComplexArray = tangents(self.changed(of, samples, seed), self._middle)[0]
            return gains
        gains, joints = self._gains.copy(), self.machine.joints()
        for i, joint in enumerate(changed_joints(self.machine, of.joints)):
            if joint is not joints[i]:
                gains[i] = complex(joint.first_harmonic(0.0, 2 * np.pi * self._middle).gain)
        return gains


def _moved(component: Component, axis: int) -> float:
    """The mass in kg that moves along an axis: what a unit acceleration pulls at the dofs along it."""
    pull = component.weight(np.eye(3)[axis])
    if pull is None:
        return 0.0
    return float(sum(f for f, dof in zip(pull, component.dofs, strict=True) if axis_of(dof.rpartition(".")[2]) == axis))


def with_joints(machine: Machine, joints: tuple[Joint, ...]) -> Machine:
    """The machine with these joints in its flexible connections, in order."""
    new = dict(zip((c.name for c in machine.flexible), joints, strict=True))
    kept = (replace(c, joint=new[c.name], identify=None) if c.name in new else c for c in machine.connections)
    return replace(machine, connections=tuple(kept))


@dataclass(eq=False)
class Machines:
    """The machines of a study as they are asked for; the last few are kept, with what was computed of them."""

    found: Mapping[str, Joint]
    """Joints that the base machine leaves to be identified, by connection."""
    _kept: dict[tuple[Path, tuple[tuple[str, Any], ...]], Variant] = field(default_factory=dict)
    _cuts: dict[tuple[Path, tuple[tuple[str, Any], ...]], Cutting] = field(default_factory=dict)
    _tables: dict[tuple[Path, tuple[tuple[str, Any], ...]], dict[str, Any]] = field(default_factory=dict)

    def of(self, file: Path, document: tuple[tuple[str, Any], ...] = ()) -> Variant:
        """The machine of a file with changes, before parameters of its joints are changed."""
        key = file, document
        if key not in self._kept:
            machine = read_machine(file, {path: plain(value) for path, value in document})
            machine = replace(machine, components=tuple(self._known(c) for c in machine.components))
            for connection in machine.flexible:
                if connection.joint is None and connection.name in self.found:
                    machine = machine.with_joint(connection.name, self.found[connection.name])
            _make_room(self._kept, _KEPT)
            self._kept[key] = Variant(machine)
        return self._kept[key]

    def base(self, study: Study) -> Machine:
        """The machine that the designs change, with the first of its tools."""
        return self.of(study.base, study.with_tools[0]).machine

    def _known(self, component: Component) -> Component:
        """The same component of a machine that is kept, with what was computed of it, if there is one."""
        others = (other for kept in self._kept.values() for other in kept.machine.components)
        return next((other for other in others if alike(other, component)), component)

    def cut(self, of: Setting, samples: int = 0, seed: int = 0) -> Cutting:
        """The cutting operation of a configuration; of one of ``samples``, with the coefficients drawn for it."""
        found = self._cut(of)
        return found if of.sample is None else drawn_cut(found, of.sample, samples, seed)

    def _cut(self, of: Setting) -> Cutting:
        if not of.cutting:
            return self.of(of.file, of.document).cutting
        tool = tuple(one for one in of.document if one[0].startswith("tool."))  # its file may tell of the cut
        key = of.file, (*tool, *of.cutting)
        if key not in self._cuts:
            _make_room(self._cuts, _CUTS)
            if (of.file, tool) not in self._tables:
                self._tables[of.file, tool] = cutting_table(of.file, dict(tool))
            changes = {path: plain(value) for path, value in of.cutting}
            self._cuts[key] = read_cutting(of.file, self._tables[of.file, tool], changes)
        return self._cuts[key]


def alike(one: Any, other: Any) -> bool:
    """Whether two declarations say the same."""
    if type(one) is not type(other):
        return False
    if is_dataclass(one):
        return all(alike(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and bool(np.all(one == other))
    if isinstance(one, scipy.sparse.csc_matrix):
        return bool(one.shape == other.shape and (one != other).nnz == 0)
    if isinstance(one, Mapping):
        return list(one) == list(other) and all(alike(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(alike(a, b) for a, b in zip(one, other, strict=True))
    return one is other or (isinstance(one, str | int | float) and bool(one == other))


def _make_room(kept: dict[Any, Any], most: int) -> None:
    while len(kept) >= most:
        del kept[next(iter(kept))]
