"""Natural modes of a machine: what moves, which joint holds the energy, what stiffness gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import FrequencyRange, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import Working, emit, wrote

from .quantities import AMPLITUDE


@click.command("modes", cls=Verb)
@input_file("files", metavar="MACHINE | MEASUREMENT...", nargs=-1, required=True)
@click.option(
    "--amplitude",
    type=AMPLITUDE,
    help="Of a machine: tool-point amplitude of the joints; default: at rest.",
)
@click.option("--all", is_flag=True, help="Of a machine: every mode, not only the first and those it feels.")
@click.option("-o", "output", type=Target(".toml"), help="Of measurements: the component file to write.")
@click.option("--plot", type=Target(".svg", ".png"), help="Of measurements: stabilisation chart, fit over measured.")
@click.option("--band", type=FrequencyRange(), help="Of measurements: lo:hi, the lines that are fitted.")
@click.option("--condition", help="Of measurements: which one of several levels.")
@click.option("--most", type=click.IntRange(1), help="Of measurements: at most so many modes, the strongest.")
@click.option("--free", is_flag=True, help="Of measurements: of a body that nothing holds.")
@tool_option
@json_option
def command(files: tuple[Path, ...], changes: dict[str, str], as_json: bool, **asked: Any) -> None:
    """Modes of a MACHINE: frequency, damping, which part moves, which joint holds the energy; or of measured FRFs.

    Of MEASUREMENTs of kind "frf" frequency, damping and shapes with their errors, as a component file for machines.

    \b
    Examples:
      jointlib modes machines/library/lathe.toml
      jointlib modes machines/library/three_joints/tip.measurement.toml --condition "8 N" -o tip.component.toml
    """
    from ..answers.modes import MeasuredModes, modes

    found = modes(files, tool=changes.get("tool.use"), progress=Working(), **asked)
    written = found.files if isinstance(found, MeasuredModes) else ()
    emit(as_json, found.as_json(), [*found.words(), *map(wrote, written)])
