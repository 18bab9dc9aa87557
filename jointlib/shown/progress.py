"""What a long computation tells of where it is."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Protocol


class Progress(Protocol):
    """Told of every part that takes long."""

    def step(self, what: str) -> AbstractContextManager[None]:
        """Entered when the part begins, left when it has ended."""


class Silent:
    """Tells nothing."""

    def step(self, what: str) -> AbstractContextManager[None]:
        """Nothing."""
        return nullcontext()
