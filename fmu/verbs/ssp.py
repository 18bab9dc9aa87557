"""Export a machine as a system of FMUs."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import emit, working, wrote


@click.command("ssp", cls=Verb)
@input_file("machine")
@click.option("-o", "output", type=Target(".ssp"), required=True, help="The .ssp file to write.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", help="Version of FMI; SSP is 1.0 or 2.0 with it.")
@click.option(
    "--platform", "platforms", multiple=True, help="Compile for this platform, win64 for example; repeatable."
)
@tool_option
@json_option
def command(
    machine: Path, output: Path, fmi: str, platforms: tuple[str, ...], changes: dict[str, str], as_json: bool
) -> None:
    """Write MACHINE as a system of FMUs (SSP): one for each component, one for each flexible connection.

    It is run and compared with the machine's equations before it appears. The largest communication step at which
    the exchange is stable is computed for the assembled machine.

    \b
    Example:
      jointlib ssp machines/library/two_mass.toml -o two_mass.ssp
    """
    from ..ssp import export_ssp

    with working("exporting and verifying"):
        done = export_ssp(machine, output, fmi=int(fmi), platforms=platforms, tool=changes.get("tool.use"))
    data = {
        "file": str(done.file),
        "max_step": done.max_step,
        "recommended_step": done.recommended_step,
        "masters": done.masters,
        "platforms": list(done.platforms),
        "verified_with": list(done.verified_with),
        "messages": done.messages,
    }
    lines = [wrote(done.file), f"platforms: {', '.join(done.platforms)}"]
    emit(as_json, data, [*lines, f"verified with {', '.join(done.verified_with)}", *done.messages])
