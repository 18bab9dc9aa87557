"""Averages of shaker records: random by overlapping blocks, periodic by whole periods, bursts by whole records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.estimation.blocks import Spectra, motions_of, spectra_of
from jointlib.estimation.estimators import Averages, Spread, averages, spread, spread_of, transfer
from jointlib.estimation.noise import ALONE, noise_of, shared
from jointlib.estimation.overload import full_scales, overloaded
from jointlib.measurement import Measurement, Record

_OVERLAP = 0.5
_BLOCKS = 20
"""Blocks that a random record is cut into where nothing is said."""
_BLURRED = 3
"""Lines that a Hann window makes err together, on a side and with the line itself."""
_EXCITED = 1e-4
"""Share of the strongest line's power below which a line of a periodic force is none."""
_ABOVE = 20.0
"""Times the noise power that such a line has at least."""


@dataclass(frozen=True, eq=False)
class Lines:
    """What was estimated for one motion."""

    frequency: Array
    value: ComplexArray
    spread: Spread | None
    coherence: Array
    count: float


def unclipped(m: Measurement, records: Sequence[Record], left_out: list[str]) -> list[Record]:
    """The records without overloads."""
    kept = []
    for record in records:
        if over := overloaded(record, full_scales(record, (*m.of("force"), *motions_of(m)))):
            left_out.append(f"{record.name} is {over}")
        else:
            kept.append(record)
    if not kept:
        raise InputError(f"{m.source}: no record without overload: " + "; ".join(said.rstrip(".") for said in left_out))
    return kept


def from_averages(
    frequency: Array,
    of: Averages,
    estimator: str,
    motion_alike: Array = ALONE,
    force_alike: Array = ALONE,
    raised: Array | float = 1.0,
) -> Lines:
    """Value and error of one pair by averages; |ρ|² between lines and how much noise is raised as of `Spectra`."""
    H = transfer(of, estimator)
    return Lines(frequency, H, spread_of(of, H, estimator, motion_alike, force_alike, raised), of.coherence, of.count)


def from_spectra(spectra: Spectra, estimator: str) -> list[Lines]:
    """Value and error for every motion, blocks being independent averages."""
    s = spectra
    return [
        from_averages(s.frequency, averages(s.force, X), estimator, s.motion_alike, s.force_alike, s.raised)
        for X in s.motions
    ]


