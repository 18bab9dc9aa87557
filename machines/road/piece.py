"""Steps of a run and their pieces: what must stand before them, and what becomes of the run when one fails."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path
from typing import TYPE_CHECKING

from jointlib.errors import CheckFailed, InputError, nearest
from jointlib.registry import installed

from ..deadline import within

if TYPE_CHECKING:
    from ..model.machine import Machine
    from .run import Run

BUDGET = 600.0
"""Seconds for a piece of a run, so that a run ends with a report; a verb that repeats the piece alone has no end."""
_OURS = Path(__file__).parents[2]
_PACKAGES = ("jointlib", "machines", "fmu")


@dataclass(frozen=True)
class Piece:
    """A part of a run that stands or fails alone."""

    step: str
    """Its word in ``steps``."""
    title: str
    """What it makes, as a heading."""
    take: Callable[[Run], None]
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


@dataclass(frozen=True)
class Step:
    """A step of a run: its pieces for a machine and tool-point amplitudes (m), and the steps that come before it.

    Steps are found by the entry points of the group ``jointlib.steps``, so that any package can bring one.
    """

    name: str
    pieces: Callable[[Machine, Sequence[float]], list[Piece]]
    after: tuple[str, ...] = ()


def steps() -> list[Step]:
    """Every step that is installed, in an order in which each comes after those it names."""
    found: dict[str, Step] = {step.name: step for step in installed("jointlib.steps").found.values()}
    order = TopologicalSorter({name: [one for one in step.after if one in found] for name, step in found.items()})
    return [found[name] for name in order.static_order()]


def chosen_steps(asked: Sequence[Step | str] | None) -> list[Step]:
    """The steps that were asked for, an installed one by its name; all that are installed where none were."""
    known = steps()
    if asked is None:
        return known
    by_name = {step.name: step for step in known}
    for one in asked:
        if isinstance(one, str) and one not in by_name:
            raise InputError(f"run: no step {one!r}, {nearest(one, list(by_name))}")
    return [by_name[one] if isinstance(one, str) else one for one in asked]


def open_joints(machine: Machine) -> tuple[str, ...]:
    """Names of the pieces that identify what the machine file leaves open: most others need them."""
    return tuple(f"identify {c.name}" for c in machine.connections if c.identify is not None)


def walk(pieces: Iterable[Piece], road: Run) -> None:
    """Take every piece whose needs stand; one that fails leaves its reason and a section, and ends nothing else."""
    failed: dict[str, str] = {}
    for piece in pieces:
        missing = next((name for name in piece.needs if name in failed), None)
        if missing is not None:
            failed[piece.name] = failed[missing]
            road.lost(piece, f"it needs what is missing: {failed[missing]}")
            continue
        try:
            with within(BUDGET):
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
