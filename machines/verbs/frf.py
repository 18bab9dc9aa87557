"""Nonlinear forced response of a machine, all branches."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import FrequencyRange, Quantity, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import emit, working, wrote
from jointlib.errors import InputError

from ..compare.over_measured import over_measured
from ..forced_response.each_drive import peak_rows
from ..forced_response.response_file import write_response
from .told.frf_files import draw, write_bands, write_receptances
from .told.frf_told import contact_lines, measured_lines, tool_lines

PLOTS = ("mag-phase", "re-im", "nyquist")


@click.command("frf", cls=Verb)
@input_file("machine")
@click.option("--force", type=Quantity("N"), multiple=True, help="Peak force; default: those of the file.")
@click.option("--frequency", type=FrequencyRange(), help="lo:hi:n; default: the range of the file.")
@click.option("--drive", help="Degree of freedom the force acts on; default: that of the file, else each of the tool.")
@click.option(
    "--harmonics",
    help="auto (the default: further ones where they matter by more than 0.1 %), 1 (the first alone; the default of "
    "--samples), or multiples such as 1,3,5.",
)
@click.option(
    "--samples", type=click.IntRange(40), help="Band of the receptance from so many samples of what is uncertain."
)
@click.option(
    "-o",
    "output",
    type=Target(".npz", ".csv", ".frf", ".svg", ".png"),
    required=True,
    help=".npz: every branch; .csv, .frf (CutPro): receptances, one file per force and output; .svg, .png: a picture.",
)
@click.option("--measured", type=click.Path(path_type=Path), multiple=True, help="Measured FRFs to lay over it.")
@click.option("--contacts", is_flag=True, help="Also list the peaks of every contact.")
@click.option("--plot", type=click.Choice(PLOTS), default=PLOTS[0], help="What a picture shows.")
@tool_option
@json_option
def command(
    machine: Path,
    force: tuple[float, ...],
    frequency: tuple[float, float, int | None] | None,
    drive: str | None,
    harmonics: str | None,
    samples: int | None,
    output: Path,
    measured: tuple[Path, ...],
    contacts: bool,
    plot: str,
    changes: dict[str, str],
    as_json: bool,
) -> None:
    """Forced response of MACHINE at each force: every branch, with the peaks of the tool and of each joint.

    \b
    Example:
      jointlib frf machines/library/two_mass.toml --force 10 50N --frequency 1kHz:7kHz -o two_mass.npz
    """
    from .. import read_machine
    from ..forced_response.each_drive import both
    from ..road.open_joints import with_joints
    from ..uncertainty.lobe_bands import refuse_certain

    wanted = _harmonics(harmonics or "auto")
    if samples and output.suffix not in (".npz", ".csv"):
        raise InputError(f"-o {output}: this format has no room for a band, expected .npz or .csv with --samples")
    with working("coupling the machine"):
        model, remarks = with_joints(read_machine(machine, changes))
        band = None if frequency is None else (frequency[0], frequency[1])
        points = 600 if frequency is None or frequency[2] is None else frequency[2]
        if samples:
            refuse_certain(model)
        drive = model.driven_dof(drive) if samples else drive
        results = both(model, drive, force or None, band, points=points, harmonics=wanted, stability="auto")
    further: dict[str, Any] = {}
    if samples:
        further["band"] = band_of(model, results[0], points, samples, _harmonics(harmonics or "1"))
    axes = {dof: axis for axis, dof in model.tool.items()}
    laid, told = over_measured(model, (*model.compare, *measured))
    further |= told
    if output.suffix == ".npz":
        written = write_response(output, results, further.get("band"))
    elif output.suffix in (".svg", ".png"):
        written = draw(output, results, plot, laid)
    else:
        written = write_receptances(output, results, points, axes) + write_bands(
            output, results[0], further.get("band")
        )
    lines = tool_lines(results, axes)
    lines += contact_lines(results) if contacts else []
    lines += measured_lines(laid, told)
    for result in results:
        lines += [f"{f:g} N: {o.value}" for f, o in zip(result.force, result.outcomes, strict=True) if o.value]
    warnings = list(dict.fromkeys([*remarks, *(warning for result in results for warning in result.warnings)]))
    lines += [f"warning: {warning}" for warning in warnings]
    if samples and further["band"]["clipped"]:
        lines.append(f"{further['band']['clipped']} sampled parameters lay outside their bounds and were set to them.")
    data = {"file": str(written[0]), "files": [str(path) for path in written], "warnings": warnings}
    emit(as_json, peak_rows(results) | data | further, [*lines, *(wrote(path) for path in written)])


def band_of(
    model: Any, result: Any, points: int, samples: int, harmonics: int | str | tuple[int, ...]
) -> dict[str, Any]:
    """|G| (m/N) at 2.5, 50 and 97.5 % of the samples, ``size`` [force][share][line][output], on even lines (Hz)."""
    import numpy as np

    from ..uncertainty.lobe_bands import SHARES
    from ..uncertainty.response_band import response_band

    known = result.frfs[0].frequency
    lines = np.linspace(known[0], known[-1], points)
    begun = time.perf_counter()
    response_band(model, result.force, lines, result.drive, 1, harmonics=harmonics)
    cost = samples * (time.perf_counter() - begun)
    with working(f"computing {samples} samples, about {cost:.0f} s"):
        band = response_band(model, result.force, lines, result.drive, samples, harmonics=harmonics)
    return {
        "share": SHARES,
        "frequency": lines,
        "size": np.swapaxes(band.quantiles, 0, 1),
        "outputs": result.outputs,
        "samples": samples,
        "clipped": band.clipped,
    }


def _harmonics(text: str) -> int | str | tuple[int, ...]:
    """1, "auto" or multiples from a comma-separated list; whether they make sense is for the solver to say."""
    if text == "auto":
        return text
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdigit() for part in parts):
        raise InputError(f"--harmonics: {text!r}, expected 1, auto or multiples such as 1,3,5")
    return tuple(int(part) for part in parts)
