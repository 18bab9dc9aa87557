"""How the candidates of a trace fared, as bars: the share of the excess that each removes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.shown.pictures import AFTER

if TYPE_CHECKING:
    from jointlib.loop.answer.report import Candidate

_INK = "#1b1f24"
_MOST_CANDIDATES = 10
_COLOURS = {"accepted": AFTER, "tied": "#6ea3d0"}
"""By status; the others are grey."""


def draw_candidates(axes: Any, rows: Sequence[Candidate]) -> bool:
    """A bar for each, the first at the foot; whether one has an interval."""
    intervals = False
    for i, c in enumerate(rows):
        share, half = 100 * c.share_of_current, 100 * half_width(c)
        axes.barh(i, np.clip(share, 0, 110), height=0.6, color=_COLOURS.get(c.status.value, "#d1d5db"))
        end = np.clip([share - half, share + half], 0, 110)
        if half > 0 and share > 0:
            axes.plot(end, [i, i], color=_INK, linewidth=1.6, solid_capstyle="butt")
            intervals = True
        removed = f"{share:.1f} %" if share > 0 else "nothing"
        axes.text(end[1] + 1.5, i, f"{removed}, {c.status.value}", va="center", fontsize=8.5)
    axes.set_yticks(range(len(rows)), [name_of(c) for c in rows], fontsize=9)
    axes.tick_params(axis="y", length=0)
    axes.set(xlabel="share of the excess removed on data left out of the fit [%]", xlim=(0, 140))
    axes.set_xticks(range(0, 101, 20))
    axes.grid(axis="y", visible=False)
    return intervals


def shown_candidates(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The leading candidates, and those accepted or tied whatever their rank."""
    ranked = sorted(candidates, key=lambda c: c.rank)
    keep = [c for c in ranked if c.status.value in _COLOURS]
    others = [c for c in ranked if c not in keep][: max(3, _MOST_CANDIDATES - len(keep))]
    return sorted([*keep, *others], key=lambda c: c.rank)


def half_width(c: Candidate) -> float:
    """Half the 95 % interval of the share removed, from z or its standard error; 0 where there is neither."""
    z, error = c.significance.get("z"), c.significance.get("share_error", 0.0)
    half = 1.96 * (abs(c.share_of_current / z) if z else error)
    return half if np.isfinite(half) else 0.0


def name_of(c: Candidate) -> str:
    """Family, member and place."""
    name = c.family if c.member in ("", c.family) else f"{c.family} ({c.member})"
    return f"{name} at {c.where}" if c.where else name
