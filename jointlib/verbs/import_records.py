"""Write the measurement file of the records that a laboratory has."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jointlib.cli.arguments import Target, input_file, json_option
from jointlib.cli.output import emit, working, wrote
from jointlib.shown.text import table

if TYPE_CHECKING:
    from jointlib.lab.importing.bring import Brought


@click.command("import")
@input_file("files", nargs=-1, required=True)
@click.option("--kind", help="Kind of the measurement: rig, path, static, frf …; default: as the signals tell.")
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="A key of the file, as channel.acc_x.unit=g; again for more.",
)
@click.option("-o", "output", type=Target(".toml"), required=True, help="The measurement file to write.")
@json_option
def command(files: tuple[Path, ...], kind: str | None, settings: tuple[str, ...], output: Path, as_json: bool) -> None:
    """Read FILES as they are (text of any dialect, universal, TDMS, MATLAB, HDF5, WAV, LabVIEW, npz; a folder with a
    record in each file; or a table of test cuts) and write the measurement file that names them.

    What the files do not say is guessed, and every guess is told here and beside its key. What can be read in two ways
    is refused with both readings.

    \b
    Example:
      jointlib import machines/library/guide_mill/static.csv -o vise.measurement.toml
    """
    from jointlib.answers.import_records import brought_to

    with working("reading"):
        brought = brought_to(files, output, kind, settings)
    emit(as_json, {"file": str(output), **data(brought)}, [*words(brought), wrote(output)])


def data(brought: Brought) -> dict[str, Any]:
    """The promised keys."""
    from jointlib.lab.importing.draft import names_of

    channels = [names_of(t) for t in brought.draft.channels]
    rate = brought.draft.top.get("sample_rate")
    return {
        "kind": brought.kind,
        "sample_rate": _hertz(rate.value) if rate is not None else None,
        "channels": [
            {"column": c.get("column", c["name"]), **{key: c.get(key) for key in ("name", "role", "quantity", "unit")}}
            for c in channels
        ],
        "records": [names_of(t)["file"] for t in (*brought.draft.records, *brought.draft.cuts) if "file" in t],
        "guesses": brought.draft.guesses,
    }


def words(brought: Brought) -> list[str]:
    """Kind, cuts, records and channels, and the guesses as a list."""
    from jointlib.lab.importing.draft import names_of

    told = data(brought)
    count = len(told["records"])
    rate = f" at {told['sample_rate']:g} Hz" if told["sample_rate"] else ""
    lengths = {len(c.values) for f in brought.files for c in f.columns[:1]}
    span = f"{min(lengths)} to {max(lengths)}" if len(lengths) > 1 else str(*lengths)
    cuts = [names_of(t).get("verdict", "by its record") for t in brought.draft.cuts]
    judged = ", ".join(f"{cuts.count(word)} {word}" for word in dict.fromkeys(cuts))
    lines = [f"{told['kind']}: {len(cuts)} cuts, {judged}"] if cuts else []
    if not cuts or count:
        lines += [f"{told['kind']}: {count} record{'s' * (count > 1)}{f' of {span} samples' if lengths else ''}{rate}"]
    rows = [
        tuple(str(c[key] or "") for key in ("name", "column", "role", "quantity", "unit")) for c in told["channels"]
    ]
    lines += table(("channel", "column", "role", "quantity", "unit"), rows) if rows else []
    guesses = told["guesses"]
    return [*lines, *(["not in the files:"] if guesses else []), *(f"  {said}" for said in guesses)]


def _hertz(value: Any) -> float:
    from jointlib.units import quantity

    return quantity(value, "Hz", "sample_rate")
