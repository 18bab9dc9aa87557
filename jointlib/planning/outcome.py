"""How a campaign ends where an effect is hidden: the loop itself, on simulated records."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from jointlib.loop.answer.report import Candidate, Status, TraceReport, Verdict
from jointlib.loop.trace import trace
from jointlib.planning.simulated import Bench, Hidden

UNNAMED = "no name"
"""Something is missing, and the loop does not say what."""
NOTHING = "nothing"
_CLOSE, _DEVIATIONS = 0.03, 50.0
"""Of the chosen one's gain, and absolutely: a candidate that comes so near may be a rival with other noise."""
_BARELY = 0.975
"""Explained; a name needs 0.97."""
_SITS = {"driven": "a1", "behind": "a2", "behind_too": "a3"}
"""Bodies of simulated records, see `measurement_text`."""


@dataclass(frozen=True)
class End:
    """What was named of what was hidden."""

    hidden: str
    named: frozenset[str]
    """The chosen effect and its rivals; or :data:`UNNAMED`, or :data:`NOTHING`."""
    nearly: frozenset[str]
    """What might as well have been among them."""

    @property
    def possible(self) -> frozenset[str]:
        """Both."""
        return self.named | self.nearly


def end_of(bench: Bench, hidden: Hidden, draw: int) -> End | None:
    """Simulate and trace; None where the rig with it finds no steady motion."""
    moved = bench.moved(hidden)
    if moved is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        report = trace(bench.records(hidden, moved, Path(folder), (draw, _number(hidden))), bench.joint)
    return ended(report, hidden.name)


def ended(report: TraceReport, hidden: str) -> End:
    """A report as what it names."""
    chosen = report.chosen
    if report.verdict is Verdict.NOTHING_MISSING or chosen is None:
        word = NOTHING if report.verdict is Verdict.NOTHING_MISSING else UNNAMED
        return End(hidden, frozenset({word}), frozenset())
    if report.verdict in (Verdict.PARTIAL, Verdict.UNEXPLAINED):
        explained = chosen.explained or 0.0
        nearly = {label(chosen.family, chosen.where)} if explained > 0.96 else set()
        return End(hidden, frozenset({UNNAMED}), frozenset(nearly))
    named = {label(chosen.family, chosen.where), *(label(r.family, r.where) for r in report.rivals)}
    nearly = {label(c.family, c.where) for c in report.candidates if _comes_near(c, report)}
    if (chosen.explained or 1.0) < _BARELY:
        nearly |= {UNNAMED}
    return End(hidden, frozenset(named), frozenset(nearly - named))


def label(family: str, where: str) -> str:
    """A family, with its channel where it has one; a body by the accelerometer that sits on it."""
    return f"{family}@{_SITS.get(where, where)}" if where else family


def _comes_near(c: Candidate, report: TraceReport) -> bool:
    best = max(x.gain_heldout for x in report.candidates)
    return c.status is not Status.UNPHYSICAL and close(c.gain_heldout, best)


def close(gain: float, best: float) -> bool:
    """Whether a gain is so near to the best that other noise may turn them round."""
    return best - gain < max(_CLOSE * best, _DEVIATIONS)


def _number(hidden: Hidden) -> int:
    """Of its name, so that every effect has noise of its own whichever others are asked for."""
    return sum(ord(x) * (i + 1) for i, x in enumerate(hidden.name))
