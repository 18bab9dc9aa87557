"""What is kept of a setting: its machine file, under a name that somebody typed."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from jointlib.errors import InputError
from jointlib.io.atomic import write_text
from jointlib.joint import Joint

from ..files.machine_writer import write_machine

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9 _.\-]{0,79}")
_RESERVED = re.compile(r"(?:con|prn|aux|nul|com\d|lpt\d)(?:\..*)?", re.IGNORECASE)
"""Names that Windows keeps for devices, whatever follows a dot."""
_ONE_AT_A_TIME = Lock()


def plain_name(name: object) -> str:
    """A name for a file inside a folder; whatever could lead out of it, or hide in it, is refused."""
    text = name.strip() if isinstance(name, str) else ""
    if not _NAME.fullmatch(text) or ".." in text or text.endswith(".") or _RESERVED.fullmatch(text):
        shown = repr(name) if len(repr(name)) < 60 else "something long"
        raise InputError(
            f"name: {shown}, expected letters, digits, blanks, '_', '-' and single dots, such as 'stiffer guide'"
        )
    return text


def free_target(folder: Path, name: object, suffix: str) -> Path:
    """Where a file of that name is to lie; one that is there already is never replaced."""
    target = Path(folder) / f"{plain_name(name).removesuffix(suffix)}{suffix}"
    if os.path.lexists(target):
        raise InputError(f"{target}: is there already, expected a new name")
    return target


def save_machine(
    source: Path, changes: Mapping[str, Any], joints: Mapping[str, Joint], folder: Path, name: object
) -> tuple[Path, ...]:
    """Write the machine with changes as a file that stands for itself; the files written, the machine file first."""
    with _ONE_AT_A_TIME:
        target = free_target(folder, name, ".toml")
        if os.path.lexists(target.with_suffix("")):
            raise InputError(f"{target.with_suffix('')}: is there already, expected a new name")
        return write_machine(source, changes, target, joints)


def write_new(target: Path, text: str) -> None:
    """Write a file that was not there, whole or not at all."""
    with _ONE_AT_A_TIME:
        write_text(free_target(target.parent, target.stem, target.suffix), text)
