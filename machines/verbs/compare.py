"""Two of a kind side by side: machines, joints, measured FRFs, runs, designs of a study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option
from jointlib.cli.output import emit, table, working, wrote
from jointlib.errors import InputError

if TYPE_CHECKING:
    from ..compare.side_by_side import Side


@click.command("compare", cls=Verb)
@input_file("first")
@input_file("others", nargs=-1)
@click.option("--results", type=click.Path(path_type=Path), help="Of a study: the folder of 'jointlib study run'.")
@click.option(
    "--designs", type=click.IntRange(min=0), multiple=True, help="Of a study: which designs, default: best and second."
)
@click.option("-o", "output", type=Target(".svg", ".png"), help="Also draw their receptances over each other.")
@click.option("--plot", type=click.Choice(("mag-phase", "re-im", "nyquist")), default="mag-phase", help="What of them.")
@json_option
def command(
    first: Path,
    others: tuple[Path, ...],
    results: Path | None,
    designs: tuple[int, ...],
    output: Path | None,
    plot: str,
    as_json: bool,
) -> None:
    """What differs between FIRST and each of OTHERS: machines, joints, measured FRFs, or folders of runs.

    Of a study: between its designs, as in jointlib compare mill.study.toml --results study --designs 0 3, which go by
    their number from 0 on. A difference below two standard errors is none.

    \b
    Example:
      jointlib compare machines/library/paper_sdof.toml machines/library/paper_sdof_hertz.toml
    """
    from ..compare.side_by_side import differences, sentence, side

    if designs and results is None:
        raise InputError("--designs: expected --results as well, the folder of 'jointlib study run'")
    if results is None and not others:
        raise InputError("compare: expected two files or folders, or a study file with --results")
    if results is not None and others:
        raise InputError("--results: expected a study file alone, its designs are compared")
    with working("comparing"):
        sides = [side(path) for path in (first, *others)] if results is None else _designs(first, results, designs)
        base, *rest = sides
        found = [d for other in rest for d in differences(base, other)]
    told = sentence(base, rest, found)
    rows = [
        (d.what, *(f"{value:.6g}" if value == value else "–" for value in (d.first, d.other)), d.unit or "–", d.against)
        for d in found
    ]
    remarks = [remark for each in (base, *rest) for remark in each.remarks]
    lines = [
        told,
        *(f"warning: {remark}" for remark in remarks),
        *(table(("what", "first", "other", "unit", "other is"), rows) if rows else []),
    ]
    written = []
    if output is not None:
        if not base.curves:
            raise InputError(
                f"-o {output}: a {base.kind} has no receptance to draw, expected machines or measured FRFs"
            )
        written = [_draw(output, [base, *rest], plot)]
    data = {
        "differences": [vars(d) for d in found],
        "sentence": told,
        "files": [str(path) for path in written],
        "warnings": remarks,
    }
    emit(as_json, data, [*lines, *map(wrote, written)])


def _designs(study: Path, results: Path, designs: tuple[int, ...]) -> list[Side]:
    """Designs of a study by number."""
    from ..study.findings.design_sides import design_sides
    from ..study.run import tools_asked
    from ..study.study_file import read_study
    from .study import identified

    opened = read_study(study, tools_asked(results))
    if not (results / "study.json").is_file():
        raise InputError(f"--results: {results} holds no study, expected the folder of 'jointlib study run'")
    if len(set(designs)) < len(designs) or len(designs) == 1:
        raise InputError(f"--designs: {', '.join(map(str, designs))}, expected at least two different numbers")
    return list(design_sides(opened, results, designs, identified(opened)))


def _draw(path: Path, sides: list[Side], plot: str) -> Path:
    """A panel for each receptance that the first side has, the sides over each other."""
    from jointlib.io.atomic import write, write_text

    from ..report.drawing import shades
    from ..report.figures.receptance_figure import Curve, Lobes, receptance_figure

    looks = list(zip(sides, shades(len(sides))[::-1], ["-", *["--"] * len(sides)], strict=False))
    panels = [
        (
            name,
            [
                Curve(each.curves[name][0], each.curves[name][1], each.short, colour, style)
                for each, colour, style in looks
                if name in each.curves
            ],
        )
        for name in sides[0].curves
    ]
    lobes = [
        Lobes(each.limits.speed, each.limits.depth, each.limits.chatter_frequency, each.short, colour, style)
        for each, colour, style in looks
        if each.limits is not None
    ]
    figure = receptance_figure(panels, plot, lobes=lobes, png=path.suffix == ".png")
    if path.suffix == ".png":
        write(path, lambda file: file.write(figure.png))
    else:
        write_text(path, figure.svg)
    return path
