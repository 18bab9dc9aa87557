"""Held out: which explanations pass, which one is chosen, and which ones these records cannot tell from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import ComplexArray
from jointlib.loop.answer.report import Status, Verdict

from ..indices import Index, Mask
from .fit import Fitted, Fold

_SIGNIFICANT = 4.0
_EVIDENCE = 10.0
_ACTIVE = 0.01
_SIZE = 0.03
"""Least gain, per line and in units of the noise variance: significance without size names nothing."""
_SHARE = 0.05
_TIE = 10.0
_RIVAL = 3.0
_MODEL = 0.3
"""Share of what the best explanation leaves over that the shape of a law may be blamed for."""
NAMED_FROM = 0.95
OUTDONE = "another explains more"
"""Why a candidate without a fault is not the one that is named."""
NEAREST_FROM = 0.5


def excess(loss: float, lines: int) -> float:
    """What a loss has beyond what noise would make of it."""
    e = loss - lines
    return float(max(0.0, e - 6 * np.sqrt(lines) - 0.04 * lines))


@dataclass(frozen=True, eq=False)
class Judged:
    """An explanation, held out level by level and block by block."""

    fitted: Fitted
    before: ComplexArray
    """Residual of the machine as it is."""
    levels: tuple[tuple[str, ComplexArray], ...]
    """Residual on each level with parameters from the others; none where there is one level."""
    blocks: tuple[tuple[str, ComplexArray], ...]
    folds: tuple[Fold, ...]

    @property
    def place(self) -> str:
        return self.fitted.hypothesis.place.name

    @property
    def family(self) -> str:
        return self.fitted.hypothesis.family

    @property
    def size(self) -> int:
        """Numbers fitted."""
        return len(self.fitted.u)

    @cached_property
    def gains(self) -> dict[str, float]:
        """Drop of the loss on every fold."""
        rows = {fold.name: fold.rows for fold in self.folds}
        return {
            name: _loss(self.before[rows[name]]) - _loss(residual) for name, residual in (*self.levels, *self.blocks)
        }

    @cached_property
    def gain(self) -> float:
        """The smaller of the drops over all levels and over all blocks."""
        sums = [sum(self.gains[name] for name, _ in kind) for kind in (self.levels, self.blocks) if kind]
        return float(min(sums))

    @property
    def score(self) -> float:
        """Loss of the fit, and the price of the numbers it took: what explanations that passed compete by."""
        return self.fitted.loss + 0.5 * self.size * float(np.log(len(self.before)))

    @property
    def left(self) -> float:
        """What the fit leaves beyond noise."""
        return max(self.fitted.loss - len(self.before), 0.0)

    def heldout(self) -> ComplexArray:
        """Residual on left-out levels, else blocks, at all points."""
        rows = {fold.name: fold.rows for fold in self.folds}
        out = np.zeros(len(self.before), dtype=complex)
        for name, residual in self.levels or self.blocks:
            out[rows[name]] = residual
        return out

    @cached_property
    def left_out(self) -> float:
        """Σ abs(residual)² on what was left out of the fit."""
        return _loss(self.heldout())

    @property
    def chi2(self) -> float:
        """Mean square of the residual."""
        return self.fitted.loss / max(len(self.before), 1)

    def deviation(self) -> float:
        """Standard deviation of the gain, with all that the fit leaves over taken for noise."""
        return float(np.sqrt(2 * _loss(self.fitted.residual - self.before) * max(1.0, self.chi2)))

    def apart(self, other: Judged) -> float:
        """Standard deviation that noise gives the difference of two losses.

        What both leave over beyond noise is no chance: it does not change sides from one record to the next.
        """
        return float(np.sqrt(2 * _loss(self.fitted.residual - other.fitted.residual)))

    def fault(self, families: int) -> str:
        """Why it does not pass; empty where it does."""
        n = len(self.before)
        if self.gain <= _SIGNIFICANT * self.deviation():
            return "its gain on what was left out is within noise"
        if self.gain - 0.5 * (self.size + 1) * np.log(n) - np.log(families) <= _EVIDENCE:
            return "its gain is too small for the numbers it fits"
        if self.gain < max(_SIZE * n, _SHARE * (_loss(self.before) - n)):
            return "its gain is significant but of no size"
        if self.levels:
            moved = {f.name: _loss((self.fitted.residual - self.before)[f.rows]) for f in self.folds}
            active = [k for k, _ in self.levels if moved[k] >= _ACTIVE * sum(moved[j] for j, _ in self.levels)]
            worse = [k for k in active if self.gains[k] <= 0]
            if worse:
                return f"it makes {', '.join(worse)} worse where that is left out"
        return ""


def _loss(residual: ComplexArray) -> float:
    return float(np.sum(np.abs(residual) ** 2))


def judged(fitted: Fitted, before: ComplexArray, levels: Sequence[Fold], blocks: Sequence[Fold]) -> Judged:
    """Hold an explanation against what it was not fitted to."""
    by_level = tuple((f.name, f.residual(fitted)) for f in levels)
    by_block = tuple((f.name, f.residual(fitted)) for f in blocks)
    return Judged(fitted, before, by_level, by_block, (*levels, *blocks))


def preferred(of_place: Sequence[Judged]) -> Judged:
    """The simplest among the explanations of one place that are as good as its best."""
    best = min(of_place, key=lambda j: j.score)
    tied = [j for j in of_place if j.score - best.score <= max(_TIE, 4 * best.apart(j), _MODEL / 3 * best.left)]
    # A stop on one side behind a softer spring has the first harmonic of play: the simpler word is said.
    return min(tied, key=lambda j: (j.family != "refit", j.size, j.family == "contact-loss", j.fitted.penalty))


def is_rival(chosen: Judged, other: Judged) -> bool:
    """Whether these records cannot tell another explanation from the chosen one."""
    return other.score - chosen.score < max(_TIE, _RIVAL * chosen.apart(other), _MODEL * chosen.left)


@dataclass(frozen=True, eq=False)
class Judgement:
    """What all explanations come to."""

    verdict: Verdict
    chosen: Judged | None
    rivals: tuple[Judged, ...]
    ordered: tuple[tuple[Judged, Status, str], ...]
    explained: float | None
    """Share of what was missing that is explained."""
    beyond: float | None = None
    """Share of what the joint's own parameters leave missing that the effect explains; None for a refit."""

    @property
    def nearest(self) -> tuple[Judged, float] | None:
        """Of the laws at the joint that is chosen the one that leaves least, and the share that it explains."""
        chosen = self.chosen
        named = [j for j, *_ in self.ordered if chosen and j is not chosen and j.place == chosen.place]
        law = min((j for j in named if j.family != "refit"), key=lambda j: j.fitted.loss, default=None)
        share = _share(_loss(law.before), law.fitted.loss, len(law.before)) if law is not None else None
        return None if law is None or share is None else (law, share)


