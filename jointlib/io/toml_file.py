"""TOML documents opened and written."""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any

import tomli_w

from jointlib.errors import InputError
from jointlib.io.atomic import write_text
from jointlib.io.mistakes import Mistakes
from jointlib.io.toml import Section
from jointlib.io.toml_lines import shown


def read_toml(path: Path, kind: str, mistakes: Mistakes | None = None) -> Section:
    """Open ``schema = "jointlib/<kind>/1"``."""
    text = ""
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
        table = tomllib.loads(text)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, expected a {kind} file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: cannot be read, it is a folder, expected a {kind} file") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read as text, expected a {kind} file in TOML") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error})") from None
    except tomllib.TOMLDecodeError as error:
        if Path(path).suffix.lower() != ".toml" and "schema" not in text:
            raise InputError(f"{path}: cannot be read as TOML, expected a {kind} file") from None
        raise InputError(f"{path}: {not_valid(text, error)}") from None
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


def not_valid(text: str, error: tomllib.TOMLDecodeError) -> str:
    """What is wrong with the TOML, and the line of it."""
    line = re.search(r"at line (\d+)", str(error))
    number = int(line[1]) if line else len(text.splitlines())
    return f"not valid TOML: {error} {shown(text, number)}" if number else f"not valid TOML: {error}"


def write_toml(path: Path, kind: str, table: dict[str, Any]) -> None:
    """Write a document whole or not at all; floats read back exactly."""
    write_text(path, tomli_w.dumps({"schema": f"jointlib/{kind}/1", **table}))
