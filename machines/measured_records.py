"""Records of a measured component, as its machine file names them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jointlib.errors import InputError
from jointlib.frf import Quantity
from jointlib.io.frf_files import FrfRecord, read_frfs
from jointlib.io.toml import Section
from jointlib.io.universal import place
from jointlib.units import scale


def record_of(
    part: Section, dofs: tuple[str, ...], default: str | None
) -> list[tuple[tuple[int, int], FrfRecord, Quantity]]:
    """What one ``[[record]]`` brings: an entry, or the whole matrix."""
    path = Path(part.path("file"))
    word = part.text("quantity", default, tuple(q.word for q in Quantity))
    unit = part.text("unit", None)
    sides = part.text("response", None, dofs), part.text("drive", None, dofs)
    at = part.text("response_at", None), part.text("drive_at", None)
    part.done()
    try:
        found, sign = _chosen(path, read_frfs(path), at)
    except InputError as error:
        raise InputError(f"{part.where}: {error}") from None
    quantity = found.quantity if word is None else Quantity[word.upper()]
    if quantity is None:
        raise InputError(
            f"{part.where}: {path} does not say what it holds, expected quantity = receptance, mobility or accelerance"
        )
    if found.quantity not in (None, quantity):
        raise InputError(f"{part.where}: quantity is {word!r}, but {path} holds {found.quantity.word}")
    factor = sign * (1.0 if unit is None else scale(unit, quantity.value, f"{part.where}: unit"))
    variance = None if found.variance is None else found.variance * factor**2
    value = found.value * factor
    if value.ndim == 1:
        if sides[0] is None or sides[1] is None:
            raise InputError(
                f"{part.where}: response and drive are missing, expected two of the dofs {', '.join(dofs)}"
            )
        pair = dofs.index(sides[0]), dofs.index(sides[1])
        return [(pair, FrfRecord(found.frequency, value, variance, quantity, units=found.units), quantity)]
    if any(side is not None for side in sides):
        raise InputError(f"{part.where}: response or drive is given, but {path} holds a matrix for all dofs")
    if value.shape[1:] != (len(dofs), len(dofs)):
        raise InputError(f"{part.where}: {path} holds {value.shape[1:]} entries a line, expected {(len(dofs),) * 2}")
    return [
        (
            (i, j),
            FrfRecord(found.frequency, value[:, i, j], None if variance is None else variance[:, i, j], quantity),
            quantity,
        )
        for i in range(len(dofs))
        for j in range(len(dofs))
    ]


def _chosen(path: Path, records: Sequence[FrfRecord], at: Sequence[str | None]) -> tuple[FrfRecord, int]:
    """The record between the places that are asked for, and the sign that their directions give."""
    if all(label is None for label in at):
        if len(records) > 1:
            held = ", ".join(f"{r.response} from {r.drive}" for r in records[:6])
            raise InputError(f"{path}: holds {held}{', …' * (len(records) > 6)}; expected response_at and drive_at")
        return records[0], 1
    if None in at:
        raise InputError(f"{path}: expected response_at and drive_at together")
    try:
        (response, up), (drive, along) = (place(str(label)) for label in at)
    except ValueError as error:
        raise InputError(f"{path}: response_at or drive_at is {error}") from None
    fit = []
    for record in records:
        if record.response is not None and record.drive is not None:
            (a, p), (b, q) = place(record.response), place(record.drive)
            if (a, b) == (response, drive):
                fit.append((record, up * along * p * q))
    if len(fit) != 1:
        raise InputError(f"{path}: holds {len(fit) or 'no'} responses at {at[0]} to a force at {at[1]}, expected one")
    return fit[0]
