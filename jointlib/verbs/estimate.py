"""Frequency responses from hammer hits and shaker records."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option
from jointlib.cli.output import emit, working, wrote
from jointlib.shown.text import table


@click.command("estimate", cls=Verb)
@input_file("measurement")
@click.option("-o", "output", type=Target(".toml"), required=True, help="The measurement file of kind frf to write.")
@click.option("--plot", type=Target(".svg", ".png"), help="Also draw receptances and coherence into this file.")
@json_option
def command(measurement: Path, output: Path, plot: Path | None, as_json: bool) -> None:
    """Frequency responses, with the variance of every line, from the hits or shaker records of MEASUREMENT.

    \b
    Example:
      jointlib estimate machines/library/tap_test/hits.measurement.toml -o tip.measurement.toml
    """
    import numpy as np

    from jointlib.answers.estimate import estimate_to

    with working("estimating"):
        found, written = estimate_to(measurement, output, plot)
    data = {
        "file": str(output),
        "frfs": [
            {
                "drive": f.drive,
                "response": f.response,
                "condition": f.condition,
                "quantity": f.quantity.word,
                "lines": len(f.frequency),
                "averages": f.averages,
                "coherence": float(np.median(f.coherence)),
                "force": f.force,
            }
            for f in found.frfs
        ],
        "left_out": list(found.left_out),
        "notes": list(found.notes),
        "files": [str(path) for path in written if path != plot],
        "sentence": found.finding(),
    }
    rows = [
        (
            f.response,
            f.drive,
            f.condition or "",
            f"{len(f.frequency)}",
            f"{f.averages:.3g}",
            f"{float(np.median(f.coherence)):.4f}" if f.averages > 1 else "says nothing",
            f"{f.force:.3g}",
        )
        for f in found.frfs
    ]
    header = ("response", "drive", "condition", "lines", "averages", "coherence", "force [N]")
    lines = [found.finding() + ".", *table(header, rows)]
    lines += [f"left out: {said}" for said in found.left_out]
    lines += [f"note: {said}" for said in found.notes]
    emit(as_json, data, [*lines, *map(wrote, written)])
