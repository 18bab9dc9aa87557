"""``jointlib compare``: two of a kind side by side."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option
from jointlib.cli.output import emit, table, working, wrote
from jointlib.errors import InputError


@click.command("compare", cls=Verb)
@input_file("first")
@input_file("others", nargs=-1, required=True)
@click.option("-o", "output", type=Target(".svg", ".png"), help="Also draw their receptances over each other.")
@click.option("--plot", type=click.Choice(("mag-phase", "re-im", "nyquist")), default="mag-phase", help="What of them.")
@json_option
def command(first: Path, others: tuple[Path, ...], output: Path | None, plot: str, as_json: bool) -> None:
    """What differs between FIRST and each of OTHERS: machines, joints, measured FRFs, or folders of runs.

    A difference below two standard errors is none.

    \b
    Example:
      jointlib compare machines/library/paper_sdof.toml machines/library/paper_sdof_hertz.toml
    """
    from machines.side_by_side import differences, sentence, side

    with working("comparing"):
        base, rest = side(first), [side(path) for path in others]
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


def _draw(path: Path, sides: list, plot: str) -> Path:  # type: ignore[type-arg]
    """A panel for each receptance that the first side has, the sides over each other."""
    from jointlib.io.atomic import write, write_text
    from machines.report.drawing import shades
    from machines.report.receptance_figure import Curve, receptance_figure

    panels = [
        (
            name,
            [
                Curve(each.curves[name][0], each.curves[name][1], each.name, colour, style)
                for each, colour, style in zip(
                    sides, shades(len(sides))[::-1], ["-", *["--"] * len(sides)], strict=False
                )
                if name in each.curves
            ],
        )
        for name in sides[0].curves
    ]
    figure = receptance_figure(panels, plot, png=path.suffix == ".png")
    if path.suffix == ".png":
        write(path, lambda file: file.write(figure.png))
    else:
        write_text(path, figure.svg)
    return path
