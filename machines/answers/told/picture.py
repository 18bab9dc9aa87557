"""The picture of a machine, for ``jointlib inspect -o``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ...view.mode_shape import Mode

_SHARE = 0.08
"""Largest displacement of a still mode shape over the size of the machine."""


def draw(file: Path, output: Path, mode: int | None, changes: dict[str, str] | None = None) -> list[str]:
    """Write the machine of a file as SVG or HTML, by the suffix; what is to be said of it.

    ``mode`` is the number of one that is shown, from 1 on in ascending frequency; an HTML page has others as well.
    """
    from jointlib.io.atomic import write_text

    from ...files.machine_file import read_machine
    from ...road.open_joints import with_joints
    from ...view import scene
    from ...view.modes import modes_of
    from ...view.page import page
    from ...view.svg import picture

    machine = read_machine(file, changes)
    drawn, said = scene(machine), list[str]()
    wanted = () if mode is None else (mode,)
    modes: tuple[Mode, ...] = ()
    if output.suffix == ".html" or wanted:
        given = {connection.name for connection in machine.connections if connection.identify is not None}
        machine, remarks = with_joints(machine)
        said += [remark for remark in remarks if remark.partition(":")[0] in given]
        modes, why = modes_of(machine, drawn, wanted)
        said += [why] if why else []
    if output.suffix == ".html":
        first = next((i for i, one in enumerate(modes, start=1) if one.number == mode), 0)
        write_text(output, page(drawn, modes, first))
    else:
        chosen = next((one for one in modes if one.number == mode), None)
        moved = None if chosen is None else _SHARE * drawn.size * np.real(chosen.moved)
        write_text(output, picture(drawn, moved, f"{drawn.name}: {chosen.name}" if chosen else ""))
    return [*said, *drawn.placeless, f"wrote {output}"]
