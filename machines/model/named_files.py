"""Files that a document names, whatever key it is that names them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from jointlib.io.toml_file import parsed


def documents_and_data(path: Path) -> set[Path]:
    """A file and every file that its text names, in turn."""
    found: set[Path] = set()
    todo = [_absolute(path)]
    while todo:
        file = todo.pop()
        if file not in found:
            found.add(file)
            if file.suffix == ".toml":
                todo += named_files(read(file), file.parent)
    return found


def named_files(value: object, folder: Path) -> list[Path]:
    """The files in strings of nested tables, relative to a folder, in order."""
    found: list[Path] = []

    def noted(file: Path) -> str:
        found.append(file)
        return ""

    renamed(value, folder, noted)
    return found


def renamed(value: Any, folder: Path, name: Callable[[Path], str]) -> Any:
    """The same nested tables, with every file that lies there, seen from a folder, called by another name."""
    if isinstance(value, Mapping):
        return {key: renamed(part, folder, name) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [renamed(part, folder, name) for part in value]
    return name(_absolute(folder / value)) if _is_file(value, folder) else value


def read(path: Path) -> dict[str, Any]:
    """The tables of a TOML file, unchecked."""
    return parsed(path)[1]


def _absolute(path: Path) -> Path:
    """Without '..', and with links as they are called."""
    return Path(os.path.abspath(path))


def _is_file(value: object, folder: Path) -> bool:
    """A string with a suffix that names a file beside a document."""
    if not isinstance(value, str) or not Path(value).suffix:
        return False
    try:
        return (folder / value).is_file()
    except OSError:  # no name that a file could have
        return False
