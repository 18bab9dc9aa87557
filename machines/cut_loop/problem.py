"""What a trace of cuts is about: the cuts, the places where they were made, and the tool that made them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.cuts.tried_cut import TriedCut
from jointlib.errors import CheckFailed, InputError

from ..cutting.forced.forced_vibration import forced_vibration
from ..cutting.process.cutting import Cutting
from ..indices import Index
from ..model.machine import Machine
from .borders import Condition
from .distances import Place, exact
from .exactness import Exactness, learnt
from .sampled_tool import SampledTool

_FEED = 1e-4
"""m per tooth."""


@dataclass(frozen=True, eq=False)
class Problem:
    """The cuts, where they were made, and the tool that made them."""

    cuts: tuple[TriedCut, ...]
    places: tuple[Place, ...]
    index: Index
    """The place of each cut."""
    shaken: Array
    """Forced vibration of each cut in feeds per tooth."""
    tool: SampledTool
    exactness: Exactness | None
    seed: int

    def scatter(self, k: int) -> float:
        """Of ln b_lim at a place, by what the method of its borders misses."""
        return 0.0 if self.exactness is None else self.exactness.of[k].scatter

    @property
    def guessed(self) -> bool:
        """Whether multipliers could tell what is taken from zero order and what was learnt."""
        return self.exactness is not None and self.tool.modal and self.places[0].at.cutting.process == "milling"

    def flips(self, k: int) -> bool:
        """Whether what was learnt tells the chatter of a place to be a flip; multipliers tell flips themselves."""
        return self.exactness is not None and self.exactness.of[k].flip


def problem_of(
    cuts: tuple[TriedCut, ...],
    conditions: Sequence[Condition],
    index: Index,
    machine: Machine,
    tool: SampledTool,
    seed: int,
) -> Problem:
    """The cuts at their places, with what has to be learnt of borders where multipliers do not tell them."""
    depths = [
        np.unique([cut.depth for cut, where in zip(cuts, index, strict=True) if where == k])
        for k in range(len(conditions))
    ]
    told = all(exact(tool, at) for at in conditions)
    learned = None if told else learnt(machine, tool, conditions, depths, seed)
    sung = {int(k) for cut, k in zip(cuts, index, strict=True) if cut.chatter_frequency is not None}
    places = tuple(Place(at, depths[k], k, learned, k in sung) for k, at in enumerate(conditions))
    forced = np.zeros(len(cuts))
    for k, at in enumerate(conditions):
        here = np.flatnonzero(index == k)
        forced[here] = shaken(machine, at.cutting, at.speed, [cuts[int(i)].depth for i in here])
    return Problem(cuts, places, index, forced, tool, learned, seed)


def shaken(machine: Machine, cutting: Cutting, speed: ArrayLike, depth: ArrayLike) -> Array:
    """Forced vibration of the machine as it is at speeds in rpm and depths in m that broadcast, in feeds per tooth; 0
    where it has none.

    Forces of chips grow with the feed as their vibration does, so that any feed will do where none is told.
    """
    table = {one.name: getattr(cutting, one.name) for one in fields(cutting) if one.init}
    fed = replace(machine, cutting={**table, "feed": table["feed"] or _FEED})
    speed, depth = np.broadcast_arrays(speed, depth)
    found = np.zeros(speed.shape)
    try:
        found = forced_vibration(fed, speed, depth).amplitude.reshape(speed.shape)
    except (InputError, CheckFailed):
        # What a measured part refuses at one speed it may tell at others.
        different = np.unique(speed)
        for one in different if len(different) > 1 else ():
            found[speed == one] = shaken(fed, cutting, one, depth[speed == one])
        return found
    return np.asarray(np.nan_to_num(found) / fed.cutting["feed"])  # type: ignore[index]
