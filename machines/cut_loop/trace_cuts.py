"""The route of a trace of test cuts: draw the machine, weigh it by the cuts, let suspects compete, say what to cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.cuts.judged import JudgedCut, heard_of, judged_cuts
from jointlib.cuts.strange import strange
from jointlib.errors import InputError
from jointlib.io.atomic import sha256
from jointlib.loop.answer.report import Verdict
from jointlib.measurement import CUTS, Measurement

from ..components.modal import Modal
from ..cutting.process.cutting import Cutting
from ..model.machine import Machine
from ..model.spindle_speed import refuse_dependence
from .advice import chance_at, outlook
from .borders import conditions_of
from .contest import NEEDED, ODDS, STRAINED, Entry, Outcome, decided, entry, errors, folds_of, surprising
from .line_up import suspects_of
from .posterior import Posterior
from .problem import Problem, problem_of
from .report import CutCandidate, CutRival, CutTold, CutTrace
from .sampled_tool import SampledTool, sampled_tool
from .sentences import nearly, reach, sentence
from .suspects import AsItIs
from .tempered import posterior, posteriors

DRAWS, SAFE = 300, 0.95
_FEWEST = 6
_SCATTERS = 0.25
"""Of ln depth: where the exact border scatters more about what was learnt, that is said."""


def trace_cuts(
    measurement: Measurement,
    machine: Machine,
    *,
    seed: int = 0,
    draws: int | None = None,
    safe: float = SAFE,
    asked: tuple[float, float] | None = None,
) -> CutTrace:
    """Say which test cuts a machine cannot explain, which effect would, and what to cut next.

    Parameters
    ----------
    measurement
        Of kind ``cuts``.
    machine
        With a tool and a cut; its joints, modes, measured responses and coefficients carry what is known of their
        errors, which is the prior.
    seed
        Of all that is drawn.
    draws
        Samples of the machine and of every suspect, default `DRAWS`.
    safe
        Probability of being stable that the most productive cut is to have.
    asked
        A cut, rpm and m, whose probability of being stable is to be told.
    """
    draws = DRAWS if draws is None else draws
    judged = judged_cuts(measurement)
    table = _checked(measurement, machine, judged, safe)
    cuts = tuple(one.cut for one in judged if one.cut.verdict != "unknown")
    conditions, index = conditions_of(cuts, table, machine.tool_axes)
    tool = sampled_tool(machine, draws, seed, min(at.tooth_frequency for at in conditions))
    problem = problem_of(cuts, conditions, index, machine, tool, seed)
    fastest, usual = max(cut.speed for cut in cuts), float(np.exp(np.mean(np.log([cut.depth for cut in cuts]))))
    heard = max((cut.chatter_frequency or 0.0 for cut in cuts), default=0.0)
    suspects, undecided = suspects_of(tool, table, fastest, usual, heard)
    folds = folds_of(problem)
    base = entry(posterior(AsItIs(), problem), problem, folds)
    tried = posteriors(suspects, problem, base.weight + float(np.log(ODDS)))
    entries = [entry(one, problem, folds) for one in tried]
    outcome = decided(base, entries, problem)
    after = outcome.chosen or base
    believed = [after, *outcome.rivals, *(outcome.left_open if outcome.chosen is None else ())]
    seen = outlook(machine, problem, believed, safe, seed)
    changes, mended = _changes(machine, outcome)
    odd = strange([one.cut for one in judged], measurement.sample_rate, (machine.cutting or {}).get("diameter"))
    return CutTrace(
        verdict=outcome.verdict,
        sentence=sentence(outcome, base, problem, seen),
        machine=machine,
        chosen=None if outcome.chosen is None else _candidates(base, entries, outcome)[entries.index(outcome.chosen)],
        candidates=tuple(_candidates(base, entries, outcome)),
        rivals=tuple(_rival(one, after) for one in outcome.rivals),
        left_open=tuple(_rival(one, after) for one in outcome.left_open),
        odds=outcome.odds,
        error_before=errors(base, problem),
        error_after=errors(after, problem),
        next_cut=seen.next_cut,
        safe_cut=None if outcome.verdict is Verdict.UNEXPLAINED else seen.safe_cut,
        safe=safe,
        effective_size={"before": base.posterior.effective, "after": after.posterior.effective, "draws": float(draws)},
        strain={"before": base.posterior.strain, "after": after.posterior.strain},
        cuts=tuple(_told(problem, base, after)),
        tried=tuple(one.cut for one in judged),
        speed=seen.speed,
        band_before=seen.before,
        band_after=seen.after,
        depth=seen.depth,
        probability=seen.probability,
        asked=None if asked is None else chance_at(machine, problem, believed, *asked, seed),
        warnings=(*odd, *_warnings(measurement, judged, tool, problem, base, mended), *nearly(base, outcome)),
        not_decidable=tuple(undecided),
        repro=_repro(measurement, machine, seed, draws),
        changes=changes,
    )


def _checked(m: Measurement, machine: Machine, judged: Sequence[JudgedCut], safe: float) -> Cutting:
    if m.kind != CUTS:
        raise InputError(f"{m.source}: kind is {m.kind!r}, expected {CUTS!r}")
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], expected the operation that the cuts were made with")
    if not machine.tool_axes:
        raise InputError(f"{machine.where}: no tool point, expected [tool] with x or y")
    if not 0.5 <= safe < 1:
        raise InputError(f"--safe: {safe:g}, expected a probability from 0.5 to below 1")
    refuse_dependence(machine, "a trace of cuts")
    table = Cutting(**dict(machine.cutting))
    other = next((one.cut for one in judged if one.cut.teeth != table.cuts_per_revolution), None)
    if other is not None:
        raise InputError(
            f"{m.source}: {other.name} was made with {other.teeth} teeth, the machine has {table.cuts_per_revolution}"
        )
    told = [one.cut for one in judged if one.cut.verdict != "unknown"]
    if len(told) < _FEWEST:
        raise InputError(f"{m.source}: {len(told)} cuts with a verdict, expected at least {_FEWEST}")
    return table


def _told(problem: Problem, base: Entry, after: Entry) -> list[CutTold]:
    odd = surprising(base, problem)
    return [
        CutTold(
            cut.name,
            cut.speed,
            cut.depth,
            str(cut.verdict),
            cut.chatter_frequency,
            float(base.stable[i]),
            float(after.stable[i]),
            bool(odd[i]),
        )
        for i, cut in enumerate(problem.cuts)
    ]


def _candidates(base: Entry, entries: Sequence[Entry], outcome: Outcome) -> list[CutCandidate]:
    gains = [one.weight - base.weight for one in entries]
    order = np.argsort(np.argsort([-gain for gain in gains]))
    found = []
    for i, one in enumerate(entries):
        of = one.posterior
        found.append(
            CutCandidate(
                of.suspect.family,
                of.suspect.member,
                _parameters(of),
                one.total - base.total,
                gains[i],
                tuple((one.score - base.score).tolist()),
                of.effective,
                int(order[i]) + 1,
                outcome.status[i],
                outcome.reason[i],
                of.told(),
            )
        )
    return found


def _parameters(of: Posterior) -> dict[str, dict[str, Any]]:
    middle, inside = of.mean(), of.interval()
    units = dict(of.suspect.parameters)
    return {name: {"value": middle[name], "unit": units[name], "ci95": list(inside[name])} for name in middle}


def _rival(one: Entry, best: Entry) -> CutRival:
    of = one.posterior
    return CutRival(of.suspect.family, of.suspect.member, best.weight - one.weight, of.effective, of.told())


def _changes(machine: Machine, outcome: Outcome) -> tuple[Mapping[str, Any], str]:
    """Keys of the machine file that the finding is, and a sentence where it is none."""
    if outcome.chosen is None:
        return {}, ""
    of, value, table = outcome.chosen.posterior.suspect, outcome.chosen.posterior.mean(), machine.cutting or {}
    if of.family == "process-damping":
        if table.get("indentation") is None:
            return {"cutting.process_damping": value["process_damping"] + (table.get("process_damping") or 0.0)}, ""
    elif of.family == "coefficient":
        full = Cutting(**dict(table))
        keys = ("specific",) if full.process != "milling" else ("tangential", "normal")
        return {f"cutting.{key}": float(getattr(full, key) * value["factor"]) for key in keys}, ""
    elif of.family in ("mode-frequency", "mode-damping"):
        found = _mode_of(machine, float(getattr(of, "at", 0.0)))
        if found is not None:
            part, row = found
            factor, name = value["factor"], f"component.{part.name}"
            if of.family == "mode-damping":
                return {f"{name}.damping_ratio": _scaled(part.damping_ratio, row, factor)}, ""
            assert part.modal_mass is not None
            frequency = _scaled(part.frequency, row, factor)
            mass = _scaled(part.modal_mass, row, factor ** (-2 * value["mass_share"]))
            return {f"{name}.frequency": frequency, f"{name}.modal_mass": mass}, ""
    return {}, f"{of.family} is no key of the machine file: the mended machine is the one that went in."


def _scaled(values: Array, row: int, factor: float) -> list[float]:
    return [float(value * factor) if i == row else float(value) for i, value in enumerate(values)]


def _mode_of(machine: Machine, frequency: float) -> tuple[Modal, int] | None:
    """The mode of a modal component that stands in the machine as it is, and which one; None where joints shift it."""
    if machine.connections or machine.source is None:
        return None
    for part in machine.components:
        if isinstance(part, Modal):
            off = np.abs(part.frequency / frequency - 1)
            if np.min(off) < 0.05:
                return part, int(np.argmin(off))
    return None


def _warnings(
    m: Measurement,
    judged: Sequence[JudgedCut],
    tool: SampledTool,
    problem: Problem,
    base: Entry,
    mended: str,
) -> list[str]:
    said = [one.doubt() for one in judged if one.doubt()] + heard_of(judged)
    unknown = sum(one.cut.verdict == "unknown" for one in judged)
    if unknown:
        said.append(f"{unknown} cuts of unknown verdict are left out.")
    if tool.certain:
        said.append("No input carries an error: the prior is the chart itself, and every deviation is held against it.")
    if tool.left_out:
        said.append(f"{tool.left_out} samples of the machine have other modes and are left out.")
    if not base.reached:
        said.append(
            f"The machine as it is, before any finding, reaches the cuts with {reach(base)} alone ({NEEDED:g} draws "
            f"are needed and {STRAINED:g} standard errors at most): that is a residual and no posterior."
        )
    wide = [place.at.speed for k, place in enumerate(problem.places) if problem.scatter(k) > _SCATTERS]
    if wide:
        listed = ", ".join(f"{speed:g}" for speed in wide[:5])
        more = " …" if len(wide) > 5 else ""
        said.append(f"Where the exact border lies scatters about what was learnt of it at {listed}{more} rpm.")
    return [*said, *([mended] if mended else [])]


def _repro(m: Measurement, machine: Machine, seed: int, draws: int) -> dict[str, Any]:
    sources = [path for path in (m.source, machine.source) if path is not None and path.is_file()]
    return {
        "program": f"jointlib {version('jointlib')}",
        "simulated": m.simulated,
        "seed": seed,
        "draws": draws,
        "files": [{"file": path.name, "sha256": sha256(path)} for path in sources],
    }
