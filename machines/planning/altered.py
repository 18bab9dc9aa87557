"""What may be wrong in a joint of a machine, in a size that the responses show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import ComplexArray
from jointlib.errors import InputError, nearest
from jointlib.joint import Joint

from ..loop.explanations.families import EFFECTS, Family, Motion
from ..loop.explanations.hypothesis import Hypothesis, refit
from ..loop.explanations.places import Place, places_of
from .probe import Bench

REFIT = "refit"
"""The joint's own parameters."""
DEFAULT = (REFIT, "coulomb", "cubic", "gap", "hysteresis")
_DRAWS = 3
_SIZINGS, _SIZED, _REACHED = 9, 0.05, 0.5
_MOST = 40
_FEW, _INNER = 3, (-2.5, -0.5)
"""Logarithms of lengths over the motion, so that what slips slips and what has play comes out of it."""
_LOWEST, _HIGHEST = -12.0, 1.2


@dataclass(frozen=True, eq=False)
class Altered:
    """A machine with something changed in one joint."""

    name: str
    responses: ComplexArray
    """m/N, (places, levels, lines)."""
    size: float
    """Rms of the change over that of the response, at the driving place over all levels."""


@dataclass(frozen=True)
class Question:
    """An effect at a place."""

    place: Place
    family: str

    @property
    def name(self) -> str:
        """As it is answered."""
        return f"{self.place.name}:{self.family}"


def questions(bench: Bench, asked: Sequence[str]) -> tuple[Question, ...]:
    """Every effect that is asked for, in every joint; ``place:effect`` for one joint alone."""
    known = tuple(dict.fromkeys([REFIT, *(f.name for f in EFFECTS)]))
    places = {p.name: p for p in places_of(bench.machine)}
    if not places:
        raise InputError(f"{bench.machine.where}: no connection carries a joint, expected at least one")
    out: dict[str, Question] = {}
    for word in asked or DEFAULT:
        place, _, family = word.rpartition(":")
        if family not in known:
            raise InputError(f"--effects: unknown effect {family!r} of a machine's joint, {nearest(family, known)}")
        if place and place not in places:
            raise InputError(f"--effects: no joint {place!r}, {nearest(place, places)}")
        for p in [places[place]] if place else places.values():
            out[f"{p.name}:{family}"] = Question(p, family)
    if len(out) > _MOST:
        raise InputError(
            f"--effects: {len(out)} effects in {len(places)} joints are in question, expected at most {_MOST}: ask for "
            f"those of some joints, as {next(iter(out))}"
        )
    return tuple(out.values())


def draws(question: Question) -> int:
    """How often an effect is drawn, so that every law that goes by its name, and either sign, is among them."""
    return max(_DRAWS, sum(f.name == question.family for f in EFFECTS))


def altered(bench: Bench, question: Question, draw: int, rng: np.random.Generator, size: float) -> Altered | None:
    """One that changes the responses by ``size``; None where the effect cannot, or the machine finds no motion."""
    hypothesis, shape = _drawn(bench, question, draw, rng)
    if hypothesis is None:
        return None
    u, way = hypothesis.centre.copy(), float(rng.choice([-1.0, 1.0]))
    n = len(hypothesis.own)
    if question.family == REFIT:
        moved = draw % n
        lead, x = [moved], 0.1 * way
    else:
        u[n:] = shape
        lead = [n + i for i in range(len(shape)) if hypothesis.added[i].name in _sizes(question, hypothesis)]
        x = float(u[lead[0]])
    believed = bench.believed[0]
    begun = u.copy()
    best: tuple[float, ComplexArray, float] | None = None
    for _ in range(_SIZINGS):
        for i in lead:
            shift = x - begun[lead[0]] if hypothesis.coordinates[i].log else 0.0
            u[i] = begun[i] + shift if hypothesis.coordinates[i].log else x
        joints = _joints(hypothesis, hypothesis.bounded(u))
        whole = None if joints is None else bench.responses(joints)
        log = hypothesis.coordinates[lead[0]].log and question.family != REFIT
        if whole is None:
            x = x - 0.7 if log else 0.5 * x
            continue
        found = float(np.linalg.norm(whole[0] - believed) / np.linalg.norm(believed))
        off = abs(np.log(max(found, 1e-12) / size))
        if best is None or off < best[0]:
            best = off, whole, found
        if off < _SIZED:
            break
        step = float(np.clip(np.log(size / max(found, 1e-12)), -2.0, 2.0))
        x = float(np.clip(x + step, _LOWEST, _HIGHEST)) if log else x * float(np.exp(step))
    if best is None or best[0] > _REACHED:
        return None
    return Altered(question.name, best[1], best[2])


def _drawn(
    bench: Bench, question: Question, draw: int, rng: np.random.Generator
) -> tuple[Hypothesis | None, tuple[float, ...]]:
    """What is changed, and shapes from the middle of those that the loop begins at; law and sign by the draw."""
    if question.family == REFIT:
        found = refit(bench.machine, question.place)
        return (found, ()) if found.own else (None, ())
    members = [f for f in EFFECTS if f.name == question.family]
    family: Family = members[draw % len(members)]
    hypothesis = family.at(bench.machine, question.place, _motion(bench, question.place))
    inner = []
    for start in hypothesis.starts:
        shapes = range(family.linear, len(start))
        tried = {i: sorted({s[i] for s in hypothesis.starts}) for i in shapes}
        if all(_INNER[0] <= start[i] <= _INNER[1] if len(tried[i]) > _FEW else start[i] <= 0 for i in shapes):
            inner.append(start)
    starts = inner or list(hypothesis.starts)
    if not hypothesis.added[0].log:
        starts = [s for s in starts if (s[0] > 0) == (draw % 2 == 0)] or starts
    return hypothesis, starts[int(rng.integers(len(starts)))]


def _sizes(question: Question, hypothesis: Hypothesis) -> tuple[str, ...]:
    """Names of the coordinates in which the force is linear."""
    family = next(f for f in EFFECTS if f.name == question.family and f.member == hypothesis.member)
    return tuple(c.name for c in hypothesis.added[: family.linear])


def _motion(bench: Bench, place: Place) -> Motion:
    """How the stiffest row of a place moves at the top force."""
    z, omega = bench.motion(place.rows[int(np.argmax(place.share))])
    top = int(np.argmax(z))
    return Motion(float(z[top]), float(np.sqrt(np.mean(z**2)) + z[top]) / 2, float(omega[top]), place.stiffness)


def _joints(hypothesis: Hypothesis, u: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[Joint, ...] | None:
    """All joints of the machine; None where the numbers make no law."""
    try:
        return hypothesis.joints(u, exact=True)
    except InputError:
        return None
