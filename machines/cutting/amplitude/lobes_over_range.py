"""The lowest limit of an exact chart over its whole range of speeds, dips between its lines included.

A period doubling may cut a dip into the boundary that is narrower than the spacing of the lines, where a chatter that
is not the first one on either side passes half a tooth frequency. So four things are looked at: intervals over which
the lobe, the kind or ⌊2·f_c/f_T⌋ of the chatter changes, at the speed at which both limits meet or in the middle; a
Hopf chatter is met where it passes half a tooth frequency; a chatter f that is lowest somewhere is looked for again at
every speed of the range at which it stands alike to the teeth, f_T = f/(k + ψ) and 2·f/k, but where its lobe is known
on both sides; and every low place is closed in, by the parabola through its own chatter.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import CheckFailed
from jointlib.shown.progress import each, remark
from jointlib.system.processes import on_every_core

from ...model.machine import Machine
from ..process.chart import BY_SPEED, StabilityLobes, joined
from ..process.cutting import Cutting
from ..rest import dips
from ..rest.periodic import AT_SPEEDS
from .frozen_lobes import lobes_at_amplitude

_HALVINGS = 5
_HALVES = 3
"""Times that a Hopf chatter is met at half of the teeth."""
_CLOSER = 12
_FEWEST = 3
_TRIED = 5
"""Speeds that tell how long all of them take."""
_HURRIED = 0.1
"""Share of the budget that the speeds take from which on what is left goes to the lowest place first."""
_LONG = 60.0
"""Seconds from which on that is said before the others are begun."""


def lobes_over_range(
    machine: Machine,
    speed: ArrayLike,
    amplitude: float = 0.0,
    method: str | None = None,
    budget: float = np.inf,
    *,
    every: bool = False,
) -> StabilityLobes:
    """`lobes_at_amplitude` over a range of speeds (rpm, ascending): what dips between them is among them as well.

    Once ``budget`` (s) is spent the chart ends with the speeds that are known, spread over the range, and says so. A
    speed at which the method does not settle is left out, and that is said. With ``every`` it keeps every speed that
    was looked at, not those alone at which the limit dips.
    """
    speeds, deadline = np.ravel(np.asarray(speed, dtype=float)), time.monotonic() + budget
    refused: dict[float, str] = {}

    def charted(further: Array) -> StabilityLobes:
        return lobes_at_amplitude(machine, further, amplitude, method)

    def at(further: Array) -> StabilityLobes:
        chart, left_out = settled(charted, further)
        refused.update(left_out)
        if chart is None:
            raise CheckFailed(next(iter(left_out.values())))
        return chart

    tried = np.unique(np.linspace(0, speeds.size - 1, _TRIED).round().astype(int))
    begun = time.monotonic()
    chart, hurried = at(speeds if not np.isfinite(budget) else speeds[tried]), False
    if chart.speed.size < speeds.size:
        needed = (time.monotonic() - begun) * speeds.size / tried.size
        slow, hurried = needed > budget / 2 and not chart.branches, needed > _HURRIED * budget
        if needed > _LONG and not chart.branches:
            faster = "multi-frequency is faster, " if chart.method == "collocation" and not _plain(machine) else ""
            long = f"{speeds.size} speeds by {chart.method} take about {needed:.0f} s"
            remark(f"{long}; {faster}zero-order is a fast preview")
        chart = _until(chart, np.delete(speeds, tried), charted, deadline, refused) if slow else at(speeds)
    if chart.branches or chart.speed.size < _FEWEST:
        return without(chart, refused)  # closed forms have the minimum over every speed
    missing = speeds.size - chart.speed.size - np.count_nonzero(np.isin(list(refused), speeds))
    known = speeds.size - missing
    chart = over_the_range(chart, charted, deadline, hurried, every, refused)
    if AT_SPEEDS not in chart.notes and not missing:
        return chart
    short = f"Time was up after {budget:.3g} s: " + (
        f"{known} of {speeds.size} speeds are computed, spread over the range; the others are left out, and what dips "
        "between them was not looked for."
        if missing
        else f"of what dips between the {speeds.size} speeds not all was looked for."
    )
    notes = tuple(dict.fromkeys((*chart.notes, AT_SPEEDS)))
    left_out = tuple(np.setdiff1d(speeds, [*chart.speed, *refused]).tolist())
    return replace(chart, minimum_at=None, notes=notes, warnings=(*chart.warnings, short), left_out=left_out)


def _plain(machine: Machine) -> bool:
    """Whether the cutter has equal pitches, no helix and no flank that rubs."""
    return Cutting(**dict(machine.cutting or {})).plain


def without(chart: StabilityLobes, refused: Mapping[float, str]) -> StabilityLobes:
    """The chart with what is to be said of speeds (rpm) that were refused."""
    if not refused:
        return chart
    rpm, said = next(iter(refused.items()))
    many = f"{len(refused)} speeds, the first of them {rpm:g} rpm," if len(refused) > 1 else f"{rpm:g} rpm"
    left_out = f"No depth was found at {many} and the chart goes on without: {said}"
    return replace(chart, warnings=(*chart.warnings, left_out))


def farthest(speed: Array, known: Array) -> int:
    """Index of the speed (rpm) farthest from any that is known."""
    return int(np.argmax(np.min(np.abs(speed[:, None] - known), axis=1)))


def _until(
    chart: StabilityLobes,
    speeds: Array,
    charted: Callable[[Array], StabilityLobes],
    deadline: float,
    refused: dict[float, str],
) -> StabilityLobes:
    """The chart with further speeds, those farthest from any that is known first, until the deadline."""

    def spread(left: Array) -> Iterator[Array]:
        taken = chart.speed
        while len(left) and time.monotonic() < deadline:
            following = farthest(left, taken)
            yield left[[following]]
            taken, left = np.append(taken, left[following]), np.delete(left, following)

    known, further = [chart], each("speeds", spread(speeds), len(speeds))
    for one, left_out in on_every_core(partial(settled, charted), further, len(speeds)):
        refused.update(left_out)
        if one is not None:
            known.append(one)
    return joined(known)


def settled(
    charted: Callable[[Array], StabilityLobes], speeds: Array
) -> tuple[StabilityLobes | None, dict[float, str]]:
    """The chart at those of some speeds (rpm) at which the method settles, and what is said of the others."""
    try:
        return charted(speeds), {}
    except CheckFailed as error:
        if speeds.size < 2:
            return None, {float(speeds[0]): str(error)}
    # A speed that does not settle takes no other with it.
    halves = [settled(charted, half) for half in np.array_split(speeds, 2)]
    charts = [chart for chart, _ in halves if chart is not None]
    return joined(charts) if charts else None, {rpm: said for _, refused in halves for rpm, said in refused.items()}


def over_the_range(
    chart: StabilityLobes,
    charted: Callable[[Array], StabilityLobes],
    deadline: float = np.inf,
    hurried: bool = False,
    every: bool = False,
    refused: dict[float, str] | None = None,
) -> StabilityLobes:
    """The chart with the lowest place of every interval that dips below both its ends, and the minimum over all speeds.

    ``chart`` has ascending speeds and comes from a method that computes speed by speed; ``charted`` computes further
    ones, until a ``deadline`` by `time.monotonic`; where that came before the end the minimum is the lowest that was
    seen. ``hurried`` closes in on the lowest place before all else; ``every`` speed that was computed may be kept;
    ``refused`` are speeds at which the method did not settle, and why.
    """
    grid, whole, refused = chart.speed.ravel(), True, {} if refused is None else refused
    known = {key: getattr(chart, key).ravel() for key in BY_SPEED}

    def join(speeds: Array) -> None:
        parts = [speeds] if deadline == np.inf else _lowest_first(known, speeds)[:, None]

        def before_the_end() -> Iterator[Array]:
            nonlocal whole
            for part in parts:
                if time.monotonic() > deadline:
                    whole = False
                    return
                yield part

        between = each("speeds between them", before_the_end(), len(parts))
        for more, left_out in on_every_core(partial(settled, charted), between, len(parts)):
            refused.update(left_out)
            if more is None:
                continue
            order = np.argsort(np.concatenate([known["speed"], more.speed.ravel()]), kind="stable")
            for key in BY_SPEED:
                known[key] = np.concatenate([known[key], getattr(more, key).ravel()])[order]

    def close_in(near: float) -> None:
        for _ in range(_CLOSER):
            closer = dips.beside(known, near)
            if not len(closer):
                break
            join(closer)

    if hurried:
        close_in(dips.AS_LOW)
    # Of a mean cut no chatter doubles the period of the teeth: its lobes are alike, and are met by that.
    mean = chart.method in ("turning", "zero-order")
    for _ in range(0 if mean else _HALVINGS):
        if not len(between := dips.changes(known, chart.cuts_per_revolution)):
            break
        join(between)
    for _ in range(0 if mean else _HALVES):
        if not len(half := dips.half(known, chart.cuts_per_revolution)):
            break
        join(half)
    again = dips.alike(known, chart.cuts_per_revolution, mean)
    if len(again):
        join(again)
    close_in(dips.AS_LOW if mean else dips.NEAR)
    kept = np.isin(known["speed"], grid) | dips.hidden(known, grid) | every
    values = {key: known[key][kept] for key in BY_SPEED}
    row = int(np.argmin(known["depth"]))
    lowest, frequency, rpm = (float(known[key][row]) for key in ("depth", "chatter_frequency", "speed"))
    waves = 60 * frequency / (chart.cuts_per_revolution * rpm)
    chart = replace(
        chart,
        **values,
        minimum_depth=lowest,
        minimum_frequency=frequency,
        minimum_phase=waves % 1,
        minimum_at=rpm if whole and np.isfinite(lowest) else None,
        notes=tuple(note for note in chart.notes if note != AT_SPEEDS or not whole),
    )
    return without(chart, refused)


def _lowest_first(known: dict[str, Array], speeds: Array) -> Array:
    """Further speeds in the order of what is known beside them."""
    after = np.clip(np.searchsorted(known["speed"], speeds), 1, len(known["speed"]) - 1)
    return speeds[np.argsort(np.minimum(known["depth"][after - 1], known["depth"][after]), kind="stable")]
