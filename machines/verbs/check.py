"""Compare the coupled machine, joints linearised, with python-control."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Quantity, Verb, input_file, json_option, tool_option
from jointlib.cli.output import emit, working
from jointlib.errors import CheckFailed


@click.command("check", cls=Verb)
@input_file("machine")
@click.option("--amplitude", type=Quantity("m"), help="Linearise the joints at this amplitude; default: at rest.")
@tool_option
@json_option
def command(machine: Path, amplitude: float | None, changes: dict[str, str], as_json: bool) -> None:
    """Compare MACHINE, its joints linearised, with a state-space model built by feedback in python-control.

    \b
    Example:
      jointlib check machines/library/two_mass.toml
    """
    from ..answers.check import check

    with working("comparing with python-control"):
        result = check(machine, amplitude=amplitude, tool=changes.get("tool.use"))
    excluded = [{"connection": e.connection, "law": e.law, "reason": e.reason} for e in result.excluded]
    lines = [
        f"largest relative difference in norm {result.max_relative_difference:.2g} over "
        f"{result.coupled.frequency[0]:.4g} to {result.coupled.frequency[-1]:.4g} Hz: "
        + ("passed" if result.passed else "FAILED"),
        *(f"excluded: {e['law']} in {e['connection']} ({e['reason']})" for e in excluded),
    ]
    data = {
        "max_relative_difference": result.max_relative_difference,
        "passed": result.passed,
        "excluded": excluded,
        "warnings": result.remarks,
    }
    emit(as_json, data, [*lines, *result.remarks])
    if not result.passed:
        raise CheckFailed(f"{machine}: receptance coupling and python-control differ, see above")
