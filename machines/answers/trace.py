"""Close the loop on a joint or on a machine, and write what was found."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from jointlib.answers.given import File, measurement_of
from jointlib.errors import InputError
from jointlib.estimation.settings import EXCITED
from jointlib.io.atomic import given_target
from jointlib.io.joint_file import read_joint
from jointlib.io.measurement_write import is_written_by_a_program
from jointlib.joint import Joint
from jointlib.loop import close as joint_files
from jointlib.loop.answer.report import TraceReport
from jointlib.loop.answer.words import words as joint_words
from jointlib.loop.trace import trace as joint_trace
from jointlib.measurement import CUTS, FORCES, Measurement
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown

from ..cut_loop.close import check_folder, write_cut_trace
from ..cut_loop.report import CutTrace
from ..cut_loop.trace_cuts import SAFE, trace_cuts
from ..files.machine_file import read_machine
from ..loop.close import check_target, write_trace
from ..loop.records import said_of
from ..loop.report import MachineTrace
from ..loop.trace import trace_machine
from ..model.machine import Machine
from .told.trace_pages import machine_words, write_cuts_page, write_joint_page, write_machine_page


@dataclass(frozen=True, eq=False, repr=False)
class Trace(Shown):
    """What a joint, or the joints of a machine, leave unexplained, and the files that say so."""

    report: TraceReport | MachineTrace | CutTrace
    files: tuple[Path, ...]

    def finding(self) -> str:
        """The verdict and the error before and after."""
        return self.report.finding()

    def columns(self) -> Columns:
        """A row per candidate."""
        return self.report.columns()

    def plot(self, ax: Any = None) -> Any:
        """What each candidate removes, or to which joint the residual points."""
        return self.report.plot(ax)

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib trace --json`` prints."""
        return self.report.as_json()

    def words(self) -> list[str]:
        """What ``jointlib trace`` prints."""
        if isinstance(self.report, CutTrace):
            return self.report.words()
        return machine_words(self.report) if isinstance(self.report, MachineTrace) else list(joint_words(self.report))


def trace(
    measurement: Measurement | File,
    *,
    joint: Joint | File | None = None,
    machine: Machine | File | None = None,
    seed: int = 0,
    safe: float | None = None,
    output: File | None = None,
    progress: Progress | None = None,
) -> Trace:
    """Say what a joint leaves unexplained of a measurement, name the effect it lacks, mend it: ``jointlib trace``.

    With a machine the measurement holds frequency responses at several forces (kind "frf"): say which connection of the
    machine they point to, and mend the joint in it; or test cuts (kind "cuts"): say which of them the machine cannot
    explain, which effect would, and what to cut next.

    Parameters
    ----------
    measurement
        A measurement or its file.
    joint, machine
        The model that is to be doubted, one of the two, or its file.
    seed
        Of whatever is drawn, noted in the report.
    safe
        Of test cuts: the probability of being stable that the most productive cut is to have, default 0.95.
    output
        Folder for the trace, the mended files and ``report.html``; a machine then is a file.
    progress
        Told of every part that takes long.
    """
    if (joint is None) == (machine is None):
        found = "neither --joint nor" if joint is None else "both --joint and"
        fits = "; jointlib identify … --law linear viscous fits a joint to begin with" if joint is None else ""
        raise InputError(
            f"trace: {found} --machine is given, expected one of them, the model that is to be doubted{fits}"
        )
    test, folder = measurement_of(measurement), given_target(output, folder=True)
    if test.kind in EXCITED:
        raise InputError(
            f"{test.source}: kind is {test.kind!r}, records in time; expected the frequency responses that `jointlib "
            "estimate` makes of them"
        )
    if test.kind == FORCES:
        raise InputError(
            f"{test.source}: kind is {test.kind!r}, expected records of a joint, frequency responses or test cuts; "
            "`jointlib identify` makes coefficients of it"
        )
    if safe is not None and test.kind != CUTS:
        raise InputError(f"--safe: {test.source} is of kind {test.kind!r}, expected test cuts (kind {CUTS!r}) with it")
    if (test.kind in ("frf", CUTS)) != (machine is not None):
        wanted = "--machine" if test.kind in ("frf", CUTS) else "--joint"
        raise InputError(f"{test.source}: kind is {test.kind!r}, expected {wanted} with it")
    words = ["jointlib", "trace", str(test.source), "--joint" if joint is not None else "--machine"]
    words += [str(joint or machine), "-o", str(folder), *(["--seed", str(seed)] if seed else [])]
    during = progress or Silent()
    if machine is not None and test.kind == CUTS:
        words += ["--safe", f"{safe:g}"] if safe is not None else []
        return _of_cuts(test, machine, seed, SAFE if safe is None else safe, folder, shlex.join(words), during)
    if machine is not None:
        return _of_machine(test, machine, seed, folder, shlex.join(words), during)
    assert joint is not None
    if folder is not None:
        target = folder / "measurement.toml"
        if target.exists() and target.samefile(test.source) and not is_written_by_a_program(test.source):
            raise InputError(f"-o {folder}: its measurement.toml is the one to be traced, expected another folder")
    with during.step("tracing the residual"):
        report = joint_trace(test, joint if isinstance(joint, Joint) else read_joint(Path(joint)), seed=seed)
        if folder is None:
            return Trace(report, ())
        written = (*joint_files.write_trace(report, folder), folder / "report.html")
        write_joint_page(report, test, shlex.join(words), written[-1])
    return Trace(report, written)


def _of_cuts(
    test: Measurement,
    machine: Machine | File,
    seed: int,
    safe: float,
    folder: Path | None,
    command: str,
    progress: Progress,
) -> Trace:
    """Trace test cuts, and write everything into the folder where there is one."""
    if folder is not None and isinstance(machine, Machine):
        raise InputError(f"{machine.where}: output {folder}, expected the file of the machine with it, which is mended")
    model = machine if isinstance(machine, Machine) else read_machine(Path(machine))
    if folder is not None:
        check_folder(Path(str(machine)), folder)
    with progress.step("weighing the machine by the cuts"):
        report = trace_cuts(test, model, seed=seed, safe=safe)
    if folder is None:
        return Trace(report, ())
    written = (*write_cut_trace(report, folder), folder / "report.html")
    write_cuts_page(report, test, Path(str(machine)), command, written[-1])
    return Trace(report, written)


def _of_machine(
    test: Measurement, machine: Machine | File, seed: int, folder: Path | None, command: str, progress: Progress
) -> Trace:
    """Trace, and write everything into the folder where there is one."""
    if folder is not None and isinstance(machine, Machine):
        raise InputError(f"{machine.where}: output {folder}, expected the file of the machine with it, which is mended")
    model = machine if isinstance(machine, Machine) else read_machine(Path(machine))
    if folder is not None:
        check_target(Path(str(machine)), folder)
    with progress.step("tracing the residual of the machine"):
        report = trace_machine(test, model, seed=seed)
        told = dict.fromkeys([*report.warnings, *said_of(report.records)])
        report = replace(report, warnings=tuple(told))
        if folder is None:
            return Trace(report, ())
        written, report = write_trace(report, folder)
        page = folder / "report.html"
        write_machine_page(report, test, Path(str(machine)), command, page)
    return Trace(report, (*written, page))
