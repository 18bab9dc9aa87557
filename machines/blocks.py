"""Work in pieces, so that memory grows with what is kept and not with what is passed through."""

from __future__ import annotations

from collections.abc import Iterator

_ENTRIES = 2**22
"""Of an array at a time; complex ones take 64 MB."""


def blocks(count: int, each: int) -> Iterator[slice]:
    """Slices of ``count`` points of which each needs an array of ``each`` entries."""
    step = max(1, _ENTRIES // max(each, 1))
    for start in range(0, count, step):
        yield slice(start, min(start + step, count))
