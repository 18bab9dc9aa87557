"""What a trace of cuts is about: the cuts, the places where they were made, and the tool that made them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.cuts.tried_cut import TriedCut

from ..indices import Index
from ..model.machine import Machine
from .borders import Condition
from .distances import Place, exact
from .exactness import Exactness, learnt
from .sampled_tool import SampledTool


@dataclass(frozen=True, eq=False)
class Problem:
    """The cuts, where they were made, and the tool that made them."""

    cuts: tuple[TriedCut, ...]
    places: tuple[Place, ...]
    index: Index
    """The place of each cut."""
    tool: SampledTool
    exactness: Exactness | None
    seed: int

    def scatter(self, k: int) -> float:
        """Of ln b_lim at a place, by what the method of its borders misses."""
        return 0.0 if self.exactness is None else float(self.exactness.scatter[k])

    def flips(self, k: int) -> bool:
        """Whether what was learnt tells the chatter of a place to be a flip; multipliers tell flips themselves."""
        return self.exactness is not None and bool(self.exactness.flip[k])


def problem_of(
    cuts: tuple[TriedCut, ...],
    conditions: Sequence[Condition],
    index: Index,
    machine: Machine,
    tool: SampledTool,
    seed: int,
) -> Problem:
    """The cuts at their places, with what has to be learnt of borders where multipliers do not tell them."""
    told = all(exact(tool, at) for at in conditions)
    learned = None if told else learnt(machine, tool, conditions, seed)
    depths = [
        np.unique([cut.depth for cut, where in zip(cuts, index, strict=True) if where == k])
        for k in range(len(conditions))
    ]
    places = tuple(Place(at, depths[k], k, learned) for k, at in enumerate(conditions))
    return Problem(cuts, places, index, tool, learned, seed)
