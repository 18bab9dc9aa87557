"""LabVIEW measurement files (.lvm): a text table under headers that tell separator, decimal mark, units and step."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from jointlib.errors import InputError
from jointlib.lab.dialect import Told
from jointlib.lab.encoding import text_of
from jointlib.lab.lab_file import Column, LabFile
from jointlib.lab.sampling import rounded_rate
from jointlib.lab.text_table import table_of

_END = "***End_of_Header***"


def read_lvm(path: Path, told: Told | None = None) -> LabFile:
    """Columns by their names, the time as ``X_Value`` where the file has it."""
    text, encoding = text_of(path, None if told is None else told.encoding)
    lines = text.split("\n")
    if not lines[0].startswith("LabVIEW Measurement"):
        raise InputError(f"{path}: does not begin with 'LabVIEW Measurement', expected an .lvm file")
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    if len(ends) < 2 or len(lines) <= ends[1] + 2:
        raise InputError(f"{path}: ends before its samples, expected two headers and a table")
    if len(ends) > 2:
        raise InputError(f"{path}: holds {len(ends) - 1} pieces, expected one (save them to a file each)")
    mark = "," if _said(lines[: ends[0]], "Separator") == "Comma" else "\t"
    above = {line.split(mark)[0].strip(): [c.strip() for c in line.split(mark)[1:]] for line in lines[: ends[1]]}
    names = [cell.strip() for cell in lines[ends[1] + 1].split(mark)]
    if names[-1:] == ["Comment"]:
        names.pop()
    rows = [line for line in lines[ends[1] + 2 :] if line.strip()]
    count = len(names)
    empty = names[:1] == ["X_Value"] and all(row.split(mark)[0] == "" for row in rows)
    cut = [mark.join(row.split(mark)[1 if empty else 0 : count]) for row in rows]
    names = names[1:] if empty else names
    decimal = above.get("Decimal_Separator", ["."])[0] or "."
    told = replace(told or Told(), separator=mark, decimal=decimal, header=1)
    table = table_of(path, "\n".join([mark.join(names), *cut]), encoding, told)
    units = [cell for cell in above.get("Y_Unit_Label", []) if cell]
    step = above.get("Delta_X", [""])[0].replace(",", ".")
    rate = rounded_rate(1 / float(step)) if _is_step(step) else None
    signals = [name for name in table.names if name != "X_Value"]
    of = dict(zip(signals, units, strict=False)) if len(units) >= len(signals) else {}
    columns = [
        Column(name, values, "s" if name == "X_Value" else of.get(name, ""), rate=rate)
        for name, values in zip(table.names, table.columns, strict=True)
    ]
    return LabFile(path, tuple(columns))


def _said(lines: list[str], key: str) -> str:
    return next((line[len(key) :].strip() for line in lines if line.startswith(key)), "")


def _is_step(text: str) -> bool:
    try:
        return float(text) > 0
    except ValueError:
        return False
