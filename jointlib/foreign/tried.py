"""Readers in C that may never come back, or end the program, tried in a process of their own first."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from jointlib.errors import InputError

_PATIENCE = 10.0
"""s for a small file."""
_SLOWEST = 20e6
"""Bytes a second that a reader has at least."""
_LOOK = 0.002
"""s between looks at the child."""


def tried(path: Path, what: str, read: Callable[[], object]) -> None:
    """Let a child read a file first; refuse it where the child does not come back in time, or is ended by a signal.

    A loop in a library in C cannot be interrupted. On systems without ``fork`` nothing is tried.
    """
    if not hasattr(os, "fork"):
        return
    with suppress(OSError):
        _watched(path, what, read, _PATIENCE + path.stat().st_size / _SLOWEST)


def _watched(path: Path, what: str, read: Callable[[], object], seconds: float) -> None:
    deadline, child = time.monotonic() + seconds, os.fork()
    if child == 0:
        try:
            with suppress(BaseException):  # the parent meets it again, and tells it
                read()
        finally:
            os._exit(0)
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            raise InputError(f"{path}: cannot be read as {what} (its reader does not come to an end)")
        time.sleep(_LOOK)
    if os.WIFSIGNALED(status):
        raise InputError(f"{path}: cannot be read as {what} (its reader is ended by the system)")
