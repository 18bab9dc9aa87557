"""Trace measured FRFs of a machine at several force levels to one of its joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.loop.answer.report import Verdict
from jointlib.measurement import Measurement

from ..model.machine import Machine
from .errors import before_and_after
from .explanations.families import EFFECTS
from .explanations.places import places_of
from .fit import Fold
from .forward import with_joints
from .judge import Judged, Judgement, block_folds, excess, judge, judged, level_folds, with_table
from .mended import mended, parameters_of, shifts_of, spent
from .noise.drift import FARTHEST, FREQUENCY, LEVEL
from .noise.parts import with_doubt_of_parts
from .records import LevelFRF, read_frfs, said_of, within_parts
from .report import MachineCandidate, MachineRival, MachineTrace
from .search import Search
from .separate import Separation, separation
from .setting import WHITE, Setting
from .with_drift_out import Searched
from .words import NOT_DECIDABLE, sentence

_ALIKE = {"gap", "contact-loss"}
_BEYOND = "Their first harmonics are the same about a zero mean: record second harmonics or the mean displacement."
_TOLD = 2.0
"""Deviations of a drift from which on it is told."""
_CLEARLY, _BY_FAR = 0.5, 0.1
"""Share of what the best name leaves of levels left out below which a table is taken instead; the smaller one where
that name explains enough to be said."""
_BLOCKS = 4
_WIDTH = 8


def trace_machine(measurement: Measurement, machine: Machine, *, seed: int = 0) -> MachineTrace:
    """Read the FRFs of a measurement of kind "frf" and trace them; see `trace_frfs`."""
    return trace_frfs(read_frfs(measurement, machine), machine, seed=seed)


def trace_frfs(frfs: Sequence[LevelFRF], machine: Machine, *, seed: int = 0) -> MachineTrace:
    """Name the connection, and what changes there, that explains how measured FRFs differ from a machine's.

    Every place (a connection, or all rows of a bundle) is refitted and given every effect of the catalogue that a
    describing function can see; what wins is judged on levels and lines that were left out of its fit.

    Parameters
    ----------
    frfs
        Measured FRFs; sealed ones are used for the error before and after only.
    machine
        The machine as it is thought to be, every connection with its joint.
    seed
        Noted in the report; nothing here is drawn at random.
    """
    frfs = within_parts(frfs, machine, FARTHEST * FREQUENCY)
    training = tuple(r for r in frfs if not r.sealed)
    if not training:
        raise InputError(f"{machine.where}: every FRF is sealed, expected at least one to trace")
    places = places_of(machine)
    if not places:
        raise InputError(f"{machine.where}: no connection carries a joint, expected at least one")
    searched = Searched.of(machine, places, training)
    best = min(searched.found, key=lambda f: f.loss)
    doubted = with_doubt_of_parts(frfs, with_joints(machine, best.hypothesis.joints(best.u, exact=True)))
    if any(a is not b for a, b in zip(doubted, frfs, strict=True)):
        # What measured parts of the machine err by is known where its response is.
        frfs = doubted
        training = tuple(r for r in frfs if not r.sealed)
        searched = Searched.of(machine, places, training)
    setting, search, pointing = searched.setting, searched.search, searched.pointing
    fitting = search.fitting
    points = fitting.forward.points
    levels = [
        Fold.of(name, fitting, out) for name, out in level_folds(np.array([r.level for r in training])[points.record])
    ]
    blocks = [
        Fold.of(name, fitting, out) for name, out in block_folds(fitting.forward.line, points.record, _BLOCKS, _WIDTH)
    ]
    judgement = judge([judged(f, search.residual, levels, blocks) for f in searched.found], len(EFFECTS) + 1)
    if searched.table is not None:
        judgement = _or_the_table(judgement, judged(searched.table, search.residual, levels, blocks))
    floor = _floor(setting, training, search.residual if judgement.chosen is None else judgement.chosen.fitted.residual)
    before = excess(search.before, len(points)) or max(search.before - len(points), 1e-300)
    named = judgement.chosen if judgement.verdict not in (Verdict.UNEXPLAINED, Verdict.NOTHING_MISSING) else None
    candidates = _candidates(judgement, before)
    rivals = _rivals(search, judgement, named)
    sealed = tuple(r for r in frfs if r.sealed)
    vetoed = False
    made = machine if named is None else mended(machine, named.fitted, named.chi2, training, sealed)
    error_before, error_after = before_and_after(machine, made, fitting, search.residual, named, training, sealed)
    if named is not None and sealed and error_after["relative"] >= error_before["relative"]:
        # The sealed record may veto: what does not hold there is no name.
        judgement = replace(judgement, verdict=Verdict.UNEXPLAINED, rivals=())
        made, named, rivals, error_after = machine, None, (), error_before
        candidates, vetoed = _candidates(judgement, before), True
    elif named is not None and error_after["chi2"] > WHITE:
        judgement = replace(judgement, verdict=Verdict.PARTIAL)
    chosen = candidates[0] if judgement.chosen is not None else None
    shares = {
        p.name: {
            kind: _share(search, pointing[p.name][kind].loss, before) if p.name in pointing else 0.0
            for kind in ("stiffness", "damping", "amplitude")
        }
        for p in places
    }
    return MachineTrace(
        judgement.verdict,
        sentence(judgement.verdict, chosen, rivals, error_before, error_after, judgement, vetoed),
        machine,
        made,
        None if named is None else named.place,
        chosen if named is not None else None,
        candidates,
        rivals,
        shares,
        error_before,
        error_after,
        floor,
        (*said_of(frfs), *spent(machine, frfs), *_said_of_lines(floor, error_after["chi2"] <= WHITE)),
        _next(search, judgement, rivals),
        NOT_DECIDABLE,
        {"seed": seed, "version": version("jointlib")},
        tuple(frfs),
        _plots(search, named),
    )


def _or_the_table(judgement: Judgement, table: Judged) -> Judgement:
    """Stiffness and damping by table, where all that has a name leaves much more of what was left out than they do.

    No name goes with them, so that the verdict is partial at best. A law that explains what is missing has a cause: the
    form in which it differs from a contact of many sliders is no reason to give it up.
    """
    least = _BY_FAR if judgement.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS) else _CLEARLY
    if table.left_out >= least * judgement.ordered[0][0].left_out or table.fault(len(EFFECTS) + 2):
        return judgement
    return with_table(judgement, table)


def _floor(setting: Setting, training: Sequence[LevelFRF], residual: ComplexArray) -> dict[str, Any]:
    """The noise as shares of the measured FRFs, and how the records drifted."""
    points = setting.fitting.forward.points
    lost = setting.lines - len(points)
    floor = {
        "relative": _rms(points.deviation) / _rms(points.measured),
        "with_truncation": _rms(setting.fitting.sigma) / _rms(points.measured),
        "source": sorted({r.deviation_from for r in training}),
        "lines": len(points),
        "left_out": lost,
    }
    drifts = setting.drifts(residual, len(training)).tolist()
    floor["drift"] = [
        {"name": r.name, "frequency": d, "level": level} for r, (level, d) in zip(training, drifts, strict=True)
    ]
    return floor


def _said_of_lines(floor: dict[str, Any], explained: bool) -> tuple[str, ...]:
    """What is to be said of lines that are left out, and of records beside the others.

    Where more than noise is left, not all is ``explained``, and what is missing may move a record as drift does.
    """
    lost = floor["left_out"]
    said = [f"{lost} lines are left out: the machine's response is not found there."] if lost else []
    why = "that is taken for" if explained else "that may be what is still missing, or"
    return (
        *said,
        *(
            f"{r['name']}: its natural frequencies lie {r['frequency']:+.2%} and its level {r['level']:+.1%} beside "
            f"those of the others; {why} drift from record to record."
            for r in floor["drift"]
            if abs(r["frequency"]) > _TOLD * FREQUENCY or abs(r["level"]) > _TOLD * LEVEL
        ),
    )


def _rms(x: Array | ComplexArray) -> float:
    return float(np.sqrt(np.mean(np.abs(x) ** 2)))


def _share(search: Search, loss: float, before: float) -> float:
    return float(np.clip((search.before - loss) / before, 0.0, 1.0))


def _candidates(judgement: Judgement, before: float) -> tuple[MachineCandidate, ...]:
    """One row for each family at each place, its best member."""
    seen: set[tuple[str, str]] = set()
    out: list[MachineCandidate] = []
    for j, status, reason in judgement.ordered:
        if (j.place, j.family) in seen:
            continue
        seen.add((j.place, j.family))
        out.append(
            MachineCandidate(
                j.place,
                j.family,
                j.fitted.hypothesis.member,
                parameters_of(j.fitted, j.chi2),
                shifts_of(j.fitted),
                j.gain,
                j.gains,
                float(np.clip(j.gain / before, 0.0, 1.0)),
                len(out) + 1,
                status,
                reason,
            )
        )
    return tuple(out)


def _rivals(search: Search, judgement: Judgement, named: Judged | None) -> tuple[MachineRival, ...]:
    if named is None:
        return ()
    out: list[MachineRival] = []
    for j in judgement.rivals:
        alike = j.place == named.place and {j.family, named.family} == _ALIKE
        far = None if alike else _apart(search, named, j)
        none = _BEYOND if alike else "No single measurement of first harmonics separates them."
        out.append(
            MachineRival(
                j.place,
                j.family,
                j.fitted.hypothesis.member,
                float(j.gain / named.gain),
                none if far is None else far.words,
                0.0 if far is None else far.deviations,
            )
        )
    return tuple(out)


def _apart(search: Search, one: Judged, other: Judged) -> Separation | None:
    """The measurement that separates two explanations best."""
    forward, both = search.fitting.forward, (one.fitted, other.fitted)
    moving = tuple(sorted({*forward.nonlinear, *(row for f in both for row in f.hypothesis.place.rows)}))
    first, second = (f.hypothesis.joints(f.u) for f in both)
    return separation(forward, search.fitting.sigma, first, second, moving)


def _next(search: Search, judgement: Judgement, rivals: Sequence[MachineRival]) -> str:
    if rivals:
        return rivals[0].separating_experiment
    if judgement.verdict is Verdict.NOTHING_MISSING:
        return "None needed at these levels; a higher level would show what these do not reach."
    if judgement.verdict is Verdict.IDENTIFIED:
        return "Confirm on a new record at another level."
    near = [j for j, *_ in judgement.ordered]
    other = next((j for j in near if j.place != near[0].place), None)
    far = None if other is None else _apart(search, near[0], other)
    if other is None or far is None:
        return f"Measure across {near[0].place}, or excite nearer to it: the records hold more than it explains."
    return f"Between {near[0].place} and {other.place}, which come nearest: {far.words}"


def _plots(search: Search, named: Judged | None) -> dict[str, Array | ComplexArray]:
    points = search.fitting.forward.points
    further = search.fitting.correction
    before = search.base.receptance + further
    after = before if named is None else named.fitted.answer.receptance + further
    out: dict[str, Array | ComplexArray] = {}
    for i in np.unique(points.record).tolist():
        rows = points.record == i
        out[f"frequency_{i}"] = points.frequency[rows]
        out[f"measured_{i}"] = points.measured[rows]
        out[f"before_{i}"] = before[rows]
        out[f"after_{i}"] = after[rows]
        out[f"deviation_{i}"] = points.deviation[rows]
    return out
