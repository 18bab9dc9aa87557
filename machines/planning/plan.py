"""The plan of a test of a machine: the fewest responses that decide, and what they leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.loop.answer.report import Status, Verdict
from jointlib.planning.outcome import NOTHING, UNNAMED, close
from jointlib.planning.plan import Confusion, Tried, both_ways
from jointlib.shown.progress import Progress, each

from ..loop.judge import OUTDONE
from ..loop.report import MachineTrace
from ..loop.trace import trace_frfs
from .altered import Altered, Question, altered, draws, questions
from .probe import LEVELS, Bench, Test, measured, tests

SIZE = 0.05
_CLEAR = 150.0
"""Squared distance in deviations of the noise, beside what a rival can take up."""

_QUIET = 2
"""How often the responses of the machine as it is believed are traced."""
_TRIED, _MOST_TRACES = 2, 12
_ALIKE = {"gap", "contact-loss"}
BEYOND = (
    "Their first harmonics are the same about a zero mean, so no frequency response tells them apart: record second "
    "harmonics or the mean displacement."
)


def alike(e: str, r: str) -> bool:
    """Whether two are one and the same to a first harmonic, at one place."""
    (place, _, one), (other, _, two) = e.rpartition(":"), r.rpartition(":")
    return place == other and {one, two} == _ALIKE


@dataclass(frozen=True, eq=False)
class MachinePlan:
    """What to measure on a machine, and how it will end."""

    bench: Bench
    test: Test
    size: float
    sizes: Mapping[str, float]
    """Of every effect in question, the smallest that was simulated."""
    ends: Mapping[str, frozenset[str]]
    """What may be named where an effect is hidden; of nothing hidden under ""."""
    confusions: tuple[Confusion, ...]
    left_out: tuple[str, ...]
    traces: int
    seed: int

    @cached_property
    def decides(self) -> dict[str, tuple[str, ...]]:
        """What every effect in question is told from, nothing at all among it."""
        every = (*self.sizes, NOTHING)
        return {e: tuple(o for o in every if o not in {e, *named}) for e, named in self.ends.items() if e}


def plan_machine(bench: Bench, asked: Sequence[str], size: float, seed: int, progress: Progress) -> MachinePlan:
    """Choose by distances between simulated responses, then ask the loop; what stays confused is tried elsewhere."""
    wanted = questions(bench, asked)
    said: dict[str, None] = {}
    drawn: dict[str, list[Altered]] = {}
    with progress.step("choosing places and forces"):
        for q in each("effects", wanted, len(wanted)):
            found = [altered(bench, q, draw, _random(seed, draw, q.name), size) for draw in range(draws(q))]
            if not (usable := [a for a in found if a is not None]):
                said[f"{q.name} cannot change the responses by {100 * size:g} % here, or lets no motion be found."] = (
                    None
                )
            else:
                drawn[q.name] = usable
        if not drawn:
            raise InputError("--effects: none of these can be simulated on this machine; " + " ".join(said))
        test = _fewest(bench, drawn)
    work = _Work(seed)
    hidden: list[tuple[str, Altered | None, int]] = [("", None, d) for d in range(_QUIET)]
    hidden += [(name, case, d) for name, cases in drawn.items() for d, case in enumerate(cases)]
    ends = dict.fromkeys(("", *drawn), frozenset[str]())
    with progress.step("tracing simulated responses, with every effect hidden in turn"):
        for name, case, d in each("traces", hidden, len(hidden), "fewer --effects ask for less"):
            ends[name] |= work.end(bench, case, test, d)
    ends = both_ways({e: named | {o for n in named if (o := _twin(n))} for e, named in ends.items()})
    confusions = _confusions(work, bench, test, wanted, size, ends, progress)
    sizes = {name: min(a.size for a in cases) for name, cases in drawn.items()}
    return MachinePlan(bench, test, size, sizes, ends, confusions, tuple(said), work.traces, seed)


def _twin(name: str) -> str:
    """What is one and the same to a first harmonic; empty where nothing is."""
    place, _, family = name.rpartition(":")
    return f"{place}:{next(iter(_ALIKE - {family}))}" if family in _ALIKE else ""


class _Work:
    """Traces, counted."""

    def __init__(self, seed: int) -> None:
        self.seed, self.traces = seed, 0

    def end(self, bench: Bench, hidden: Altered | None, test: Test, draw: int) -> frozenset[str]:
        """What the loop names, or nearly does, of simulated responses."""
        name = "" if hidden is None else hidden.name
        H = bench.believed if hidden is None else hidden.responses
        self.traces += 1
        frfs = measured(bench, H, test, _random(self.seed, draw, f"noise {name}"))
        return ended(trace_frfs(frfs, bench.machine))


def ended(report: MachineTrace) -> frozenset[str]:
    """A report as what it names, or might with other noise."""
    if report.verdict is Verdict.NOTHING_MISSING:
        return frozenset({NOTHING})
    if report.chosen is None or report.verdict in (Verdict.PARTIAL, Verdict.UNEXPLAINED):
        return frozenset({UNNAMED})
    chosen = report.chosen
    best = max(c.gain_heldout for c in report.candidates if c.reason == OUTDONE or c.status is not Status.REJECTED)
    near = {f"{c.place}:{c.family}" for c in report.candidates if c.reason == OUTDONE and close(c.gain_heldout, best)}
    named = {f"{chosen.place}:{chosen.family}", *(f"{r.place}:{r.family}" for r in report.rivals)}
    return frozenset(named | near)


def _fewest(bench: Bench, drawn: Mapping[str, Sequence[Altered]]) -> Test:
    """The first test that keeps as many pairs apart as the best does."""
    every = tests(bench)
    apart = [_apart(bench, drawn, t) for t in every]
    return every[apart.index(max(apart))]


def _apart(bench: Bench, drawn: Mapping[str, Sequence[Altered]], test: Test) -> int:
    """Pairs whose changes of the responses differ beyond noise, the rival's scaled as suits it best."""
    signals = {name: [_change(bench, a.responses, test) for a in cases] for name, cases in drawn.items()}
    count = 0
    for one, mine in signals.items():
        count += all(float(x @ x) > _CLEAR for x in mine)
        for other, theirs in signals.items():
            if one != other:
                basis = np.linalg.qr(np.array(theirs).T)[0]
                count += all(float(np.sum((x - basis @ (basis.T @ x)) ** 2)) > _CLEAR for x in mine)
    return count


