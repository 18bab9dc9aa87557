"""Slides that cannot slide: axes, guides and screws whose directions do not agree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from jointlib.arrays import Array

from ..model.machine import Machine
from .contacts import words
from .elements import Element

_STIFF = 0.01
"""Share of a carriage's largest stiffness that a direction of travel may have."""
_PARALLEL = 0.999


def wrong_directions(machine: Machine, found: Sequence[Element]) -> Iterator[str]:
    """Axes and screws that push where their guides are stiff, and guides of one slide that run apart."""
    guides = [e for e in found if e.kind == "linear-guide" and e.direction is not None]
    for axis in machine.axes:
        along = np.asarray(axis.direction, dtype=float)
        for guide in guides:
            if (guide.sides[0] in axis.moves) != (guide.sides[1] in axis.moves) and _stiff(guide, along):
                yield (
                    f"axis {axis.name}: it moves {', '.join(axis.moves)} along {words(along)}, where "
                    f"{guide.name} holds with "
                    f"{_along(guide, along) * 1e-6:.4g} N/um; its carriages run along {words(_travel(guide))}"
                )
                break
    for screw in (e for e in found if e.kind == "ball-screw" and e.direction is not None):
        assert screw.direction is not None
        for guide in guides:
            if set(guide.sides) == set(screw.sides) and _stiff(guide, screw.direction[0]):
                yield (
                    f"{screw.name}: it drives along {words(screw.direction[0])}, where {guide.name} holds already; its "
                    f"carriages run along {words(_travel(guide))}"
                )
                break
    for i, guide in enumerate(guides):
        for other in guides[:i]:
            apart = abs(float(_travel(guide) @ _travel(other))) < _PARALLEL
            if set(guide.sides) == set(other.sides) and apart:
                yield (
                    f"{guide.name}: it runs along {words(_travel(guide))} and {other.name} between the same "
                    "parts along "
                    f"{words(_travel(other))}, so they hold each other"
                )
                break


def _travel(guide: Element) -> Array:
    return np.asarray(np.linalg.eigh(guide.holds)[1][:, 0])


def _along(guide: Element, direction: Array) -> float:
    n = direction / np.linalg.norm(direction)
    return float(n @ guide.holds @ n)


def _stiff(guide: Element, direction: Array) -> bool:
    largest = float(np.linalg.eigvalsh(guide.holds)[-1])
    return largest > 0 and _along(guide, direction) > _STIFF * largest
