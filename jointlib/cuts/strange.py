"""What only looks wrong with test cuts: units, repeats that contradict each other, what cannot be heard."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from jointlib.cuts.tried_cut import TriedCut

_AUDIBLE = 20e3
"""Hz; no structure of a machine is lively above it."""
_CRAWL = 5.0
"""Hz; no machine chatters below it."""
_SLIP = 5.0
"""Times the fastest of all other cuts, or their slowest, from which on a speed has a digit too many or too few."""
_WAVES = 100.0
"""Of chatter between two teeth, where nothing is known of the diameter: at 100 rpm a mill of 200 mm leaves 20."""
_SHORTEST = 5e-5
"""m of cutting speed in a period of chatter, below which the flank of any edge damps it out."""
_TURNS = 15.0
"""rpm below which no mill turns; one of 0.5 m has 30 in steel."""
_PITCH, _MANY = 1e-3, 12
"""m between the teeth of a cutter of more than so many."""
_SAME_SPEED, _SAME_DEPTH = 5e-3, 1e-2
"""Of the value: cuts that are no further apart are repeats."""


def strange(cuts: Sequence[TriedCut], rate: float | None = None, diameter: float | None = None) -> list[str]:
    """Sentences on cuts in SI, of records at ``rate`` in Hz, of ``diameter`` in m where a cut tells none."""
    return list(
        dict.fromkeys(
            [*_slow(cuts, diameter), *_alone(cuts), *_crowded(cuts, diameter), *_high(cuts, rate), *_both(cuts)]
        )
    )


def _slow(cuts: Sequence[TriedCut], diameter: float | None) -> Iterator[str]:
    """Speeds that were meant in Hz: chatter of waves that no flank follows, or the crawl of no mill."""
    milled = [cut for cut in cuts if cut.process == "milling"]
    if milled and max(cut.speed for cut in milled) < _TURNS:
        yield f"speeds up to {max(cut.speed for cut in milled):g} rpm are those of no mill: {_in_hz(milled[0])}"
        return
    for cut in milled:
        f, d = cut.chatter_frequency, cut.diameter or diameter
        if f is None:
            continue
        waves, long = f / cut.tooth_frequency, math.inf if d is None else math.pi * d * cut.speed / 60 / f
        if d is None and cut.teeth > 1 and waves > _WAVES:
            yield f"{cut.name}: chatter at {f:g} Hz is {waves:.3g} waves between two teeth: {_in_hz(cut)}"
            return
        if long < _SHORTEST:
            yield f"{cut.name}: chatter at {f:g} Hz leaves waves of {1e6 * long:.2g} um, expected more: {_in_hz(cut)}"
            return


def _alone(cuts: Sequence[TriedCut]) -> Iterator[str]:
    """The one speed that is far from all others."""
    speeds = sorted({cut.speed for cut in cuts})
    if len(speeds) < 3:
        return
    for one, near, rest in ((speeds[0], speeds[1], speeds[1:]), (speeds[-1], speeds[-2], speeds[:-1])):
        if max(one / near, near / one) >= _SLIP:
            (cut, *_) = (cut for cut in cuts if cut.speed == one)
            others = f"all others {rest[0]:g} to {rest[-1]:g} rpm"
            yield f"{cut.name}: {one:g} rpm, {others}: has it a digit too many or too few?"


def _in_hz(cut: TriedCut) -> str:
    return f'was the speed meant in Hz? Then write "{cut.speed:g} Hz"'


def _crowded(cuts: Sequence[TriedCut], diameter: float | None) -> Iterator[str]:
    for cut in cuts:
        d = cut.diameter or diameter
        if cut.process == "milling" and d is not None and cut.teeth > _MANY and math.pi * d / cut.teeth < _PITCH:
            yield (
                f"{cut.teeth} teeth on a cutter of {1e3 * d:g} mm stand {1e3 * math.pi * d / cut.teeth:.2g} mm apart: "
                "is the number of teeth right?"
            )


def _high(cuts: Sequence[TriedCut], rate: float | None) -> Iterator[str]:
    for cut in cuts:
        f = cut.chatter_frequency
        if f is not None and cut.record is not None and rate is not None and f > rate / 2:
            yield f"{cut.name}: chatter at {f:g} Hz is above half of the sample_rate of its record, {rate / 2:g} Hz"
        elif f is not None and f < _CRAWL:
            yield f'{cut.name}: no machine chatters at {f:g} Hz: was it meant in kHz? Then write "{f:g} kHz"'
        elif f is not None and f > _AUDIBLE:
            yield f"{cut.name}: chatter at {f:g} Hz is above what is heard or what a machine does, {_AUDIBLE:g} Hz"


def _both(cuts: Sequence[TriedCut]) -> Iterator[str]:
    """Repeats of which one was stable and one was not."""
    for one, other in combinations([cut for cut in cuts if cut.verdict in ("stable", "chatter")], 2):
        if one.verdict != other.verdict and _repeats(one, other):
            calm, loud = (one, other) if one.verdict == "stable" else (other, one)
            alike = "twice" if calm.name == loud.name else f"as {loud.name} too"
            yield (
                f"{calm.name} was made {alike}, once stable and once with chatter: is it near its limit, worn or "
                "clamped anew, or is one row a slip?"
            )


def _repeats(one: TriedCut, other: TriedCut) -> bool:
    alike = all(getattr(one, key) == getattr(other, key) for key in ("teeth", "mode", "immersion", "feed", "process"))
    near = math.isclose(one.speed, other.speed, rel_tol=_SAME_SPEED)
    return alike and near and math.isclose(one.depth, other.depth, rel_tol=_SAME_DEPTH)
