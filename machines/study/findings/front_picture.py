"""Designs of a study over two of its objectives: the front, the best, the limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array
from jointlib.shown.pictures import AFTER, BEFORE, FLOOR, MEASURED

from ..study import Constraint, Study
from ..words import headed, shown_unit

if TYPE_CHECKING:
    from .verdict import Verdict

_AROUND = 5.0
"""Spans of the front that a picture shows on either side of it."""
_RULED_OUT = "#e5a98c"


def draw_front(axes: Any, study: Study, verdict: Verdict, q: str, joined: bool = True) -> NDArray[np.bool_]:
    """The first objective over another one, ``q``; which designs lie outside the picture.

    The front is ``joined`` to a staircase where it is one of these two objectives alone.
    """
    main, goals = study.objectives[0].quantity, {o.quantity: o.goal for o in study.objectives}
    x, y = (np.mean(verdict.ranking.worst[of], axis=1) * shown_unit(of)[1] for of in (q, main))
    front, out = [d.number for d in verdict.front], ~verdict.ranking.allowed
    axes.plot(x[~out], y[~out], "o", color=FLOOR, alpha=0.6, markersize=4, markeredgewidth=0, label="designs")
    axes.plot(x[out], y[out], "x", color=_RULED_OUT, markersize=4, label="ruled out" if out.any() else None)
    along = sorted(front, key=lambda i: (x[i], y[i]))
    step = "steps-post" if goals[q] == "min" else "steps-pre"
    style: dict[str, Any] = {"drawstyle": step, "linewidth": 1.0} if joined else {}
    line = "-" if joined else ""
    axes.plot(x[along], y[along], f"o{line}", color=AFTER, markersize=6, label="beaten by no other", **style)
    if verdict.best is not None:
        i = verdict.best.number
        axes.plot(x[i], y[i], "*", color=BEFORE, markersize=17, label="the best", zorder=5)
    outside = _close_to(axes, x, y, along)
    for c in study.constraints:
        _limit(axes, c, q, main)
    axes.set(xlabel=headed(q), ylabel=headed(main))
    return outside


def draw_ranked(axes: Any, study: Study, verdict: Verdict) -> None:
    """The first objective of the designs that meet the constraints, best first."""
    main = study.objectives[0].quantity
    values = np.mean(verdict.ranking.worst[main], axis=1)[verdict.ranking.order] * shown_unit(main)[1]
    axes.plot(np.arange(1, len(values) + 1), values, "o", color=AFTER, markersize=4)
    axes.set(xlabel="rank of the design", ylabel=headed(main))


def _close_to(axes: Any, x: Array, y: Array, front: Sequence[int]) -> NDArray[np.bool_]:
    """Leave no more room around the front than lets it be seen; which designs lie outside."""
    outside = np.zeros(len(x), dtype=bool)
    for values, set_ends in ((x, axes.set_xlim), (y, axes.set_ylim)):
        span = float(np.ptp(values[front])) if len(front) else 0.0
        if np.isfinite(span) and span > 0:
            low, high = np.min(values[front]), np.max(values[front])
            inside = (values >= low - _AROUND * span) & (values <= high + _AROUND * span)
            if np.any(np.isfinite(values) & ~inside):
                set_ends(np.min(values[inside]) - 0.05 * span, np.max(values[inside]) + 0.05 * span)
                outside |= np.isfinite(values) & ~inside
    return outside


def _limit(axes: Any, c: Constraint, x: str, y: str) -> None:
    """The limit of a constraint as a line, and the forbidden side in grey."""
    draw = {x: (axes.axvline, axes.axvspan, axes.get_xlim), y: (axes.axhline, axes.axhspan, axes.get_ylim)}
    if c.quantity not in draw:
        return
    line, span, ends = draw[c.quantity]
    low, high = ends()
    scale = shown_unit(c.quantity)[1]
    for value, outside in ((c.at_least * scale, low), (c.at_most * scale, high)):
        if np.isfinite(value):
            line(value, color=MEASURED, linewidth=1.2, linestyle="--")
            if low < value < high:
                span(min(value, outside), max(value, outside), color=FLOOR, alpha=0.15, linewidth=0)
    (axes.set_xlim if c.quantity == x else axes.set_ylim)(low, high)