def _change(bench: Bench, H: ComplexArray, test: Test) -> Array:
    """What something hidden changes in the responses that are fitted, in deviations of their noise."""
    parts = [
        (H[p, n] - bench.believed[p, n]) / bench.sigma[p] * np.sqrt(2) for p, n, sealed in test.rows() if not sealed
    ]
    return np.concatenate(parts).view(float)


@dataclass(frozen=True, eq=False)
class _Remedy:
    word: str
    words: str
    bench: Bench
    test: Test


def _remedies(bench: Bench, test: Test) -> list[_Remedy]:
    """Another place, more forces, a higher top force, less noise."""
    out = []
    for i in range(1, len(bench.places)):
        if i not in test.places:
            more = Test((*test.places, i), test.levels)
            out.append(_Remedy(f"place {bench.places[i]}", f"the response of {bench.places[i]} as well", bench, more))
    if len(test.levels) < len(LEVELS) - 1:
        out.append(_Remedy("levels", "one force more", bench, Test(test.places, (0, 1, 2, 4))))
    absolute = None if bench.absolute is None else bench.absolute / 10
    quiet = replace(bench, noise=bench.noise / 10, absolute=absolute)
    out.append(_Remedy("quieter", "a tenth of the noise", quiet, test))
    further = replace(bench, top=2 * bench.top)
    out.append(_Remedy("further", f"up to {further.top:.3g} N, which is more than is allowed now", further, test))
    return out


def _confusions(
    work: _Work,
    bench: Bench,
    test: Test,
    wanted: Sequence[Question],
    size: float,
    ends: Mapping[str, frozenset[str]],
    progress: Progress,
) -> tuple[Confusion, ...]:
    """Every open pair with the remedies that set the two furthest apart, tried."""
    asked = {q.name: q for q in wanted}
    begun, out = work.traces, []
    answers: dict[tuple[str, str], frozenset[str]] = {}
    for e, r in [(e, r) for e, named in ends.items() if e for r in sorted(named) if r != e]:
        tried: list[Tried] = []
        for remedy in [] if alike(e, r) else _remedies(bench, test):
            if len(tried) == _TRIED or any(t.resolves for t in tried):
                break
            key = e, remedy.word
            if key not in answers:
                if work.traces - begun >= _MOST_TRACES:
                    break
                with progress.step(f"simulating {e} with {remedy.words.split(',')[0]}"):
                    try:
                        every = range(draws(asked[e]))
                        cases = [altered(remedy.bench, asked[e], d, _random(work.seed, d, e), size) for d in every]
                    except InputError:
                        continue
                    found = [work.end(remedy.bench, a, remedy.test, d) for d, a in enumerate(cases) if a is not None]
                    if not found:
                        continue
                    answers[key] = frozenset[str]().union(*found)
            tried.append(Tried(remedy.word, remedy.words, e in answers[key] and r not in answers[key]))
        out.append(Confusion(e, r, tuple(tried)))
    return tuple(out)


def _random(seed: int, draw: int, name: str) -> np.random.Generator:
    return np.random.default_rng([seed, draw, *name.encode()])
