"""``jointlib frf``: nonlinear forced response of a machine, all branches."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import FrequencyRange, Quantity, Target, Verb, input_file, json_option
from jointlib.cli.output import emit, table, working, wrote
from jointlib.errors import InputError


@click.command("frf", cls=Verb)
@input_file("machine")
@click.option("--force", type=Quantity("N"), multiple=True, help="Peak force; default: those of the file.")
@click.option("--frequency", type=FrequencyRange(), help="lo:hi:n; default: the range of the file.")
@click.option("--drive", help="Degree of freedom the force acts on; default: that of the file, else the tool.")
@click.option(
    "--harmonics",
    default="1",
    help="1, auto (further ones where they matter by more than 0.1 %) or multiples such as 1,3,5.",
)
@click.option(
    "--samples", type=click.IntRange(40), help="Band of the receptance from so many samples of what is uncertain."
)
@click.option(
    "-o",
    "output",
    type=Target(".npz", ".csv", ".frf"),
    required=True,
    help=".npz: every branch; .csv or .frf (CutPro): receptances, one file per force and output.",
)
@json_option
def command(
    machine: Path,
    force: tuple[float, ...],
    frequency: tuple[float, float, int | None] | None,
    drive: str | None,
    harmonics: str,
    samples: int | None,
    output: Path,
    as_json: bool,
) -> None:
    """Forced response of MACHINE at each force: every branch, with refined peaks of each joint.

    \b
    Example:
      jointlib frf machines/library/two_mass.toml --force 10 50N --frequency 1kHz:7kHz -o two_mass.npz
    """
    from jointlib.cli.joints import with_joints
    from machines import read_machine, response
    from machines.lobes.uncertainty import refuse_certain

    wanted = _harmonics(harmonics)
    if samples and output.suffix == ".frf":
        raise InputError(f"-o {output}: this format has no room for a band, expected .npz or .csv with --samples")
    with working("coupling the machine"):
        model, remarks = with_joints(read_machine(machine))
        band = None if frequency is None else (frequency[0], frequency[1])
        points = 600 if frequency is None or frequency[2] is None else frequency[2]
        if samples:
            refuse_certain(model)
        result = response(model, force or None, band, drive, points=points, harmonics=wanted, stability="auto")
    further: dict[str, Any] = {}
    if samples:
        further["band"] = band_of(model, result, points, samples, wanted)
    if output.suffix == ".npz":
        written = write_response(output, result, further.get("band"))
    else:
        written = write_receptances(output, result, points) + write_bands(output, result, further.get("band"))
    peaks = peak_rows(result)
    rows = [
        (f"{p['force']:g}", p["connection"], f"{p['amplitude'] * 1e6:.5g}", f"{p['frequency']:.6g}", p["outcome"])
        for p in peaks
    ]
    lines = table(("force [N]", "connection", "amplitude [um]", "frequency [Hz]", "outcome"), rows)
    lines += [f"{f:g} N: {o.value}" for f, o in zip(result.force, result.outcomes, strict=True) if o.value]
    warnings = [*remarks, *result.warnings]
    lines += warnings
    if samples and further["band"]["clipped"]:
        lines.append(f"{further['band']['clipped']} sampled parameters lay outside their bounds and were set to them.")
    data = {"peaks": peaks, "file": str(written[0]), "files": [str(path) for path in written], "warnings": warnings}
    data |= further
    emit(as_json, data, [*lines, *(wrote(path) for path in written)])


def band_of(
    model: Any, result: Any, points: int, samples: int, harmonics: int | str | tuple[int, ...]
) -> dict[str, Any]:
    """|G| (m/N) at 2.5, 50 and 97.5 % of the samples, ``size`` [force][share][line][output], on even lines (Hz)."""
    import numpy as np

    from machines.lobes.uncertainty import SHARES
    from machines.response_band import response_band

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


def write_bands(path: Path, result: Any, band: dict[str, Any] | None) -> list[Path]:
    """The bands of |G| in m/N beside the receptances, a ``…_band.csv`` for each force and output."""
    from jointlib.io.atomic import write_text

    written: list[Path] = []
    if band is None:
        return written
    for force, sizes in zip(result.force, band["size"], strict=True):
        for o, output in enumerate(result.outputs):
            target = _named(path, result, force, output, "_band")
            rows = zip(band["frequency"].tolist(), *sizes[:, :, o].tolist(), strict=True)
            text = "".join(f"{f:.12g},{low:.12e},{middle:.12e},{high:.12e}\n" for f, low, middle, high in rows)
            write_text(target, f"frequency,low,median,high\n{text}")
            written.append(target)
    return written


def _named(path: Path, result: Any, force: float, output: str, more: str = "") -> Path:
    """The file of one force and output, a name of its own where there are several."""
    several = len(result.force) > 1, len(result.outputs) > 1
    return path.with_name(f"{path.stem}{f'_{output}' * several[1]}{f'_{force:g}N' * several[0]}{more}{path.suffix}")


def _harmonics(text: str) -> int | str | tuple[int, ...]:
    """1, "auto" or multiples from a comma-separated list; whether they make sense is for the solver to say."""
    if text == "auto":
        return text
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdigit() for part in parts):
        raise InputError(f"--harmonics: {text!r}, expected 1, auto or multiples such as 1,3,5")
    return tuple(int(part) for part in parts)


def peak_rows(result: Any) -> list[dict[str, Any]]:
    """The refined peaks as the contract names them."""
    return [
        {
            "force": p.force,
            "connection": p.connection,
            "amplitude": p.amplitude,
            "frequency": p.frequency,
            "harmonics": p.harmonics,
            "outcome": p.outcome.name.lower(),
        }
        for p in result.peaks
    ]


def write_response(path: Path, result: Any, band: dict[str, Any] | None = None) -> list[Path]:
    """Receptances per force, and every branch: ``frequency_0`` … (Hz), ``receptance_0`` … (m/N), ``branch_0_0_…``.

    Of a branch: motions of the joints and outputs (m), stability of the whole and of every point, estimated error of
    the first harmonic, outcome of every point, harmonics and, where there are several, the motions in
    the others; under a static load where the joints stand. A band adds ``band_frequency`` and ``band``, |G| in m/N as
    [force, share, line, output] at the shares ``band_share`` of the samples.
    """
    import numpy as np

    from jointlib.io.atomic import write_npz

    arrays: dict[str, Any] = {
        "force": np.array(result.force),
        "drive": np.array(result.drive),
        "outputs": np.array(result.outputs),
        "connections": np.array(result.connections),
    }
    for i, (frf, branches) in enumerate(zip(result.frfs, result.branches, strict=True)):
        arrays[f"frequency_{i}"], arrays[f"receptance_{i}"] = frf.frequency, frf.receptance[:, :, 0]
        for k, branch in enumerate(branches):
            arrays[f"branch_{i}_{k}_frequency"] = branch.frequency
            arrays[f"branch_{i}_{k}_joint"] = branch.joint
            arrays[f"branch_{i}_{k}_output"] = branch.output
            arrays[f"branch_{i}_{k}_stability"] = np.array(branch.stability.value)
            arrays[f"branch_{i}_{k}_labels"] = np.array([label.value for label in branch.labels])
            arrays[f"branch_{i}_{k}_outcomes"] = np.array([outcome.name.lower() for outcome in branch.outcomes])
            arrays[f"branch_{i}_{k}_error"] = branch.error
            arrays[f"branch_{i}_{k}_harmonics"] = np.array(branch.harmonics)
            if len(branch.harmonics) > 1:
                arrays[f"branch_{i}_{k}_overtones"] = branch.overtones
            if branch.mean.size:
                arrays[f"branch_{i}_{k}_mean"] = branch.mean
    if band is not None:
        arrays |= {"band_frequency": band["frequency"], "band": band["size"], "band_share": np.array(band["share"])}
    write_npz(path, arrays)
    return [path]


def write_receptances(path: Path, result: Any, points: int) -> list[Path]:
    """The receptance of each force and output in m/N, in a file of its own where there are several.

    A ``.csv`` has the lines that were computed, closer at the peaks, as far as there is a solution; a ``.frf`` has
    ``points`` lines of one step, as its readers expect.
    """
    import numpy as np

    from jointlib.io.atomic import write_text
    from jointlib.io.cutpro import write_cutpro

    written = []
    for force, frf in zip(result.force, result.frfs, strict=True):
        for o, output in enumerate(result.outputs):
            target = _named(path, result, force, output)
            found = np.isfinite(frf.receptance[:, o, 0])
            if path.suffix == ".frf":
                if not found.all():
                    raise InputError(
                        f"-o {path}: at {force:g} N there is no solution inside the valid range at "
                        f"{frf.frequency[~found][0]:g} Hz, and this format has no gaps; expected .csv or less force"
                    )
                even = frf.on(np.linspace(frf.frequency[0], frf.frequency[-1], points))
                write_cutpro(target, even.frequency, even.receptance[:, o, 0])
            else:
                rows = zip(frf.frequency[found].tolist(), frf.receptance[found, o, 0].tolist(), strict=True)
                text = "".join(f"{f:.12g},{H.real:.12e},{H.imag:.12e}\n" for f, H in rows)
                write_text(target, f"frequency,real,imaginary\n{text}")
            written.append(target)
    return written
