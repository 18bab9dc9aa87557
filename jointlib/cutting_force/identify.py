"""From a measurement of cutting forces to coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version

import numpy as np

from jointlib.arrays import Array
from jointlib.cutting_force.coefficients import Coefficients
from jointlib.cutting_force.cut import AXES, Cut
from jointlib.cutting_force.fit import CoefficientFit, ForceRecord, by_lines, by_means
from jointlib.cutting_force.lines import tooth_lines
from jointlib.cutting_force.result import CuttingForces, MeanForce
from jointlib.cutting_force.tooth_force import COEFFICIENTS
from jointlib.cutting_force.transfer import Transfer, read_transfer
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
_DIFFER = 4.0
"""Standard errors from which on the two fits are said to differ."""
_POOR = 4.0
"""χ² over degrees of freedom from which on the linear force is said not to hold."""


def identify_cutting(measurement: Measurement) -> CuttingForces:
    """Coefficients of cutting forces from the fit records of a measurement of kind ``cutting-force``.

    Mean forces give a first answer, a straight line over the feed. Where the lines of the teeth stand out of the noise
    every one of them is fitted, which is least squares on the force at each instant without what repeats with the
    revolution alone (run-out). Errors come from the scatter of blocks of whole revolutions; where the straight line
    misses more than that they are raised by what it misses.
    """
    _refuse_one_feed(measurement)
    channels = [c for c in measurement.channels if c.name in AXES[_process(measurement)]]
    transfers = {c.name: read_transfer(c.transfer, measurement.text) for c in channels if c.transfer is not None}
    opened = read_records(measurement, (*measurement.with_role("fit"), *measurement.with_role("quiet")))
    zero, doubt = _zero(opened, [c.name for c in channels])
    sign = -1.0 if measurement.acts_on == "workpiece" else 1.0
    highest, messages = _highest(measurement, transfers)
    records, unheard = [], []
    for record in opened:
        if record.source.role != "fit":
            continue
        assert record.source.cut is not None
        force: Array = sign * np.array([record.channels[c.name] - zero.get(c.name, 0.0) for c in channels])
        made, heard = _lines(record, record.source.cut, force, [c.name for c in channels], highest, transfers)
        records.append(replace(made, zero=doubt))
        unheard += [] if heard else [record.name]
    if not zero:
        messages.append("No quiet record: the zero of the dynamometer is taken as it stands in the records.")
    try:
        means = by_means(records)
    except InputError as error:
        raise InputError(f"{measurement.source}: {error}") from None
    _refuse_sign(measurement, means)
    found = None if unheard or highest == 0 or _process(measurement) == "turning" else by_lines(records, means)
    messages += _said(measurement, means, found, unheard)
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
) -> tuple[ForceRecord, bool]:
    """The lines of one record with the dynamometer taken out, and whether the teeth were heard."""
    axes = tuple(AXES[cut.process].index(name) for name in names)
    top = 0.0 if cut.process == "turning" else highest
    found = tooth_lines(force, record.sample_rate, cut.frequency, cut.teeth, top, record.name)
    value, variance = found.value.copy(), found.variance.copy()
    line = found.frequency * np.arange(len(value), dtype=float)
    for i, name in enumerate(names):
        if name in transfers:
            gain = transfers[name].inverse(line)
            value[:, i] *= gain
            variance[:, i] *= np.abs(gain) ** 2
    value[0] = value[0].real
    turning_at = 60 * found.frequency / cut.teeth
    made = ForceRecord(record.name, replace(cut, speed=turning_at), axes, value, variance, np.zeros(len(axes)))
    return made, found.heard or top == 0


def _refuse_sign(m: Measurement, means: CoefficientFit) -> None:
    names = tuple(COEFFICIENTS)
    told = dict(zip((names[k] for k in means.known), means.value, strict=True))
    wrong = [name for name in ("tangential", "normal") if told.get(name, 1.0) <= 0]
    if wrong:
        raise InputError(
            f"{m.source}: {wrong[0]} comes out as {1e-6 * told[wrong[0]]:.4g} N/mm², expected more than 0: is it the "
            'force on the workpiece (acts_on = "workpiece"), does a channel look the other way (direction), or x '
            "not along the feed?"
        )


def _said(m: Measurement, means: CoefficientFit, lines: CoefficientFit | None, unheard: Sequence[str]) -> list[str]:
    said = []
    feeds = {round(r.cut.feed, 9) for r in m.with_role("fit") if r.cut is not None}
    if len(feeds) == 2:
        said.append("Two feeds: nothing tells whether the force grows straight with the feed; a third would.")
    if unheard:
        said.append(f"The teeth do not stand out of the noise in {', '.join(unheard)}: mean forces alone are used.")
    elif lines is None and _process(m) != "turning":
        said.append("The lines of the teeth tell no angle of the spindle: mean forces alone are used.")
    used = lines or means
    if used.misfit > _POOR:
        said.append(
            f"The records miss the linear force by {used.misfit**0.5:.2g} times their scatter, and the errors are "
            "raised by that: the force may bend with the feed, the tool may vibrate, or the dynamometer resonate."
        )
    if lines is not None:
        names = tuple(COEFFICIENTS)
        apart = (lines.value - means.value) / np.sqrt(np.diag(lines.covariance) + np.diag(means.covariance))
        for k in np.flatnonzero(np.abs(apart) > _DIFFER):
            said.append(
                f"{names[lines.known[k]]}: mean forces alone say something else, by {abs(apart[k]):.2g} standard "
                "errors; mind the zero of the dynamometer and its bandwidth."
            )
    return said


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
    )
