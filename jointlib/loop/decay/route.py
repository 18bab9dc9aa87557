"""Close the loop on free decays."""

from __future__ import annotations

from dataclasses import replace

from jointlib.effect import JointEffect
from jointlib.errors import InputError
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop.answer.catalogue import catalogue
from jointlib.loop.answer.report import TraceReport
from jointlib.loop.decay.answer import Sealed, report_of
from jointlib.loop.decay.contest import Round, is_quiet
from jointlib.loop.decay.fitted import fit, folds_of, with_folds
from jointlib.loop.decay.rounded import rounded
from jointlib.loop.decay.search import Search, search
from jointlib.loop.path.checks import exists_in_time
from jointlib.measurement import Measurement
from jointlib.registry import installed as installed_laws
from jointlib.ringdown.backbone import backbones
from jointlib.ringdown.evidence import evidence_of, free_of
from jointlib.ringdown.identify import said_of


def _steps_by_turns(effect: JointEffect) -> bool:
    """Members with memory that need every sample stepped are left out: a decay does not tell them from the others."""
    kind = installed_laws("jointlib.laws").found.get(effect.member)
    return kind is None or not kind.states or kind.by_turns


def trace_decay(measurement: Measurement, joint: Joint, *, seed: int = 0) -> TraceReport:
    """Say what M z̈ + f(z, ż) = 0 leaves unexplained of frequency and damping over amplitude, and which effect it is.

    The joint is everything that holds the mode. It is refitted, then every installed effect of a joint competes
    beside it by its describing function. Conditions left out (levels, else records) decide. Sealed records are opened
    after everything is chosen.
    """
    if not free_of(joint):
        raise InputError(
            f"{measurement.source}: joint {joint.name!r} has no parameter that is free, expected one to refit"
        )
    records = read_records(measurement, measurement.with_role("fit"))
    modes = backbones(measurement, records)
    evidence = evidence_of(measurement, modes)
    folds = folds_of(evidence)
    before = with_folds(evidence, folds, fit(evidence, joint))
    installed = catalogue()
    if is_quiet(before.loss, len(folds.masks[0])):
        found = Search(before, Round(before, ()), (), before, 0.0, (), len(folds.masks[0]))
    else:
        found = search(
            evidence, folds, before, [e for e in installed.joint if exists_in_time(e) and _steps_by_turns(e)]
        )
        found = replace(found, rounded=rounded(evidence, before.joint, found.after))
    opened = read_records(measurement, measurement.with_role("sealed"))
    sealed = Sealed(evidence_of(measurement, backbones(measurement, opened)), opened) if opened else None
    report = report_of(measurement, joint, records, evidence, folds, found, sealed, said_of(modes), seed)
    return replace(report, warnings=(*report.warnings, *installed.failed))
