"""``jointlib trace --machine``: measured frequency responses against a machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointlib.cli.output import working, wrote
from jointlib.loop.answer.head import assumptions_of, inputs_of

if TYPE_CHECKING:
    from jointlib.measurement import Measurement

    from ...loop.report import MachineTrace


def traced(test: Measurement, machine: Path, output: Path, seed: int, command: str) -> tuple[dict[str, Any], list[str]]:
    """Trace, write everything into a folder; the JSON and the lines to print."""
    from dataclasses import replace

    from ...files.machine_file import read_machine
    from ...loop.close import check_target, write_trace
    from ...loop.records import said_of
    from ...loop.trace import trace_machine

    model = read_machine(machine)
    check_target(machine, output)
    with working("tracing the residual of the machine"):
        report = trace_machine(test, model, seed=seed)
        told = dict.fromkeys([*report.warnings, *said_of(report.records)])
        written, report = write_trace(replace(report, warnings=tuple(told)), output)
        _write_page(report, test, machine, command, output / "report.html")
    return report.as_json(), [*words(report), *map(wrote, (*written, output / "report.html"))]


def words(report: MachineTrace) -> list[str]:
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


def _write_page(report: MachineTrace, test: Measurement, machine: Path, command: str, path: Path) -> None:
    from importlib.metadata import version

    from jointlib.io.atomic import sha256

    from ...report import Page
    from ...report.machine_trace_section import machine_trace_section

    before, after = report.error_before["relative"], report.error_after["relative"]
    Page(
        title=f"Trace of {test.source.name}",
        finding=report.sentence,
        numbers=[
            ("verdict", report.verdict.value.replace("_", " ")),
            ("joint", report.place or "–"),
            ("error before", f"{100 * before:.3g} %"),
            ("error after", f"{100 * after:.3g} %"),
        ],
        sections=[machine_trace_section(report)],
        inputs=[(machine.name, sha256(machine)), *inputs_of([test])],
        assumptions=assumptions_of([test]),
        warnings=report.warnings,
        command=command,
        version=version("jointlib"),
    ).write(path)
