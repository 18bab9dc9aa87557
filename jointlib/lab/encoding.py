"""The text of a file, whatever its encoding: UTF-8 and UTF-16 with or without a mark, Windows, Latin-1."""

from __future__ import annotations

import codecs
from pathlib import Path

from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_PROBE = 4096
_OTHERS = {
    b"PK\x03\x04": "a zip archive or a spreadsheet (export it as text)",
    b"\xd0\xcf\x11\xe0": "a spreadsheet of an old kind (export it as text)",
    b"TDSm": "a TDMS file",
    b"\x89HDF": "an HDF5 file",
    b"MATLAB ": "a MATLAB file",
    b"RIFF": "a WAV file",
    b"\x93NUMPY": "a NumPy array",
    b"%PDF": "a PDF",
    b"PAR1": "a Parquet table",
    b"\x1f\x8b": "a gzip archive (unpack it)",
}
"""First bytes of what is often called .csv and is not."""


def text_of(path: Path, encoding: str | None = None) -> tuple[str, str]:
    """The text of a file with line ends as \\n, and the encoding it was read in."""
    data = bytes_of(path, "text")
    for first, what in _OTHERS.items():
        if data.startswith(first):
            raise InputError(f"{path}: is {what} by its first bytes, expected text")
    mark, marked = next(((mark, word) for mark, word in _MARKS if data.startswith(mark)), (b"", None))
    found = encoding or marked or _unmarked(path, data)
    try:
        text = data[len(mark) :].decode(found)
    except (UnicodeDecodeError, LookupError):
        raise InputError(f"{path}: cannot be read as text in {found}") from None
    return text.rstrip("\x1a").replace("\r\n", "\n").replace("\r", "\n"), found


def _unmarked(path: Path, data: bytes) -> str:
    """UTF-8 where that is valid, else the Windows code page, which Latin-1 is a part of."""
    probe = data[:_PROBE]
    if b"\0" in probe:
        even, odd = probe[::2].count(0), probe[1::2].count(0)
        if max(even, odd) > len(probe) // 4 and min(even, odd) == 0:
            return "utf-16-le" if odd else "utf-16-be"
        raise InputError(f"{path}: holds bytes that are no text, expected a table of numbers as text")
    for encoding in ("utf-8", "cp1252"):
        try:
            data.decode(encoding)
        except UnicodeDecodeError:
            continue
        return encoding
    return "latin-1"
