"""What a trace of test cuts found: the chart with the cuts as marks, the cuts one by one, who competed."""

from __future__ import annotations

import numpy as np

from jointlib.loop.answer.report import Verdict

from ..cut_loop.report import ENTRY, CutCandidate, CutTold, CutTrace
from .drawing import sheet
from .page import Figure, Section, Table

_MEANING = {
    Verdict.IDENTIFIED: "Identified: one effect makes the cuts likely, and no other does as well.",
    Verdict.AMBIGUOUS: "Ambiguous: an effect makes the cuts likely, but they cannot tell it from its rivals.",
    Verdict.PARTIAL: "Partial: one effect explains a good part of the cuts; take it for a hypothesis.",
    Verdict.UNEXPLAINED: "Unexplained: something is missing that the cuts do not name. The machine is unchanged.",
    Verdict.NOTHING_MISSING: "Nothing missing: what the inputs leave open explains the cuts.",
}
_MOST = 10


def cuts_section(report: CutTrace) -> Section:
    """The chart before and after the cuts, the cuts, the suspects, and what they cannot tell."""
    safe = report.safe_cut
    most = (
        f"{report.none_safe[0].upper()}{report.none_safe[1:]}."
        if safe is None
        else f"The most productive cut that is stable with a probability of {report.safe:g}: {safe.speed:g} rpm and "
        f"{1e3 * safe.depth:.3g} mm. {ENTRY[0].upper()}{ENTRY[1:]}."
    )
    text = [_MEANING[report.verdict], report.sentence, report.next_words(), most]
    parts = [_cuts(report), _contest(report), _limits(report)]
    return Section("Test cuts", text, [_chart(report)], parts=[p for p in parts if p.text or p.tables])


def _chart(report: CutTrace) -> Figure:
    with sheet(width=9.5, height=5.0) as paper:
        axes = report.plot(paper.axes)
        depth = 1e3 * report.depth
        if np.ptp(report.probability) > 0 and np.min(report.probability) < report.safe < np.max(report.probability):
            axes.contour(report.speed, depth, report.probability.T, [report.safe], colors="#15803d", linestyles="--")
            axes.plot([], [], "--", color="#15803d", label=f"stable up to here, probability {report.safe:g}")
        deepest = max(1e3 * cut.depth for cut in report.cuts)
        axes.set_ylim(0.0, min(1.5 * deepest, float(depth[-1])))
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, columnspacing=1.5, handlelength=1.8)
    return Figure(
        paper.svg,
        "The depths at which cuts turn, 5 to 95 %, by the inputs alone and with the cuts; the cuts by their "
        "verdict, and the one that tells most. Up to the broken line all cuts are stable with the probability asked "
        "for.",
    )


def _cuts(report: CutTrace) -> Section:
    before, after, size = report.error_before, report.error_after, report.effective_size
    rows = [
        ("held-out cuts classified rightly", f"{100 * before['right']:.0f} %", f"{100 * after['right']:.0f} %"),
        ("mean ln of the probability of their verdicts", f"{before['log_score']:.2f}", f"{after['log_score']:.2f}"),
        (f"effective draws, of {size['draws']:.0f}", f"{size['before']:.0f}", f"{size['after']:.0f}"),
        ("standard errors by which modes are pulled", *(f"{report.strain[at]:.1f}" for at in ("before", "after"))),
    ]
    header = ("cut", "speed [rpm]", "depth [mm]", "verdict", "chatter [Hz]", "held stable before", "and after", "")
    return Section(
        "How the cuts are explained",
        tables=[
            Table(("", "before", "after"), rows, "From all other cuts, those of a speed left out together"),
            Table(header, [_row(cut) for cut in report.cuts], "Probability of being stable", "The cuts one by one"),
        ],
    )


def _row(cut: CutTold) -> tuple[str, ...]:
    heard = "" if cut.chatter_frequency is None else f"{cut.chatter_frequency:.4g}"
    said = "not explained by the machine as it is" if cut.unexplained else ""
    place = f"{cut.speed:g}", f"{1e3 * cut.depth:.3g}"
    return cut.name, *place, cut.verdict, heard, f"{cut.before:.2f}", f"{cut.after:.2f}", said


def _contest(report: CutTrace) -> Section:
    ranked = sorted(report.candidates, key=lambda c: c.rank)[:_MOST]
    rows = [(str(c.rank), c.family, c.member, _sizes(c), f"{c.gain:.1f}", c.status.value, c.reason) for c in ranked]
    header = ("", "effect", "of", "parameters", "gain [nats]", "status", "why")
    rest = len(report.candidates) - len(rows)
    caption = "Gain: ln of how much likelier all cuts become, the prior of its size counted."
    caption += f" {rest} more are in the JSON." if rest else ""
    tables = [Table(header, rows, caption)]
    if report.rivals:
        listed = [(r.family, r.words, r.apart()) for r in report.rivals]
        tables.append(Table(("rival", "change", "evidence"), listed, "Rivals: these cuts cannot rule them out"))
    return Section("How the suspects fared", tables=tables)


def _sizes(c: CutCandidate) -> str:
    said = []
    for name, p in c.parameters.items():
        unit = "" if p["unit"] == "1" else f" {p['unit']}"
        low, high = p["ci95"]
        said.append(f"{name.replace('_', ' ')} {p['value']:.3g}{unit} ({low:.3g} to {high:.3g})")
    return ", ".join(said)


def _limits(report: CutTrace) -> Section:
    rows = [(n["family"], n["needs"]) for n in report.not_decidable]
    tables = [Table(("effect", "what would show it"), rows)] if rows else []
    left = ", ".join(r.family for r in report.left_open)
    text = [f"Not ruled out beside the machine as it is: {left}."] if left else []
    return Section("What these cuts cannot decide", text, tables=tables)
