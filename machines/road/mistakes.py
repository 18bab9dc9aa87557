"""What looks like a mistake in the machine of a run, said beside the answer and beside what it concerns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from .piece import Piece, Step, open_joints

if TYPE_CHECKING:
    from .. import Machine
    from ..report import Section
    from .run import Run

_LOOKS = "Looks wrong: "
_CUT, _FORCED, _STANDS, _SEEN = (
    "Stability lobes",
    "Forced response",
    "Static working point",
    "The machine and its modes",
)


def mistake_pieces(machine: Machine, amplitudes: Sequence[float] = ()) -> list[Piece]:
    """One look at the machine, once its joints are known."""
    remedy = f"`jointlib inspect {machine.source}` looks for them alone."
    return [Piece("mistakes", "What looks like a mistake", _look, remedy, needs=open_joints(machine))]


def _look(road: Run) -> None:
    from ..mistakes import mistakes

    with road.progress.step("looking for mistakes in the machine file"):
        road.mistakes = mistakes(road.machine)
    if road.mistakes:
        road.steps.append({"step": "mistakes", "found": list(road.mistakes)})
    road.doubts += [f"looks wrong: {said}" for said in road.mistakes]


def beside(sections: Sequence[Section], mistakes: Sequence[str]) -> list[Section]:
    """The sections of a report, each headed by the mistakes that concern what it shows."""
    titles = [section.title for section in sections]
    places = [_concerned(said, titles) for said in mistakes]
    return [
        replace(
            section,
            text=[*(_LOOKS + said for said, at in zip(mistakes, places, strict=True) if i in at), *section.text],
        )
        for i, section in enumerate(sections)
    ]


def _concerned(said: str, titles: Sequence[str]) -> set[int]:
    """Which sections show what a sentence speaks of; the picture where no other does."""
    about = said.partition(": ")[0]
    named = {"[static]": (_STANDS,), "[cutting]": (_CUT,), "tool": (_CUT, _FORCED)}.get(about)
    if named is None and about.startswith("the mode at "):
        named = (_CUT, _FORCED)
    if named is not None:
        found = {i for i, title in enumerate(titles) if title.startswith(named)}
    else:
        found = {i for name in re.split(" and |, ", about) for i, title in enumerate(titles) if _of(name, title)}
    return found or {i for i, title in enumerate(titles) if title == _SEEN}


def _of(name: str, title: str) -> bool:
    """Whether a title names this joint, or a contact of this bundle."""
    return any(word == name or word.startswith(f"{name}.") for word in title.split())


STEP = Step("mistakes", mistake_pieces, after=("joints",))
