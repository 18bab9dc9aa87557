"""What configurations are worth: the quantities of a study, block by block."""

from __future__ import annotations

import threading
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError
from jointlib.frf import FRF
from jointlib.joint import Joint

from ..cutting.amplitude.chattering_tool import operating_receptance
from ..cutting.process.cutting import Cutting
from ..cutting.rest.together import static_compliance
from ..model.joint_places import joint_units
from ..model.machine import Machine
from ..model.spindle_speed import depends_on_speed
from ..operating.operating_point import frozen_receptance
from ..tool.at_rest import tool_at_rest
from ..tool.chatter_band import chatter_band
from ..tool.tool_model import ToolModel
from .asked import DEPTHS
from .conditions import Case
from .inputs import inputs_hash
from .settings import Setting, setting
from .speed_dependent import SpeedDependent
from .study import Study
from .study_file import read_study
from .tool_points import Cut, Tips, direct, pockets_of
from .variants import Machines, Variant

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
    files: str = ""
    """Hash of what the study stands on when the run began; where it is given, files that change stop the run."""
    tools: tuple[str, ...] = ()
    """Tools that were asked for in the place of those that the file names."""

    @cached_property
    def _study(self) -> Study:
        return read_study(self.source, self.tools)

    @cached_property
    def _numbers(self) -> Array:
        return self._study.numbers()

    @cached_property
    def _machines(self) -> Machines:
        return Machines(dict(self.joints))

    @cached_property
    def _places(self) -> dict[str, str]:
        return joint_units(self._machines.base(self._study), (f.path for f in self._study.factors))

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return _arrived, (self.source, self.joints, self.run, self.files, self.tools)

    def __call__(self, first: int, end: int) -> dict[str, Array]:
        """Every quantity that the study asks for, of the configurations from ``first`` to before ``end``."""
        return self.of(self._numbers[first:end], first)

    def of(self, numbers: Array, first: int) -> dict[str, Array]:
        """Every quantity of configurations with these numbers, the first of which is row ``first`` of the plan.

        They are not numbers where a machine has none: it gives way under its load, or a mode of its tool never settles.
        """
        asked = [(row, self._study.case(first + i)) for i, row in enumerate(numbers)]
        try:
            return self.each(asked)
        except (CheckFailed, InputError):
            if self.files and self.files != inputs_hash(self._study):
                raise
            able = [i for i, one in enumerate(asked) if not self.refused(*one)]
        out = {name: np.full(len(asked), np.nan) for name in self._study.quantities}
        for name, values in (self.each([asked[i] for i in able]) if able else {}).items():
            out[name][able] = values
        return out

    def refused(self, numbers: Array, case: Case) -> str:
        """The sentence in which a configuration is refused; empty where it has its results."""
        try:
            self.each([(numbers, case)])
        except (CheckFailed, InputError) as error:
            return str(error)
        return ""

    def each(self, asked: Sequence[tuple[Array, Case]]) -> dict[str, Array]:
        """Every quantity of configurations told by the numbers of their factors and their conditions."""
        settings = [self.setting(*one) for one in asked]
        out = {name: np.full(len(asked), np.nan) for name in self._study.quantities}
        tips, cuttings = Tips(), dict[int, Cutting]()  # the cut of every row, where there is one
        for rows in _by_machine(settings):
            part = self._machines.of(settings[rows[0]].file, settings[rows[0]].document)
            if "weight" in out:
                out["weight"][rows] = part.weight
            if part.machine.cutting is not None:
                cuttings |= {
                    row: self._machines.cut(settings[row], self._study.samples, self._study.seed) for row in rows
                }
            if set(out) != {"weight"}:
                self._meet(part, {row: settings[row] for row in rows}, cuttings, out, tips)
        if "peak-receptance" in out:
            out["peak-receptance"] = tips.peaks(len(asked))
        if DEPTHS & set(out):
            found = self._depths(tips, [cuttings[row] for row in range(len(asked))], asked)
            out |= {name: values for name, values in found.items() if name in out}
        return out

    def _meet(
        self,
        part: Variant,
        settings: Mapping[int, Setting],
        cuttings: Mapping[int, Cutting],
        out: dict[str, Array],
        tips: Tips,
    ) -> None:
        """Static compliances and tool points of configurations, by row, that differ in joints and cut only."""
        draws = self._study.samples, self._study.seed
        models = dict(zip(settings, part.models(list(settings.values()), *draws), strict=True))
        modal = {row: model for row, model in models.items() if model is not None}
        if "static-compliance" in out:
            if modal:
                out["static-compliance"][list(modal)] = static_compliance(list(modal.values()))
            for row in models.keys() - modal.keys():
                _refuse_unstable(part.changed(settings[row], *draws))
                at_rest = frozen_receptance(part.changed(settings[row], *draws), _STATIC_LINE, 0.0)
                out["static-compliance"][row] = np.max(direct(at_rest.receptance))
        if not set(out) & (DEPTHS | {"peak-receptance"}):
            return
        by_speed = bool(set(out) & DEPTHS) and depends_on_speed(part.machine)
        for amplitude in self._study.amplitudes:
            for row, of in settings.items():
                tool: ToolModel | FRF | None = modal.get(row) if amplitude == 0 else None
                cut: Cut | None = tool
                if tool is None or by_speed:
                    machine, cutting = part.changed(of, *draws), cuttings.get(row)
                    if tool is None and amplitude == min(self._study.amplitudes):
                        _refuse_unstable(machine)
                    if tool is None:
                        tool = cut = operating_receptance(machine, amplitude, cutting=cutting).frf
                    if by_speed:
                        cut = SpeedDependent(machine, amplitude)
                    elif amplitude == 0 and cutting is not None:
                        cut = tool_at_rest(machine)
                assert cut is not None
                tips.add(row, tool, cut, part.machine.tool_axes)

    def setting(self, numbers: Array, case: Case) -> Setting:
        """What is changed in which file for a configuration."""
        return setting(self._study, numbers, case, self._places)

    def numbers(self, designs: Array) -> Array:
        """Rows of the plan that belong to designs, given as quantiles (designs, design factors)."""
        return replace(self._study, found=designs).numbers()

    def _depths(self, tips: Tips, cuttings: Sequence[Cutting], asked: Sequence[tuple[Array, Case]]) -> dict[str, Array]:
        """Depths and pockets of every configuration, the lowest limit over its tool points counting."""
        study = self._study
        speeds = np.array([
            cutting.speeds(study.speed_count)
            if "cutting.speed" in case.changes or not len(study.speeds)
            else study.speeds
            for cutting, (_, case) in zip(cuttings, asked, strict=True)
        ])  # fmt: skip
        pockets = bool(set(study.quantities) & DEPTHS - {"minimum-depth"})
        found = tips.limits(range(len(cuttings)), cuttings, speeds, study.lobes, pockets)
        out = {"minimum-depth": found.minimum_depth}
        if pockets:
            out |= {name: np.full(len(cuttings), np.nan) for name in ("pocket-depth", "pocket-speed", "removal-rate")}
            groups = self._told_apart(asked, speeds)
            for row, one in pockets_of(tips, cuttings, speeds, found.depth, groups, study.lobes).items():
                out["pocket-depth"][row], out["pocket-speed"][row] = one.depth, one.speed
                out["removal-rate"][row] = np.nan if one.removal_rate is None else one.removal_rate
        return out

    def _told_apart(self, asked: Sequence[tuple[Array, Case]], speeds: Array) -> list[list[int]]:
        """The samples of every design in every case: who sets the speed knows the latter, and not the sample."""
        known = [i for i, factor in enumerate(self._study.factors) if not factor.uncertain]
        found: dict[Hashable, list[int]] = {}
        for row, (numbers, case) in enumerate(asked):
            found.setdefault((case, numbers[known].tobytes(), speeds[row].tobytes()), []).append(row)
        return list(found.values())


def _refuse_unstable(machine: Machine) -> None:
    """Raise for a machine that does not stand by itself: its receptance looks like that of one that does."""
    undamped = chatter_band(machine).undamped
    if undamped is not None and undamped.unstable:
        raise undamped


def _by_machine(settings: Sequence[Setting]) -> list[list[int]]:
    """Configurations that differ in their joints and their cut only."""
    found: dict[tuple[object, object], list[int]] = {}
    for row, of in enumerate(settings):
        found.setdefault((of.file, of.document), []).append(row)
    return list(found.values())


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


def _arrived(
    source: Path, joints: tuple[tuple[str, Joint], ...], run: str, files: str, tools: tuple[str, ...]
) -> Evaluation:
    """The evaluation in a worker: that of earlier tasks of the same run with all it has read, or a new one."""
    known: Evaluation | None = getattr(_LATEST, "evaluation", None)
    if known is None or not run or known.run != run:
        known = _LATEST.evaluation = Evaluation(source, joints, run, files, tools)
    return known
