"""Blocks of records with one force and several motions, and their spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.estimation.noise import ALONE
from jointlib.frf import Quantity
from jointlib.measurement import Channel, Measurement, Record

QUANTITY = {
    "acceleration": Quantity.ACCELERANCE,
    "velocity": Quantity.MOBILITY,
    "displacement": Quantity.RECEPTANCE,
}
"""What motion over force is called, by the motion."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Spectra of several blocks of one place of the force, at lines in Hz above 0."""

    frequency: Array
    force: ComplexArray
    """(blocks, lines)"""
    motions: tuple[ComplexArray, ...]
    """(blocks, lines) for every motion channel."""
    force_alike: Array = field(default_factory=lambda: ALONE)
    """|ρ|² of noise on the force between lines so far apart, as where only a short piece of it is left."""
    motion_alike: Array = field(default_factory=lambda: ALONE)
    """The same of the motions."""
    raised: Array | float = 1.0
    """Noise power of the motions over that of white noise, by line: what the zero of the sensors, badly known, adds."""


def motions_of(m: Measurement) -> tuple[Channel, ...]:
    """The channels of motion, in file order."""
    return tuple(c for c in m.channels if c.quantity in QUANTITY and not c.is_input)


def drive_of(m: Measurement, record: Record) -> str:
    """Where the force of a record acts."""
    return record.source.drive or m.of("force")[0].dof or ""


def place_of(m: Measurement, record: Record) -> tuple[str, str | None]:
    """What records that are averaged have in common: where the force acts, and the condition."""
    return drive_of(m, record), record.source.condition


def refuse_silent(m: Measurement, records: Sequence[Record]) -> None:
    """A channel that shows the same number throughout was not connected."""
    for channel in (*m.of("force"), *motions_of(m)):
        if all(not np.any(np.diff(record.channels[channel.name])) for record in records):
            value = records[0].channels[channel.name][0]
            raise InputError(
                f"{m.source}: channel {channel.name} is {value:g} on every sample of every record, expected a signal; "
                "was its cable connected?"
            )


def spectra_of(
    force: Sequence[Array], motions: Sequence[Sequence[Array]], sample_rate: float, window: Array | float = 1.0
) -> Spectra:
    """Spectra of blocks of one length, in units of the signal times s; the line at 0 Hz is left out."""
    length = len(force[0])
    lines = np.arange(1, length // 2 + (length % 2)) * sample_rate / length
    part = slice(1, len(lines) + 1)

    def transformed(blocks: Sequence[Array]) -> ComplexArray:
        return np.asarray([np.fft.rfft(block * window)[part] / sample_rate for block in blocks])

    return Spectra(
        lines,
        transformed(force),
        tuple(transformed(blocks) for blocks in zip(*motions, strict=True)),
    )
