"""The picture of a run: the machine in three dimensions with its modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointlib.cli.steps.piece import Piece
from jointlib.errors import InputError

if TYPE_CHECKING:
    from jointlib.cli.steps.road import Road
    from machines import Machine


def picture_pieces(machine: Machine, needs: tuple[str, ...]) -> list[Piece]:
    """One picture, once the joints are known; none where no part has a place in space."""
    from machines.view.places import Places

    if next(Places(machine).points(), None) is None:
        return []
    remedy = f"`jointlib inspect {machine.source} -o picture.html` draws it alone."
    return [Piece("picture", "The machine and its modes", _picture, remedy, needs=needs)]


def _picture(road: Road) -> None:
    from machines.report import Figure, Section
    from machines.view import scene
    from machines.view.modes import modes_of
    from machines.view.page import fragment

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
    caption = "Drag to turn; choose a mode to see it move, exaggerated; point at a part for its name."
    text = (
        [why]
        if why
        else [
            "Modes with the joints as they are at rest, numbered in ascending frequency; those that the "
            "tool feels most can be chosen."
        ]
    )
    road.sections.append(Section(title, [*text, *drawn.placeless], [Figure(shown, caption)]))
