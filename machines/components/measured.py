"""Component that is known by measured frequency response functions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError, nearest
from jointlib.frf import FRF, Quantity
from jointlib.io.frf_files import FrfRecord
from jointlib.io.toml import Section

from ..indices import Index
from ..shapes.drawn import Drawn
from .component import Component, checked_dofs
from .interpolation import METHODS, Curve, curve, gaps, left_out
from .nodes import Nodes, read_nodes
from .plausibility import broken, not_passive, not_reciprocal
from .record_files import entries_of, sections_of

_SAME = 1e-9
_WHOLE = 2**25
"""Entries of a record up to which all are looked at; of a larger one those that are used."""


@dataclass(frozen=True, eq=False)
class Measured(Component):
    """Receptance on measured lines; accelerance is divided by −ω², mobility by jω. It has no equations of motion.

    Between the lines nothing is known unless ``interpolation`` says how; outside them nothing ever is. `remarks`
    tells the error of the interpolation, and where the record is not reciprocal or not passive.

    Parameters
    ----------
    frequency
        Lines in Hz, above 0.
    value
        [line, response, drive], in the unit of ``quantity``.
    variance
        E|error|² of ``value``, or None.
    interpolation
        "none", "rational" or "spline", see `machines.components.interpolation.curve`; it acts on the accelerance.
    notes
        What was said on reading.
    nodes
        Places in space of the dofs that are named after them (``nose.x``, ``nose.ry``).
    """

    name: str
    dofs: tuple[str, ...]
    frequency: Array
    value: ComplexArray
    quantity: Quantity = Quantity.RECEPTANCE
    variance: Array | None = None
    interpolation: str = "none"
    notes: tuple[str, ...] = ()
    nodes: Nodes | None = None

    kind: ClassVar[str] = "frf"

    def __post_init__(self) -> None:
        where = self._where
        object.__setattr__(self, "dofs", checked_dofs(where, self.dofs))
        if self.interpolation not in METHODS:
            raise InputError(
                f"{where}: interpolation is {self.interpolation!r}, {nearest(self.interpolation, METHODS)}"
            )
        f, ports = np.array(self.frequency, dtype=float), len(self.dofs)
        if f.ndim != 1 or len(f) < 2 or not np.all(np.isfinite(f)) or f[0] <= 0 or np.any(np.diff(f) <= 0):
            raise InputError(f"{where}: expected at least two frequencies, finite, above 0 and ascending")
        # Not copied: a record of many dofs may be larger than the memory, and lie in a file (np.memmap).
        value = np.asarray(self.value, dtype=complex)
        whole = value.size <= _WHOLE
        if value.shape != (len(f), ports, ports) or (whole and not np.all(np.isfinite(value))):
            raise InputError(
                f"{where}: values of shape {value.shape}, expected finite ones of shape {(len(f), ports, ports)}: "
                "line, response, drive"
            )
        variance = None if self.variance is None else np.array(self.variance, dtype=float)
        if variance is not None and (variance.shape != value.shape or not np.all(variance >= 0)):
            raise InputError(f"{where}: variance must not be negative and have the shape of the values {value.shape}")
        for key, array in (("frequency", f), ("value", value), ("variance", variance)):
            object.__setattr__(self, key, array)
        if whole:
            per = self.quantity.per_receptance(f)[:, None, None]
            known = None if variance is None else variance / np.abs(per) ** 2
            for sentence in broken(f, value / per, self.dofs, known):
                raise InputError(f"{where}: {sentence}")

    @property
    def _where(self) -> str:
        return f"component {self.name!r}"

    @classmethod
    def from_section(cls, section: Section) -> Measured:
        name, dofs = section.text("name"), checked_dofs(section.where, section.words("dofs"))
        words = tuple(q.word for q in Quantity)
        default = section.text("quantity", None, words)
        method = section.text("interpolation", "none", METHODS)
        conjugate = section.flag("conjugate")
        entries: dict[tuple[int, int], tuple[FrfRecord, Quantity]] = {}
        notes: list[str] = []
        if section.has("measurement"):
            parts = sections_of(section, section.path("measurement"), name)
        else:
            parts = list(section.sections("record"))
        for part in parts:
            for pair, record, quantity in entries_of(part, dofs, default):
                if pair in entries:
                    raise InputError(f"{part.where}: {dofs[pair[0]]} from {dofs[pair[1]]} is there already")
                entries[pair] = record, quantity
                if record.units and record.units not in notes:
                    notes.append(record.units)
        nodes = read_nodes(section)
        return replace(_assembled(name, dofs, section.where, entries, method, conjugate, notes), nodes=nodes)

    @cached_property
    def frf(self) -> FRF:
        """The receptance as measured, with its variance."""
        per = self.quantity.per_receptance(self.frequency)[:, None, None]
        names = tuple(f"{self.name}.{dof}" for dof in self.dofs)
        variance = None if self.variance is None else self.variance / np.abs(per) ** 2
        return FRF(self.frequency, self.value / per, names, names, variance=variance)

    @property
    def band(self) -> tuple[float, float]:
        return float(self.frequency[0]), float(self.frequency[-1])

    @cached_property
    def _between(self) -> tuple[Curve, int]:
        return curve(self.frequency, self._accelerance, self.interpolation)

    @cached_property
    def _curves(self) -> dict[tuple[bytes, bytes], Curve]:
        """Interpolations of those entries that have been asked for, by rows and columns."""
        return {}

    def _entries(self, lines: Index, i: Index, k: Index) -> ComplexArray:
        """Receptance on measured lines between some dofs, (lines, rows, columns)."""
        held = self.value[lines[:, None, None], i[:, None], k]
        if not np.all(np.isfinite(held)):
            raise InputError(f"{self._where}: the record holds values that are not finite")
        return np.asarray(held / self.quantity.per_receptance(self.frequency[lines])[:, None, None])

    def _curve(self, i: Index, k: Index) -> Curve:
        key = i.tobytes(), k.tobytes()
        if key not in self._curves:
            every = np.arange(len(self.frequency))
            per = Quantity.ACCELERANCE.per_receptance(self.frequency)[:, None, None]
            self._curves[key] = curve(self.frequency, self._entries(every, i, k) * per, self.interpolation)[0]
        return self._curves[key]

    @property
    def _accelerance(self) -> ComplexArray:
        """It is smooth where a free body's receptance is steep, at low frequencies."""
        return self.frf.receptance * Quantity.ACCELERANCE.per_receptance(self.frequency)[:, None, None]

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        """Of the record only the entries that the rows and columns touch are taken up."""
        i, k = (np.flatnonzero(np.any(part, axis=0)) for part in (rows, columns))
        lines, f = omega / (2 * np.pi), self.frequency
        slack = _SAME * f[-1]
        if np.min(lines) < f[0] - slack or np.max(lines) > f[-1] + slack:
            raise FrequencyMismatch(
                f"{self._where}: asked for {np.min(lines):.6g} to {np.max(lines):.6g} Hz, measured from {f[0]:.6g} to "
                f"{f[-1]:.6g} Hz; nothing is extrapolated"
            )
        near = np.clip(np.searchsorted(f, lines), 1, len(f) - 1)
        near = near - (np.abs(f[near - 1] - lines) < np.abs(f[near] - lines))
        off = np.abs(f[near] - lines) > slack
        H = self._entries(near, i, k)
        if np.any(off):
            if self.interpolation == "none":
                raise FrequencyMismatch(
                    f"{self._where}: asked for {lines[off][0]:.8g} Hz, which is no measured line; say interpolation = "
                    '"rational" or "spline" to go between them'
                )
            inside = np.clip(lines[off], f[0], f[-1])
            for low, high in gaps(f):
                lost = inside[(inside > low) & (inside < high)]
                if len(lost):
                    raise FrequencyMismatch(
                        f"{self._where}: asked for {lost[0]:.8g} Hz, but no line lies between {low:.6g} and {high:.6g} "
                        "Hz, much further apart than the others; measure there or leave that range out"
                    )
            per = Quantity.ACCELERANCE.per_receptance(inside)[:, None, None]
            H[off] = self._curve(i, k)(inside) / per
        return np.asarray(rows[:, i] @ H @ columns[:, k].T)

    def second_order(self) -> None:
        return None

    def motion_at(self, point: Array, direction: Array) -> Array | None:
        """Motion of the node that lies there; None where no positions are given."""
        return None if self.nodes is None else self.nodes.motion(self._where, self.dofs, point, direction)

    def rotation_at(self, point: Array, direction: Array) -> Array | None:
        """Rotation of the node that lies there."""
        return None if self.nodes is None else self.nodes.rotation(self._where, self.dofs, point, direction)

    def drawn(self) -> Drawn | None:
        """Its nodes, as dots."""
        if self.nodes is None:
            return None
        return Drawn(self.nodes.frames(self.dofs), self.nodes.names, len(self.nodes.names), dots=True)

    def remarks(self) -> tuple[str, ...]:
        f, H, variance = self.frequency, self.frf.receptance, self.frf.variance
        known = "its variance is not known" if variance is None else "with its variance"
        said = [
            f"measured {self.quantity.word}, {len(f)} lines from {f[0]:.5g} to {f[-1]:.5g} Hz, {known}.",
            *self.notes,
        ]
        if self.interpolation != "none":
            error = left_out(f, self._accelerance, self.interpolation)
            said.append(
                f"between its lines by {self.interpolation} interpolation; with every second line left out those are "
                f"predicted within {error.norm:.2g} in norm, worst at {error.worst:.5g} Hz."
            )
            if self._between[1]:
                said.append(
                    f"in {self._between[1]} pieces noise would have put a pole between two lines; a cubic is used."
                )
        said += not_reciprocal(f, H, self.dofs, variance) + not_passive(f, H, self.dofs, variance)
        return tuple(f"{self.name}: {sentence}" for sentence in said)


