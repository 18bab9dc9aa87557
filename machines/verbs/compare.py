"""Two of a kind side by side: machines, joints, measured FRFs, runs, designs of a study."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Given, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import emit, working, wrote
from jointlib.shown.text import table


@click.command("compare", cls=Verb)
@input_file("first")
@input_file("others", nargs=-1)
@click.option("--results", type=Given(), help="Of a study: the folder of 'jointlib study run'.")
@click.option(
    "--designs", type=click.IntRange(min=0), multiple=True, help="Of a study: which designs, default: best and second."
)
@click.option("-o", "output", type=Target(".svg", ".png"), help="Also draw their receptances over each other.")
@click.option("--plot", type=click.Choice(("mag-phase", "re-im", "nyquist")), default="mag-phase", help="What of them.")
@tool_option
@json_option
def command(
    first: Path,
    others: tuple[Path, ...],
    results: Path | None,
    designs: tuple[int, ...],
    output: Path | None,
    plot: str,
    changes: dict[str, str],
    as_json: bool,
) -> None:
    """What differs between FIRST and each of OTHERS: machines, joints, measured FRFs, or folders of runs.

    Of a study: between its designs, as in jointlib compare mill.study.toml --results study --designs 0 3, which go by
    their number from 0 on. A difference below two standard errors is none.

    \b
    Example:
      jointlib compare machines/library/paper_sdof.toml machines/library/paper_sdof_hertz.toml
    """
    from ..answers.compare import compare
    from ..compare.side_by_side import as_told

    with working("comparing"):
        found = compare(
            first, *others, results=results, designs=designs, output=output, plot=plot, tool=changes.get("tool.use")
        )
    rows = [as_told(d) for d in found.differences]
    lines = [
        found.finding(),
        *found.depths,
        *(f"warning: {remark}" for remark in found.remarks),
        *(table(("what", "first", "other", "unit", "other is"), rows) if rows else []),
    ]
    data = {
        "differences": [vars(d) for d in found.differences],
        "sentence": found.finding(),
        "depths": found.depths,
        "files": [str(path) for path in found.files],
        "warnings": found.remarks,
    }
    emit(as_json, data, [*lines, *map(wrote, found.files)])
