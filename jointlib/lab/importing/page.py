"""The text of a measurement file with its comments."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from jointlib.lab.importing.draft import Draft, Noted, Table

FIRST = "# Written by jointlib import"
_WIDTH = 34


def page(draft: Draft, files: str) -> str:
    """The file as TOML; what is marked as a guess is what the records do not say."""
    lines = [f"{FIRST} from {files}. What is marked as a guess the files do not say."]
    lines += ['schema = "jointlib/measurement/1"', *_rows(draft.top)]
    single = {"text": draft.text, "bodies": draft.bodies, "estimate": draft.estimate, "cutting": draft.cutting}
    for name, table in single.items():
        if table:
            lines += ["", f"[{name}]", *_rows(table)]
    for name, tables in (("channel", draft.channels), ("record", draft.records), ("cut", draft.cuts)):
        for table in tables:
            lines += ["", f"[[{name}]]", *_rows(table)]
    return "\n".join(lines) + "\n"


def _rows(table: Table) -> list[str]:
    return [_row(key, noted) for key, noted in table.items() if noted.value is not None]


def _row(key: str, noted: Noted) -> str:
    word = key if key.replace("_", "").replace("-", "").isascii() and key.isidentifier() else json.dumps(key)
    row = f"{word} = {toml(noted.value)}"
    return f"{row.ljust(_WIDTH)}  # {noted.comment}" if noted.comment else row


def toml(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml(inner) for inner in value) + "]"
    return repr(value)
