"""What configurations are worth: the quantities of a study, block by block."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.frf import FRF
from jointlib.joint import Joint

from ..lobes.amplitude import operating_receptance
from ..lobes.cutting import Cutting
from ..lobes.machine_model import machine_model
from ..lobes.pocket import best_pocket
from ..lobes.solve import stability_lobes
from ..lobes.tool_model import ToolModel
from ..machine import AXES, Machine
from ..operating import frozen_receptance
from .asked import DEPTHS
from .conditions import Case
from .study import Study, read_study
from .variants import Machines, Setting, changed_joints, joint_units, setting, with_joints

_CLOSER = 5
"""Looks at a peak, each four times as close; the last leaves 1e-5 of it."""
_STATIC_LINE = 0.1
"""Hz; low enough for the receptance to be the static one, high enough for free parts."""


_LATEST = threading.local()


@dataclass(frozen=True)
class Evaluation:
    """Evaluates rows of a study's plan; what travels to a worker is the file's name and the identified joints."""

    source: Path
    joints: tuple[tuple[str, Joint], ...] = ()
    """Joints that the base machine leaves to be identified, by connection."""
    run: str = ""
    """A word for one run of the study: within it a worker reads the files once."""

    @cached_property
    def _study(self) -> Study:
        return read_study(self.source)

    @cached_property
    def _numbers(self) -> Array:
        return self._study.numbers()

    @cached_property
    def _machines(self) -> Machines:
        return Machines(dict(self.joints))

    @cached_property
    def _places(self) -> dict[str, str]:
        return joint_units(self._machines.of(self._study.base).machine, (f.path for f in self._study.factors))

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return _arrived, (self.source, self.joints, self.run)

    def __call__(self, first: int, end: int) -> dict[str, Array]:
        """Every quantity that the study asks for, of the configurations from ``first`` to before ``end``."""
        return self.of(self._numbers[first:end], first)

    def of(self, numbers: Array, first: int) -> dict[str, Array]:
        """Every quantity of configurations with these numbers, the first of which is row ``first`` of the plan."""
        return self.each([(row, self._study.case(first + i)) for i, row in enumerate(numbers)])

    def each(self, asked: Sequence[tuple[Array, Case]]) -> dict[str, Array]:
        """Every quantity of configurations told by the numbers of their factors and their conditions."""
        rows = [self._one(*one) for one in asked]
        return {name: np.array([row[name] for row in rows]) for name in self._study.quantities}

    def setting(self, numbers: Array, case: Case) -> Setting:
        """What is changed in which file for a configuration."""
        return setting(self._study, numbers, case, self._places)

    def numbers(self, designs: Array) -> Array:
        """Rows of the plan that belong to designs, given as quantiles (designs, design factors)."""
        return replace(self._study, found=designs).numbers()

    def _one(self, numbers: Array, case: Case) -> dict[str, float]:
        of = self.setting(numbers, case)
        part = self._machines.of(of.file, of.document)
        machine = part.machine
        if of.sample is not None:
            machine = part.drawn(of.sample, self._study.samples, self._study.seed)
        if of.joints:
            machine = with_joints(machine, changed_joints(machine, of.joints))
        wanted = set(self._study.quantities)
        out = {"weight": part.weight} if "weight" in wanted else {}
        if wanted == {"weight"}:
            return out
        model = part.modes
        if model is not None and (of.joints or of.sample is not None):
            model = machine_model(machine, float(np.mean(_band(machine))))
        if "static-compliance" in wanted:
            G = frozen_receptance(machine, _STATIC_LINE, 0.0).receptance if model is None else model(np.zeros(1))
            out["static-compliance"] = float(np.max(_direct(G)))
        if wanted & (DEPTHS | {"peak-receptance"}):
            tools = [self._tool(machine, model, A) for A in self._study.amplitudes]
            if "peak-receptance" in wanted:
                out["peak-receptance"] = max(_peak(tool) for tool in tools)
            if wanted & DEPTHS:
                out |= self._depths(machine, tools, self._machines.cut(of), case)
        return out

    def _tool(self, machine: Machine, model: ToolModel | None, amplitude: float) -> ToolModel | FRF:
        """The tool point as modes, or on lines close enough where the amplitude or a component allows no modes."""
        return model if model is not None and amplitude == 0 else operating_receptance(machine, amplitude).frf

    def _depths(self, machine: Machine, tools: list[ToolModel | FRF], cutting: Cutting, case: Case) -> dict[str, float]:
        own = "cutting.speed" in case.changes or not len(self._study.speeds)
        speeds = cutting.speeds(self._study.speed_count) if own else self._study.speeds
        method = self._study.lobes or ("zero-order" if cutting.process == "milling" else "turning")
        axes = tuple(axis for axis in AXES if axis in machine.tool)
        charts = [
            stability_lobes(tool, cutting, speeds, method, axes=axes if isinstance(tool, FRF) else None)
            for tool in tools
        ]
        best = best_pocket(speeds, np.min([chart.depth for chart in charts], axis=0), cutting)
        nothing = float("nan")
        return {
            "minimum-depth": min(chart.minimum_depth for chart in charts),
            "pocket-depth": nothing if best is None else best.depth,
            "pocket-speed": nothing if best is None else best.speed,
            "removal-rate": nothing if best is None or best.removal_rate is None else best.removal_rate,
        }


@dataclass(frozen=True, eq=False)
class Generation:
    """Evaluates the rows of some designs of a search, which travel with it."""

    evaluation: Evaluation
    designs: Array
    """Quantiles (designs, design factors)."""
    first: int
    """Row of the plan at which they begin."""

    @cached_property
    def _numbers(self) -> Array:
        return self.evaluation.numbers(self.designs)

    def __call__(self, first: int, end: int) -> dict[str, Array]:
        """Every quantity of the configurations from ``first`` to before ``end``."""
        return self.evaluation.of(self._numbers[first - self.first : end - self.first], first)


def _arrived(source: Path, joints: tuple[tuple[str, Joint], ...], run: str) -> Evaluation:
    """The evaluation in a worker: that of earlier tasks of the same run with all it has read, or a new one."""
    known: Evaluation | None = getattr(_LATEST, "evaluation", None)
    if known is None or not run or known.run != run:
        known = _LATEST.evaluation = Evaluation(source, joints, run)
    return known


def _band(machine: Machine) -> tuple[float, float]:
    if machine.frequency is None:
        raise InputError(f"{machine.where}: no frequency in [response], a study needs the band")
    return machine.frequency


def _peak(tool: ToolModel | FRF) -> float:
    """Largest direct receptance in m/N: of modes at the very peak, of a record or at an amplitude on its lines."""
    if isinstance(tool, FRF):
        return float(np.max(_direct(tool.receptance)))
    found = 0.0
    for axis in range(_direct(tool(tool.lines[:1])).shape[1]):
        lines = tool.lines
        for _ in range(_CLOSER):
            size = _direct(tool(lines))[:, axis]
            i = int(np.argmax(size))
            found = max(found, float(size[i]))
            lines = np.linspace(lines[max(i - 1, 0)], lines[min(i + 1, len(lines) - 1)], 9)
    return found


def _direct(receptance: ComplexArray) -> Array:
    """Sizes of the direct receptances, (lines, axes)."""
    return np.asarray(np.abs(np.einsum("fii->fi", receptance)))
