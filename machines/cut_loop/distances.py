"""How far draws of a machine stand from their border at the depths of cuts, and at which frequency they chatter there.

Milling with even, straight teeth and a tool known by its modes: by the multiplier of a tooth period at each depth, see
`passes`. ln|μ| runs nearly straight over ln b, and where it is zero the border lies. Anything else: by the borders of
`borders` with what `exactness` has learnt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..indices import Index
from .borders import Condition, border
from .exactness import Exactness
from .growth import growth, map_of, multiplier
from .passes import Pass, arc_of, pass_of
from .sampled_tool import Drawn, SampledTool
from .suspects import Suspect

_FAR = 3.0
"""ln of depths beyond which nobody asks how far."""
_PIECE = 128
"""Draws that stay in the cache."""
_NEXT = 1.25
"""Times a depth that stands alone, where the slope is looked at."""


@dataclass(frozen=True, eq=False)
class Place:
    """A condition and the depths in m, ascending, at which it is asked; ``number`` finds it in what was learnt.

    ``sung`` says whether chatter was heard there, so that its frequency at the border is asked as well.
    """

    at: Condition
    depths: Array
    number: int
    exactness: Exactness | None = None
    sung: bool = False


def exact(tool: SampledTool, at: Condition) -> bool:
    """Whether the multiplier of a tooth period tells it."""
    cutting = at.cutting
    even = cutting.pitch is None and cutting.helix is None
    return tool.modal and cutting.process == "milling" and even


def distances(
    suspect: Suspect, tool: SampledTool, place: Place, base: Drawn, rows: Index, values: Array
) -> tuple[Array, Array, Array]:
    """ln(b_lim/b) and the frequency of chatter in Hz at every depth of a place, (draws, depths), and that frequency at
    the border, (draws,).

    ``base`` are the draws with their modes where they stand, ``rows`` the samples behind them.
    """
    pieces = [np.arange(begin, min(begin + _PIECE, len(rows))) for begin in range(0, max(len(rows), 1), _PIECE)]
    found = [_of_piece(suspect, tool, place, base.of(piece), rows[piece], values[piece]) for piece in pieces]
    apart, frequency, at_border = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return apart, frequency, at_border


def _of_piece(
    suspect: Suspect, tool: SampledTool, place: Place, base: Drawn, rows: Index, values: Array
) -> tuple[Array, Array, Array]:
    """`distances` of as many draws as stay in the cache."""
    at, ladder = place.at, place.depths
    if not exact(tool, at):
        changed = suspect.changed(base, values, at.speed, float(np.mean(ladder)))
        damping = changed.damping + (at.cutting.process_damping or 0.0)
        G = tool.response(changed, rows)
        depth, frequency = border(G, tool.lines, at, changed.tangential, changed.normal, damping)
        if place.exactness is not None:
            depth = depth * np.exp(place.exactness.logarithm(changed, place.number))
            frequency = frequency + place.exactness.shift[place.number]
        with np.errstate(divide="ignore"):
            apart = np.clip(np.log(depth[:, None] / ladder), -_FAR, _FAR)
        return np.asarray(apart), np.broadcast_to(frequency[:, None], apart.shape), frequency
    asked = np.append(ladder, _NEXT * ladder[0]) if len(ladder) == 1 else ladder
    grown, angle = np.zeros((len(rows), len(asked))), np.zeros((len(rows), len(asked)))
    arc, found, changed = arc_of(at, max(tool.highest, suspect.highest)), None, base
    for k, depth in enumerate(asked):
        if found is None or suspect.by_depth:
            changed = suspect.changed(base, values, at.speed, float(depth))
            found = pass_of(changed, tool.direct[rows], at, arc, tool.axes)
        grown[:, k], angle[:, k] = _grown(found, changed, at, np.full(len(rows), float(depth)))
    repeats = at.tooth_frequency if changed.active is None else at.speed / 60
    least = 0.3 * np.min(-changed.poles[:, tool.felt()].real, axis=1) / at.tooth_frequency
    apart = _to_border(grown, np.log(asked), least)[:, : len(ladder)]
    angle = angle[:, : len(ladder)]
    at_border = angle[np.arange(len(rows)), np.argmin(np.abs(apart), axis=1)]
    if place.sung and found is not None and not suspect.by_depth:
        at_border = _grown(found, changed, at, first_border(place, apart))[1]
    hertz = repeats / (2 * np.pi)
    return apart, angle * hertz, at_border * hertz


def _grown(found: Pass, changed: Drawn, at: Condition, depth: Array) -> tuple[Array, Array]:
    """ln|μ| of a tooth period and the angle of the multiplier at a depth in m for each draw, (draws,)."""
    steps = found.steps(depth)
    if changed.active is None:
        return growth(steps, found.states)
    # A flute that stands back leaves the surface to the next one.
    teeth = at.cutting.cuts_per_revolution
    passing, idle = map_of(steps, found.states), found.idle()
    turned = passing
    for tooth in range(1, teeth):
        cuts = (tooth < changed.active)[:, None, None]
        turned = np.where(cuts, passing, idle) @ turned
    of_turn, angle = multiplier(turned)
    return of_turn / teeth, angle


def _to_border(grown: Array, depth: Array, least: Array) -> Array:
    """ln(b_lim/b) from ln|μ| at the logarithms of depths, by the slope towards where it is zero.

    ``least`` is the slope of each sample that is believed at least, (samples,).
    """
    slope = np.diff(grown, axis=1) / np.diff(depth)
    up = np.concatenate([slope, slope[:, -1:]], axis=1)
    down = np.concatenate([slope[:, :1], slope], axis=1)
    toward = np.maximum(np.where(grown < 0, up, down), least[:, None])
    return np.asarray(np.clip(-grown / toward, -_FAR, _FAR))


def first_border(place: Place, apart: Array) -> Array:
    """The lowest border in m among the depths of a place, (draws,); beyond the ends by what is told there."""
    inside = np.argmax(apart <= 0, axis=1)
    any_below = np.any(apart <= 0, axis=1)
    at = np.where(any_below, inside, apart.shape[1] - 1)
    return np.asarray(place.depths[at] * np.exp(apart[np.arange(len(apart)), at]))