def _assembled(
    name: str,
    dofs: tuple[str, ...],
    where: str,
    entries: dict[tuple[int, int], tuple[FrfRecord, Quantity]],
    method: str,
    conjugate: bool,
    notes: list[str],
) -> Measured:
    """The whole matrix; an entry that was measured one way only stands for the other way too."""
    if not entries:
        raise InputError(f"{where}: no [[component.record]], expected frequency responses")
    frequency = next(iter(entries.values()))[0].frequency
    quantities = {quantity for _, quantity in entries.values()}
    quantity = quantities.pop() if len(quantities) == 1 else Quantity.RECEPTANCE
    kept, ports = frequency > 0, len(dofs)
    if not np.all(kept):
        notes = [*notes, "the line at 0 Hz is left out."]
    lines = frequency[kept]
    value = np.zeros((len(lines), ports, ports), dtype=complex)
    variance = np.full(value.shape, np.nan)
    mirrored = []
    for i in range(ports):
        for j in range(ports):
            pair = (i, j) if (i, j) in entries else (j, i)
            if pair not in entries:
                raise InputError(f"{where}: no record of {dofs[i]} from {dofs[j]}, nor back")
            if pair != (i, j):
                mirrored.append(f"{dofs[i]} from {dofs[j]}")
            record, own = entries[pair]
            if record.frequency.shape != frequency.shape or np.any(
                np.abs(record.frequency - frequency) > _SAME * frequency[-1]
            ):
                raise FrequencyMismatch(
                    f"{where}: {dofs[i]} from {dofs[j]} stands on other lines than the first record, expected the same"
                )
            per = quantity.per_receptance(lines) / own.per_receptance(lines)
            value[:, i, j] = record.value[kept] * per
            if record.variance is not None:
                variance[:, i, j] = record.variance[kept] * np.abs(per) ** 2
    if mirrored:
        notes = [*notes, f"not measured and taken from the way back: {', '.join(mirrored)}."]
    if conjugate:
        value, notes = value.conj(), [*notes, "conjugated: the record counts time as exp(-jωt)."]
    known = None if np.any(np.isnan(variance)) else variance
    return Measured(name, dofs, lines, value, quantity, known, method, tuple(notes))
