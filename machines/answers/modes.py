"""Modes of a machine with what holds their energy, or of measured frequency responses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.answers.given import File, Quantity, Span, files_of, one, span
from jointlib.errors import InputError
from jointlib.io.atomic import given_target
from jointlib.io.toml_file import schema_of
from jointlib.modal_fit.fit import fit_modes
from jointlib.modal_fit.fitted_modes import FittedModes
from jointlib.shown.pictures import write_picture
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown

from ..files.opened import machine_of
from ..measured_modes.measured_responses import read_responses
from ..measured_modes.modal_component import component_of, write_component
from ..measured_modes.tool_responses import tool_responses
from ..model.machine import Machine
from ..modes.mode_energy import ModeEnergies, mode_energies
from ..modes.mode_words import leading, shown_modes, warnings
from ..modes.natural_modes import NaturalModes, natural_modes
from ..modes.static_compliance import static_compliance
from ..ranges import LARGEST_AMPLITUDE
from ..road.open_joints import with_joints
from .told.machine_modes import modes_as_json, modes_in_words
from .told.measured_modes import beyond, measured_as_json, measured_in_words

if TYPE_CHECKING:
    from ..modes.depth_sensitivity import DepthSensitivity


@dataclass(frozen=True, eq=False, repr=False)
class MachineModes(Shown):
    """Natural modes of a machine: what moves, which joint holds the energy, what stiffness would give."""

    modes: NaturalModes
    energies: ModeEnergies
    static_compliance: dict[str, float | None]
    """m/N by tool axis."""
    depth: DepthSensitivity | None
    """What the stiffness of the joints is to the depth of cut; None without a cut."""
    shown: tuple[int, ...]
    """Indices of the modes that are told: all, or the first and those that the tool feels."""
    warnings: tuple[str, ...]

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """Which mode leads at the tool and what would make it stiffer."""
        return leading(self.modes, self.energies, self.depth)

    def finding(self) -> str:
        """Which mode leads at the tool and which joint holds it."""
        return self.sentences[0]

    def columns(self) -> Columns:
        """A row per mode that is told, with the share of every joint in its energy."""
        rows = list(self.shown)
        plain = {name: (np.asarray(values)[rows], unit) for name, (values, unit) in self.modes.columns().items()}
        names = [f"share of {c.name}" for c in self.modes.machine.flexible]
        return plain | {name: (strain[rows], "") for name, strain in zip(names, self.energies.strain, strict=True)}

    def plot(self, ax: Any = None) -> Any:
        """Compliance of the tool at the resonances, in µm/N over Hz."""
        return self.modes.plot(ax)

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib modes --json`` prints."""
        return modes_as_json(self)

    def words(self) -> list[str]:
        """What ``jointlib modes`` prints."""
        return modes_in_words(self)


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredModes(Shown):
    """Modes of measured frequency responses, as a component where that was asked for."""

    fitted: FittedModes
    warnings: tuple[str, ...]
    files: tuple[Path, ...]

    def finding(self) -> str:
        """How many modes in which band, and how well they fit."""
        return self.fitted.finding()

    def columns(self) -> Columns:
        """A row per mode, with standard errors."""
        return self.fitted.columns()

    def plot(self, ax: Any = None) -> Any:
        """The stabilisation chart under the measured and fitted responses."""
        return self.fitted.plot(ax)

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib modes --json`` prints of measurements."""
        return measured_as_json(self)

    def words(self) -> list[str]:
        """What ``jointlib modes`` prints of measurements."""
        return measured_in_words(self)


def modes(
    machine: Machine | File | Iterable[File],
    *,
    amplitude: Quantity | None = None,
    all: bool = False,
    output: File | None = None,
    plot: File | None = None,
    band: Span | None = None,
    condition: str | None = None,
    most: int | None = None,
    free: bool = False,
    tool: str | None = None,
    progress: Progress | None = None,
) -> MachineModes | MeasuredModes:
    """Modes of a machine, or of measured frequency responses: ``jointlib modes``.

    Parameters
    ----------
    machine
        A machine or its file; or one or several measurement files of kind "frf".
    amplitude
        Of a machine: tool-point amplitude of the joints, m or with its unit; default: at rest.
    all
        Of a machine: tell every mode, not only the first and those that the tool feels.
    output
        Of measurements: the component file to write.
    plot
        Of measurements: the stabilisation chart to write, .svg or .png.
    band
        Of measurements: the lines that are fitted, (low, high) in Hz or ``"lo:hi"``.
    condition
        Of measurements: which one of several levels.
    most
        Of measurements: at most so many modes, the strongest.
    free
        Of measurements: of a body that nothing holds.
    tool
        Of a machine: which of several named tools is in it.
    progress
        Told of every part that takes long.
    """
    during = progress or Silent()
    files = () if isinstance(machine, Machine) else files_of(machine)
    of_measurements = {"-o": output, "--plot": plot, "--band": band, "--condition": condition, "--most": most}
    if files and _measured(files[0]):
        for name, given in (("--amplitude", amplitude is not None), ("--all", all)):
            if given:
                raise InputError(f"{name}: given with measurements, expected with a machine alone")
        if tool is not None:
            raise InputError(f"--tool: {files[0]} is no machine, expected a machine with several tools")
        given_target(output, ".toml")
        given_target(plot, ".svg", ".png", where="plot")
        lines = span(band, "--band")
        return _of_measurements(files, output, plot, lines and lines[:2], condition, most, free, during)
    for name, value in (*of_measurements.items(), ("--free", free or None)):
        if value is not None:
            where = machine.where if isinstance(machine, Machine) else ", ".join(map(str, files[:1]))
            raise InputError(f"{name}: given with {where}, expected with measurements of kind 'frf' alone")
    if not files and not isinstance(machine, Machine):
        raise InputError("modes: no file, expected a machine, or measurements of kind 'frf'")
    if len(files) > 1:
        raise InputError(f"{files[1]}: a second machine, expected one, or several measurements of kind 'frf'")
    with during.step("computing modes"):
        model, remarks = with_joints(machine_of(machine if isinstance(machine, Machine) else files[0], tool))
        if model.without_equations and model.tool:
            return _at_the_tool(model, one(amplitude, "m", "--amplitude", 0, LARGEST_AMPLITUDE) or 0.0, remarks)
        found = natural_modes(model, one(amplitude, "m", "--amplitude", 0, LARGEST_AMPLITUDE) or 0.0)
        energies, compliance = mode_energies(found), static_compliance(found)
        depth = None
        try:
            if model.cutting is not None and model.tool:
                from ..modes.depth_sensitivity import depth_sensitivity

                depth = depth_sensitivity(found)
        except InputError as error:  # the modes are told all the same
            remarks = (*remarks, f"{error}.")
    told = range(len(found.pole)) if all else shown_modes(found)
    said = (*warnings(found, compliance), *(depth.warnings if depth is not None else ()), *remarks)
    return MachineModes(found, energies, compliance, depth, tuple(int(i) for i in told), said)


def _of_measurements(
    files: tuple[Path, ...],
    output: File | None,
    plot: File | None,
    band: tuple[float, float] | None,
    condition: str | None,
    most: int | None,
    free: bool,
    progress: Progress,
) -> MeasuredModes:
    """Fit and write."""
    with progress.step("fitting modes"):
        fitted = fit_modes(read_responses(files, band, condition), most=most, free=free)
    if output is not None:
        component_of(fitted, Path(output).name)  # refused before anything is written
    written: tuple[Path, ...] = ()
    if plot is not None:
        write_picture(Path(plot), fitted.plot())
        written = (Path(plot),)
    if output is not None:
        written = (*write_component(Path(output), fitted, files), *written)
    return MeasuredModes(fitted, (*fitted.notes, *beyond(fitted)), written)


def _at_the_tool(machine: Machine, amplitude: float, remarks: tuple[str, ...]) -> MeasuredModes:
    """Modes of the tool point of a machine that has no equations, fitted to its receptance."""
    fitted = fit_modes(tool_responses(machine, amplitude))
    said = (
        f"component {machine.without_equations[0]!r} is known by its receptance only: these modes are fitted to the "
        "receptance of the tool, and what holds their energy is not known."
    )
    return MeasuredModes(fitted, (said, *fitted.notes, *beyond(fitted, computed=True), *remarks), ())


def _measured(file: Path) -> bool:
    """Whether a file is a measurement; what is wrong with it is said where it is read."""
    return schema_of(file) == "jointlib/measurement/1"
