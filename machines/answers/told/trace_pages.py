"""What is told of a trace: a machine's in words, and the pages of all kinds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from jointlib.loop.answer.head import assumptions_of, inputs_of, trace_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jointlib.loop.answer.report import TraceReport
    from jointlib.measurement import Measurement

    from ...cut_loop.report import CutTrace
    from ...loop.report import MachineTrace
    from ...report import Section


def machine_words(report: MachineTrace) -> list[str]:
    """The finding and the errors as lines of text."""
    before, after = report.error_before, report.error_after
    lines = [f"{report.verdict.value}: {report.sentence}"]
    lines.append(
        f"error before {100 * before['relative']:.3g} %, after {100 * after['relative']:.3g} % "
        f"({before['where']}); in sample {100 * before['in_sample']:.3g} %, {100 * after['in_sample']:.3g} %"
    )
    for place, shares in report.pointing.items():
        listed = ", ".join(f"{kind} {100 * share:.0f} %" for kind, share in shares.items())
        lines.append(f"alone in {place} would remove: {listed}")
    lines += [f"rival: {r.family} in {r.place}. {r.separating_experiment}" for r in report.rivals]
    return [*lines, *(f"warning: {w}" for w in report.warnings)]


def write_machine_page(report: MachineTrace, test: Measurement, machine: Path, command: str, path: Path) -> None:
    from ...report.machine_trace_section import machine_trace_section

    before, after = report.error_before["relative"], report.error_after["relative"]
    numbers = [
        ("verdict", report.verdict.value.replace("_", " ")),
        ("joint", report.place or "–"),
        ("error before", f"{100 * before:.3g} %"),
        ("error after", f"{100 * after:.3g} %"),
    ]
    _write(report, test, numbers, machine_trace_section(report), command, path, machine)


def write_cuts_page(report: CutTrace, test: Measurement, machine: Path, command: str, path: Path) -> None:
    from ...report.cuts_section import cuts_section

    before, after, chosen = report.error_before, report.error_after, report.chosen
    numbers = [
        ("verdict", report.verdict.value.replace("_", " ")),
        ("named", "–" if chosen is None else chosen.family.replace("-", " ")),
        ("right of held-out cuts, before", f"{100 * before['right']:.0f} %"),
        ("and after", f"{100 * after['right']:.0f} %"),
    ]
    _write(report, test, numbers, cuts_section(report), command, path, machine, [report.next_words()])


def write_joint_page(report: TraceReport, test: Measurement, command: str, path: Path) -> None:
    from ...report.sections import trace_section

    _write(report, test, trace_numbers(report), trace_section(report), command, path)


def _write(
    report: TraceReport | MachineTrace | CutTrace,
    test: Measurement,
    numbers: Sequence[tuple[str, str]],
    section: Section,
    command: str,
    path: Path,
    machine: Path | None = None,
    answers: Sequence[str] = (),
) -> None:
    """The page of a trace: its finding and numbers, what shows them, and what it stands on."""
    from importlib.metadata import version

    from jointlib.io.atomic import sha256

    from ...report import Page

    Page(
        title=f"Trace of {test.source.name}",
        finding=report.sentence,
        answers=answers,
        numbers=numbers,
        sections=[section],
        inputs=[*([] if machine is None else [(machine.name, sha256(machine))]), *inputs_of([test])],
        assumptions=assumptions_of([test]),
        warnings=report.warnings,
        command=command,
        version=version("jointlib"),
    ).write(path)
