"""A piece of a run: what it is called, what must stand before it, and what becomes of the run when it fails."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from jointlib.errors import CheckFailed, InputError

if TYPE_CHECKING:
    from jointlib.cli.steps.road import Road

_OURS = Path(__file__).parents[3]
_PACKAGES = ("jointlib", "machines", "fmu")


@dataclass(frozen=True)
class Piece:
    """A part of a run that stands or fails alone."""

    step: str
    """Its word in ``steps``."""
    title: str
    """What it makes, as a heading."""
    take: Callable[[Road], None]
    remedy: str
    """What to do if it fails, a sentence."""
    of: str = ""
    """The joint or the amplitude, where a step is taken for several."""
    needs: tuple[str, ...] = ()
    """Names of pieces without which it cannot be taken."""

    @property
    def name(self) -> str:
        """The step and what it is taken for."""
        return f"{self.step} {self.of}".rstrip()


def walk(pieces: Iterable[Piece], road: Road) -> None:
    """Take every piece whose needs stand; one that fails leaves its reason and a section, and ends nothing else."""
    failed: dict[str, str] = {}
    for piece in pieces:
        missing = next((name for name in piece.needs if name in failed), None)
        if missing is not None:
            failed[piece.name] = failed[missing]
            road.lost(piece, f"it needs what is missing: {failed[missing]}")
            continue
        try:
            piece.take(road)
        except Exception as error:
            failed[piece.name] = f"{piece.title[0].lower()}{piece.title[1:]}"
            road.lost(piece, reason(error), unexpected=not isinstance(error, InputError | CheckFailed))


def reason(error: Exception) -> str:
    """Why a piece failed: the sentence of one of our errors, else the kind of the error and where it arose."""
    if isinstance(error, InputError | CheckFailed):
        return str(error)
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if any(Path(f.filename).is_relative_to(_OURS / package) for package in _PACKAGES)]
    where = f", in {Path(ours[-1].filename).relative_to(_OURS)} line {ours[-1].lineno}" if ours else ""
    said = " ".join(str(error).split())
    return f"unexpected: {type(error).__name__}{f': {said}' if said else ''}{where}"
