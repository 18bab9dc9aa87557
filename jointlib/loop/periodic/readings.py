"""The records of a rig measurement, read and made ready; the sealed ones only when asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop.answer.following import unfollowed
from jointlib.loop.answer.import_checks import without_dead_channels
from jointlib.loop.balance.bench import Found, Raw
from jointlib.loop.balance.bodies import Rig, rig_of
from jointlib.loop.balance.floor import Closure, excited_band, noise_floor
from jointlib.loop.balance.inputs import inputs_of, ranges_of
from jointlib.loop.balance.spectra import Spectra, spectra_of
from jointlib.loop.contest.fitted import Fitted, fit, free_parameters
from jointlib.measurement import Channel, Measurement, Record
from jointlib.modulation import CONDITION_OF


@dataclass(frozen=True)
class Readings:
    """Training and quiet records as spectra, with their floors."""

    measurement: Measurement
    rig: Rig
    training: tuple[Raw, ...]
    quiet: tuple[Spectra, ...]
    band: tuple[float, float, float, float]
    warnings: tuple[str, ...]
    ranges: Mapping[str, tuple[float, float]]
    """Of the inputs that parameters may follow, over the training records, by condition, SI."""

    def opened(self) -> tuple[tuple[Raw, ...], tuple[str, ...]]:
        """The sealed records, read now; one that cannot be used is said and left out, for all else is decided."""
        said: list[str] = []
        raws: list[Raw] = []
        for source in self.measurement.with_role("sealed"):
            try:
                read = _spectra(self.measurement, read_records(self.measurement, [source]), said)
                here = [_raw(self.measurement, r, s, self.rig, self.quiet, self.band) for r, s in read]
                raws += _with_held(here, self.ranges)
            except InputError as unusable:
                said.append(f"Sealed record not used: {unusable}.")
        return tuple(raws), tuple(said)


def readings(measurement: Measurement) -> Readings:
    """Read what takes part in the choice."""
    records = read_records(measurement, measurement.with_role("fit"))
    alive, said = without_dead_channels(measurement, records)
    if alive is not measurement:
        measurement, records = alive, read_records(alive, alive.with_role("fit"))
    warnings = list(said)
    training = _spectra(measurement, records, warnings)
    silent = read_records(measurement, measurement.with_role("quiet"))
    quiet = tuple(s for _, s in _spectra(measurement, silent, warnings))
    rig = rig_of(measurement)
    spectra = [s for _, s in training]
    band = excited_band(spectra, [noise_floor(s, quiet) for s in spectra], measurement.band)
    raws = tuple(_raw(measurement, r, s, rig, quiet, band) for r, s in training)
    ranges = ranges_of([r.inputs for r in raws])
    raws = _with_held(raws, ranges)
    for raw in raws:
        if raw.floor.source == "quiet" and raw.spectra.periods > 1:
            raised = ", ".join(f"{n} {r:.1f} times" for n, r in raw.floor.ratio.items() if r > 1.5)
            warnings.append(
                f"{raw.spectra.name}: between the lines {raised} the quiet level; something does not repeat."
            )
    warnings += idle_inputs(measurement.channels, ranges)
    return Readings(measurement, rig, raws, quiet, band, tuple(warnings), ranges)


def idle_inputs(channels: Sequence[Channel], ranges: Mapping[str, tuple[float, float]]) -> list[str]:
    """A sentence for every channel that might be an input and that nothing can follow."""
    said = []
    for c in (c for c in channels if c.is_input):
        what, condition = f"Channel {c.name} ({c.quantity})", CONDITION_OF.get(c.quantity)
        if condition is None or condition not in ranges:
            said.append(f"{what} takes no part: parameters do not follow this quantity.")
        elif ranges[condition][0] == ranges[condition][1]:
            said.append(f"{what} is the same in all records to fit: whether parameters follow it they cannot tell.")
    return [*said, *unfollowed(channels)]


def _spectra(measurement: Measurement, records: Sequence[Record], warnings: list[str]) -> list[tuple[Record, Spectra]]:
    out = []
    for record in records:
        s, said = spectra_of(record, measurement)
        out.append((record, s))
        warnings += said
    return out


def _raw(
    measurement: Measurement,
    record: Record,
    spectra: Spectra,
    rig: Rig,
    quiet: Sequence[Spectra],
    band: tuple[float, float, float, float],
) -> Raw:
    first = measurement.settle * spectra.period_samples
    steady = slice(first, first + spectra.samples)
    return Raw(
        spectra,
        noise_floor(spectra, quiet, _closures(rig, spectra)),
        rig,
        band,
        first,
        _feed(measurement, record, steady),
        inputs_of(measurement, record, steady, spectra.period_samples),
    )


def _with_held(raws: Sequence[Raw], ranges: Mapping[str, tuple[float, float]]) -> tuple[Raw, ...]:
    return tuple(replace(raw, inputs=raw.inputs.held(ranges)) for raw in raws)


def _closures(rig: Rig, record: Spectra) -> list[Closure]:
    """Sums of channels in which no motion is left, whatever the joint does."""
    omega = 2 * np.pi * record.frequency
    balance: Closure = {"P": 1.0, **{name: -rig.apparent_mass(name, omega) for name in rig.masses}}
    return [balance] * rig.has_balance + [{"a2": 1.0, "a3": -1.0}] * rig.has_third


def _feed(measurement: Measurement, record: Record, steady: slice) -> Array | None:
    channels = [c for c in measurement.channels if c.quantity == "position"]
    return record.channels[channels[0].name][steady] if channels else None


def baseline(raws: Sequence[Raw], joint: Joint, found: Sequence[Found] = ()) -> Fitted:
    """The joint refitted to the training records, twice: the noise of z depends on its stiffness."""
    fitted = Fitted(tuple(raws), joint)
    for _ in range(2):
        fitted = fit(raws, fitted.joint, free_parameters(joint), found)
    return fitted
