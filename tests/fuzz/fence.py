"""A fence around runs of damaged inputs: whatever path an input names, nothing outside of one folder is written."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CHANGES = {
    "os.rename": ((0, 2), (1, 3)),
    "os.remove": ((0, 1),),
    "os.mkdir": ((0, 2),),
    "os.rmdir": ((0, 1),),
    "os.link": ((1, 3),),
    "os.symlink": ((1, 2),),
    "os.truncate": ((0, None),),
    "os.chmod": ((0, 2),),
    "os.chown": ((0, 3),),
    "os.utime": ((0, 3),),
}
"""Events of the interpreter that change files, and which arguments are the paths and the folders they begin in."""


def fence(folder: Path) -> None:
    """From here on this process writes below ``folder`` alone: what else it tries is a `PermissionError`.

    The hook cannot be taken away again, so it is for a process of its own.
    """
    inside = os.path.realpath(folder)

    def outside(path: Any, begins: Any) -> bool:
        if not isinstance(path, str | bytes | os.PathLike):
            return False  # a descriptor, which was opened before
        name = os.fsdecode(path)
        if isinstance(begins, int) and begins >= 0:  # as when a tree is removed
            name = os.path.join(os.path.realpath(f"/proc/self/fd/{begins}"), name)
        whole = os.path.join(os.path.realpath(os.path.dirname(name) or "."), os.path.basename(name))
        return whole != inside and not whole.startswith(f"{inside}{os.sep}")

    def watch(event: str, given: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(given[2], int) and given[2] & _WRITES:
            paths = [(given[0], None)]
        else:
            paths = [(given[k], None if at is None else given[at]) for k, at in _CHANGES.get(event, ())]
        for path, begins in paths:
            if path != os.devnull and outside(path, begins):
                raise PermissionError(13, "Permission denied", os.fsdecode(path))

    sys.addaudithook(watch)
