"""What to cut next: the cut whose verdict tells most, and the most productive one that is safe enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from jointlib.arrays import Array

from ..cutting.process.cutting import Cutting
from ..model.machine import Machine
from .borders import Condition, condition
from .contest import Entry
from .distances import Draws, Place, distances, first_border, surely
from .evidence import scatter, sound, stable
from .exactness import learnt
from .posterior import seen
from .problem import Problem, shaken
from .suspects import AsItIs

_SPEEDS, _DEPTHS, _DRAWS = 25, 16, 200
_WIDER, _BELOW, _ABOVE = 1.3, 2, 6
"""Times the depth from one rung beyond the ladder to the next, and how many there are on either side."""
_FURTHER, _PROOFS = 2, 5
"""Depths beyond a cut that is called safe at which it is proved as well, and speeds at which that is tried."""
_SHARES = (0.05, 0.5, 0.95)
_TURNS = ndtri((np.arange(10) + 0.5) / 10)
"""Deviations of σ at which a cut turns, each as likely as the others."""


@dataclass(frozen=True)
class Advice:
    """A cut to make: rpm, m, the probability that it is stable, and bits that its verdict is expected to tell."""

    speed: float
    depth: float
    probability: float
    bits: float


@dataclass(frozen=True, eq=False)
class Outlook:
    """Borders over the range: ``before`` and ``after`` are 5, 50 and 95 % of the depth in m at which a cut turns,
    (3, speeds), see `band`."""

    speed: Array
    before: Array
    after: Array
    depth: Array
    """m, the depths at which the probability of being stable is told, (depths,)."""
    probability: Array
    """Of being stable, as is every shallower cut at that speed, (speeds, depths)."""
    next_cut: Advice
    safe_cut: Advice | None
    """None where no cut is as safe as was asked for."""


def outlook(machine: Machine, problem: Problem, believed: Sequence[Entry], safe: float, seed: int) -> Outlook:
    """Borders as the inputs have them and as the cuts leave them, and what to cut next.

    ``believed`` are the entries that cannot be ruled out, weighed by their evidence. A verdict tells
    H(mean p) − mean H(p) bits of them, H the entropy of a coin. ``safe`` is the probability that a safe cut has.
    """
    speeds, ladder = _range(machine, problem)
    places = _places(machine, problem, speeds, _beyond(ladder), seed)
    inside = np.isin(places[0].depths, ladder)
    rng = np.random.default_rng([seed, 30])
    rows = np.asarray(rng.choice(problem.tool.count, _DRAWS), dtype=np.intp)
    modes = rng.standard_normal((_DRAWS, problem.tool.freedom))
    before = seen(AsItIs(), problem.tool, places, rows, np.zeros((_DRAWS, 0)), modes)
    drawn, sigma = forecast(believed, problem, rng)
    apart = apart_at(drawn, places)
    forced = shaken(machine, places[0].at.cutting, speeds[:, None], ladder)
    mean, bits = told_by([part[:, inside] for part in apart], sigma, forced)
    i, k = _largest(bits)
    if problem.guessed:
        told = _by_multipliers(drawn, places[i], ladder[max(k - 1, 0) : k + 2])
        mean[i, k] = np.mean(sound(told[:, min(k, 1)], sigma[:, 0]))
    best = Advice(float(speeds[i]), float(ladder[k]), float(mean[i, k]), float(bits[i, k]))
    through = all_the_way(apart, sigma)[:, inside]
    removed = np.where(through >= safe, speeds[:, None] * ladder, -1.0)
    if problem.guessed:
        _prove(removed, through, drawn, places, ladder, sigma, safe)
    i, k = _largest(removed)
    held = Advice(float(speeds[i]), float(ladder[k]), float(through[i, k]), float(bits[i, k]))
    was = band(places, [part for part, _ in before], scatter(rng.standard_normal((_DRAWS, 1))))
    return Outlook(speeds, was, band(places, apart, sigma), ladder, through, best, held if removed[i, k] > 0 else None)


def _prove(
    removed: Array,
    through: Array,
    drawn: Sequence[Draws],
    places: Sequence[Place],
    ladder: Array,
    sigma: Array,
    safe: float,
) -> None:
    """Hold the most productive safe cut against multipliers, and the next one where they deny it, in place.

    Of speeds that nobody has come to after some nothing is called safe.
    """
    proved = list[int]()
    while len(proved) < _PROOFS and np.max(removed) > 0:
        i, k = _largest(removed)
        if i in proved:
            return
        proved.append(i)
        rungs = min(k + 1 + _FURTHER, len(ladder))
        told = all_the_way([_by_multipliers(drawn, places[i], ladder[:rungs])], sigma)[0]
        through[i] = np.append(told, np.minimum(through[i, rungs:], told[-1]))
        removed[i] = np.where(through[i] >= safe, places[i].at.speed * ladder, -1.0)
    removed[np.isin(np.arange(len(removed)), proved, invert=True)] = -1.0


def chance_at(
    machine: Machine, problem: Problem, believed: Sequence[Entry], speed: float, depth: float, seed: int
) -> float:
    """The probability that a cut at rpm and m is stable, as is every shallower one at its speed."""
    ladder = depth * _WIDER ** np.arange(-_ABOVE, 2.0)
    drawn, sigma = forecast(believed, problem, np.random.default_rng([seed, 31]))
    if problem.guessed:
        place = Place(_condition(machine, problem, speed), ladder, 0)
        apart = [_by_multipliers(drawn, place, ladder)]
    else:
        apart = apart_at(drawn, _places(machine, problem, np.array([speed]), ladder, seed))
    return float(all_the_way(apart, sigma)[0, _ABOVE])


def forecast(believed: Sequence[Entry], problem: Problem, rng: np.random.Generator) -> tuple[list[Draws], Array]:
    """The machine as the cuts leave it, drawn, by suspect, and the scatter of the verdicts, (draws, 1)."""
    share = np.exp(np.array([one.weight for one in believed]) - max(one.weight for one in believed))
    after, sigmas = list[Draws](), []
    for one, many in zip(believed, np.ceil(share / np.sum(share) * _DRAWS).astype(int), strict=True):
        found = one.posterior
        pick = rng.choice(len(found.rows), int(many), p=found.weights())
        base = problem.tool.placed(problem.tool.drawn().of(found.rows[pick]), found.modes[pick])
        after.append(Draws(found.suspect, problem.tool, base, found.rows[pick], found.values[pick]))
        sigmas.append(found.sigma[pick])
    return after, np.concatenate(sigmas)[:, None]


def apart_at(drawn: Sequence[Draws], places: Sequence[Place]) -> list[Array]:
    """ln(b_lim/b) at every place, (draws, depths) each."""
    return [np.concatenate([distances(some, place)[0] for some in drawn]) for place in places]


def _by_multipliers(drawn: Sequence[Draws], place: Place, ladder: Array) -> Array:
    """The same at depths of one place, (draws, depths), where that is learnt elsewhere."""
    return np.concatenate([surely(some, place.at, ladder) for some in drawn])


def _largest(of: Array) -> tuple[int, int]:
    """Row and column."""
    row, column = np.unravel_index(int(np.argmax(of)), of.shape)
    return int(row), int(column)


def told_by(apart: Sequence[Array], sigma: Array, forced: Array) -> tuple[Array, Array]:
    """Of every speed and depth the probability of being stable and the bits that a verdict tells, (speeds, depths).

    ``forced`` is the forced vibration in feeds per tooth, (speeds, depths): where it is large a verdict tells little.
    """
    said = np.array([stable(part, sigma, by) for part, by in zip(apart, forced, strict=True)])  # with draws between
    bits = _entropy(np.mean(said, axis=1)) - np.mean(_entropy(said), axis=1)
    # What is not heard is chatter all the same.
    return np.mean([sound(part, sigma) for part in apart], axis=1), np.asarray(bits)


def all_the_way(apart: Sequence[Array], sigma: Array) -> Array:
    """Of every speed and depth the probability that no depth up to it chatters, (speeds, depths): beyond an island of
    chatter a cut is stable, and the tool does not come there but through it."""
    return np.array([np.mean(sound(np.minimum.accumulate(part, axis=1), sigma), axis=0) for part in apart])


def _range(machine: Machine, problem: Problem) -> tuple[Array, Array]:
    """Speeds in rpm and depths in m that are looked at: those of the machine and well around the cuts."""
    table = Cutting(**dict(machine.cutting or {}))
    told, deep = [cut.speed for cut in problem.cuts], [cut.depth for cut in problem.cuts]
    low, high = table.speed or (min(told), max(told))
    low = max(low, 0.7 * min(told))
    deepest = min(1.6 * max(deep), max(table.flute_length or np.inf, max(deep)))
    return np.round(np.linspace(low, high, _SPEEDS), -1), np.geomspace(0.4 * min(deep), deepest, _DEPTHS)


def _beyond(ladder: Array) -> Array:
    """A ladder with rungs below and above it: borders are looked for there as well, and not told by its ends."""
    below, above = ladder[0] * _WIDER ** np.arange(-_BELOW, 0.0), ladder[-1] * _WIDER ** np.arange(1.0, _ABOVE + 1)
    return np.concatenate([below, ladder, above])


def _condition(machine: Machine, problem: Problem, speed: float) -> Condition:
    """That of the first cut, at another speed in rpm."""
    return condition(problem.places[problem.index[0]].at.cutting, speed, machine.tool_axes)


def _places(machine: Machine, problem: Problem, speeds: Array, ladder: Array, seed: int) -> list[Place]:
    conditions = [_condition(machine, problem, float(n)) for n in speeds]
    learned = (
        None
        if problem.exactness is None
        else learnt(machine, problem.tool, conditions, [ladder] * len(speeds), seed, tools=1)
    )
    return [Place(at, ladder, k, learned) for k, at in enumerate(conditions)]


def band(places: Sequence[Place], apart: Sequence[Array], sigma: Array) -> Array:
    """Quantiles of the depth in m at which a cut turns, (3, speeds), or the deepest rung where it does deeper.

    ``sigma`` is the scatter about the border of each draw, (draws, 1), as in the probability of being stable.
    """
    turned = np.exp(sigma * _TURNS)
    borders = (
        np.minimum(first_border(one, part)[:, None] * turned, one.depths[-1]).ravel()
        for one, part in zip(places, apart, strict=True)
    )
    depth = np.stack(list(borders), axis=1)
    return np.asarray(np.quantile(depth, _SHARES, axis=0, method="inverted_cdf"))


def _entropy(p: Array) -> Array:
    """Bits of a coin."""
    return np.asarray(-(p * np.log2(p) + (1 - p) * np.log2(1 - p)))
