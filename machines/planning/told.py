"""A plan of a machine in sentences and as JSON."""

from __future__ import annotations

from typing import Any

from jointlib.planning.outcome import NOTHING, UNNAMED
from jointlib.planning.plan import Confusion
from jointlib.planning.told import listed, pairs_of, resolution, told_from, verdicts

from .plan import BEYOND, MachinePlan, alike
from .probe import SEALED


def sentences(plan: MachinePlan) -> list[str]:
    """The test, what it decides and what stays open; everything simulated."""
    b, t = plan.bench, plan.test
    forces = [f"{b.forces[n]:.3g}" for n in t.levels]
    lines = [
        f"Force on {b.drive}, response of {listed([b.places[p] for p in t.places])}: {len(b.lines)} lines from "
        f"{b.lines[0]:.5g} to {b.lines[-1]:.5g} Hz at {listed(forces)} N, and sealed at {b.forces[SEALED]:.3g} N; "
        f"{t.cost} responses.",
        "Noise of a line, rms: " + ", ".join(f"{b.places[p]} {b.sigma[p]:.3g} m/N" for p in t.places) + ".",
        *(f"Assumed: {said}." for said in b.assumed),
        f"An effect counts from {100 * plan.size:.3g} % of the response of {b.drive} (rms over all lines and forces).",
    ]
    whole = [e for e, ends in plan.ends.items() if e and ends == {e}]
    if whole:
        lines.append(f"Decides, simulated: {listed(whole)} {'is' if len(whole) == 1 else 'are each'} named alone.")
    told = plan.decides
    lines += [said for e in plan.ends if e and e not in whole and (said := told_from(e, told[e], plan.ends[e]))]
    if plan.ends.get("", frozenset()) - {NOTHING}:
        lines.append("Where nothing is hidden something may be named.")
    lines += [_open(e, r, confusions) for (e, r), confusions in pairs_of(plan.confusions).items()]
    return [*lines, *plan.left_out]


def _open(e: str, r: str, confusions: list[Confusion]) -> str:
    found, tried = resolution(confusions)
    what = {
        UNNAMED: f"Undecided: {e} may end without a name",
        NOTHING: f"Undecided: {e} may stay unseen",
    }.get(r, f"Undecided: {e} and {r}")
    if alike(e, r):
        return f"{what}. {BEYOND}"
    if found is not None:
        return f"{what}. Resolved, as simulated, by {found.words}."
    if tried:
        return f"{what}. Tried in vain: {'; '.join(x.words for x in tried)}."
    return f"{what}. Nothing further was tried."


def as_json(plan: MachinePlan) -> dict[str, Any]:
    """The promised keys ``decides`` and ``undecided``, and the test in SI."""
    b, t = plan.bench, plan.test
    return {
        **verdicts(plan.ends, plan.decides, plan.sizes, plan.confusions, lambda e, r: BEYOND if alike(e, r) else None),
        "campaign": {
            "kind": "frf",
            "drive": b.drive,
            "responses": [b.places[p] for p in t.places],
            "forces": [float(b.forces[n]) for n in t.levels],
            "sealed_force": float(b.forces[SEALED]),
            "frequency": b.lines.tolist(),
        },
        "noise": {b.places[p]: float(b.sigma[p]) for p in t.places},
        "size": plan.size,
        "assumed": list(b.assumed),
        "left_out": list(plan.left_out),
        "simulated": True,
        "seed": plan.seed,
    }
