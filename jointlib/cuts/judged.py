"""The cuts of a measurement with what their records tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.cuts.background import background_of, rises
from jointlib.cuts.heard import Heard, told_by
from jointlib.cuts.sound import Sound, listen
from jointlib.cuts.steady import listen_to_cut
from jointlib.cuts.tried_cut import TriedCut
from jointlib.io.measurement_file import read_records
from jointlib.measurement import Measurement

_ENOUGH = 2
"""Other cuts by which the run-out of a tool is told."""
_SPEED = 0.002
"""Share by which speeds differ that are one."""
_FAINT = 0.2
"""Size of the faintest line over that of the teeth up to which a record tells of run-out."""


@dataclass(frozen=True)
class JudgedCut:
    """A cut with its verdict, and what its record said; ``heard`` is None without one."""

    cut: TriedCut
    heard: Heard | None = None
    background: tuple[str, ...] = ()
    """Sentences on lines that were left out, alike in all records that hold them."""

    def doubt(self) -> str:
        """Half a sentence where file and record disagree; empty where they do not."""
        if self.heard is None or "unknown" in (self.heard.verdict, self.cut.verdict):
            return ""
        if (self.heard.verdict == "stable") == (self.cut.verdict == "stable"):
            return ""
        share = f"{100 * self.heard.share:.0f} % of the vibration does not repeat with the revolution"
        return f"{self.cut.name}: {self.cut.verdict} by the file, {self.heard.verdict} by its record ({share})"

    def remarks(self) -> list[str]:
        """What was left out of the record, and why it does not tell more."""
        return [] if self.heard is None else [f"{self.cut.name}: {said}" for said in self.heard.said]


def heard_of(judged: Sequence[JudgedCut]) -> list[str]:
    """What was left out as background, once, and what is to be said of single records."""
    shared = dict.fromkeys(said for one in judged for said in one.background)
    return [*shared, *(said for one in judged for said in one.remarks())]


def judged_cuts(m: Measurement) -> tuple[JudgedCut, ...]:
    """Every cut of a measurement of kind ``cuts``; the channel of a record that holds most chatter tells it."""
    names = [c.name for c in m.channels if c.quantity not in ("time", "temperature")]
    recorded = [(cut, cut.record) for cut in m.cuts if cut.record is not None]
    sounds: list[dict[str, Sound]] = []
    for cut, source in recorded:
        (record,) = read_records(m, [source])
        sounds.append({
            name: listen_to_cut(signal, record.sample_rate, cut.speed, cut.teeth, f"{record.name}: {name}")
            for name, signal in record.channels.items()
            if name in names
        })  # fmt: skip
    quiet = [
        {name: listen(record.channels[name], record.sample_rate, 0.0, 1, f"{record.name}: {name}") for name in names}
        for record in read_records(m, m.with_role("quiet"))
    ]
    tried, found, k = [cut for cut, _ in recorded], [], 0
    for cut in m.cuts:
        if cut.record is None:
            found.append(JudgedCut(cut))
            continue
        told = [judged_sound(k, tried, [s[name] for s in sounds], [q[name] for q in quiet]) for name in names]
        loudest, background = max(told, key=lambda one: _loudness(one[0]))
        found.append(JudgedCut(cut.judged(loudest.verdict, loudest.chatter_frequency), loudest, background))
        k += 1
    return tuple(found)


def _loudness(told: Heard) -> tuple[bool, float, bool]:
    """By which of the channels of a record tells its cut."""
    return told.verdict in ("chatter", "marginal"), told.share, told.verdict != "unknown"


def judged_sound(
    k: int, cuts: Sequence[TriedCut], sounds: Sequence[Sound], quiet: Sequence[Sound]
) -> tuple[Heard, tuple[str, ...]]:
    """Record ``k`` of a channel with what the others, of the ``cuts`` in their order, say of shop and tool."""
    background = background_of(k, sounds, quiet)
    told = told_by(sounds[k], list(background), _run_out(k, cuts, sounds), rises(k, sounds, quiet))
    loud = {one.sentence() for line, one in background.items() if line.loud}
    return told, tuple(sorted(loud))


def _run_out(k: int, cuts: Sequence[TriedCut], sounds: Sequence[Sound]) -> float | None:
    """How large lines of the revolution that are none of the teeth are in other cuts, over those of the teeth.

    That of most of them, or of a shallower cut at the same speed if that is less: both grow with the depth alike, until
    the deeper one chatters. None where too few cuts tell.
    """
    sizes = {
        i: float(np.sqrt(max(s.half, s.others, s.faintest) / s.tooth))
        for i, s in enumerate(sounds)
        if i != k and s.teeth == sounds[k].teeth and s.faintest < _FAINT**2 * s.tooth
    }
    if len(sizes) < _ENOUGH:
        return None
    return min([float(np.median(list(sizes.values()))), *(sizes[i] for i in sizes if _shallower(cuts[i], cuts[k]))])


def _shallower(one: TriedCut, other: TriedCut) -> bool:
    same = (one.mode, one.immersion, one.feed) == (other.mode, other.immersion, other.feed)
    return same and one.depth < other.depth and abs(one.speed / other.speed - 1) < _SPEED
