"""Measured frequency responses of a machine at several sizes of the force, read and checked."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.atomic import sha256
from jointlib.io.frf_files import read_frf
from jointlib.measurement import Measurement, RecordSource

from ..components.plausibility import spans
from ..model.machine import Machine
from .noise.deviation import FEWEST, from_neighbours, from_repeats
from .sparse_lines import sparse_lines

_CLEAR = 4.0
"""Deviations by which a phase must be wrong to be called so."""
_TILT = 0.1
"""Share of |H| by which Im H of a driving point may be above zero: a phase error of six degrees."""
_MOST = 0.9
_SOME = 0.05
_JUMP = 8.0
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class LevelFRF:
    """One measured frequency response at one size of the force; arrays have one entry per line."""

    name: str
    drive: str
    response: str
    force: float
    """N, peak; the median of those on the lines where it was not held."""
    frequency: Array
    """Hz, ascending, above 0."""
    receptance: ComplexArray
    """m/N: first harmonic of the motion over the force, time factor e^(+jωt)."""
    deviation: Array
    """m/N: √(E|error|²) of the complex value, and larger by √n where n lines err together."""
    deviation_from: str
    """"file", "repeats" (records of the same drive, response and force) or "neighbours" (the lines around)."""
    sealed: bool
    sha256: str
    remarks: tuple[str, ...] = ()
    """What a reader should know of the record, a sentence each."""
    forces: Array | None = None
    """N, peak on each line, where it was measured or the response was held; else ``force`` on all."""
    held: str = ""
    """What was held, in words, where that was not the force."""

    @property
    def level(self) -> str:
        """What was held, in words; records of one level are left out together."""
        return self.held or f"{self.force:g} N"

    @property
    def line_forces(self) -> Array:
        """N, peak on each line."""
        return np.full(len(self.frequency), self.force) if self.forces is None else self.forces


def within_parts(frfs: Sequence[LevelFRF], machine: Machine, drift: float) -> tuple[LevelFRF, ...]:
    """The lines at which measured parts are known, whatever a relative drift moves them by."""
    low, high = machine.known_band
    low, high = low * (1 + drift), high * (1 - drift)
    if low <= 0 and not np.isfinite(high):
        return tuple(frfs)
    found = []
    for r in frfs:
        kept = (r.frequency > low) & (r.frequency < high)
        if not np.any(kept):
            raise InputError(f"{r.name}: no line between {low:.5g} and {high:.5g} Hz, where all parts are known")
        forces = None if r.forces is None else r.forces[kept]
        cut = replace(r, frequency=r.frequency[kept], receptance=r.receptance[kept], forces=forces)
        found.append(replace(cut, deviation=r.deviation[kept]))
    return tuple(found)


def read_frfs(measurement: Measurement, machine: Machine) -> tuple[LevelFRF, ...]:
    """Open every record of a measurement of kind "frf", in file order, and hold it against the names of a machine.

    A driving point whose phase is turned, or that yields energy on more than a twentieth of its lines, is refused.
    """
    if measurement.kind != "frf":
        raise InputError(f"{measurement.source}: kind is {measurement.kind!r}, a machine is traced on records of 'frf'")
    check_dofs(measurement, machine)
    measurement = at_the_tool(measurement, machine)
    return open_frfs(measurement, measurement.records)


def at_the_tool(measurement: Measurement, machine: Machine) -> Measurement:
    """The measurement with ``tool.x``, as `jointlib import` guesses a place, as the degree of freedom that it is."""
    words = {} if any(c.name == "tool" for c in machine.components) else machine.tool
    dofs = {f"tool.{axis}": dof for axis, dof in words.items()}

    def named(record: RecordSource) -> RecordSource:
        s = record.sweep
        if s is None:
            return record
        return replace(
            record, sweep=replace(s, drive=dofs.get(s.drive, s.drive), response=dofs.get(s.response, s.response))
        )

    return replace(measurement, records=tuple(named(record) for record in measurement.records))


def check_dofs(measurement: Measurement, machine: Machine) -> None:
    """Refuse a degree of freedom that the machine does not have, with the nearest one that it has."""
    for record in at_the_tool(measurement, machine).records:
        if record.sweep is not None:
            for what, dof in (("drive", record.sweep.drive), ("response", record.sweep.response)):
                try:
                    machine.dof_rows([dof], what)
                except InputError as error:
                    raise InputError(f"{measurement.source}: record {record.name}: {error}") from None


def open_frfs(measurement: Measurement, sources: Iterable[RecordSource]) -> tuple[LevelFRF, ...]:
    """The frequency responses of some records of a measurement, without a machine."""
    chosen = list(sources)
    names = _names(measurement, chosen)
    opened = [_opened(measurement, source, name) for source, name in zip(chosen, names, strict=True)]
    return tuple(_checked(measurement, _with_deviation(measurement, record, opened)) for record in opened)


def _names(measurement: Measurement, sources: Sequence[RecordSource]) -> list[str]:
    """Names of the records; with their folder where the names of files repeat."""
    names = [source.name for source in sources]
    return [
        f"{os.path.relpath(source.file.parent, measurement.source.parent)}/{name}" if names.count(name) > 1 else name
        for source, name in zip(sources, names, strict=True)
    ]


def said_of(frfs: Sequence[LevelFRF]) -> tuple[str, ...]:
    """What the records tell of themselves, and whether they can show that a response depends on its amplitude."""
    said = [remark for frf in frfs for remark in frf.remarks]
    levels = {frf.level for frf in frfs if not frf.sealed}
    if len(levels) == 1:
        said.append(f"all records have one level, {levels.pop()}: that a joint depends on amplitude cannot be seen.")
    return tuple(dict.fromkeys(said))


@dataclass(frozen=True, eq=False)
class _Opened:
    source: RecordSource
    name: str
    frequency: Array
    receptance: ComplexArray
    variance: Array | None
    forces: Array | None
    remarks: tuple[str, ...]

    @property
    def test(self) -> tuple[str, str, str, bool]:
        """What records that repeat each other have in common."""
        sweep = self.source.sweep
        assert sweep is not None
        return sweep.drive, sweep.response, sweep.level, sweep.conjugate

    def repeats(self, other: _Opened) -> bool:
        f, g = self.frequency, other.frequency
        return self.test == other.test and f.shape == g.shape and bool(np.all(np.abs(f - g) <= _SAME * f))


def _opened(measurement: Measurement, source: RecordSource, name: str) -> _Opened:
    """Receptance of one record and its variance, where the file has it."""
    sweep, where = source.sweep, f"{measurement.source}: record {name}"
    assert sweep is not None
    found = read_frf(
        source.file,
        where=where,
        response_at=sweep.response_at,
        drive_at=sweep.drive_at,
        quantity=sweep.quantity,
        unit=sweep.unit,
        told=measurement.text,
    )
    if found.value.ndim != 1:
        raise InputError(f"{where}: the file holds a matrix a line, expected one response to one force")
    assert found.quantity is not None
    said = [found.units] if found.units else []
    kept = found.frequency > 0
    if not np.all(kept):
        said.append("the line at 0 Hz is left out.")
    f = found.frequency[kept]
    if not len(f):
        raise InputError(f"{where}: no line above 0 Hz, expected one or more")
    per = found.quantity.per_receptance(f)
    H = found.value[kept]
    H = (H.conj() if sweep.conjugate else H) / per
    if not np.any(H):
        raise InputError(f"{where}: the response is zero on every line, expected a signal")
    variance = None if found.variance is None else found.variance[kept] / np.abs(per) ** 2
    if variance is not None and not np.all(variance > 0):
        raise InputError(f"{where}: the deviation at {f[np.argmin(variance)]:g} Hz is 0, expected more than 0")
    if variance is not None and found.alike is not None:
        variance = variance * found.alike[kept]  # so that what is fitted to all lines has the right errors
    forces = None if found.force is None else found.force[kept]
    if not sweep.force and forces is None:
        moved = (2 * np.pi * f) ** 2 * np.abs(H) if sweep.acceleration else np.abs(H)
        if not np.all(moved > 0):
            raise InputError(f"{where}: the response is zero at {f[np.argmin(moved)]:g} Hz, expected the one held")
        forces = (sweep.acceleration or sweep.amplitude) / moved
    if forces is not None and np.ptp(forces) > 0:
        held = "" if sweep.force else f" to hold {sweep.level}"
        said.append(f"the force varies from {np.min(forces):.4g} to {np.max(forces):.4g} N{held}.")
    said += [*_gaps(f), *sparse_lines(f, H)]
    return _Opened(source, name, f, H, variance, forces, tuple(f"{name}: {sentence}" for sentence in said))


def _gaps(frequency: Array) -> list[str]:
    """Where the lines jump: nothing is known in between, and a resonance may hide there."""
    step = np.diff(frequency)
    beside = np.maximum(np.concatenate([[0.0], step[:-1]]), np.concatenate([step[1:], [0.0]]))
    return [
        f"the lines jump from {frequency[i]:.5g} to {frequency[i + 1]:.5g} Hz; what lies between is not known."
        for i in np.flatnonzero(step > _JUMP * beside)
    ]


def _with_deviation(measurement: Measurement, record: _Opened, all_records: Sequence[_Opened]) -> LevelFRF:
    source, sweep = record.source, record.source.sweep
    assert sweep is not None
    same = [r for r in all_records if r.source.role != "sealed" and r.repeats(record)]
    if record.variance is not None:
        deviation, origin = np.sqrt(record.variance), "file"
    elif len(same) > 1:
        for other in same:
            if other is not record and np.array_equal(other.receptance, record.receptance):
                raise InputError(
                    f"{measurement.source}: records {record.name} and {other.name} hold the same values, expected "
                    "tests of their own where drive, response and force are the same"
                )
        deviation, origin = from_repeats([r.receptance for r in same]), "repeats"
    else:
        if len(record.frequency) < FEWEST:
            raise InputError(
                f"{measurement.source}: record {record.name}: {len(record.frequency)} lines above 0 Hz do not tell "
                f"their noise, expected at least {FEWEST}, a column deviation, or a record that repeats it"
            )
        deviation, origin = from_neighbours(record.frequency, record.receptance), "neighbours"
    return LevelFRF(
        record.name,
        sweep.drive,
        sweep.response,
        sweep.force or float(np.median(record.forces)),  # type: ignore[arg-type]
        record.frequency,
        record.receptance,
        deviation,
        origin,
        source.role == "sealed",
        sha256(source.file),
        record.remarks,
        record.forces,
        "" if sweep.force else sweep.level,
    )


def _checked(measurement: Measurement, frf: LevelFRF) -> LevelFRF:
    """A driving point takes energy in: Im H < 0. A turned phase is refused, a few lines beyond are told."""
    if frf.drive != frf.response:
        return frf
    H, where = frf.receptance, f"{measurement.source}: record {frf.name}"
    clear = np.abs(H.imag) > np.maximum(_CLEAR * frf.deviation, _SAME * np.abs(H))
    wrong = clear & (H.imag > 0)
    gross = wrong & (H.imag > _TILT * np.abs(H))
    if np.any(clear) and np.sum(wrong) > _MOST * np.sum(clear):
        raise InputError(
            f"{where}: Im H > 0 at the driving point {frf.drive}, so it would yield energy; the file may hold "
            "accelerances (see quantity), count time as exp(-jωt), then say conjugate = true, or carry the wrong sign"
        )
    if np.sum(gross) > _SOME * len(H):
        raise InputError(
            f"{where}: the driving point {frf.drive} yields energy (Im H > 0) at {spans(frf.frequency, gross)}, "
            "expected the phase of a passive structure"
        )
    if not np.any(wrong):
        return frf
    said = f"{frf.name}: the driving point yields energy (Im H > 0) at {spans(frf.frequency, wrong)}."
    return replace(frf, remarks=(*frf.remarks, said))
