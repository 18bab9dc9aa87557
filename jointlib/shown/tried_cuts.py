"""Test cuts as a table and as marks on a chart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.shown.result import Columns

if TYPE_CHECKING:
    from jointlib.cuts.tried_cut import TriedCut

_MARKS = {"stable": "o", "marginal": "^", "chatter": "x", "unknown": ".", None: "."}


def cut_columns(cuts: Sequence[TriedCut]) -> Columns:
    """A row per cut."""
    return {
        "cut": ([cut.name for cut in cuts], ""),
        "speed": ([cut.speed for cut in cuts], "rpm"),
        "depth": ([cut.depth for cut in cuts], "m"),
        "verdict": ([cut.verdict or "" for cut in cuts], ""),
        "chatter_frequency": ([cut.chatter_frequency or np.nan for cut in cuts], "Hz"),
    }


def draw_cuts(axes: Any, cuts: Sequence[TriedCut]) -> None:
    """Cuts over speed in rpm and depth in mm, a mark by verdict."""
    for verdict, mark in _MARKS.items():
        some = [cut for cut in cuts if cut.verdict == verdict]
        if some:
            axes.plot([c.speed for c in some], [1e3 * c.depth for c in some], mark, label=verdict or "by its record")
    axes.set(xlabel="spindle speed [rpm]", ylabel="depth of cut [mm]", ylim=(0.0, None))
    axes.legend()


def told_cuts(cuts: Sequence[TriedCut]) -> str:
    """How many cuts, and of which verdict by the file."""
    counts = {word: sum(cut.verdict == word for cut in cuts) for word in ("stable", "chatter", "marginal")}
    words = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    return f"{len(cuts)}" + (f" ({words} by the file)" if words else "")
