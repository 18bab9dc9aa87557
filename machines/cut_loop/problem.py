"""What a trace of cuts is about: the cuts, the places where they were made, and the tool that made them."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.cuts.tried_cut import TriedCut
from jointlib.errors import CheckFailed, InputError

from ..cutting.forced.forced_vibration import forced_vibration
from ..indices import Index
from ..model.machine import Machine
from .borders import Condition
from .distances import Place, exact
from .evidence import unheard
from .exactness import Exactness, learnt
from .sampled_tool import SampledTool


@dataclass(frozen=True, eq=False)
class Problem:
    """The cuts, where they were made, and the tool that made them."""

    cuts: tuple[TriedCut, ...]
    places: tuple[Place, ...]
    index: Index
    """The place of each cut."""
    unheard: Array
    """Share in which chatter like that of each cut is heard only deeper."""
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
    sung = {int(k) for cut, k in zip(cuts, index, strict=True) if cut.chatter_frequency is not None}
    places = tuple(Place(at, depths[k], k, learned, k in sung) for k, at in enumerate(conditions))
    late = unheard(_shaken(machine, cuts, conditions, index))
    return Problem(cuts, places, index, late, tool, learned, seed)


def _shaken(machine: Machine, cuts: Sequence[TriedCut], conditions: Sequence[Condition], index: Index) -> Array:
    """Forced vibration of the machine as it is, in feeds per tooth, (cuts,); 0 where it has none or none is known."""
    found = np.zeros(len(cuts))
    for k, at in enumerate(conditions):
        here = np.flatnonzero(index == k)
        depth = [cuts[int(i)].depth for i in here]
        table = {one.name: getattr(at.cutting, one.name) for one in fields(at.cutting) if one.init}
        with contextlib.suppress(InputError, CheckFailed):
            moved = forced_vibration(replace(machine, cutting=table), at.speed, depth).amplitude
            found[here] = np.nan_to_num(moved) / table["feed"]
    return found
