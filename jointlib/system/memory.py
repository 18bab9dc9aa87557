"""How much memory a computation may take: a share of what is free, or what was asked for."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from jointlib.errors import InputError

SHARE = 0.8
"""Of the free memory, without a word on it."""
_WORDS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB"))
_SIZE = re.compile(r"(\d+(?:\.\d+)?(?:e\d{1,2})?)\s*(TB|GB|MB|kB|B|)", re.ASCII | re.IGNORECASE)
_LIBRARIES = 512 << 20
"""Bytes left beside for what libraries of linear algebra take themselves: where they cannot, they end the program."""
_UNKNOWN = 4 << 30
"""Bytes where the system tells nothing."""
_ASKED: ContextVar[int | None] = ContextVar("asked", default=None)


def free_memory() -> int:
    """Bytes that the system, or the group of processes this one belongs to, can still give."""
    found = [_UNKNOWN]
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        found = [1024 * int(next(line for line in lines if line.startswith("MemAvailable")).split()[1])]
    if found == [_UNKNOWN] and hasattr(os, "sysconf"):
        with suppress(OSError, ValueError):
            found = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        found.append(int((group / "memory.max").read_text()) - int((group / "memory.current").read_text()))
    return max(0, min(found))


def limit() -> int:
    """Bytes that one command may take."""
    asked = _ASKED.get()
    return int(SHARE * free_memory()) if asked is None else asked


def bytes_in(text: str, where: str) -> int:
    """Bytes of a size in words, as ``4GB``, ``500 MB`` or ``1e9``."""
    match = _SIZE.fullmatch(text.strip())
    factor = {"": 1.0, "B": 1.0} | {word.upper(): f for f, word in _WORDS} if match else {}
    size = float(match[1]) * factor[match[2].upper()] if match else 0.0
    if not 1e6 <= size < 1e18:
        raise InputError(f"{where}: {text!r}, expected a size of at least 1 MB, such as 4GB")
    return int(size)


def ask(size: int) -> None:
    """Let so many bytes be the limit, up to the end of `limited`."""
    _ASKED.set(size)
    _enforce()


@contextmanager
def limited() -> Iterator[None]:
    """Within it the system refuses what goes beyond the limit, which Python tells as a `MemoryError`.

    Without that Linux gives away more than it has, and stops a program in the middle once that is used. Other systems
    than Linux do not count so, and there it is left to them.
    """
    token, before = _ASKED.set(None), _enforce()
    try:
        yield
    finally:
        _ASKED.reset(token)
        if before is not None:
            import resource

            resource.setrlimit(resource.RLIMIT_DATA, before)


def _enforce() -> tuple[int, int] | None:
    """Let no more be taken than the limit beside what is held; the limits of the system before that."""
    if not sys.platform.startswith("linux"):
        return None
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    with suppress(OSError, ValueError, IndexError):
        most = _held() + limit() + _LIBRARIES
        resource.setrlimit(resource.RLIMIT_DATA, (most if before[1] < 0 else min(most, before[1]), before[1]))
    return before


def divide(parts: int) -> None:
    """Leave this process, one of so many that were divided from one, its part of what the system still lets it take."""
    if not sys.platform.startswith("linux"):
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    with suppress(OSError, ValueError, IndexError):
        held = _held()
        if soft >= held:
            resource.setrlimit(resource.RLIMIT_DATA, (held + (soft - held) // parts, hard))


def _held() -> int:
    """Bytes of data that this process has."""
    return int(Path("/proc/self/statm").read_text("ascii").split()[5]) * os.sysconf("SC_PAGE_SIZE")


def refuse_beyond(need: float, why: str) -> None:
    """Refuse what needs more bytes than the limit; ``why`` begins the sentence and tells the number that makes it so.

    Raises
    ------
    InputError
        ``why``, what it would take, and the limit.
    """
    most = limit()
    if need > most:
        raise InputError(f"{why} would take {in_words(need)} of memory, expected at most {in_words(most)} (--limit)")


def in_words(size: float) -> str:
    """Bytes as people say them."""
    factor, word = next(((f, w) for f, w in _WORDS if size >= f), (1.0, "bytes"))
    return f"{size / factor:.3g} {word}"
