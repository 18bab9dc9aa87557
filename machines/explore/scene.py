"""What follows from a setting of the controls, at once: receptance, describing functions, lobes."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint

from ..compare.comparison import Comparison
from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.amplitude.pocket import Pocket, best_pocket
from ..files.named_tools import USE
from ..model.joint_places import changed_joints, rows_of
from ..model.machine import Machine
from ..report.comparison_section import comparison_section
from ..study.study import Study
from ..study.variants import Machines, with_joints
from ..tool.chatter_band import modes_at_rest
from .built import Built, Moment
from .controls import AMPLITUDE, Control, chosen
from .curves import Curves, drawn, leading, limit
from .knobs import controls_of
from .measured import Measured, Tried, laid_over, records_of, tried_of
from .report import setting_page
from .save import free_target, save_machine, write_new
from .scatter import Scatter, designs, study_of, widened

__all__ = ["Curves", "Explorer", "Reading", "Scatter", "Summary"]

_KEPT_MACHINES, _KEPT_RESULTS = 16, 64
_Changes = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class Reading:
    """The limit at one speed, as `jointlib lobes` has it."""

    speed: float
    """rpm."""
    depth: float
    """m; inf where the cut is stable at any depth."""
    chatter_frequency: float
    """Hz; nan where the depth is inf."""
    kind: str
    """``hopf`` or ``flip``; empty where the depth is inf."""
    lobe: int
    method: str
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Summary:
    """A setting in a few numbers, to be compared with another."""

    minimum_depth: float | None
    """m, by the fast method; None without a cut."""
    pocket: Pocket | None
    """The recommended one, by the fast method."""
    static_compliance: float
    """m/N, the larger of x and y."""
    peak_receptance: float
    """m/N, the larger of x and y, at the chosen amplitude."""


@dataclass(frozen=True, eq=False)
class Explorer:
    """One machine file and all that can be turned in it; it holds nothing of who asks, and any thread may ask.

    Parameters
    ----------
    machine
        A machine file.
    study, results
        A study of it and the folder of its results, for `scatter`.
    joints
        Joints that the file leaves to be identified, by connection.
    tool
        Which of several named tools is in the machine; empty: the one that the file says.
    measured
        Files of measured frequency responses to lay over the receptance, beside those of ``[[compare]]``.
    """

    machine: Path
    study: Path | None = None
    results: Path | None = None
    joints: Mapping[str, Joint] = field(default_factory=dict)
    tool: str = ""
    measured: tuple[Path, ...] = ()
    _file: Lock = field(default_factory=Lock, init=False, repr=False)

    def __post_init__(self) -> None:
        if not self.base.tool:
            raise InputError(f"{self.machine}: no [tool], expected the tool point to look at")
        if (self.study is None) != (self.results is None):
            raise InputError("explore: a study and the folder of its results, expected both or neither")
        _ = self._study, self.records, self.tried  # a study or measurement of another machine is refused at once

    @cached_property
    def base(self) -> Machine:
        """The machine as the file has it, with its joints."""
        return self._document(())

    @cached_property
    def records(self) -> tuple[tuple[Measured, ...], tuple[str, ...]]:
        """Measured frequency responses of the tool point, and what is to be said of them."""
        return records_of(self.base, (*self.base.compare, *self.measured))

    @cached_property
    def tried(self) -> tuple[Tried, ...]:
        """Test cuts of the machine file, to be marked on the lobes."""
        return tried_of(self.base)

    def laid_over(self, curves: Curves) -> tuple[Comparison, ...]:
        """Each of them over the receptance that is drawn."""
        return tuple(laid_over(one, curves) for one in self.records[0])

    @cached_property
    def controls(self) -> tuple[Control, ...]:
        """What may be changed, in the order of the groups tool, axes, joints, cutting."""
        found = controls_of(self.base, self._chosen)
        return found if self._study is None else tuple(widened(found, self._study))

    @cached_property
    def by_key(self) -> Mapping[str, Control]:
        """The controls by their keys."""
        return {control.key: control for control in self.controls}

    def curves(self, values: Mapping[str, object], exact: bool = False) -> Curves:
        """Everything that is drawn of a setting, by control in the unit of the control; what is left out is as it was.

        Lobes come from the fast method of the process, from `jointlib lobes`'s own where ``exact``, which in milling
        takes seconds.
        """
        return self._curves(self._setting(values), exact)

    def leading(self, curves: Curves) -> str | None:
        """Of the joints in `Curves.gains` the one that holds the leading mode; None without any."""
        return leading(self.base, self._places, curves)

    def at(self, values: Mapping[str, object], speed: object) -> Reading:
        """The limit at a spindle speed in rpm, by the method of `jointlib lobes`."""
        setting = self._setting(values)
        cutting = self._moment(setting).cutting
        if cutting is None:
            raise InputError(f"{self.machine}: no [cutting], lobes need a cutting operation")
        low, high = cutting.speed or (0.0, np.inf)
        if isinstance(speed, bool) or not isinstance(speed, int | float) or not low <= speed <= high or speed == 0:
            raise InputError(f"speed: {speed!r}, expected {low:g} to {high:g} rpm")
        return self._reading(setting, float(speed))

    def summary(self, values: Mapping[str, object]) -> Summary:
        """A setting in a few numbers, lobes by the fast method."""
        curves, moment = self.curves(values), self.moment(values)
        lowest = best = None
        if moment.cutting is not None and len(curves.speed):
            lowest, best = float(np.min(curves.depth)), self._best(moment, curves)
        peak = max(float(np.max(np.abs(G))) for G in curves.receptance.values())
        return Summary(lowest, best, moment.built.static_compliance, peak)

    def _best(self, moment: Moment, curves: Curves) -> Pocket | None:
        """The recommended pocket of a setting, by the method of its curves."""
        cutting = moment.cutting
        return (
            None if cutting is None else best_pocket(curves.speed, curves.sure, cutting, limit(moment, curves.method))
        )

    def scatter(self) -> Scatter | None:
        """The designs of the study; None without one."""
        return None if self._study is None or self.results is None else designs(self._study, self.results, self.by_key)

    def moment(self, values: Mapping[str, object]) -> Moment:
        """The machine of a setting, what it cuts and how far its tool point moves."""
        return self._moment(self._setting(values))

    def changes(self, values: Mapping[str, object]) -> dict[str, Any]:
        """What the machine file of a setting has in the place of what it has now, by path."""
        return self._changes(self._setting(values))

    def save(self, values: Mapping[str, object], folder: Path, name: object) -> tuple[Path, ...]:
        """Write the machine of a setting into a folder; the files written, the machine file first."""
        return save_machine(self.machine, self._chosen | self.changes(values), self.joints, folder, name)

    def report(self, values: Mapping[str, object], folder: Path, name: object) -> Path:
        """Write a page about a setting, with lobes by the method of `jointlib lobes`; in milling it takes seconds."""
        target = free_target(folder, name, ".html")
        setting = self._setting(values)
        page = setting_page(self._moment(setting), self.curves(values), self.controls, dict(setting), self._words)
        laid = self.laid_over(self.curves(values))
        if laid:
            page = replace(page, sections=[*page.sections, comparison_section(laid, None)])
        write_new(target, page.html())
        return target

    @property
    def _chosen(self) -> dict[str, Any]:
        """The change of the file that puts the tool in."""
        return {USE: self.tool} if self.tool else {}

    @property
    def _words(self) -> str:
        """Options of `jointlib explore` beside the machine."""
        said = ["--tool", self.tool] if self.tool else []
        return shlex.join([*said, *(word for file in self.measured for word in ("--measured", str(file)))])

    def _setting(self, values: Mapping[str, object]) -> _Changes:
        return tuple(chosen(self.by_key, values).items())

    def _changes(self, setting: _Changes) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, value in setting:
            found |= self.by_key[key].changes(value)
        return found

    @cached_property
    def _machines(self) -> Machines:
        return Machines(self.joints)

    # What follows is kept by the values that differ from the file's, the last few of each.

    @cached_property
    def _curves(self) -> Callable[[_Changes, bool], Curves]:
        return lru_cache(_KEPT_RESULTS)(self._draw)

    @cached_property
    def _reading(self) -> Callable[[_Changes, float], Reading]:
        return lru_cache(_KEPT_RESULTS)(self._read_off)

    @cached_property
    def _built(self) -> Callable[[_Changes, _Changes], Built]:
        return lru_cache(_KEPT_MACHINES)(self._build)

    @cached_property
    def _study(self) -> Study | None:
        if self.study is None or self.results is None:
            return None
        return study_of(self.study, self.results, self.machine, self.base.tool_name)

    @cached_property
    def _has_modes(self) -> bool:
        return modes_at_rest(self.base) is not None

    @cached_property
    def _places(self) -> Mapping[str, str]:
        """The place that every connection belongs to: its own name, or that of a bundle or of others alike."""
        groups = dict.fromkeys(c.group for c in self.controls if c.key.startswith(("bundle.", "connection.")))
        of = {row: group for group in groups for row in rows_of(self.base, group)}
        return {c.name: of.get(c.name, c.name) for c in self.base.flexible}

    def _document(self, changes: _Changes) -> Machine:
        """The machine of the file with changes, one at a time: machines share what was computed of their parts."""
        with self._file:
            return self._machines.of(self.machine, (*self._chosen.items(), *changes)).machine

    def _moment(self, setting: _Changes) -> Moment:
        """The machine of a setting; those that differ in the cut alone share what was computed of the machine."""
        changes = self._changes(setting)
        cut = {path.partition(".")[2]: value for path, value in changes.items() if path.startswith("cutting.")}
        joints = {path: value for path, value in changes.items() if ".joint." in path}
        other = {path: v for path, v in changes.items() if path not in joints and not path.startswith("cutting.")}
        built = self._built(tuple(other.items()), tuple(joints.items()))
        machine = replace(built.machine, cutting={**(built.machine.cutting or {}), **cut}) if cut else built.machine
        return Moment(built, machine, self.by_key[AMPLITUDE].si(dict(setting).get(AMPLITUDE, 0.0)))

    def _build(self, other: _Changes, joints: _Changes) -> Built:
        machine = self._document(other)
        return Built(with_joints(machine, changed_joints(machine, joints)) if joints else machine, self._has_modes)

    def _read_off(self, setting: _Changes, speed: float) -> Reading:
        moment = self._moment(setting)
        moment.refuse_slow(speed)
        chart = lobes_at_amplitude(moment.machine, np.array([speed]), moment.amplitude)
        return Reading(
            speed,
            float(chart.depth[0]),
            float(chart.chatter_frequency[0]),
            str(chart.kind[0]),
            int(chart.lobe[0]),
            chart.method,
            chart.warnings,
        )

    def _draw(self, setting: _Changes, exact: bool) -> Curves:
        tool = self.by_key[AMPLITUDE]
        return drawn(self._moment(setting), self._places, tool.si(tool.high), exact)
