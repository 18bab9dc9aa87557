"""Pictures of a study: designs over two objectives, effects, what separates two designs, how sure a ranking is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.shown.pictures import literal

from ...study.findings.contrast import Contrast
from ...study.findings.effects import Effect
from ...study.findings.front_picture import draw_front
from ...study.findings.verdict import Verdict
from ...study.study import Study
from ...study.words import headed, named, shown_unit, wanted
from ..drawing import AFTER, BEFORE, FLOOR, MEASURED, sheet
from ..page import Figure

_PANELS = 5
_ORDINALS = ("the first", "the second", "the third", "the fourth", "the fifth")


def pareto_figure(study: Study, verdict: Verdict) -> Figure:
    """All designs over the first objective and each further one; the front, the best, the limits."""
    pairs = [o.quantity for o in study.objectives[1:]][:3]
    left_out = np.zeros(len(verdict.ranking.allowed), dtype=bool)
    with sheet(1, len(pairs), width=9.0, height=4.2 * len(pairs), squeeze=False) as paper:
        for axes, q in zip(paper.axes[:, 0], pairs, strict=True):
            left_out |= draw_front(axes, study, verdict, q, joined=len(pairs) == 1)
            axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    counted = " in its worst case" * (len(study.cases) > 1) + _averaged(study)
    said = f"Every design{counted}. Wanted: {wanted(study.objectives)}."
    if left_out.any():
        said += f" Outside the picture, far worse: {int(left_out.sum())} of {len(left_out)} designs."
    return Figure(paper.svg, said)


def _averaged(study: Study) -> str:
    return ", on average over what is uncertain" if study.uncertain else ""


def effects_figure(quantity: str, effects: Sequence[Effect]) -> Figure:
    """Shares of the variance of an objective by factor, and its mean over the values of the strongest ones."""
    ranked = sorted(effects, key=lambda e: e.first if e.total is None else e.total)
    strongest = ranked[::-1][:_PANELS]
    labels = [literal(e.factor.name) for e in ranked]
    columns = 1 + len(strongest)
    height = max(2.9, 0.55 * len(ranked) + 1.3)
    ratios = [1.7, *([1.0] * len(strongest))]
    with sheet(columns, width=max(6.5, 2.6 + 1.9 * columns), height=height, width_ratios=ratios) as paper:
        bars, *panels = paper.axes
        y = np.arange(len(ranked))
        with_total = all(e.total is not None for e in ranked)
        if with_total:
            bars.barh(y - 0.19, [100 * (e.total or 0.0) for e in ranked], 0.36, color=FLOOR, label="with interactions")
        bars.barh(y + (0.19 if with_total else 0), [100 * e.first for e in ranked], 0.36, color=AFTER, label="alone")
        bars.set_yticks(y, labels)
        bars.set(xlabel="share of the variance [%]")
        bars.set_xlim(left=0)
        bars.grid(axis="y", visible=False)
        bars.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=8.5, borderaxespad=0.2)
        scale = shown_unit(quantity)[1]
        means = np.concatenate([e.mean for e in strongest]) * scale
        room = 0.08 * float(np.ptp(means)) or abs(float(means[0])) * 0.05 or 1.0
        for axes, effect in zip(panels, strongest, strict=True):
            _levels(axes, effect, scale)
            axes.set_ylim(float(means.min()) - room, float(means.max()) + room)
            if axes is not panels[0]:
                axes.tick_params(labelleft=False)
        panels[0].set_ylabel(headed(quantity))
    said = f"What the {named(quantity)} depends on. Left: the share of its variance over all designs that each factor"
    said += " explains alone and with every interaction it takes part in." if with_total else " explains alone."
    return Figure(paper.svg, f"{said} Right: its mean over all designs with that value of the factor.")


def _levels(axes: Any, effect: Effect, scale: float) -> None:
    x: Array = effect.place
    words = [literal(word) for word in effect.words]
    listed = bool(effect.factor.choices)
    axes.plot(x, effect.mean * scale, "o-" if not listed or len(x) > 2 else "o:", color=AFTER, markersize=5)
    if listed:
        tilted = max(map(len, words)) > 6
        axes.set_xticks(x, words, rotation=30 if tilted else 0, ha="right" if tilted else "center")
        axes.set_xlim(x[0] - 0.4, x[-1] + 0.4)
    else:
        axes.set_xlabel(f"[{effect.factor.unit}]" if effect.factor.unit else "")
        axes.locator_params(axis="x", nbins=3)
    axes.set_title(literal(effect.factor.name), fontsize=10)


def contrast_figure(found: Contrast) -> Figure:
    """From the first design to the second, one factor at a time, as a waterfall."""
    quantity = found.objective.quantity
    scale = shown_unit(quantity)[1]
    steps = [(literal(f"{e.factor}: {e.first} → {e.second}"), e.change) for e in found.exchanges]
    steps.append(("acting together", found.remainder))
    with sheet(width=9.0, height=1.5 + 0.42 * (len(steps) + 2)) as paper:
        axes = paper.axes
        labels = ["the first", *(word for word, _ in steps), "the other"]
        at, reached = np.arange(len(labels)), found.first * scale
        axes.plot([reached, reached], [-0.35, 0.35], color=AFTER, linewidth=3)
        for i, (_, change) in enumerate(steps, start=1):
            worse = (change < 0) == (found.objective.goal == "max")
            axes.barh(i, change * scale, 0.6, left=reached, color=BEFORE if worse else AFTER)
            axes.plot([reached, reached], [i - 1 + 0.35, i + 0.3], color=MEASURED, linewidth=0.8)
            reached += change * scale
        axes.plot([reached, reached], [len(steps) + 0.3, len(steps) + 1.35], color=MEASURED, linewidth=3)
        axes.set_yticks(at, labels)
        axes.invert_yaxis()
        axes.use_sticky_edges = False
        axes.margins(x=0.12)
        axes.grid(axis="y", visible=False)
        axes.set(xlabel=headed(quantity))
    return Figure(
        paper.svg,
        "From the first design to the other: each factor of the other put into the first by itself, orange where "
        "that is worse, blue where it is better, and what they do together beyond that.",
    )


def certainty_figure(study: Study, verdict: Verdict) -> Figure:
    """The leading designs over the samples of what is uncertain."""
    quantity = study.objectives[0].quantity
    scale = shown_unit(quantity)[1]
    rows = [verdict.ranking.worst[quantity][d.number] * scale for d in verdict.leading]
    with sheet(width=9.0, height=1.3 + 0.5 * len(rows)) as paper:
        axes = paper.axes
        lines = {f"{part}props": {"color": AFTER, "linewidth": 1.2} for part in ("box", "whisker", "cap")}
        lines["medianprops"] = {"color": BEFORE, "linewidth": 1.8}
        axes.boxplot(rows, orientation="horizontal", widths=0.5, whis=(0, 100), showfliers=False, **lines)
        for i, values in enumerate(rows, start=1):
            axes.plot(values, np.full(len(values), float(i)), "o", color=MEASURED, markersize=3, alpha=0.5)
        axes.set_yticklabels([_ORDINALS[i] for i in range(len(rows))])
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set(xlabel=headed(quantity))
    return Figure(
        paper.svg,
        "The leading designs over the same samples of what is uncertain: dots the samples, box the middle half, line "
        "the median, whiskers the ends.",
    )


def map_figure(study: Study, quantity: str, axes_moved: Sequence[str], values: Array) -> Figure:
    """A quantity over the positions of one axis (a curve per design) or two (a field of the first design).

    ``values`` is (designs, positions of the first axis[, of the second]), SI.
    """
    places = [sorted({case.position[axis] for case in study.cases}) for axis in axes_moved]
    scaled = values * shown_unit(quantity)[1]
    mm = [np.array(p) * 1e3 for p in places]
    moved = [f"{literal(axis)} [mm]" for axis in axes_moved]
    with sheet(width=7.5, height=4.2 if len(places) > 1 else 3.4) as paper:
        axes = paper.axes
        if len(places) == 1:
            for row, name, colour in zip(scaled, _ORDINALS, (AFTER, BEFORE, MEASURED), strict=False):
                axes.plot(mm[0], row, "o-", color=colour, markersize=5, label=name)
            axes.legend()
            axes.set(xlabel=moved[0], ylabel=headed(quantity))
        else:
            _field(axes, mm, scaled[0], headed(quantity))
            axes.set(xlabel=moved[0], ylabel=moved[1])
    what = "Curves" if len(places) == 1 else "Field"
    said = f"{what} of the {named(quantity)} over the positions of the axes{_averaged(study)}."
    return Figure(paper.svg, said)


def _field(axes: Any, mm: Sequence[Array], values: Array, label: str) -> None:
    drawn = axes.pcolormesh(np.arange(len(mm[0])), np.arange(len(mm[1])), values.T, cmap="viridis", shading="nearest")
    axes.set_xticks(np.arange(len(mm[0])), [f"{x:g}" for x in mm[0]])
    axes.set_yticks(np.arange(len(mm[1])), [f"{y:g}" for y in mm[1]])
    axes.grid(visible=False)
    middle = 0.5 * (np.nanmin(values) + np.nanmax(values))
    if values.size <= 80:
        for i, column in enumerate(values):
            for j, value in enumerate(column):
                colour = "black" if value > middle else "white"
                axes.text(i, j, f"{value:.3g}", ha="center", va="center", color=colour, fontsize=9)
    axes.figure.colorbar(drawn, ax=axes, label=label)
