"""Close the loop on a force measured along a path."""

from __future__ import annotations

from dataclasses import replace

from jointlib.effects.preload_shape import PreloadShape
from jointlib.estimation.same_motion import refuse_other_motion
from jointlib.identification.strange import strange_mass, yielding
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop.answer.catalogue import catalogue
from jointlib.loop.answer.report import TraceReport
from jointlib.loop.path.answer import answer
from jointlib.loop.path.band_floor import with_band_floor
from jointlib.loop.path.checks import check_laws, check_records, exists_in_time, missing_of
from jointlib.loop.path.columns import law_forces
from jointlib.loop.path.composed.beam import search
from jointlib.loop.path.composed.follower import followers
from jointlib.loop.path.composed.input_lag import input_lags
from jointlib.loop.path.estimates import estimates
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.preparation import choose_preparation, prepare
from jointlib.loop.path.repeats import repeat_floor
from jointlib.loop.path.strokes import divide
from jointlib.measurement import Measurement


def trace_path(measurement: Measurement, joint: Joint, *, seed: int = 0) -> TraceReport:
    """Say what F = m a + f(z, ż) + F0 leaves unexplained along the measured paths, and which effect it is.

    The joint is refitted with the offset (and the carriage's mass where unknown), then every installed effect
    competes beside it. Conditions left out (speeds, levels, records) decide; blocks left out show the noise.
    Sealed records are opened after everything is chosen. ``seed`` drives the sign-flip permutations only.
    """
    check_laws(joint, str(measurement.source))
    records = read_records(measurement, measurement.with_role("fit"))
    check_records(measurement, records)
    doubts = refuse_other_motion(measurement, records)
    preparation = choose_preparation(measurement, records)
    runs = tuple(prepare(measurement, record, preparation) for record in records)
    division = divide(runs)
    floor = with_band_floor(repeat_floor(runs, division), measurement, records, preparation, division)
    evidence = Evidence(runs, measurement.carriage, division, floor, law_forces(runs))
    found = catalogue()
    missing = missing_of(measurement, records)
    undeclared = measurement.carriage is None
    faults = [f for f in found.path if f.requires not in missing and (undeclared or not f.inertia)]
    effects = [e for e in found.joint if exists_in_time(e)]
    known = joint.with_parameters(joint.parameters)
    finding = search(evidence, known, [*effects, PreloadShape(), *followers(runs), *input_lags(runs), *faults], seed)
    report = answer(measurement, joint, records, finding.before.evidence, finding, found.path, missing, seed)
    moving = estimates(finding.before if report.mended is joint else finding.after).get("mass")
    if moving is not None:
        doubts += strange_mass(measurement, moving.value, moving.standard_error or 0.0)
    doubts += yielding((run.force, run.path.velocity) for run in runs)
    return replace(report, warnings=(*doubts, *report.warnings, *found.failed))
