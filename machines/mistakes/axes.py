"""Slides that cannot slide: axes, guides and screws whose directions do not agree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from jointlib.arrays import Array

from ..components.connection import Connection
from ..components.riding import Riding
from ..model.axes import FREE, Axis
from ..model.machine import Machine
from ..modes.natural_modes import NaturalModes
from .contacts import words
from .elements import Element

_STIFF = 0.01
"""Share of a carriage's largest stiffness that a direction of travel may have."""
_PARALLEL = 0.999
_SLIDES = 1e-6
_HELD = 0.5
"""Cosine of the angle between an axis and what a flange holds."""


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
    for screw, guide in _blocked(found):
        assert screw.direction is not None
        yield (
            f"{screw.name}: it drives along {words(screw.direction[0])}, where {guide.name} holds already; its "
            f"carriages run along {words(_travel(guide))}"
        )
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


def blocked_travels(found: Sequence[Element]) -> list[Array]:
    """Directions in which guides slide whose screw drives across them: what drifts along these follows from that."""
    return [_travel(guide) for _, guide in _blocked(found)]


def _blocked(found: Sequence[Element]) -> Iterator[tuple[Element, Element]]:
    """Screws, each with the first guide of its slide that is stiff where it drives."""
    for screw in (e for e in found if e.kind == "ball-screw" and e.direction is not None):
        assert screw.direction is not None
        for guide in (e for e in found if e.kind == "linear-guide" and e.direction is not None):
            if set(guide.sides) == set(screw.sides) and _stiff(guide, screw.direction[0]):
                yield screw, guide
                break


def across(modes: NaturalModes, found: Sequence[Element]) -> Iterator[tuple[str, Array]]:
    """Connections that act where the guides of their slide hold, while nothing drives it: a sentence and the travel.

    A gib or a clamp acts there too, but beside a drive.
    """
    parts, free = modes.machine.components, modes.free
    size = np.max(np.abs(free), initial=0.0)
    for connection in (e for e in found if not e.kind and e.direction is not None):
        assert connection.direction is not None
        for guide in (e for e in found if e.kind == "linear-guide" and e.direction is not None):
            if set(guide.sides) != set(connection.sides) or not _stiff(guide, connection.direction[0]):
                continue
            assert guide.at is not None
            travel = _travel(guide)
            at, along = guide.at[0], travel
            slides = Connection(
                "travel", guide.words, at=(at[0], at[1], at[2]), direction=(along[0], along[1], along[2]), rigid=True
            )
            if size and abs(slides.row(parts) @ free).max() > _SLIDES * size:
                yield (
                    f"{connection.name}: it acts along {words(connection.direction[0])}, where {guide.name} holds "
                    f"already; its carriages run along {words(travel)}, and nothing holds them there",
                    travel,
                )
                break


def torn_apart(machine: Machine) -> Iterator[str]:
    """Axes that move a part away from one that a flange holds it to, or a bundle that lets nothing slide.

    Guides slide and screws drive; a spring, or one rigid connection alone, may be what drives the axis.
    """
    flanges: dict[tuple[object, ...], list[Connection]] = {}
    for connection in machine.connections:
        if connection.rigid and connection.at is not None:
            name = connection.name.rpartition(".")[0] or connection.name
            flanges.setdefault((name, connection.between, connection.at), []).append(connection)
    for axis in machine.axes:
        along = np.asarray(axis.direction, dtype=float)
        for (flange, *_), rows in flanges.items():
            shifts = [row.direction for row in rows if row.direction is not None and not row.turns]
            held = any(abs(along @ np.array(n)) > _HELD * np.linalg.norm(n) for n in shifts)
            if len(rows) > 1 and held:
                yield from _torn(machine, axis, str(flange), "holds rigidly", rows[0].between)
        for bundle in machine.bundles:
            if bundle.bundle.slides_with is None:
                how = f"holds, a {bundle.bundle.kind} that lets nothing slide"
                yield from _torn(machine, axis, bundle.name, how, bundle.between)


def _torn(machine: Machine, axis: Axis, name: str, how: str, between: tuple[str, str]) -> Iterator[str]:
    moved, still = sorted((side.partition(".")[0] for side in between), key=lambda side: side not in axis.moves)
    if moved in axis.moves and still not in axis.moves:
        ends = [[side.partition(".")[0] for side in c.between] for c in machine.connections]
        beside = {side for sides in ends if still in sides for side in sides} - {still, *axis.moves}
        stands = [c for c in machine.components if c.name in beside and not (c.kind in FREE or isinstance(c, Riding))]
        alone = beside == {c.name for c in stands}
        so = "".join(f"; {c.name}, of kind {c.kind}, is not known to ride on {still}" for c in stands[:1] if alone)
        yield (
            f"axis {axis.name}: it moves {moved} away from {still}, to which {name} {how}; expected both in moves, or "
            f"neither{so}"
        )


def _travel(guide: Element) -> Array:
    return np.asarray(np.linalg.eigh(guide.holds)[1][:, 0])


def _along(guide: Element, direction: Array) -> float:
    n = direction / np.linalg.norm(direction)
    return float(n @ guide.holds @ n)


def _stiff(guide: Element, direction: Array) -> bool:
    largest = float(np.linalg.eigvalsh(guide.holds)[-1])
    return largest > 0 and _along(guide, direction) > _STIFF * largest
