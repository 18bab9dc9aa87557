"""How far draws of a machine stand from their border at the depths of cuts, and at which frequency they chatter there.

Milling with even, straight teeth and a tool known by its modes: by the multiplier of a tooth period at each depth, see
`passes`. ln|μ| runs nearly straight over ln b, and where it is zero the border lies. Anything else: by the borders of
`borders` with what `exactness` has learnt.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..cutting.process.cutting import Cutting
from ..indices import Index
from .borders import Condition, still
from .exactness import Exactness, by_multipliers, of_zero_order, told
from .growth import asked_of, growth, map_of, multiplier, to_border
from .passes import Pass, arc_of, pass_of
from .sampled_tool import Drawn, SampledTool
from .suspects import Suspect

_PIECE = 128
"""Draws that stay in the cache."""


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


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of a suspect: ``base`` with their modes where they stand, the samples behind them and its ``values``.

    ``still`` are eigenvalues of the mean cut that draws without another speed in them share, by arc of cut.
    """

    suspect: Suspect
    tool: SampledTool
    base: Drawn
    rows: Index
    values: Array
    still: dict[Cutting, list[ComplexArray]] = field(default_factory=dict)

    def of(self, pick: Index) -> Draws:
        """Some of them, in an order."""
        still = {arc: [branch[pick] for branch in branches] for arc, branches in self.still.items()}
        return Draws(self.suspect, self.tool, self.base.of(pick), self.rows[pick], self.values[pick], still)

    def pieces(self) -> list[Draws]:
        """As many at a time as stay in the cache."""
        every = np.arange(len(self.rows))
        return [self.of(every[begin : begin + _PIECE]) for begin in range(0, max(len(every), 1), _PIECE)]

    def changed(self, at: Condition, depth: float) -> Drawn:
        """With the suspect's change at a condition and a depth in m."""
        return self.suspect.changed(self.base, self.values, at.speed, depth)

    def share(self, at: Condition) -> None:
        """Compute ``still`` of an arc of cut, where it serves at other speeds as well."""
        if self.suspect.by_speed or self.suspect.by_depth or at.cutting in self.still:
            return
        parts = []
        for piece in self.pieces():
            changed = piece.changed(at, np.nan)
            if np.any(changed.damping + (at.cutting.process_damping or 0.0)):
                return
            parts.append(still(piece.tool.response(changed, piece.rows), at, changed.tangential, changed.normal))
        self.still[at.cutting] = [np.concatenate(branch) for branch in zip(*parts, strict=True)]


def distances(draws: Draws, place: Place) -> tuple[Array, Array, Array]:
    """ln(b_lim/b) and the frequency of chatter in Hz at every depth of a place, (draws, depths), and that frequency at
    the border, (draws,)."""
    if not exact(draws.tool, place.at):
        draws.share(place.at)
    apart, frequency, at_border = (
        np.concatenate(parts) for parts in zip(*(_of_piece(piece, place) for piece in draws.pieces()), strict=True)
    )
    return apart, frequency, at_border


def surely(draws: Draws, at: Condition, ladder: Array) -> Array:
    """ln(b_lim/b) at depths in m, (draws, depths), of any milling cutter by multipliers; takes long."""
    changed = draws.changed(at, float(np.mean(ladder)))
    return by_multipliers(draws.tool, at, changed, draws.rows, ladder, np.zeros((len(draws.rows), len(ladder))))[0]


def _of_piece(draws: Draws, place: Place) -> tuple[Array, Array, Array]:
    """`distances` of as many draws as stay in the cache."""
    suspect, tool, base, rows, at, ladder = draws.suspect, draws.tool, draws.base, draws.rows, place.at, place.depths
    if not exact(tool, at):
        changed = draws.changed(at, float(np.mean(ladder)))
        rough = of_zero_order(tool, at, changed, rows, draws.still.get(at.cutting))
        return told(*rough, changed, ladder, place.exactness, place.number)
    asked = asked_of(ladder)
    grown, angle = np.zeros((len(rows), len(asked))), np.zeros((len(rows), len(asked)))
    arc, found, changed = arc_of(at, max(tool.highest, suspect.highest)), None, base
    for k, depth in enumerate(asked):
        if found is None or suspect.by_depth:
            changed = draws.changed(at, float(depth))
            found = pass_of(changed, tool.direct[rows], at, arc, tool.axes)
        grown[:, k], angle[:, k] = _grown(found, changed, at, np.full(len(rows), float(depth)))
    repeats = at.tooth_frequency if changed.active is None else at.speed / 60
    apart = to_border(grown, ladder, changed.poles[:, tool.felt()], at.tooth_frequency)
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


def first_border(place: Place, apart: Array) -> Array:
    """The lowest border in m among the depths of a place, (draws,); beyond the ends by what is told there."""
    inside = np.argmax(apart <= 0, axis=1)
    any_below = np.any(apart <= 0, axis=1)
    at = np.where(any_below, inside, apart.shape[1] - 1)
    return np.asarray(place.depths[at] * np.exp(apart[np.arange(len(apart)), at]))
