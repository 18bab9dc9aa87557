"""What stands at the head of the page about a trace."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jointlib.loop.answer.report import TraceReport
    from jointlib.measurement import Measurement


def trace_numbers(report: TraceReport) -> list[tuple[str, str]]:
    """Verdict and errors for the head of a report."""
    chosen = report.chosen
    alone = "–" if chosen is None else f"{chosen.family} {chosen.where}".strip()
    together = [c["member"] if c["family"] == "modulation" else c["family"] for c in report.composition]
    return [
        ("verdict", report.verdict.value.replace("_", " ")),
        ("missing effects" if together else "missing effect", ", ".join(together) or alone),
        ("error before", f"{100 * report.error_before['relative']:.3g} %"),
        ("error after", f"{100 * report.error_after['relative']:.3g} %"),
    ]


def inputs_of(tests: list[Measurement]) -> list[tuple[str, str]]:
    """Every file that a report stands on, with its hash."""
    from jointlib.io.atomic import sha256

    files = dict.fromkeys(f for test in tests for f in (test.source, *(r.file for r in test.records)))
    return [(file.name, sha256(file)) for file in files]


def assumptions_of(tests: list[Measurement]) -> list[str]:
    """What the tests take for granted."""
    said = [f"{t.source.name}: the records are simulated, not measured." for t in tests if t.simulated]
    for test in tests:
        for name, mass in test.bodies.items():
            if mass.value is not None:
                said.append(f"{test.source.name}: {name} weighs {mass.value:g} kg ± {mass.uncertainty:g} kg.")
    return said or ["None beyond the files."]
