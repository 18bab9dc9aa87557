"""A tool and the place of the workpiece that it cuts, which are not at one place."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from jointlib.arrays import Array

from ..model.machine import Machine

_APART = 0.3
"""m between the tip of a tool and the point that it cuts; tools of several lengths cut at one point of a file."""


def wrong_tool_point(machine: Machine) -> Iterator[str]:
    """``[tool]`` as the difference of two points that lie far apart, in any direction; one sentence."""
    for axis, motion in machine.tool.items():
        points = [side.strip() for side in motion.split(" - ")]
        at = [place for place in (_place(machine, point) for point in points) if place is not None]
        if len(points) != 2 or len(at) != 2:
            continue
        away = at[1] - at[0]
        if np.linalg.norm(away) > _APART:
            names = [point.rpartition(".")[0] for point in points]
            along = ", ".join(f"{1e3 * value:.4g}" for value in away)
            yield (
                f"[tool]: {axis}: {names[1]} lies ({along}) mm from {names[0]}, expected where the tool cuts: is a "
                "point off, or its unit?"
            )
            return


def _place(machine: Machine, dof: str) -> Array | None:
    """Where the point of a ``component.point.x`` is drawn, m; None of one without a place."""
    name, _, rest = dof.partition(".")
    drawn = next((part.drawn() for part in machine.components if part.name == name), None)
    point = rest.rpartition(".")[0]
    return None if drawn is None or point not in drawn.names else drawn.frames[drawn.names.index(point)].origin
