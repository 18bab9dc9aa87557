"""The fit records of a measurement, opened and turned into force balances."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.estimation.same_motion import refuse_other_motion
from jointlib.identification.excitation import excited
from jointlib.identification.force_balance import ForceBalance, balance_of
from jointlib.identification.force_samples import RestoringForce, restoring_force
from jointlib.identification.path_record import path_balance, path_unknowns
from jointlib.io.measurement_file import read_records
from jointlib.measurement import Measurement, Record


@dataclass(frozen=True)
class FitRecords:
    """One measurement with its fit records; sealed and quiet ones stay closed."""

    measurement: Measurement
    records: tuple[Record, ...]
    balances: tuple[ForceBalance, ...]
    surfaces: tuple[RestoringForce, ...] = ()
    excited: tuple[float, float] | None = None
    """Band in Hz that the excitation gave, where the measurement tells none."""
    doubts: tuple[str, ...] = ()
    """What channels of one motion do not agree on."""

    @property
    def unit(self) -> str:
        """Unit of the force."""
        forces = self.measurement.of("force")
        return forces[0].si_unit if forces and self.measurement.kind != "rig" else "N"

    @property
    def unknowns(self) -> tuple[str, ...]:
        """What the records tell beside the joint."""
        return path_unknowns(self.measurement) if self.measurement.kind == "path" else ()

    def remarks(self) -> list[str]:
        """What a reader of the fit should know of the records."""
        name, out = self.measurement.source.name, []
        if self.measurement.simulated:
            out.append(f"{name}: the records are simulated.")
        closed = len(self.measurement.with_role("sealed"))
        if closed:
            out.append(f"{name}: {closed} sealed record{'s' * (closed > 1)} left closed.")
        ignored = sorted({column for record in self.records for column in record.ignored})
        if ignored:
            out.append(f"{name}: columns without a channel ignored: {', '.join(ignored)}.")
        for record in self.records:
            rest = len(record) % record.period if record.period else 0
            if rest and self.measurement.kind == "rig":
                out.append(f"{record.name}: {rest} samples after the last whole period dropped.")
        out += [f"{name}: {doubt}" for doubt in self.doubts]
        if self.excited is not None:
            low, high = self.excited
            out.append(f"{name}: no band is given; what the shaker drives is used, {low:.0f} to {high:.0f} Hz.")
        if self.unit != "N":
            out.append(f"{name}: force and displacement are in {self.unit}; parameters are consistent, not SI.")
        return out


def open_records(measurement: Measurement) -> FitRecords:
    """Read the fit records and form their balances."""
    if measurement.kind not in ("static", "rig", "path"):
        raise InputError(
            f"{measurement.source}: kind is {measurement.kind!r}, identify needs static, rig or path records"
        )
    records = read_records(measurement, measurement.with_role("fit"))
    if not records:
        raise InputError(f'{measurement.source}: no record has role = "fit", expected at least one')
    if measurement.kind == "rig":
        band = None if measurement.band else excited(measurement, records)
        within = replace(measurement, band=band) if band else measurement
        surfaces = tuple(restoring_force(within, r) for r in records)
        return FitRecords(measurement, records, tuple(balance_of(s) for s in surfaces), surfaces, band)
    doubts = refuse_other_motion(measurement, records)
    form = path_balance if measurement.kind == "path" else static_balance
    return FitRecords(measurement, records, tuple(form(measurement, r) for r in records), doubts=tuple(doubts))


def static_balance(measurement: Measurement, record: Record) -> ForceBalance:
    """A loading curve; several displacement channels are pick-ups around the joint, their mean its deflection."""
    pickups = measurement.of("displacement") or measurement.of("position")
    for channel in (*pickups, measurement.of("force")[0]):
        if not np.any(record.channels[channel.name]):
            raise InputError(f"{record.source.file}: channel {channel.name!r} is zero throughout, expected a signal")
    z: Array = np.mean([record.channels[c.name] for c in pickups], axis=0)
    load = record.channels[measurement.of("force")[0].name]
    if len(z) < 8:
        raise InputError(f"{record.source.file}: {len(z)} points, expected at least 8 on a loading curve")
    peak = float(np.max(np.abs(load)))
    return ForceBalance(
        record.name, z, np.zeros_like(z), 0.0, load, np.asarray, np.arange(len(z), dtype=np.int64), peak
    )
