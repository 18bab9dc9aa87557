"""Say what a file holds, in plain words, with units."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option, refuse_tool, tool_option
from jointlib.cli.output import emit, table
from jointlib.errors import InputError
from jointlib.units import shown

if TYPE_CHECKING:
    from jointlib.measurement import Measurement


@click.command("inspect", cls=Verb)
@input_file("file")
@click.option("-o", "output", type=Target(".svg", ".html"), help="Draw a machine into this file: .svg or .html.")
@click.option("--mode", type=click.IntRange(1), help="Show this mode, from 1 on in ascending frequency; with -o.")
@click.option("--contacts", is_flag=True, help="Of a machine: every connection on a line of its own.")
@tool_option
@json_option
def command(
    file: Path, output: Path | None, mode: int | None, contacts: bool, changes: dict[str, str], as_json: bool
) -> None:
    """Say what FILE holds: a measurement, joint, component, machine, a record (text, npz, uff, tdms …), or an FMU.

    Of a machine also masses, stiffnesses and first modes, and what looks like a mistake in it.
    With -o a machine is drawn as well: an SVG with four views, or an HTML page in which it turns and its modes move.

    \b
    Examples:
      jointlib inspect machines/library/guide.joint.toml
      jointlib inspect machines/library/lathe.toml -o lathe.html
    """
    if not file.is_file():
        raise InputError(f"{file}: a folder, expected a file" if file.is_dir() else f"{file}: no such file")
    if mode is not None and output is None:
        raise InputError("--mode: expected -o FILE.svg or FILE.html as well, the picture that shows it")
    lines, warnings = _told(file, contacts, changes)
    data: dict[str, Any] = {"file": str(file)}
    if output is not None:
        from .told.picture import draw

        lines += draw(file, output, mode, changes)
        data["picture"] = str(output)
    emit(as_json, {**data, "lines": lines, "warnings": warnings}, lines)


def _told(file: Path, contacts: bool, changes: dict[str, str]) -> tuple[list[str], list[str]]:
    """What a file holds, and of a machine the sentences on what looks wrong in it."""
    if file.suffix != ".toml":
        refuse_tool(file, changes)
    if file.suffix == ".fmu":
        return _fmu(file), []
    if file.suffix != ".toml":
        return _record(file), []
    import tomllib

    from jointlib.io.toml_file import not_valid

    text = ""
    try:
        text = file.read_text("utf-8-sig")
        schema = tomllib.loads(text).get("schema")
    except UnicodeDecodeError as error:
        raise InputError(f"{file}: not valid TOML: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{file}: {not_valid(text, error)}") from None
    readers = {"jointlib/joint/1": _joint, "jointlib/measurement/1": _measurement}
    readers["jointlib/component/1"] = _component
    machine = "jointlib/machine/1"
    if not isinstance(schema, str) or schema not in (*readers, machine):
        raise InputError(f"{file}: schema is {schema!r}, expected one of {', '.join((*readers, machine))}")
    if schema == machine:
        from ..files.machine_file import read_machine
        from .told.machine_told import told

        return told(read_machine(file, changes), contacts)
    refuse_tool(file, changes)
    return readers[schema](file), []


def _joint(file: Path) -> list[str]:
    from jointlib.io.joint_file import read_joint
    from jointlib.modulation import CONDITIONS

    joint = read_joint(file)
    rows = []
    units = joint.units
    for name, value in joint.parameters.items():
        error = joint.covariance.standard_error(name) if joint.covariance else float("nan")
        factor, unit = shown(units[name])
        spread = f"± {error * factor:.2g}" if error == error else ""
        rows.append((name, f"{value * factor:.6g}", spread, unit, "fixed" if name in joint.fixed else ""))
    lines = [f"joint {joint.name!r}: {' + '.join(law.kind for law in joint.laws)}"]
    lines += table(("parameter", "value", "std. error", "unit", ""), rows)
    for m in joint.modulations:
        low, high = min(f for _, f in m.table), max(f for _, f in m.table)
        again = f", again after {m.period:g} {CONDITIONS[m.condition]}" if m.period else ""
        lines.append(
            f"{m.role.value} depends on {m.condition}: factor {low:g} to {high:g}, "
            f"1 at {m.reference:g} {CONDITIONS[m.condition]}{again}"
        )
    lines += [f"valid for {key} from {low:g} to {high:g}" for key, (low, high) in joint.validity.items()]
    lines += [f"provenance: {key} = {value}" for key, value in joint.provenance.items()]
    return lines


def _component(file: Path) -> list[str]:
    from ..files.component_file import read_component

    component = read_component(file, "component")
    lines = [f"{component.kind} component, dofs {', '.join(component.dofs)}"]
    if component.kind == "modal":
        frequency, ratio = component.frequency, component.damping_ratio  # type: ignore[attr-defined]
        rows = [(f"{f:.6g}", f"{100 * z:.4g}") for f, z in zip(frequency, ratio, strict=True)]
        lines += table(("mode [Hz]", "damping [%]"), rows)
    return [*lines, *component.remarks()]


def _measurement(file: Path) -> list[str]:
    from jointlib.io.measurement_file import read_measurement, read_records

    m = read_measurement(file)
    rate = f", {m.sample_rate:g} Hz" if m.sample_rate else ""
    lines = [f"{'simulated ' * m.simulated}{m.kind} measurement{rate}, {len(m.records)} records"]
    lines += [
        f"body {name}: {'unknown' if mass.value is None else f'{mass.value:g} kg ± {mass.uncertainty:g} kg'}"
        for name, mass in m.bodies.items()
    ]
    if m.carriage is not None:
        lines.append(f"moving mass: {'to be identified' if m.carriage.value is None else f'{m.carriage.value:g} kg'}")
    lines += [
        f"channel {c.name}{f' (column {c.column!r})' if c.column not in (None, c.name) else ''}: "
        f"{c.quantity}{f' of {c.body}' if c.body else ''} in {c.unit}, times {c.factor:g} "
        f"{f'and {c.offset:g} more ' if c.offset else ''}gives {c.si_unit}"
        for c in m.channels
    ]
    for c in m.corrections:
        values = ", ".join(f"{name} = {value:g}" for name, value in c.parameters.items())
        where = " ".join(filter(None, (c.site and f"of {c.site}", c.record and f"in {c.record}")))
        lines.append(f"corrected on reading: {' '.join(filter(None, (c.family, where)))}, {values} in SI")
    if m.kind == "frf":
        return lines + _sweeps(m)
    opened = [r for r in m.records if r.role != "sealed"]
    rows = []
    for source, record in zip(opened, read_records(m, opened), strict=True):
        spans = ", ".join(f"{name} rms {float((x**2).mean() ** 0.5):.4g}" for name, x in record.channels.items())
        rows.append((source.name, source.role, str(len(record)), spans))
    rows += [(r.name, "sealed", "", "not opened") for r in m.records if r.role == "sealed"]
    return lines + table(("record", "role", "samples", "SI values"), rows)


def _sweeps(m: Measurement) -> list[str]:
    from ..loop.records import open_frfs, said_of

    rows, opened = [], open_frfs(m, m.with_role("fit"))
    for f in opened:
        size = abs(f.receptance)
        noise = f"{100 * float((f.deviation**2).mean() ** 0.5 / (size**2).mean() ** 0.5):.2g} % from {f.deviation_from}"
        span = f"{f.frequency[0]:.5g} to {f.frequency[-1]:.5g}"
        lines = str(len(size))
        rows.append((f.name, "fit", f.response, f.drive, f"{f.force:g}", lines, span, f"{size.max() * 1e6:.4g}", noise))
    for r in m.with_role("sealed"):
        if r.sweep is not None:
            rows.append(
                (r.name, "sealed", r.sweep.response, r.sweep.drive, f"{r.sweep.force:g}", "", "", "", "not opened")
            )
    header = ("record", "role", "response", "drive", "force [N]", "lines", "span [Hz]", "max |H| [um/N]", "noise")
    return [*table(header, rows), *said_of(opened)]


def _record(file: Path) -> list[str]:
    from jointlib.io.readers import read_columns

    columns = read_columns(file)
    rows = [(n, str(len(c)), f"{c.min():.6g}", f"{c.max():.6g}", f"{c.std():.4g}") for n, c in columns.items()]
    header = ("column", "samples", "lowest", "highest", "std. deviation")
    return [f"{len(columns)} columns, units as the measurement file declares", *table(header, rows)]


def _fmu(file: Path) -> list[str]:
    import zipfile

    from fmpy import read_model_description

    try:
        model = read_model_description(str(file))
    except Exception as error:  # FMPy raises plain exceptions of many kinds on broken archives
        raise InputError(f"{file}: not a readable FMU ({str(error).splitlines()[0]})") from None
    with zipfile.ZipFile(file) as archive:
        platforms = sorted({name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")})
    rows = [(v.name, v.causality, v.variability or "", v.unit or "", v.start or "") for v in model.modelVariables]
    head = f"FMU {model.modelName!r}, FMI {model.fmiVersion}, platforms {', '.join(p for p in platforms if p)}"
    return [head, *table(("variable", "causality", "variability", "unit", "start"), rows)]
