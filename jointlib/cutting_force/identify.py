"""From a measurement of cutting forces to coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version

import numpy as np

from jointlib.arrays import Array
from jointlib.cutting_force.coefficients import Coefficients
from jointlib.cutting_force.cut import AXES, Cut
from jointlib.cutting_force.doubts import doubts, refuse_sign, refuse_teeth
from jointlib.cutting_force.fit import CoefficientFit, ForceRecord, by_lines, by_means
from jointlib.cutting_force.lines import tooth_lines
from jointlib.cutting_force.result import CuttingForces, MeanForce
from jointlib.cutting_force.tooth_force import COEFFICIENTS
from jointlib.cutting_force.transfer import Transfer, read_transfer
from jointlib.cutting_force.uneven_fit import with_run_out
from jointlib.errors import InputError
from jointlib.identification.result import FitError, Found
from jointlib.io.atomic import sha256
from jointlib.io.measurement_file import read_records
from jointlib.joint import Covariance
from jointlib.measurement import Measurement, Record

_READABLE = 2.56
"""Sample rate over the highest frequency that a recorder passes."""
_PARTS = 10
"""Of a quiet record, whose means tell how well the zero is known."""


def identify_cutting(measurement: Measurement) -> CuttingForces:
    """Coefficients of cutting forces from the fit records of a measurement of kind ``cutting-force``.

    Mean forces give a first answer, a straight line over the feed. Where the lines of the teeth stand out of the noise
    every one of them is fitted, which is least squares on the force at each instant. Where the force repeats with the
    revolution but not from tooth to tooth, the lines between are fitted too, with the run-out of each flute. Errors
    come from the scatter of blocks of whole revolutions; where the fit misses more they are raised by what it misses.
    """
    _refuse_one_feed(measurement)
    channels = [c for c in measurement.channels if c.name in AXES[_process(measurement)]]
    transfers = {c.name: read_transfer(c.transfer, measurement.text) for c in channels if c.transfer is not None}
    opened = read_records(measurement, (*measurement.with_role("fit"), *measurement.with_role("quiet")))
    zero, doubt = _zero(opened, [c.name for c in channels])
    sign = -1.0 if measurement.acts_on == "workpiece" else 1.0
    highest, messages = _highest(measurement, transfers)
    records, unheard, drifts = [], [], dict[str, float]()
    for record in opened:
        if record.source.role != "fit":
            continue
        assert record.source.cut is not None
        force: Array = sign * np.array([record.channels[c.name] - zero.get(c.name, 0.0) for c in channels])
        made, heard, drift = _lines(record, record.source.cut, force, [c.name for c in channels], highest, transfers)
        for channel, by in zip(channels, np.abs(drift), strict=True):
            drifts[channel.name] = max(drifts.get(channel.name, 0.0), float(by))
        records.append(replace(made, zero=doubt))
        unheard += [] if heard else [record.name]
    if not zero:
        messages.append("No quiet record: the zero of the dynamometer is taken as it stands in the records.")
    messages += [
        f"{name} drifts by up to {by:.3g} N along a record: half of that is counted as an error of its mean."
        for name, by in drifts.items()
        if by > 0
    ]
    refuse_teeth(measurement, records)
    try:
        means = by_means(records)
    except InputError as error:
        raise InputError(f"{measurement.source}: {error}") from None
    refuse_sign(measurement, means, records)
    found = None if unheard or highest == 0 or _process(measurement) == "turning" else by_lines(records, means)
    uneven = None if found is None else with_run_out(records, found)
    if uneven is not None:
        found, records = uneven, [replace(record, run_out=uneven.run_out) for record in records]
        means = by_means(records)
    refuse_sign(measurement, found or means, records)
    messages += dict.fromkeys(said for record in records for said in record.cut.strange())
    messages += doubts(measurement, records, means, found, unheard)
    return _result(measurement, opened, records, found or means, means, messages)


def _process(m: Measurement) -> str:
    return next(r.cut.process for r in m.records if r.cut is not None)


def _refuse_one_feed(m: Measurement) -> None:
    feeds = sorted({round(r.cut.feed, 9) for r in m.with_role("fit") if r.cut is not None})
    if len(feeds) < 2:
        raise InputError(
            f"{m.source}: one feed only ({1e3 * feeds[0]:g} mm), expected records at three feeds or more: the force "
            "over the feed has a slope, the cutting, and an offset, the edge"
        )


def _zero(opened: Sequence[Record], names: Sequence[str]) -> tuple[dict[str, float], Array]:
    """N that the channels show with the tool in the air, and E|error|² of it; empty where no quiet record tells it."""
    quiet = [record for record in opened if record.source.role == "quiet"]
    if not quiet:
        return {}, np.zeros(len(names))
    means = {
        name: np.array([np.mean(part) for r in quiet for part in np.array_split(r.channels[name], _PARTS)])
        for name in names
    }
    variance = np.array([np.var(found, ddof=1) / len(found) for found in means.values()])
    return {name: float(np.mean(found)) for name, found in means.items()}, variance


def _highest(m: Measurement, transfers: Mapping[str, Transfer]) -> tuple[float, list[str]]:
    """Hz up to which lines are taken, and what there is to say about it."""
    readable = (m.sample_rate or 0.0) / _READABLE
    top = min([readable, *(t.highest for t in transfers.values()), *([] if m.band is None else [m.band[1]])])
    if transfers or m.band is not None or _process(m) == "turning":
        return top, []
    return top, [
        f"No FRF of the dynamometer (transfer) and no band: lines up to {top:.4g} Hz are taken as they stand. A "
        "resonance below three times that would falsify them; the mean forces do not feel it."
    ]


def _lines(
    record: Record, cut: Cut, force: Array, names: Sequence[str], highest: float, transfers: Mapping[str, Transfer]
) -> tuple[ForceRecord, bool, Array]:
    """The lines of one record with the dynamometer taken out, whether the teeth were heard, and drifts in N."""
    axes = tuple(AXES[cut.process].index(name) for name in names)
    top = 0.0 if cut.process == "turning" else highest
    found = tooth_lines(force, record.sample_rate, cut.frequency, cut.teeth, top, record.name)
    value, variance = found.value.copy(), found.variance.copy()
    turn, turn_variance = found.turn.copy(), found.turn_variance.copy()
    line = found.frequency * np.arange(len(value), dtype=float)
    for i, name in enumerate(names):
        if name in transfers:
            gain = transfers[name].inverse(line)
            value[:, i] *= gain
            variance[:, i] *= np.abs(gain) ** 2
            gain = transfers[name].inverse(found.frequency / cut.teeth * np.arange(len(turn), dtype=float))
            turn[:, i] *= gain
            turn_variance[:, i] *= np.abs(gain) ** 2
    value[0], turn[0] = value[0].real, turn[0].real
    running = replace(cut, speed=60 * found.frequency / cut.teeth)
    made = ForceRecord(record.name, running, axes, value, variance, np.zeros(len(axes)), turn, turn_variance)
    return made, found.heard or top == 0, found.drift


def _result(
    m: Measurement,
    opened: Sequence[Record],
    records: Sequence[ForceRecord],
    fit: CoefficientFit,
    means: CoefficientFit,
    messages: Sequence[str],
) -> CuttingForces:
    names, units = tuple(COEFFICIENTS), tuple(COEFFICIENTS.values())

    def table(of: CoefficientFit) -> dict[str, Found]:
        error = np.sqrt(np.diag(of.covariance))
        rows = zip(of.known, of.value, error, strict=True)
        return {names[k]: Found(float(v), units[k], float(e), "fitted") for k, v, e in rows}

    covariance = Covariance(tuple(names[k] for k in fit.known), fit.covariance)
    files = {m.source.name: sha256(m.source)} if m.source.is_file() else {}
    files |= {record.source.file.name: record.sha256 for record in opened}
    provenance = {
        "program": f"jointlib {version('jointlib')}",
        "simulated": m.simulated,
        "method": fit.method,
        **({"run_out": list(fit.run_out)} if fit.run_out else {}),
        "files": [{"file": name, "sha256": digest} for name, digest in files.items()],
    }
    values = {name: one.value for name, one in table(fit).items()}
    shown, largest = [], 0.0
    for record in records:
        largest = max(largest, float(np.max(np.abs(record.value[0]))))
        model = (record.columns()[0][:, list(fit.known)] @ fit.value).real
        for i, axis in enumerate(record.axes):
            name = AXES[record.cut.process][axis]
            shown.append(MeanForce(name, record.cut.feed, float(record.value[0, i].real), float(model[i])))
    rms = float(np.sqrt(np.mean(np.square(fit.left))))
    by_record = {record.name: left for record, left in zip(records, fit.left, strict=True)}
    return CuttingForces(
        Coefficients(_process(m), values, covariance, provenance),
        table(fit),
        fit.method,
        table(means),
        fit.misfit,
        (FitError(m.source.name, m.kind, rms, "N", rms / (largest or 1.0), by_record),),
        tuple(shown),
        tuple(messages),
        tuple(Found(r, "m", e, "fitted") for r, e in zip(fit.run_out, fit.run_out_error, strict=True)),
    )