@dataclass(frozen=True, eq=False)
class Welch:
    """Mean spectra of overlapping blocks: Hann windows that overlap by half; n counts what is independent among them.

    Overlapping windows w share ρ = Σ w(t)·w(t + R)/Σ w² of their values, and n blocks weigh as much as
    n/(1 + 2·Σ (1 − k/n)·ρ_k²) independent ones (Welch, IEEE Trans. AU-15, 1967).
    """

    records: Sequence[Record]
    size: int
    counts: Array
    """Blocks of each record."""
    count: float
    """Independent averages n."""
    alike: Array
    """|ρ|² of noise between lines so far apart."""

    @classmethod
    def of(cls, m: Measurement, records: Sequence[Record], notes: list[str]) -> Welch:
        """Blocks of the length that [estimate] says, else of one that gives 20."""
        rate, length = records[0].sample_rate, m.estimate.length
        shortest = min(len(r) for r in records)
        size = round(length * rate) if length is not None else 2 * shortest // (_BLOCKS + 1)
        if size > shortest or size < 16:
            raise InputError(
                f"{m.source}: blocks of {size / rate:.4g} s ({size} samples) in records of {shortest / rate:.4g} s, "
                "expected a length in [estimate] of at least 16 samples that fits into them"
            )
        if length is None:
            notes.append(
                f"blocks of {size / rate:.4g} s, lines {rate / size:.4g} Hz apart, so that there are {_BLOCKS}."
            )
        step = size - int(_OVERLAP * size)
        counts = np.array([1 + (len(r) - size) // step for r in records], dtype=float)
        window = scipy.signal.get_window("hann", size)
        rho = np.sum(window[:-step] * window[step:]) / np.sum(window**2)
        count = float(np.sum(counts / (1 + 2 * (1 - 1 / counts) * rho**2)))
        return cls(records, size, counts, count, shared(window)[:_BLURRED])

    @property
    def lines(self) -> Array:
        """Hz, above 0."""
        return np.asarray(np.arange(1, (self.size + 1) // 2) * self.records[0].sample_rate / self.size)

    def mean(self, a: str, b: str) -> ComplexArray:
        """Mean of B·A* of two channels."""
        rate, size = self.records[0].sample_rate, self.size
        parts = [
            scipy.signal.csd(
                r.channels[a], r.channels[b], rate, "hann", size, int(_OVERLAP * size), detrend="constant"
            )[1]
            for r in self.records
        ]
        return np.asarray(np.tensordot(self.counts / self.counts.sum(), np.array(parts), 1)[1 : (size + 1) // 2])


def random_lines(m: Measurement, records: Sequence[Record], notes: list[str]) -> list[Lines]:
    """A random force by overlapping blocks."""
    blocks = Welch.of(m, records, notes)
    (source,) = m.of("force")
    force = blocks.mean(source.name, source.name).real
    out = []
    for c in motions_of(m):
        of = Averages(force, blocks.mean(c.name, c.name).real, blocks.mean(source.name, c.name), blocks.count)
        out.append(from_averages(blocks.lines, of, m.estimate.estimator, blocks.alike, blocks.alike))
    return out


def burst_lines(m: Measurement, records: Sequence[Record], notes: list[str]) -> list[Lines]:
    """Each record is one average: a chirp or burst that begins and ends at rest."""
    sizes = {len(r) for r in records}
    length = min(sizes)
    if len(sizes) > 1:
        notes.append(f"records of different length; the first {length} samples of each are used.")
    (source,) = m.of("force")
    blocks = [
        [r.channels[c.name][:length] - np.mean(r.channels[c.name][:length]) for c in (source, *motions_of(m))]
        for r in records
    ]
    for record, (force, *motions) in zip(records, blocks, strict=True):
        tail = max(8, length // 50)
        for channel, x in zip((source, *motions_of(m)), (force, *motions), strict=True):
            if np.max(np.abs(x[-tail:])) > 0.05 * np.max(np.abs(x)):
                notes.append(
                    f"{record.name}: {channel.name} has not come to rest at the end of the record, which leaks into "
                    "other lines; expected a chirp that ends earlier, or one that repeats, with its period."
                )
    spectra = spectra_of([b[0] for b in blocks], [b[1:] for b in blocks], records[0].sample_rate)
    return from_spectra(spectra, m.estimate.estimator)


def periodic_lines(m: Measurement, records: Sequence[Record], notes: list[str]) -> list[Lines]:
    """Whole periods without leakage, at the lines that the force has.

    The periods of a record are averaged first, so that noise on the force biases H1 by a p-th of what it would; then
    come the records. The variance is that among records, which holds noise and, where the phases of the multisine
    differ, what the structure does nonlinearly; with one record that among its periods (Schoukens, Pintelon, Rolain,
    Mastering System Identification in 100 Exercises, 2012, ch. 2).
    """
    rate, estimator = records[0].sample_rate, m.estimate.estimator
    (source,) = m.of("force")
    periods = {r.period for r in records}
    if len(periods) != 1:
        raise InputError(f"{m.source}: records of different periods, expected one period")
    (period,) = periods
    assert period is not None
    spectra = []
    for record in records:
        first, count = m.settle * period, len(record) // period - m.settle
        if count < 1:
            raise InputError(
                f"{m.source}: {record.name} has {len(record)} samples, expected settle + 1 periods of {period}"
            )
        cut = [
            np.reshape(record.channels[c.name][first : first + count * period], (count, period))
            for c in (source, *motions_of(m))
        ]
        blocks = [x - np.mean(x) for x in cut]
        spectra.append(spectra_of(list(blocks[0]), list(zip(*blocks[1:], strict=True)), rate))
    force = np.array([np.mean(s.force, axis=0) for s in spectra])
    power = np.mean(np.abs(force) ** 2, axis=0)
    noise = _within([s.force for s in spectra])
    excited = power > _EXCITED * np.max(power)
    if noise is not None:
        excited &= power > _ABOVE * np.median(noise)
    lines = spectra[0].frequency[excited]
    if not len(lines):
        raise InputError(f"{m.source}: no line of the force stands above its noise, expected a periodic signal")
    notes.append(f"{len(lines)} of {len(excited)} lines are excited, the others are left out.")
    out = []
    for k in range(len(motions_of(m))):
        F, X = force[:, excited], np.array([np.mean(s.motions[k], axis=0) for s in spectra])[:, excited]
        whole = averages(F, X)
        H = transfer(whole, estimator)
        each = [s.motions[k][:, excited] - H * s.force[:, excited] for s in spectra]
        inside = _within(each)
        if len(records) > 1:
            apart = np.sum(np.abs(X - H * F) ** 2, axis=0) / (len(records) - 1)
            left = noise_of(apart, np.abs(H) ** 2, len(records) - 1)
            if inside is not None and np.mean(apart) > 4 * np.mean(inside):
                share = float(np.sqrt(np.mean(apart) / np.mean(np.abs(X) ** 2)))
                notes.append(
                    f"{motions_of(m)[k].name}: records differ by more than their noise ({share:.1%} of the response): "
                    "the structure is not linear at this level, or it changed."
                )
        elif inside is not None:
            left = noise_of(inside, np.abs(H) ** 2, sum(len(x) - 1 for x in each))
        else:
            left = None
        power_of_all = np.maximum(np.sum(np.abs(F) ** 2, axis=0), 1e-300)
        known = None if left is None else spread(left.power / power_of_all, left.freedom)
        every = averages(
            np.concatenate([s.force[:, excited] for s in spectra]),
            np.concatenate([s.motions[k][:, excited] for s in spectra]),
        )
        out.append(Lines(lines, H, known, every.coherence, every.count))
    return out


def _within(each: Sequence[ComplexArray]) -> Array | None:
    """Variance of the mean of the periods of a record, averaged over records; None where records have one period."""
    counts = [len(x) for x in each]
    if max(counts) < 2:
        return None
    found = [np.sum(np.abs(x - x.mean(axis=0)) ** 2, axis=0) / (len(x) - 1) / len(x) for x in each if len(x) > 1]
    return np.asarray(np.mean(found, axis=0))
