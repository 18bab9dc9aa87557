"""The entries of a measured component that one ``[[record]]`` of a machine file brings."""

from __future__ import annotations

from pathlib import Path

from jointlib.errors import InputError
from jointlib.frf import Quantity
from jointlib.io.frf_files import FrfRecord, read_frf
from jointlib.io.measurement_file import read_measurement
from jointlib.io.toml import Section


def entries_of(
    part: Section, dofs: tuple[str, ...], default: str | None
) -> list[tuple[tuple[int, int], FrfRecord, Quantity]]:
    """What one ``[[record]]`` brings: an entry, or the whole matrix."""
    path = Path(part.path("file"))
    word = part.text("quantity", default, tuple(q.word for q in Quantity))
    unit = part.text("unit", None)
    sides = part.text("response", None, dofs), part.text("drive", None, dofs)
    at = part.text("response_at", None), part.text("drive_at", None)
    part.done()
    found = read_frf(path, where=part.where, response_at=at[0], drive_at=at[1], quantity=word, unit=unit)
    value, variance, quantity = found.value, found.variance, found.quantity
    assert quantity is not None
    if value.ndim == 1:
        if len(dofs) == 1:
            sides = sides[0] or dofs[0], sides[1] or dofs[0]
        if sides[0] is None or sides[1] is None:
            raise InputError(
                f"{part.where}: response and drive are missing, expected two of the dofs {', '.join(dofs)}"
            )
        pair = dofs.index(sides[0]), dofs.index(sides[1])
        return [(pair, found, quantity)]
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


def sections_of(section: Section, path: Path, component: str) -> list[Section]:
    """The records of a measurement of kind "frf" as ``[[record]]`` tables of a measured component.

    ``drive`` and ``response`` may be called as in the machine, ``component.dof``. One level a pair is expected.
    """
    m = read_measurement(path)
    if m.kind != "frf":
        raise InputError(f"{section.where}: measurement refers to {path} of kind {m.kind!r}, expected 'frf'")
    out = []
    for record in m.with_role("fit"):
        sweep = record.sweep
        assert sweep is not None
        if sweep.conjugate:
            raise InputError(f"{section.where}: {path}: conjugate records, expected them as [[component.record]]")
        sides = {"drive": sweep.drive, "response": sweep.response}
        table = {key: name.removeprefix(f"{component}.") for key, name in sides.items()}
        more = {"quantity": sweep.quantity, "unit": sweep.unit}
        more |= {"response_at": sweep.response_at, "drive_at": sweep.drive_at}
        table |= {key: value for key, value in more.items() if value is not None}
        table["file"] = str(record.file.absolute())
        out.append(section.within(table, f"measurement ({record.name})"))
    return out
