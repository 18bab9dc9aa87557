"""What configurations are worth: the quantities of a study, block by block."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
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
from .study import Study, read_study
from .variants import Machines, changed_joints, joint_units, setting, with_joints

_STATIC_LINE = 0.1
"""Hz; low enough for the receptance to be the static one, high enough for free parts."""
_DEPTHS = frozenset({"pocket-depth", "pocket-speed", "removal-rate", "minimum-depth"})


@dataclass(frozen=True)
class Evaluation:
    """Evaluates rows of a study's plan; what travels to a worker is the file's name and the identified joints."""

    source: Path
    joints: tuple[tuple[str, Joint], ...] = ()
    """Joints that the base machine leaves to be identified, by connection."""

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
        return joint_units(self._machines.of(self._study.base).machine, self._study.factors)

    def __reduce__(self) -> tuple[type[Evaluation], tuple[object, ...]]:
        return Evaluation, (self.source, self.joints)

    def __call__(self, first: int, end: int) -> dict[str, Array]:
        """Every quantity that the study asks for, of the configurations from ``first`` to before ``end``."""
        rows = [self._one(numbers) for numbers in self._numbers[first:end]]
        return {name: np.array([row[name] for row in rows]) for name in self._study.quantities}

    def _one(self, numbers: Array) -> dict[str, float]:
        case = setting(self._study, numbers, self._places)
        part = self._machines.of(case.file, case.document)
        machine = part.machine
        if case.sample is not None:
            machine = part.drawn(case.sample, self._study.samples, self._study.seed)
        if case.joints:
            machine = with_joints(machine, changed_joints(machine, case.joints))
        wanted = set(self._study.quantities)
        out = {"weight": part.weight} if "weight" in wanted else {}
        if wanted == {"weight"}:
            return out
        model = machine_model(machine, float(np.mean(_band(machine)))) if part.has_modes else None
        if "static-compliance" in wanted:
            G = frozen_receptance(machine, _STATIC_LINE, 0.0).receptance if model is None else model(np.zeros(1))
            out["static-compliance"] = float(np.max(np.abs(np.einsum("fii->fi", G))))
        if wanted & (_DEPTHS | {"peak-receptance"}):
            tools = [self._tool(machine, model, A) for A in self._study.amplitudes]
            out["peak-receptance"] = max(_peak(tool) for tool in tools)
            if wanted & _DEPTHS:
                out |= self._depths(machine, tools, self._machines.cut(case))
        return out

    def _tool(self, machine: Machine, model: ToolModel | None, amplitude: float) -> ToolModel | FRF:
        """The tool point as modes, or on lines close enough where the amplitude or a component allows no modes."""
        return model if model is not None and amplitude == 0 else operating_receptance(machine, amplitude).frf

    def _depths(self, machine: Machine, tools: list[ToolModel | FRF], cutting: Cutting) -> dict[str, float]:
        speeds = self._study.speeds if len(self._study.speeds) else cutting.speeds(100)
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


def _band(machine: Machine) -> tuple[float, float]:
    if machine.frequency is None:
        raise InputError(f"{machine.where}: no frequency in [response], a study needs the band")
    return machine.frequency


def _peak(tool: ToolModel | FRF) -> float:
    """Largest direct receptance on the lines, in m/N; those of modes stand at the resonances."""
    G = tool(tool.lines) if isinstance(tool, ToolModel) else tool.receptance
    return float(np.max(np.abs(np.einsum("fii->fi", G))))
