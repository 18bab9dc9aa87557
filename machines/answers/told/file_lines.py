"""What is told of a joint, a component, a measurement, a record and an FMU."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.cuts.judged import heard_of, judged_cuts
from jointlib.cuts.strange import strange
from jointlib.cutting_force.coefficients import Coefficients
from jointlib.errors import InputError, told
from jointlib.estimation.same_motion import refuse_other_motion
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.measurement import CUTS, FORCES, RINGDOWN, Measurement
from jointlib.modulation import CONDITIONS
from jointlib.shown.text import table
from jointlib.units import rounded, shown

from ...components.component import Component
from ...components.connection import Connection
from ...loop.records import open_frfs, said_of

WRONG = "looks wrong: "
"""Before a sentence on what looks like a mistake."""


def joint_lines(joint: Joint) -> list[str]:
    """Laws with their parameters, what they depend on, where the joint holds."""
    rows = []
    units = joint.units
    for name, value in joint.parameters.items():
        error = joint.covariance.standard_error(name) if joint.covariance else float("nan")
        factor, unit = shown(units[name])
        rows.append((name, *rounded(value * factor, error * factor, 6), unit, "fixed" if name in joint.fixed else ""))
    lines = [f"joint {joint.name!r}: {' + '.join(law.kind for law in joint.laws)}"]
    lines += table(("parameter", "value", "std. error", "unit", ""), rows)
    for m in joint.modulations:
        low, high = min(f for _, f in m.table), max(f for _, f in m.table)
        again = f", again after {m.period:g} {CONDITIONS[m.condition]}" if m.period else ""
        late = f", with a lag of {1e3 * m.lag:.3g} ms" if m.lag else ""
        lines.append(
            f"{m.role.value} depends on {m.condition}: factor {low:g} to {high:g}, "
            f"1 at {m.reference:g} {CONDITIONS[m.condition]}{again}{late}"
        )
    lines += [f"valid for {key} from {low:g} to {high:g}" for key, (low, high) in joint.validity.items()]
    lines += [f"provenance: {key} = {value}" for key, value in joint.provenance.items()]
    return lines


def coefficient_lines(found: Coefficients) -> list[str]:
    """Coefficients of cutting forces with their standard errors."""
    rows = []
    for name, value in found.values.items():
        factor, unit = (1e-3, "N/mm") if name.startswith("edge") else (1e-6, "N/mm²")
        known = found.covariance is not None and name in found.covariance.names
        error = found.covariance.standard_error(name) if known and found.covariance is not None else 0.0
        rows.append((name, *rounded(value * factor, error * factor, 6), unit))
    made = "simulated " if found.provenance.get("simulated") else ""
    lines = [f"{made}coefficients of {found.process}"]
    return lines + table(("coefficient", "value", "std. error", "unit"), rows)


def cut_lines(m: Measurement) -> list[str]:
    """What the tool does in each record of cutting forces."""
    rows = []
    for record in m.records:
        if (cut := record.cut) is not None:
            arc = cut.mode if cut.process == "milling" and cut.immersion == 1 else f"{cut.mode} {cut.immersion:g}"
            rows.append((
                record.name,
                f"{cut.speed:g}",
                f"{1e3 * cut.depth:g}",
                f"{1e3 * cut.feed:g}",
                arc if cut.process == "milling" else cut.process,
            ))  # fmt: skip
    said = [f"the forces act on the {m.acts_on}"]
    odd = dict.fromkeys(f"{WRONG}{one}" for record in m.records if record.cut for one in record.cut.strange())
    return [*said, *table(("record", "speed [rpm]", "depth [mm]", "feed [mm]", "cut"), rows), *odd]


def tried_lines(m: Measurement) -> list[str]:
    """Every test cut with its verdict, and what its record says of it."""
    rows, doubts = [], []
    judged = judged_cuts(m)
    for one in judged:
        cut, told_by = one.cut, "file" if one.heard is None else "record"
        share = "" if one.heard is None else f"{100 * one.heard.share:.0f}"
        frequency = "" if cut.chatter_frequency is None else f"{cut.chatter_frequency:.5g}"
        row = (f"{cut.speed:g}", f"{1e3 * cut.depth:.4g}", str(cut.verdict), frequency, cut.kind, told_by, share)
        rows.append((cut.name, *row))
        doubts += [one.doubt()] if one.doubt() else []
    header = ("cut", "speed [rpm]", "depth [mm]", "verdict", "chatter [Hz]", "kind", "by", "not repeated [%]")
    odd = strange([one.cut for one in judged], m.sample_rate)
    return [*table(header, rows), *doubts, *heard_of(judged), *(f"{WRONG}{said}" for said in odd)]


def component_lines(component: Component) -> list[str]:
    """Kind, degrees of freedom, modes."""
    lines = [f"{component.kind} component, dofs {', '.join(component.dofs)}"]
    if component.kind == "modal":
        frequency, ratio = component.frequency, component.damping_ratio  # type: ignore[attr-defined]
        rows = [(f"{f:.6g}", f"{100 * z:.4g}") for f, z in zip(frequency, ratio, strict=True)]
        lines += table(("mode [Hz]", "damping [%]"), rows)
    return [*lines, *component.remarks()]


def tool_lines(parts: Sequence[Component], joins: Sequence[Connection]) -> list[str]:
    """Mass and stations of cutter and holder, and what lies between them."""
    lines = []
    for part in parts:
        pulled = part.weight(np.array([0.0, 0.0, 1.0]))
        mass = 0.0 if pulled is None else sum(f for f, dof in zip(pulled, part.dofs, strict=True) if dof.endswith(".z"))
        stations = dict.fromkeys(dof.partition(".")[0] for dof in part.dofs)
        lines.append(f"{part.name}: {mass:.4g} kg, stations {', '.join(stations)}")
        lines += part.remarks()
    for join in joins:
        joint = join.joint
        held = {} if joint is None else {name: join.own_unit(unit) for name, unit in joint.units.items()}
        values = [f"{joint.parameters[name]:g} {unit}" for name, unit in held.items()] if joint is not None else []
        lines.append(f"connection {join.name}: {', '.join(values) or 'rigid'}")
    return lines


def measurement_lines(m: Measurement) -> list[str]:
    """Bodies, channels, records that are not sealed."""
    rate = f", {m.sample_rate:g} Hz" if m.sample_rate else ""
    count = f"{len(m.cuts)} cuts" if m.kind == CUTS else f"{len(m.records)} records"
    lines = [f"{'simulated ' * m.simulated}{m.kind} measurement{rate}, {count}"]
    lines += [
        f"body {name}: {'unknown' if mass.value is None else f'{mass.value:g} kg ± {mass.uncertainty:g} kg'}"
        for name, mass in m.bodies.items()
    ]
    if m.carriage is not None:
        word = "modal mass" if m.kind == RINGDOWN else "moving mass"
        lines.append(f"{word}: {'to be identified' if m.carriage.value is None else f'{m.carriage.value:g} kg'}")
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
    missing = dict.fromkeys(r.file.name for r in m.records if not r.file.is_file())
    if missing:
        raise InputError(
            f"{m.source}: {len(missing)} of {len({r.file for r in m.records})} record files are missing, expected "
            f"{', '.join(missing)} beside it"
        )
    if m.kind == "frf":
        return lines + _sweeps(m)
    if m.kind == CUTS:
        return lines + tried_lines(m)
    if m.kind == FORCES:
        lines += cut_lines(m)
    if m.kind == RINGDOWN:
        lines += _decays(m)
    opened = [r for r in m.records if r.role != "sealed"]
    rows, records = [], read_records(m, opened)
    for source, record in zip(opened, records, strict=True):
        spans = ", ".join(f"{name} rms {float((x**2).mean() ** 0.5):.4g}" for name, x in record.channels.items())
        rows.append((source.name, source.role, str(len(record)), spans))
    rows += [(r.name, "sealed", "", "not opened") for r in m.records if r.role == "sealed"]
    lines += table(("record", "role", "samples", "SI values"), rows)
    try:
        said = refuse_other_motion(m, records)
    except InputError as error:
        said = list(error.sentences)
    return lines + [WRONG + each for each in said]


def _decays(m: Measurement) -> list[str]:
    """The modes of each decay, from the largest amplitude to the smallest."""
    from jointlib.ringdown.backbone import backbones
    from jointlib.ringdown.identify import said_of as said_of_decays

    found = backbones(m, read_records(m, m.with_role("fit")))
    rows = []
    for modes in found:
        for b in modes:
            spans = [b.amplitude * 1e6, b.omega / 6.283185307179586, 100 * b.damping_ratio]
            rows.append(
                (b.record, f"{b.time[0]:.3g} to {b.time[-1]:.3g}", *(f"{x[0]:.5g} to {x[-1]:.5g}" for x in spans))
            )
    header = ("decay", "time [s]", "amplitude [µm]", "f [Hz]", "damping [%]")
    return [*table(header, rows), *said_of_decays(found)]


def _sweeps(m: Measurement) -> list[str]:
    rows, opened = [], open_frfs(m, m.with_role("fit"))
    for f in opened:
        size = abs(f.receptance)
        noise = f"{100 * float((f.deviation**2).mean() ** 0.5 / (size**2).mean() ** 0.5):.2g} % from {f.deviation_from}"
        span = f"{f.frequency[0]:.5g} to {f.frequency[-1]:.5g}"
        lines = str(len(size))
        rows.append((f.name, "fit", f.response, f.drive, f.level, lines, span, f"{size.max() * 1e6:.4g}", noise))
    for r in m.with_role("sealed"):
        if r.sweep is not None:
            rows.append((r.name, "sealed", r.sweep.response, r.sweep.drive, r.sweep.level, "", "", "", "not opened"))
    header = ("record", "role", "response", "drive", "held", "lines", "span [Hz]", "max |H| [um/N]", "noise")
    return [*table(header, rows), *said_of(opened)]


def record_lines(columns: Mapping[str, Array]) -> list[str]:
    """Columns with the range of their numbers, and where there are none."""
    rows, gaps = [], []
    for name, values in columns.items():
        held = finite(values)
        size = float(np.max(np.abs(held), initial=0.0))
        spread = size * float(np.std(held / size)) if size else 0.0
        told_of = (f"{np.min(held):.6g}", f"{np.max(held):.6g}", f"{spread:.4g}") if len(held) else ("", "", "")
        rows.append((told(name, 60), str(len(values)), *told_of))
        if len(held) < len(values):
            first = int(np.argmin(np.isfinite(values))) + 1
            lost = f"{len(values) - len(held)} of {len(values)} samples are no finite numbers"
            gaps.append(told(f"{name}: {lost}, the first in row {first}"))
    header = ("column", "samples", "lowest", "highest", "std. deviation")
    return [f"{len(columns)} columns, units as the measurement file declares", *table(header, rows), *gaps]


def finite(values: Array) -> Array:
    """Those of the samples that are numbers."""
    return np.asarray(values[np.isfinite(values)], dtype=float)


def fmu_lines(file: Path, model: Any) -> list[str]:
    """Version, platforms, variables."""
    with zipfile.ZipFile(file) as archive:
        platforms = sorted({name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")})
    rows = [(v.name, v.causality, v.variability or "", v.unit or "", v.start or "") for v in model.modelVariables]
    head = f"FMU {model.modelName!r}, FMI {model.fmiVersion}, platforms {', '.join(p for p in platforms if p)}"
    return [head, *table(("variable", "causality", "variability", "unit", "start"), rows)]
