"""What a trace of cuts says in words."""

from __future__ import annotations

import numpy as np

from jointlib.loop.answer.report import Verdict

from .advice import Outlook
from .contest import ODDS, Entry, Outcome, surprising
from .problem import Problem

_SPEAKS = 3.0
"""Odds from which on cuts speak for something rather than nothing (Kass & Raftery 1995, sec. 3.2)."""


def sentence(outcome: Outcome, base: Entry, problem: Problem, seen: Outlook) -> str:
    odd = int(np.count_nonzero(surprising(base, problem)))
    if outcome.chosen is None and outcome.verdict is Verdict.NOTHING_MISSING:
        but = ", but do not rule out that something is missing" if _near(outcome) else ""
        return f"The {len(problem.cuts)} cuts are explained by what the inputs leave open{but}."
    if outcome.chosen is None:
        why = f"{odd} of {len(problem.cuts)} cuts are against what the inputs leave open"
        if not base.reached:
            why = f"the machine reaches the cuts with {reach(base)} alone"
        elif outcome.odds > np.log(ODDS):
            more = f"{np.exp(outcome.odds):.2g} times as likely"
            why = f"the suspects together make the cuts {more}, and none of them tells what is held out better"
        elif not odd:
            why = "the machine would hardly ever make these cuts together"
        return f"Something is missing that has no name here: {why}. Cut next at {seen.next_cut.speed:g} rpm."
    of = outcome.chosen.posterior
    said = of.told()
    if outcome.rivals:
        others = " or ".join(one.posterior.told() for one in outcome.rivals)
        return f"The cuts point to this: {said}; they cannot rule out {others}."
    left = ", which does not explain all of them" if outcome.verdict is Verdict.PARTIAL else ""
    return f"What the cuts show: {said}{left}."


def _near(outcome: Outcome) -> bool:
    """Whether the cuts speak for something without reaching a name."""
    return outcome.chosen is None and bool(outcome.left_open) and outcome.odds >= np.log(_SPEAKS)


def nearly(base: Entry, outcome: Outcome) -> list[str]:
    """What comes near to a name where there is none."""
    if not _near(outcome):
        return []
    best = outcome.left_open[0]
    of, gain = best.posterior, best.weight - base.weight
    why = f"All suspects together make them {np.exp(outcome.odds):.2g} times as likely, a name needs {ODDS:g}"
    if outcome.odds > np.log(ODDS):
        why = f"No name, for it has {reach(best)}" if not best.reached else "On cuts held out it does no better"
    return [f"It would make the cuts {np.exp(gain):.2g} times as likely if this were so: {of.told()}. {why}: cut on."]


def reach(base: Entry) -> str:
    """What it takes to reach the cuts, in words."""
    of = base.posterior
    return f"{of.effective:.1f} effective draws and modes pulled by {of.strain:.2f} standard errors"
