"""What a long computation tells of where it is: the part, how far it is, and how long it still takes.

A part is entered by `Progress.step`. Deep inside it long loops go through `each`, which tells whoever follows the part
how far they are, and `remark` says what is worth knowing before the rest is begun.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Protocol, TypeVar

_Item = TypeVar("_Item")
_LONG = 60.0
"""Seconds of which one is warned."""


class Progress(Protocol):
    """Told of every part that takes long."""

    def step(self, what: str) -> AbstractContextManager[None]:
        """Entered when the part begins, left when it has ended."""


class Silent:
    """Tells nothing."""

    def step(self, what: str) -> AbstractContextManager[None]:
        """Nothing."""
        return nullcontext()


@dataclass(frozen=True)
class Named:
    """One of several like computations: what is told begins with its name."""

    progress: Progress
    name: str

    def step(self, what: str) -> AbstractContextManager[None]:
        """Told with the name."""
        return self.progress.step(f"{self.name}: {what}")


class Inside:
    """Parts of a part: who follows the part hears of each as of how far it is."""

    @contextmanager
    def step(self, what: str) -> Iterator[None]:
        """Told as long as it lasts."""
        follower = _FOLLOWER.get()
        loops = [] if follower is None else follower.loops
        depth = len(loops)
        loops.append(what)
        try:
            yield
        finally:
            del loops[depth:]


class Follower:
    """Hears how far the loops of a part are, and what they remark."""

    def __init__(self, remark: Callable[[str], None]) -> None:
        self.remark, self.loops = remark, list[str]()

    def __str__(self) -> str:
        """The loops, the outermost first: "3 of 16 amplitudes, about 40 s more, 20 of 200 speeds"."""
        return ", ".join(self.loops)


_FOLLOWER: ContextVar[Follower | None] = ContextVar("follower", default=None)


@contextmanager
def followed(follower: Follower) -> Iterator[None]:
    """What is computed inside tells this one how far it is."""
    token = _FOLLOWER.set(follower)
    try:
        yield
    finally:
        _FOLLOWER.reset(token)


def each(what: str, items: Iterable[_Item], count: int, cheaper: str = "") -> Iterator[_Item]:
    """The items of a long loop, of which there are at most ``count``: how many of ``what`` are done is told.

    Where the first says that all take more than a minute, that is remarked with ``cheaper``, what asks for less.
    """
    follower = _FOLLOWER.get()
    if follower is None or count < 2:
        yield from items
        return
    loops, depth, begun = follower.loops, len(follower.loops), time.perf_counter()
    try:
        for done, item in enumerate(items):
            left = (time.perf_counter() - begun) / done * (count - done) if done else 0.0
            if cheaper and done == 1 and left > _LONG:
                follower.remark(f"{count} {what} take about {left:.0f} s; {cheaper}")
            loops[depth:] = [f"{done} of {count} {what}" + (f", about {left:.0f} s more" if left and not depth else "")]
            yield item
    finally:
        del loops[depth:]


def remark(said: str) -> None:
    """Say something before the rest of a part is begun, as how long it takes and what is faster."""
    follower = _FOLLOWER.get()
    if follower is not None:
        follower.remark(said)