def judge(found: Sequence[Judged], families: int) -> Judgement:
    """Choose, say what rivals it, and how far the evidence carries."""
    before, n = _loss(found[0].before), len(found[0].before)
    faults = {id(j): j.fault(families) for j in found}
    passed = [j for j in found if not faults[id(j)]]
    by_place: dict[str, list[Judged]] = {}
    for j in passed:
        by_place.setdefault(j.place, []).append(j)
    leaders = [preferred(group) for group in by_place.values()]
    chosen = min(leaders, key=lambda j: j.score) if leaders else None
    rivals: list[Judged] = []
    if chosen is not None:
        rivals = [j for j in leaders if j is not chosen and is_rival(chosen, j)]
        if chosen.family != "refit":
            alike = [j for j in by_place[chosen.place] if j.family not in ("refit", chosen.family)]
            rivals += [j for j in alike if j.size <= chosen.size and is_rival(chosen, j)]
        rivals.sort(key=lambda j: j.score)
    explained, beyond = (None, None) if chosen is None else _shares(chosen, found)
    verdict = _verdict(before, n, chosen, rivals, [share for share in (explained, beyond) if share is not None])
    if verdict is Verdict.UNEXPLAINED:
        rivals = []
    ordered = []
    for j in sorted(found, key=lambda j: (j is not chosen, j.score)):
        if j is chosen and verdict is not Verdict.UNEXPLAINED:
            ordered.append((j, Status.ACCEPTED, "it explains most on what was left out"))
        elif j in rivals:
            ordered.append((j, Status.TIED, "these records cannot tell it from the chosen one"))
        else:
            why = faults[id(j)] or OUTDONE
            ordered.append((j, Status.REJECTED, why))
    return Judgement(verdict, chosen, tuple(rivals), tuple(ordered), explained, beyond)


def with_table(judgement: Judgement, table: Judged) -> Judgement:
    """The same with a table chosen that has no name; all that has one comes behind it."""
    explained, beyond = _shares(table, [j for j, *_ in judgement.ordered])
    behind = tuple(
        (j, Status.REJECTED, OUTDONE if s is not Status.REJECTED else why) for j, s, why in judgement.ordered
    )
    first = (table, Status.ACCEPTED, "no law of the catalogue comes near it")
    return Judgement(Verdict.PARTIAL, table, (), (first, *behind), explained, beyond)


def _shares(chosen: Judged, found: Sequence[Judged]) -> tuple[float | None, float | None]:
    """Of what was missing, and of what the refit of the same joint leaves; the second None for a refit itself."""
    n, after = len(chosen.before), chosen.fitted.loss
    refits = [j.fitted.loss for j in found if (j.place, j.family) == (chosen.place, "refit") and j is not chosen]
    return _share(_loss(chosen.before), after, n), _share(refits[0], after, n) if refits else None


def _share(before: float, after: float, n: int) -> float | None:
    """Share of the excess of a loss that is gone; None where there was none."""
    left = excess(before, n)
    return 1 - excess(after, n) / left if left > 0 else None


def _verdict(
    before: float, n: int, chosen: Judged | None, rivals: Sequence[Judged], shares: Sequence[float]
) -> Verdict:
    if chosen is None:
        return Verdict.UNEXPLAINED if excess(before, n) > 0 else Verdict.NOTHING_MISSING
    least = min(shares, default=1.0)
    if least >= NAMED_FROM:
        return Verdict.AMBIGUOUS if rivals else Verdict.IDENTIFIED
    return Verdict.PARTIAL if least >= NEAREST_FROM else Verdict.UNEXPLAINED


def level_folds(level: NDArray[np.str_]) -> list[tuple[str, Mask]]:
    """Points of every level; none where there is only one."""
    levels = list(dict.fromkeys(level.tolist()))
    return [(name, level == name) for name in levels] if len(levels) > 1 else []


def block_folds(line: Index, record: Index, count: int, width: int) -> list[tuple[str, Mask]]:
    """Blocks of neighbouring lines, dealt out to so many folds; records shorter than a block are dealt out whole."""
    short = np.bincount(record)[record] < width
    which = np.where(short, record, line // width) % count
    return [(f"lines {k + 1}/{count}", which == k) for k in range(count) if np.any(which == k)]
