"""What a long computation tells of where it is."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Named:
    """One of several like computations: what is told begins with its name."""

    progress: Progress
    name: str

    def step(self, what: str) -> AbstractContextManager[None]:
        """Told with the name."""
        return self.progress.step(f"{self.name}: {what}")
