"""The picture of a run: the machine in three dimensions with its modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from jointlib.errors import InputError

from .piece import Piece, Step, open_joints

if TYPE_CHECKING:
    from .. import Machine
    from .run import Run


def picture_pieces(machine: Machine, amplitudes: Sequence[float] = ()) -> list[Piece]:
    """One picture, once the joints are known; none where no part has a place in space."""
    from ..view.places import Places

    if next(Places(machine).points(), None) is None:
        return []
    remedy = f"`jointlib inspect {machine.source} -o picture.html` draws it alone."
    return [Piece("picture", "The machine and its modes", _picture, remedy, needs=open_joints(machine))]


def _picture(road: Run) -> None:
    from ..report import Figure, Section
    from ..view import scene
    from ..view.modes import modes_of
    from ..view.page import fragment

    title = "The machine and its modes"
    try:
        with road.progress.step("drawing the machine and its modes"):
            drawn = scene(road.machine)
            modes, why = modes_of(road.machine, drawn)
            shown = fragment(drawn, modes)
    except InputError as error:  # what is only for the eye stops nothing
        road.warnings.append(f"The machine is not drawn: {error}.")
        road.sections.append(Section(title, [road.warnings[-1]]))
        return
    caption = "A mode that is chosen moves, exaggerated."
    text = (
        [why]
        if why
        else [
            "Modes with the joints as they are at rest, numbered in ascending frequency; those that the "
            "tool feels most can be chosen."
        ]
    )
    road.sections.append(Section(title, [*text, *drawn.placeless], [Figure(shown, caption)]))


STEP = Step("picture", picture_pieces, after=("mistakes",))
