"""Find what a joint model leaves unexplained, name it, mend the joint."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option
from jointlib.cli.output import emit, working, wrote
from jointlib.errors import InputError
from jointlib.estimation.settings import EXCITED
from jointlib.loop.answer.head import assumptions_of, inputs_of, trace_numbers

if TYPE_CHECKING:
    from jointlib.loop.answer.report import TraceReport
    from jointlib.measurement import Measurement


@click.command("trace", cls=Verb)
@input_file("measurement")
@click.option("--joint", type=click.Path(path_type=Path), help="The joint model to doubt.")
@click.option("--machine", type=click.Path(path_type=Path), help="The machine to doubt, for measured FRFs.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of whatever is drawn, noted in the report.")
@click.option("-o", "output", type=Target(folder=True), required=True, help="Folder for what is written.")
@json_option
def command(
    measurement: Path, joint: Path | None, machine: Path | None, seed: int, output: Path, as_json: bool
) -> None:
    """Say what a joint leaves unexplained of MEASUREMENT, name the effect it lacks, mend it, show before and after.

    With --machine, MEASUREMENT holds frequency responses at several forces (kind "frf"): say which connection of the
    machine they point to, and mend the joint in it.

    \b
    Examples:
      jointlib trace machines/library/guide_mill/rig.measurement.toml --joint machines/library/guide_mill/start.joint.toml -o traced
      jointlib trace machines/library/three_joints/tip.measurement.toml --machine machines/library/three_joints.toml -o traced
    """  # noqa: E501
    from jointlib import read_joint, read_measurement, trace
    from jointlib.io.measurement_write import is_written_by_a_program
    from jointlib.loop.answer.words import words
    from jointlib.loop.close import write_trace

    if (joint is None) == (machine is None):
        found = "neither --joint nor" if joint is None else "both --joint and"
        raise InputError(f"trace: {found} --machine is given, expected one of them, the model that is to be doubted")
    test = read_measurement(measurement)
    if test.kind in EXCITED:
        raise InputError(
            f"{measurement}: kind is {test.kind!r}, records in time; expected the frequency responses that `jointlib "
            "estimate` makes of them"
        )
    if (test.kind == "frf") != (machine is not None):
        wanted = "--machine" if test.kind == "frf" else "--joint"
        raise InputError(f"{measurement}: kind is {test.kind!r}, expected {wanted} with it")
    again = ["jointlib", "trace", str(measurement), "--joint" if joint is not None else "--machine"]
    again += [str(joint or machine), "-o", str(output), *(["--seed", str(seed)] if seed else [])]
    if machine is not None:
        from .told.trace_machine import traced

        emit(as_json, *traced(test, machine, output, seed, shlex.join(again)))
        return
    assert joint is not None
    target = output / "measurement.toml"
    if target.exists() and target.samefile(measurement) and not is_written_by_a_program(measurement):
        raise InputError(f"-o {output}: its measurement.toml is the one to be traced, expected another folder")
    with working("tracing the residual"):
        report = trace(test, read_joint(joint), seed=seed)
        written = [*write_trace(report, output), output / "report.html"]
        _write_page(report, test, shlex.join(again), written[-1])
    emit(as_json, report.as_json(), [*words(report), *(wrote(path) for path in written)])


def _write_page(report: TraceReport, test: Measurement, command_line: str, path: Path) -> None:
    from importlib.metadata import version

    from ..report import Page
    from ..report.sections import trace_section

    Page(
        title=f"Trace of {test.source.name}",
        finding=report.sentence,
        numbers=trace_numbers(report),
        sections=[trace_section(report)],
        inputs=inputs_of([test]),
        assumptions=assumptions_of([test]),
        warnings=report.warnings,
        command=command_line,
        version=version("jointlib"),
    ).write(path)
