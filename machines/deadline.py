"""Work that ends when its time is up: long loops ask `in_time`, who began them decides how long."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from jointlib.errors import CheckFailed

_END: ContextVar[tuple[float, float]] = ContextVar("deadline", default=(float("inf"), float("inf")))


class OutOfTime(CheckFailed):
    """A computation took longer than it was given."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Give what is done inside so many seconds; an earlier end that holds already stays."""
    token = _END.set(min(_END.get(), (time.monotonic() + seconds, seconds)))
    try:
        yield
    finally:
        _END.reset(token)


def in_time() -> None:
    """Raise `OutOfTime` once the time is up."""
    end, seconds = _END.get()
    if end < float("inf") and time.monotonic() > end:
        spent = f"{seconds / 60:.3g} minutes" if seconds > 90 else f"{seconds:.3g} s"
        raise OutOfTime(f"not done after {spent}")


class Turns:
    """Pieces of work of about the same length: none is begun that would not be done in time, or if too few would."""

    def __init__(self, what: str, fewest: int) -> None:
        self.what, self.fewest, self.done, self.longest = what, fewest, 0, 0.0

    @contextmanager
    def another(self) -> Iterator[None]:
        """The next one, else `OutOfTime`."""
        in_time()
        begun = time.monotonic()
        reached = self.done + (_END.get()[0] - begun) / self.longest if self.longest else float("inf")
        if reached < max(self.fewest, self.done + 1):
            raise OutOfTime(f"{int(reached)} {self.what} are in reach, each takes about {self.longest:.3g} s")
        yield
        self.done, self.longest = self.done + 1, max(self.longest, time.monotonic() - begun)
