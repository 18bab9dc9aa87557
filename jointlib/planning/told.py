"""A plan in sentences and as JSON."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from jointlib.effect import JointEffect
from jointlib.fault import Fault
from jointlib.loop.answer.catalogue import catalogue
from jointlib.planning.outcome import NOTHING, UNNAMED
from jointlib.planning.plan import Confusion, Plan, Tried

_MANY = 4
_LEVELS = 3, "Repeat at three or more levels"
"""How an advice of the catalogue begins that a test of so many levels follows already."""


def pairs_of(confusions: Sequence[Confusion]) -> dict[tuple[str, str], list[Confusion]]:
    """Confusions by pair, either way round."""
    out: dict[tuple[str, str], list[Confusion]] = {}
    for c in confusions:
        pair = (c.effect, c.beside)
        out.setdefault(pair if pair[::-1] not in out else pair[::-1], []).append(c)
    return out


def resolution(confusions: Sequence[Confusion]) -> tuple[Tried | None, list[Tried]]:
    """What told the pair apart whichever of the two was hidden, and everything that was tried."""
    tried = {t.word: t for c in confusions for t in c.tried}
    for word, t in tried.items():
        answers = [x.resolves for c in confusions for x in c.tried if x.word == word]
        if len(answers) == len(confusions) and all(answers):
            return t, [*tried.values()]
    return None, [*tried.values()]


def sentences(plan: Plan) -> list[str]:
    """The test, what it decides and what stays open; everything simulated."""
    b = plan.bench
    c, s = b.campaign, b.setup
    lines = [
        f"The rig moves on its joint at {s.resonance:.4g} Hz. Multisine from {c.band[0]:.5g} to {c.band[1]:.5g} Hz, a "
        f"line every {c.spacing:.4g} Hz: {c.period} samples a period at {c.sample_rate:.6g} Hz.",
        f"{len(c.levels)} records to fit at {listed([f'{x * b.drive:.3g}' for x in c.levels])} N rms, one sealed at "
        f"{c.drives[-1] * b.drive:.3g} N, one quiet: each {c.settle} periods to settle and {c.periods} to use, "
        f"{c.seconds_a_record:.3g} s. The top level moves the joint by {1e6 * c.reach:.3g} µm.",
        "Noise of a sample, rms: "
        + ", ".join(f"{n} {x:.3g} {'N' if n == 'P' else 'm/s²'}" for n, x in b.sigma.items())
        + ".",
        *(f"Assumed: {said}." for said in s.assumed),
        f"An effect counts from {100 * plan.size:.3g} % of the joint force (rms at the top level, beside what stiffness"
        " and damping take up), a wrong channel or mass from that share of itself.",
    ]
    told = plan.decides
    whole = [e for e, ends in plan.ends.items() if e and ends == {e}]
    if whole:
        lines.append(f"Decides, simulated: {listed(whole)} {'is' if len(whole) == 1 else 'are each'} named alone.")
    lines += [said for e in plan.ends if e and e not in whole and (said := told_from(e, told[e], plan.ends[e]))]
    small = {e: x for e, x in plan.sizes.items() if x < 0.8 * plan.size}
    lines += [f"{e} was simulated at {100 * x:.2g} %, more it cannot reach here." for e, x in small.items()]
    if plan.ends.get("", frozenset()) - {NOTHING}:
        lines.append("Where nothing is hidden something may be named.")
    for (e, r), confusions in pairs_of(plan.confusions).items():
        lines.append(_open(e, r, confusions, c.levels))
    return [*lines, *plan.left_out]


def _open(e: str, r: str, confusions: Sequence[Confusion], levels: Sequence[float]) -> str:
    found, tried = resolution(confusions)
    what = {
        UNNAMED: f"Undecided: {e} may end without a name, as its form is not that of a single law",
        NOTHING: f"Undecided: {e} may stay unseen",
    }.get(r, f"Undecided: {e} and {r}")
    if found is not None:
        return f"{what}. Resolved, as simulated, by {found.words}."
    advice = advised(e, r, levels)
    more = f" The catalogue advises, not tried: {advice}" if advice else ""
    if not advice and advised(e, r):
        more = " The levels that the catalogue advises are in the test."
    if tried:
        return f"{what}. Tried in vain: {'; '.join(t.words for t in tried)}.{more}"
    return f"{what}. Nothing further was tried.{more}"


def advised(e: str, r: str, levels: Sequence[float] = ()) -> str:
    """What the catalogue says of two look-alikes; empty where it says nothing, or what a test of these levels does."""
    said = _of_catalogue(e, r)
    enough, begins = _LEVELS
    return "" if said.startswith(begins) and len(set(levels)) >= enough else said


def _of_catalogue(e: str, r: str) -> str:
    known = catalogue()
    for one, other in ((e, r), (r, e)):
        family, rival = one.split("@")[0], other.split("@")[0]
        effects: tuple[JointEffect | Fault, ...] = (*known.joint, *known.rig)
        for effect in effects:
            if effect.family == family and rival in effect.look_alikes:
                return effect.look_alikes[rival]
    return ""


def verdicts(
    ends: Mapping[str, frozenset[str]],
    told: Mapping[str, tuple[str, ...]],
    sizes: Mapping[str, float],
    confusions: Sequence[Confusion],
    advice: Callable[[str, str], str | None],
) -> dict[str, Any]:
    """``decides``, ``undecided`` and ``ends`` of any plan; ``advice`` on a pair that no test tells apart."""
    undecided = []
    for pair, of_pair in pairs_of(confusions).items():
        found, tried = resolution(of_pair)
        undecided.append(
            {
                "effects": list(pair),
                "resolved_by": None if found is None else {"what": found.word, "words": found.words},
                "advised": advice(*pair),
                "tried": [{"what": t.word, "words": t.words, "resolves": t is found} for t in tried],
            }
        )
    return {
        "decides": [
            {"effect": e, "told_from": list(told[e]), "alone": named == {e}, "size": sizes[e]}
            for e, named in ends.items()
            if e and told[e]
        ],
        "undecided": undecided,
        "ends": [{"hidden": e or None, "named": sorted(named)} for e, named in ends.items()],
    }


def as_json(plan: Plan) -> dict[str, Any]:
    """The promised keys ``decides`` and ``undecided``, and the test in SI."""
    b = plan.bench
    c, s = b.campaign, b.setup
    return {
        **verdicts(plan.ends, plan.decides, plan.sizes, plan.confusions, lambda e, r: advised(e, r, c.levels) or None),
        "campaign": {
            "kind": "rig",
            "band": list(c.band),
            "sample_rate": c.sample_rate,
            "period": c.period,
            "settle": c.settle,
            "periods": c.periods,
            "levels": list(c.levels),
            "sealed_level": c.drives[-1],
            "force_rms": b.drive,
            "amplitude": c.reach,
            "seconds": c.cost,
        },
        "noise": dict(b.sigma),
        "resonance": s.resonance,
        "size": plan.size,
        "assumed": list(s.assumed),
        "left_out": list(plan.left_out),
        "simulated": True,
        "seed": b.seed,
    }


def told_from(e: str, told: Sequence[str], named: Collection[str]) -> str:
    """From which of the others an effect is told; empty where from none."""
    if not told:
        return ""
    but = [n for n in sorted(named) if n != e]
    if len(told) > _MANY and but:
        return f"{e} is told from everything else in question but {listed(but)}."
    return f"{e} is told from {listed(told)}."


def listed(words: Sequence[str]) -> str:
    """A list in a sentence."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
