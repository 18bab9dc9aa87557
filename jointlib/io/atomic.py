"""Output files that appear whole or not at all: written beside, then moved into place."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from jointlib.errors import InputError

_LONGEST_NAME, _LONGEST_PATH = 255, 4095
"""Bytes, on the systems that this runs on."""


Fill = Callable[[IO[bytes]], object]
"""Writes a file that is open for it."""


def write(path: Path, fill: Fill) -> None:
    """Let ``fill`` write a temporary neighbour of ``path``, then replace ``path`` by it."""
    write_together({Path(path): fill})


def write_together(files: Mapping[Path, Fill]) -> None:
    """Write several files as `write` does, of which none is replaced before all are written."""
    beside: dict[Path, Path] = {}
    try:
        for path, fill in files.items():
            with _telling(path):
                handle, temporary = _begun(path)
                beside[path] = Path(temporary)
                with os.fdopen(handle, "wb") as file:
                    fill(file)
                os.chmod(temporary, 0o666 & ~_umask())
        for path, written in beside.items():
            with _telling(path):
                os.replace(written, path)
    except BaseException:
        for written in beside.values():
            written.unlink(missing_ok=True)
        raise


def _begun(path: Path) -> tuple[int, str]:
    """An open temporary neighbour of a file, and its name."""
    if _is_special(path):
        raise InputError(f"{path}: is a device or pipe, expected the name of a file to write")
    path.parent.mkdir(parents=True, exist_ok=True)
    return tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")


@contextmanager
def _telling(path: Path) -> Iterator[None]:
    """What the system refuses, in a sentence."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None


def text_in(text: str) -> Fill:
    """Writes UTF-8 text."""
    return lambda file: file.write(text.encode("utf-8"))


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text whole or not at all."""
    write(path, text_in(text))


def write_npz(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write named arrays whole or not at all; the same arrays give the same bytes."""
    import numpy as np

    write(path, lambda file: np.savez_compressed(file, **arrays))


def sha256(path: Path) -> str:
    """Hash of a file's bytes."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _is_special(path: Path) -> bool:
    """Whether something stands there that a file must not take the place of: a device, a pipe, a socket."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def no_name(name: str) -> str | None:
    """Why no file can bear a name, as half a sentence; None where one can."""
    if not name.strip():
        return "empty"
    if "\0" in name or any(0xD800 <= ord(c) < 0xE000 for c in name):
        return f"{name!r}, with a letter that names cannot have"
    longest = max((len(os.fsencode(part)) for part in name.split("/")), default=0)
    if longest > _LONGEST_NAME or len(os.fsencode(name)) > _LONGEST_PATH:
        return f"a name of {len(name)} letters"
    return None


def to_write(path: Path | str, where: str, *suffixes: str, folder: bool = False) -> Path:
    """The path of a file that ends in one of these suffixes, or of a folder, if it can be written."""
    wrong = no_name(str(path))
    if wrong is not None:
        raise InputError(f"{where}: is {wrong}, expected the name of a {'folder' if folder else 'file to write'}")
    path = Path(path)
    if not folder and path.is_dir():
        raise InputError(f"{where}: {path} is a folder, expected the name of a file to write")
    if not folder and _is_special(path):
        raise InputError(f"{where}: {path} is a device or pipe, expected the name of a file to write")
    if suffixes and path.suffix not in suffixes:
        raise InputError(f"{where}: {path} ends in {path.suffix!r}, expected {', '.join(suffixes)}")
    above = path if folder else path.parent
    while not above.exists() and above != above.parent:
        above = above.parent
    if not above.is_dir():
        raise InputError(f"{where}: {above} is a file, expected a folder")
    if not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"{where}: no permission to write into {above}")
    return path


def given_target(path: Path | str | None, *suffixes: str, where: str = "output", folder: bool = False) -> Path | None:
    """The same of a function's argument; None where nothing is to be written."""
    return None if path is None else to_write(path, where, *suffixes, folder=folder)
