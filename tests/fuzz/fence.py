"""A fence around runs of damaged inputs: whatever path an input names, nothing outside of one folder is written."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CHANGES = {
    "os.rename": (0, 1),
    "os.remove": (0,),
    "os.mkdir": (0,),
    "os.rmdir": (0,),
    "os.link": (1,),
    "os.symlink": (1,),
    "os.truncate": (0,),
    "os.chmod": (0,),
    "os.chown": (0,),
    "os.utime": (0,),
}
"""Events of the interpreter that change files, and which of their arguments are the paths."""


def fence(folder: Path) -> None:
    """From here on this process writes below ``folder`` alone: what else it tries is a `PermissionError`.

    The hook cannot be taken away again, so it is for a process of its own.
    """
    inside = os.path.realpath(folder)

    def outside(path: Any) -> bool:
        if not isinstance(path, str | bytes | os.PathLike):
            return False  # a descriptor, which was opened before
        name = os.fsdecode(path)
        whole = os.path.join(os.path.realpath(os.path.dirname(name) or "."), os.path.basename(name))
        return whole != inside and not whole.startswith(f"{inside}{os.sep}")

    def watch(event: str, given: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(given[2], int) and given[2] & _WRITES:
            paths = given[:1]
        else:
            paths = tuple(given[k] for k in _CHANGES.get(event, ()))
        for path in paths:
            if path != os.devnull and outside(path):
                raise PermissionError(13, "Permission denied", os.fsdecode(path))

    sys.addaudithook(watch)
