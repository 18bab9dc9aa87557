"""From the records of a measurement of kind "impact" or "shaker" to frequency responses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.estimation import checks
from jointlib.estimation.blocks import QUANTITY, drive_of, motions_of, place_of, refuse_silent
from jointlib.estimation.continuation import taken_off
from jointlib.estimation.impact import hits_of
from jointlib.estimation.result import Estimate, EstimatedFRF
from jointlib.estimation.same_motion import refuse_other_motion
from jointlib.estimation.settings import EXCITED
from jointlib.estimation.several import several_lines
from jointlib.estimation.shaker import Lines, burst_lines, from_spectra, periodic_lines, random_lines, unclipped
from jointlib.estimation.stepped import stepped_lines
from jointlib.io.measurement_file import read_records
from jointlib.measurement import Channel, Measurement, Record

_FALLEN = 100.0
"""Power ratio, 20 dB, that the force of a hit may have fallen by at the last line."""
_TOP = 0.4
"""Share of the sample rate up to which lines are used where no band is given."""


def estimate(measurement: Measurement) -> Estimate:
    """Frequency responses of every place of the force and condition, sealed and quiet records left closed.

    Returns
    -------
    Estimate
        One response per motion channel, place of the force and condition, with variance and coherence per line.

    Raises
    ------
    InputError
        Where the kind is another, no clean hit or record is left, a channel is silent, nothing follows the force, or a
        driving point yields energy.
    """
    m = measurement
    if m.kind not in EXCITED:
        raise InputError(f"{m.source}: kind is {m.kind!r}, expected {' or '.join(map(repr, EXCITED))} to estimate from")
    records = read_records(m, m.with_role("fit"))
    refuse_silent(m, records)
    left_out: list[str] = []
    notes: list[str] = refuse_other_motion(m, records)
    frfs: list[EstimatedFRF] = []
    for place in dict.fromkeys(place_of(m, r) for r in records):
        frfs += _at_one_place(m, [r for r in records if place_of(m, r) == place], left_out, notes)
    for frf in frfs:
        checks.refuse_unrelated(str(m.source), frf)
        checks.refuse_turned(str(m.source), frf)
    notes += checks.said_of(frfs)
    return Estimate(tuple(frfs), tuple(left_out), tuple(dict.fromkeys(notes)), m.simulated)


def _at_one_place(
    m: Measurement, records: Sequence[Record], left_out: list[str], notes: list[str]
) -> list[EstimatedFRF]:
    band, hits = m.band, None
    drive = drive_of(m, records[0])
    if m.kind == "impact":
        hits = hits_of(m, records)
        left_out += hits.left_out
        notes += hits.notes
        found = from_spectra(hits.spectra, m.estimate.estimator)
        band = band or _struck(hits.spectra.frequency, hits.spectra.force, records[0].sample_rate, notes)
    else:
        records = unclipped(m, records, left_out)
        if len(m.of("force")) > 1:
            each = several_lines(m, records, notes)
            out = []
            for one in each:
                frf = _of_band(m, str(one.force.dof), one.motion, one.lines, band, records)
                out.append(_with_force(m, frf, one.lines, records, one.share))
            return out
        method = {"stepped-sine": stepped_lines, "random": random_lines}.get(m.estimate.signal, burst_lines)
        if method is not stepped_lines and records[0].period is not None:
            method = periodic_lines
        found = method(m, records, notes)
    out = []
    for k, (channel, lines) in enumerate(zip(motions_of(m), found, strict=True)):
        frf = _of_band(m, drive, channel, lines, band, records)
        if hits is not None and (hits.shift or hits.unfinished[k]):
            frf, said = taken_off(frf, hits)
            notes.append(said)
        out.append(_with_force(m, frf, lines, records))
    return out


def _of_band(
    m: Measurement,
    drive: str,
    channel: Channel,
    lines: Lines,
    band: tuple[float, float] | None,
    records: Sequence[Record],
) -> EstimatedFRF:
    """The lines of a band as a response whose level is yet to be found."""
    low, high = band or (0.0, _TOP * records[0].sample_rate)
    kept = (lines.frequency >= low) & (lines.frequency <= high)
    if np.sum(kept) < 4:
        raise InputError(f"{m.source}: {np.sum(kept)} lines between {low:g} and {high:g} Hz, expected at least 4")
    assert channel.dof is not None
    return EstimatedFRF(
        drive,
        channel.dof,
        lines.frequency[kept],
        lines.value[kept],
        QUANTITY[channel.quantity],
        None if lines.spread is None else lines.spread.variance[kept],
        lines.coherence[kept],
        lines.count,
        1.0,
        records[0].source.condition,
        tuple(r.name for r in records),
        None if lines.spread is None else lines.spread.radius[kept],
        None if lines.spread is None else lines.spread.alike[kept],
    )


def _struck(frequency: Array, force: ComplexArray, rate: float, notes: list[str]) -> tuple[float, float]:
    """The band in which hits have force: until its power is 20 dB down."""
    power = np.mean(np.abs(force) ** 2, axis=0)
    weak = np.flatnonzero(power < np.max(power[: max(4, len(power) // 50)]) / _FALLEN)
    high = min(float(frequency[weak[0]]) if len(weak) else np.inf, _TOP * rate)
    notes.append(
        f"lines up to {high:.4g} Hz, where the force of the hits is 20 dB down; say band for others."
        if len(weak)
        else f"lines up to {high:.4g} Hz."
    )
    return 0.0, high


def _with_force(
    m: Measurement, frf: EstimatedFRF, lines: Lines, records: Sequence[Record], share: float = 1.0
) -> EstimatedFRF:
    """The level, as the harmonic force that would move the response as far at its highest resonance; of several forces
    this one causes a ``share`` of the power of the motion."""
    channel = next(c for c in motions_of(m) if c.dof == frf.response)
    jw = 1 / frf.quantity.per_receptance(frf.frequency)
    farthest = 0.0
    for record in records:
        x = record.channels[channel.name]
        f = np.fft.rfftfreq(len(x), 1 / record.sample_rate)
        inside = (f >= frf.frequency[0]) & (f <= frf.frequency[-1])
        spectrum = np.zeros(len(f), dtype=complex)
        spectrum[inside] = (np.fft.rfft(x)[inside]) / frf.quantity.per_receptance(f[inside])
        farthest = max(farthest, float(np.max(np.abs(np.fft.irfft(spectrum, len(x))))))
    peak = float(np.max(np.abs(frf.value * jw)))
    return replace(frf, force=float(np.sqrt(share)) * farthest / max(peak, 1e-300) or 1.0)
