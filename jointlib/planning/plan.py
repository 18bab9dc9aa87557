"""The plan of a test of a joint: the cheapest campaign that decides, and what it leaves open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.planning.campaign import Campaign, candidates
from jointlib.planning.outcome import NOTHING, UNNAMED, End, end_of
from jointlib.planning.questions import questions, rivals
from jointlib.planning.remedies import Remedy, remedies
from jointlib.planning.separable import Apart, apart
from jointlib.planning.setup import Setup
from jointlib.planning.simulated import Bench, Hidden
from jointlib.planning.truths import Truth
from jointlib.shown.progress import Progress

SIZE = 0.02
_DRAWS = 2
_REDRAWN = 4
_TRIED = 2
_MOST_TRACES = 10
"""Spent on remedies."""


@dataclass(frozen=True)
class Tried:
    """A remedy, and whether the loop then told the two apart."""

    word: str
    words: str
    resolves: bool


@dataclass(frozen=True)
class Confusion:
    """An effect that a campaign leaves beside something else."""

    effect: str
    beside: str
    """An effect, :data:`NOTHING` or :data:`UNNAMED`."""
    tried: tuple[Tried, ...]

    @property
    def resolved_by(self) -> Tried | None:
        """The first that told them apart."""
        return next((t for t in self.tried if t.resolves), None)


@dataclass(frozen=True)
class Plan:
    """What to measure, and how it will end."""

    bench: Bench
    size: float
    sizes: Mapping[str, float]
    """Of every effect in question, the smallest that was simulated."""
    ends: Mapping[str, frozenset[str]]
    """What may be named where an effect is hidden; of nothing hidden under ""."""
    confusions: tuple[Confusion, ...]
    left_out: tuple[str, ...]
    """Sentences about effects that could not be simulated."""
    traces: int

    @property
    def decides(self) -> dict[str, tuple[str, ...]]:
        """What every effect in question is told from, nothing at all among it."""
        return {
            e: tuple(o for o in (*self.sizes, NOTHING) if o != e and o not in named)
            for e, named in self.ends.items()
            if e
        }


def plan_rig(setup: Setup, joint: Joint, asked: Sequence[str], size: float, seed: int, progress: Progress) -> Plan:
    """Choose by distances, then ask the loop itself; what stays confused is tried under the likeliest remedies."""
    wanted = questions(asked, setup)
    with progress.step("choosing the excitation"):
        bench = _cheapest(setup, joint, wanted, size, seed)
    work = _Work(wanted, size, progress)
    ends = both_ways(work.ends(bench))
    if len(ends) < 2:
        raise InputError("--effects: none of these can be simulated on this joint; " + " ".join(work.said))
    confusions = _confusions(work, bench, ends)
    return Plan(bench, size, work.sizes, ends, confusions, tuple(work.said), work.traces)


class _Work:
    """Truths drawn and traced, each once."""

    def __init__(self, wanted: Sequence[Truth], size: float, progress: Progress) -> None:
        self.wanted = {t.name: t for t in wanted}
        self.size, self.progress = size, progress
        self.sizes: dict[str, float] = {}
        self.said: dict[str, None] = {}
        self.traces = 0

    def ends(
        self, bench: Bench, names: set[str] | None = None, word: str = "", draws: int = _DRAWS
    ) -> dict[str, frozenset[str]]:
        """What may be named of every effect (by default all, and nothing)."""
        out: dict[str, frozenset[str]] = {}
        for name in ("", *self.wanted) if names is None else sorted(names):
            with self.progress.step(f"simulating {name or 'no effect'}{word}"):
                found = [e for draw in range(_DRAWS) if (e := self._end(bench, name, draw)) is not None]
            if found:
                out[name] = frozenset().union(*(e.possible for e in found))
        return out

    def _end(self, bench: Bench, name: str, draw: int) -> End | None:
        for again in range(_REDRAWN):
            hidden = self.hidden(bench, name, draw + _DRAWS * again)
            if hidden is None:
                self.said[f"{name} does not apply to this joint, or cannot reach this size on it."] = None
                return None
            end = end_of(bench, hidden, draw)
            self.traces += end is not None
            if end is not None:
                if name:
                    self.sizes[name] = min(self.sizes.get(name, np.inf), hidden.size)
                return end
        self.said[f"With {name} of this size the rig finds no steady motion at this level."] = None
        return None

    def hidden(self, bench: Bench, name: str, draw: int) -> Hidden | None:
        """One truth, the same whichever others are asked for."""
        if not name:
            return Hidden("", bench.joint, 0.0)
        return self.wanted[name].drawn(_random(bench.seed, draw, name), bench, self.size)


def _cheapest(setup: Setup, joint: Joint, wanted: Sequence[Truth], size: float, seed: int) -> Bench:
    """The cheapest campaign that keeps as many pairs apart as the dearest."""
    every = list(candidates(setup))
    names = {t.name for t in wanted}
    known: dict[tuple[object, ...], Apart | None] = {}

    def apart_on(c: Campaign) -> int:
        key = (c.band, c.period, c.levels)
        bench = Bench(setup, joint, c, seed)
        if not bench.clear:
            return -1
        if key not in known:
            drawn = [t.drawn(_random(seed, 0, t.name), bench, size) for t in wanted]
            in_joint = [h for h in drawn if h is not None and h.spoiled is None]
            known[key] = apart(bench, in_joint, rivals()) if in_joint else None
        near = known[key]
        if near is None:
            return 0
        return sum(near.margin(e, r, c.periods) > 1 for e, r in near.near if r in names or not r)

    richest = max(every, key=lambda c: (c.band[1] - c.band[0], len(c.levels), c.periods, -c.period))
    most = max(apart_on(richest), apart_on(replace(richest, levels=max(every, key=lambda c: min(c.levels)).levels)))
    if most < 0:
        raise InputError(
            "--noise: the lowest level of the test drowns in it, expected quieter sensors, or a larger --amplitude"
        )
    return Bench(setup, joint, next((c for c in every if apart_on(c) >= most), richest), seed)


def both_ways(ends: Mapping[str, frozenset[str]]) -> dict[str, frozenset[str]]:
    """Where one of two is hidden and the other may be named, the same is taken to hold the other way round; and what is
    taken for another may be named itself."""
    out = {}
    for e, named in ends.items():
        others = {o for o, theirs in ends.items() if o and e and e in theirs}
        own = {e} if e and named - {UNNAMED, NOTHING} else set()
        out[e] = named | others | own
    return out


def _random(seed: int, draw: int, name: str) -> np.random.Generator:
    """Numbers of an effect, the same whichever others are asked for."""
    return np.random.default_rng([seed, draw, *name.encode()])


def _confusions(work: _Work, bench: Bench, ends: Mapping[str, frozenset[str]]) -> tuple[Confusion, ...]:
    """Every open pair with the remedies that promise most, tried."""
    open_pairs = [(e, r) for e, named in ends.items() if e for r in sorted(named) if r != e]
    offered = [r for r in remedies(bench) if r.bench.clear]
    begun, answers = work.traces, dict[tuple[str, str], frozenset[str]]()
    promised: dict[tuple[str, str, str], float] = {}
    for remedy in offered if open_pairs else ():
        hidden = [
            h for e in dict.fromkeys(e for e, _ in open_pairs) if (h := work.hidden(remedy.bench, e, 0)) is not None
        ]
        near = apart(remedy.bench, [h for h in hidden if h.spoiled is None], rivals())
        for e, r in open_pairs:
            promised[e, r, remedy.word] = near.margin(e, "" if r == NOTHING else r, remedy.bench.campaign.periods)
    out = []
    for e, r in open_pairs:
        tried: list[Tried] = []
        for remedy in sorted(offered, key=lambda o: -promised[e, r, o.word]):
            if len(tried) == _TRIED or any(t.resolves for t in tried):
                break
            if (e, remedy.word) not in answers:
                if work.traces - begun >= _MOST_TRACES:
                    break
                answers[e, remedy.word] = work.ends(remedy.bench, {e}, f" with {_first(remedy)}").get(e, frozenset())
            named = answers[e, remedy.word]
            tried.append(Tried(remedy.word, remedy.words, bool(named) and e in named and r not in named))
        out.append(Confusion(e, r, tuple(tried)))
    return tuple(out)


def _first(remedy: Remedy) -> str:
    return remedy.words.split(",")[0].split(" (")[0]
