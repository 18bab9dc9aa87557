"""What a trace found, as lines of text."""

from __future__ import annotations

from jointlib.loop.answer.report import TraceReport


def words(report: TraceReport) -> list[str]:
    """The finding and the errors as lines of text."""
    lines = [f"{report.verdict.value}: {report.sentence}"]
    before, after = report.error_before, report.error_after
    lines.append(
        f"error before {100 * before['relative']:.3g} %, after {100 * after['relative']:.3g} % "
        f"(on {before.get('where', 'the records')}); in sample {100 * before['in_sample']:.3g} %, "
        f"{100 * after['in_sample']:.3g} %"
    )
    for step in report.reduction.get("steps", ())[1:]:
        found = ", ".join(f"{name} {e.words()}" for name, e in step["parameters"].items())
        lines.append(f"with {step['family']}: in sample {100 * step['in_sample']:.3g} %; {found}")
    by_experiment: dict[str, dict[str, None]] = {}
    for r in report.rivals:
        member = f" ({r.member})" if r.member not in ("", r.family) else ""
        by_experiment.setdefault(r.separating_experiment, {})[f"{r.family}{member} {r.where}".strip()] = None
    for test, rivals in by_experiment.items():
        lines.append(f"rival{'s' * (len(rivals) > 1)}: {', '.join(rivals)}. {test}")
    if report.corrections:
        lines.append("the mended measurement file undoes it; trace that file with the mended joint to go on")
    return [*lines, *(f"warning: {w}" for w in report.warnings)]
