"""TOML documents opened and written."""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any

import tomli_w

from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of
from jointlib.io.atomic import write_text
from jointlib.io.mistakes import Mistakes
from jointlib.io.toml import Section
from jointlib.io.toml_lines import shown


def read_toml(path: Path, kind: str, mistakes: Mistakes | None = None) -> Section:
    """Open ``schema = "jointlib/<kind>/1"``."""
    text, table = parsed(path, f"a {kind} file")
    if mistakes is not None:
        mistakes.texts[str(path)] = text
    schema = table.pop("schema", None)
    other = None if schema else next(iter(difflib.get_close_matches("schema", table, n=1, cutoff=0.7)), None)
    if other is not None:
        del table[other]
    section = Section(table, str(path), Path(path).parent, mistakes)
    if schema != f"jointlib/{kind}/1":
        said = f'schema is {schema!r}, expected "jointlib/{kind}/1"'
        if other is None and not str(schema).startswith(f"jointlib/{kind}"):
            raise InputError(f"{path}: {said}")
        section.fault(said)  # of the same kind, so the rest can be read
    return section


def parsed(path: Path, what: str = "a TOML file") -> tuple[str, dict[str, Any]]:
    """The text of a TOML file and its tables, unchecked; ``what`` it is expected to be."""
    data = bytes_of(path, what)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read as text, expected {what} in TOML") from None
    try:
        return text, tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a plain ValueError: a number of more digits than Python reads
        if Path(path).suffix.lower() != ".toml" and "schema" not in text:
            raise InputError(f"{path}: cannot be read as TOML, expected {what}") from None
        raise InputError(f"{path}: {_not_valid(text, error)}") from None


def schema_of(path: Path) -> str:
    """The schema that a file names; empty where it cannot be read, which is said where it is."""
    try:
        return str(parsed(path)[1].get("schema", ""))
    except InputError:
        return ""


def _not_valid(text: str, error: Exception) -> str:
    """What is wrong with the TOML, and the line of it."""
    if isinstance(error, RecursionError):
        return "not valid TOML: lists or tables are nested too deeply"
    line = re.search(r"at line (\d+)", str(error))
    number = int(line[1]) if line else len(text.splitlines())
    twice = re.match(r"Cannot (?:mutate immutable namespace|overwrite a value|declare) \('([^']*)',", str(error))
    if twice and number and (first := _written_as(text, twice[1], number)):
        row, style = first
        told = f"{twice[1]} stands as {style} in line {row} and again as a table in line {number}"
        return f"not valid TOML: {told}, expected one of the two throughout {shown(text, number)}"
    return f"not valid TOML: {error} {shown(text, number)}" if number else f"not valid TOML: {error}"


def _written_as(text: str, name: str, before: int) -> tuple[int, str] | None:
    """In which line before one a key is given its value, and how: where it may not be a table as well."""
    given = re.compile(rf"\s*[\"']?{re.escape(name)}[\"']?\s*=\s*(.)")
    for number, line in enumerate(text.splitlines()[: before - 1], 1):
        if found := given.match(line):
            return number, {"[": f"a list, {name} = [...]", "{": f"a table in a line, {name} = {{...}}"}.get(
                found[1], "a value"
            )
    return None


def write_toml(path: Path, kind: str, table: dict[str, Any]) -> None:
    """Write a document whole or not at all; floats read back exactly."""
    write_text(path, tomli_w.dumps({"schema": f"jointlib/{kind}/1", **table}))
