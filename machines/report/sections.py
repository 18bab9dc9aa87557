"""The sections of a report, one per step of the road."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointlib.identification import Identification
from jointlib.identification.force_samples import RestoringForce
from jointlib.joint import Joint
from jointlib.loop.report import TraceReport
from jointlib.units import shown

from ..linear import LinearCheck
from ..lobes import StabilityLobes
from ..response import Response
from .joint_figures import gain, gain_over_frequency, static_fit, surface
from .machine_figures import check_figure, lobes_figure, response_figure
from .page import Figure, Section, Table
from .trace_figures import candidate_table, trace_figures


def parameter_table(joint: Joint, caption: str) -> Table:
    """Parameters with their standard errors, in the units people read."""
    rows = []
    units = joint.units
    for name, value in joint.parameters.items():
        factor, unit = shown(units[name])
        error = joint.covariance.standard_error(name) if joint.covariance else np.nan
        spread = f"± {error * factor:.2g}" if np.isfinite(error) else "not estimated"
        rows.append((name, f"{value * factor:.6g}", spread, unit))
    return Table(("parameter", "value", "standard error", "unit"), rows, caption)


def identification_section(found: Identification, simulated: bool) -> Section:
    """What the records say of the joint, before anything is doubted."""
    figures = []
    if found.static is not None:
        s = found.static
        figures.append(
            static_fit(Joint((s.law,)), s.deflection, s.load, s.preloads, s.rms_by_preload, float(s.law.preload))
        )
    if found.surfaces:
        figures.append(_surface(found.surfaces, found.joint))
    text = [
        "The records are simulated; nothing here was measured on a machine."
        if simulated
        else "The joint was fitted to the records."
    ]
    text += [f"{e.measurement}: {e.rms:.4g} {e.unit} rms, {100 * e.relative:.2f} % of the peak." for e in found.errors]
    said = [m for m in found.messages if not m.endswith("the records are simulated.")]
    return Section("The joint as identified", [*text, *said], figures, [parameter_table(found.joint, "First fit")])


def _surface(samples: Sequence[RestoringForce], joint: Joint) -> Figure:
    z, v, f = (np.concatenate([getattr(s, name) for s in samples]) for name in ("z", "v", "f"))
    return surface(z, v, f, joint, float(z @ f / (z @ z)))


def trace_section(report: TraceReport) -> Section:
    """What the model left unexplained, what it was named, what is left now."""
    before, after = report.error_before, report.error_after
    text = [report.sentence]
    if report.rivals:
        text.append(
            "These data cannot tell it from: "
            + "; ".join(f"{r.family} ({r.separating_experiment})" for r in report.rivals)
            + "."
        )
    rows = []
    for key, name in (
        ("relative", "relative error"),
        ("in_sample", "in sample"),
        ("heldout_condition", "held out by condition"),
        ("heldout_block", "held out by block"),
        ("joint_N", "joint equation [N]"),
        ("balance_N", "balance equation [N]"),
        ("redundancy_ms2", "redundancy equation [m/s²]"),
        ("chi2", "chi²"),
    ):
        if before.get(key) is not None and after.get(key) is not None:
            percent = key in ("relative", "in_sample") or key.startswith("heldout")
            values = [f"{100 * e[key]:.3g} %" if percent else f"{e[key]:.4g}" for e in (before, after)]
            rows.append((name, *values))
    errors = Table(("", "before", "after"), rows, f"Error before and after, on {before.get('where', 'the records')}")
    steps = step_table(report)
    tables = [
        errors,
        *([steps] if steps else []),
        parameter_table(report.mended, "Mended joint"),
        candidate_table(report),
    ]
    if report.not_decidable:
        lines = [(d["family"], d["why"], d["needs"]) for d in report.not_decidable]
        tables.append(Table(("family", "why it cannot be decided", "what it needs"), lines, "Not decidable here"))
    return Section("Closing the loop", [*text, *report.warnings], trace_figures(report), tables)


def step_table(report: TraceReport) -> Table | None:
    """How the error fell term by term, where the route tells it."""
    rows = []
    for step in report.reduction.get("steps", ()):
        errors = (step["in_sample"], step["heldout_condition"], step["heldout_block"])
        shown_errors = ("–" if e is None else f"{100 * e:.3g} %" for e in errors)
        words = ", ".join(f"{name} {e.words()}" for name, e in step["parameters"].items())
        rows.append((f"+ {step['family']}" if step["family"] else "model as given", *shown_errors, words))
    header = ("step", "in sample", "held out by condition", "by block", "parameters then, with 95 % intervals")
    return Table(header, rows, "Term by term") if rows else None


def gain_section(name: str, joints: Mapping[str, Joint], frequency: float) -> Section:
    """Describing functions of a joint as it was and as it is used, the last."""
    used = list(joints.values())[-1]
    high = used.validity.get("amplitude", (0.0, 5e-6))[1]
    A = np.geomspace(high / 100, 1.5 * high, 160)
    figures = [gain(joints, A, frequency)]
    figures.append(gain_over_frequency(used, high * np.array([0.1, 0.3, 1.0]), np.geomspace(10, 1e7, 120)))
    text = [
        "The describing function is what the machine sees of the joint: at each amplitude an equivalent stiffness and "
        "damping."
    ]
    return Section(f"Describing function of {name}", text, figures)


def check_section(check: LinearCheck) -> Section:
    """Receptance coupling against python-control."""
    verdict = "agree" if check.passed else "DO NOT AGREE"
    text = [
        f"With its joints linearised the coupled machine and a python-control model {verdict}: largest relative "
        f"difference in norm {check.max_relative_difference:.2g}, limit 1e-8."
    ]
    text += [f"Left out of both: {e}." for e in check.excluded]
    ours, theirs = check.coupled.receptance[:, 0, 0], check.control.receptance[:, 0, 0]
    return Section("Check against python-control", text, [check_figure(check.frequency, ours, theirs)])


def response_section(result: Response) -> Section:
    """Forced response per force level."""
    rows = [
        (f"{p.force:g}", p.connection, f"{p.amplitude * 1e6:.4g}", f"{p.frequency:.5g}", p.outcome.name.lower())
        for p in result.peaks
    ]
    header = ("force [N]", "joint", "amplitude [µm]", "frequency [Hz]", "outcome")
    said = sorted({f"{f:g} N: {o.value}" for f, o in zip(result.force, result.outcomes, strict=True) if o.value})
    text = ["The response no longer scales with the force: each level has its own resonance and damping.", *said]
    table = Table(header, rows, "Peaks of the relative motion, refined between the lines")
    return Section("Forced response", text, [response_figure(result, result.outputs[0])], [table])


def lobes_section(charts: Sequence[tuple[float, StabilityLobes]]) -> Section:
    """Stability lobes at several tool-point amplitudes."""
    rows = [
        (
            "vanishing" if A == 0 else f"{A * 1e6:g}",
            f"{c.minimum_depth * 1e3:.4g}",
            f"{c.minimum_frequency:.5g}",
            c.method,
        )
        for A, c in charts
    ]
    header = ("tool-point amplitude [µm]", "minimum depth [mm]", "chatter frequency [Hz]", "method")
    notes = sorted({*charts[0][1].notes, *(w for _, c in charts for w in c.warnings)})
    return Section("Stability lobes", notes, [lobes_figure(charts)], [Table(header, rows)])
