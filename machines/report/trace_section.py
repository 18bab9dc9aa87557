"""What a trace found, in the order of a reader's questions, each answered under a heading of its own."""

from __future__ import annotations

from jointlib.loop.answer.candidate_picture import half_width, name_of, shown_candidates
from jointlib.loop.answer.report import Candidate, TraceReport, Verdict, figures

from .effect_tables import effect_part, percent
from .error_tables import error_part
from .figures.decay_figure import decay_figures
from .figures.residual_figures import CLASSES, EQUATIONS, place_figures
from .figures.trace_figures import candidate_figure, loop_figures
from .page import Section, Table

_MEANING = {
    Verdict.IDENTIFIED: "Identified: one effect explains the excess alone, and no other fits these records as well.",
    Verdict.AMBIGUOUS: "Ambiguous: one effect explains the excess, but these records cannot tell it from its rivals.",
    Verdict.PARTIAL: "Partial: one effect explains a good part, the rest has no name; take it for a hypothesis.",
    Verdict.UNEXPLAINED: "Unexplained: something is missing, and no effect of the catalogue explains it. Nothing was "
    "added to the joint.",
    Verdict.NOTHING_MISSING: "Nothing missing: what the model leaves is noise.",
}
_TOGETHER = {
    Verdict.IDENTIFIED: "Identified: several effects explain the excess together, and no other takes the place of one.",
    Verdict.AMBIGUOUS: "Ambiguous: several effects explain the excess together, but these records cannot tell all of "
    "them from their rivals.",
    Verdict.PARTIAL: "Partial: several effects explain a good part, the rest has no name; take them for a hypothesis.",
}
_CHANCE = 5.0
"""Times the noise: one line in e^25 is larger by chance."""


def trace_section(report: TraceReport) -> Section:
    """What the model left unexplained, what it was named, what is left now; the page says the finding itself."""
    text = [_meaning(report)]
    parts = [effect_part(report), _fit(report), _place(report), _contest(report), error_part(report), _limits(report)]
    return Section("Closing the loop", text, parts=[p for p in parts if p.text or p.figures or p.tables])


def _meaning(report: TraceReport) -> str:
    """The verdict in a sentence; of several effects that explain together what none does alone, of all of them."""
    return (_TOGETHER if report.composition else _MEANING).get(report.verdict) or _MEANING[report.verdict]


def _fit(report: TraceReport) -> Section:
    return Section(
        "Does the model follow the measurement?", figures=[*loop_figures(report.plots), *decay_figures(report.plots)]
    )


def _place(report: TraceReport) -> Section:
    """Where the residual sits before and after, and the table behind it."""
    rows = []
    for equation, name in EQUATIONS.items():
        for key, word in CLASSES.items():
            cell = report.localisation.get(equation, {}).get(key)
            if cell:
                over = cell["excess"] > cell["threshold"]
                numbers = [f"{cell[k]:,.0f}".replace(",", "\u202f") for k in ("excess", "threshold", "lines")]
                rows.append((name.split(" [")[0], word, *numbers, "more than noise" if over else "noise"))
    tables = []
    if rows:
        header = ("equation", "lines", "excess", "noise stays under", "count of lines", "that is")
        caption = "Excess before, Σ|r|² − n of the whitened residual, on the records fitted"
        tables.append(Table(header, rows, caption, "The statistics behind it"))
    tables += _remainder(report)
    left = report.unexplained.get("fraction")
    text = []
    if left == 0 and report.verdict is not Verdict.NOTHING_MISSING:
        text.append("With the effect added nothing is left above the noise.")
    elif left and report.route == "periodic":
        equation = EQUATIONS.get(str(report.unexplained.get("equation")), "–").split(" [")[0].lower()
        lines = CLASSES.get(str(report.unexplained.get("line_class")), "–")
        text.append(f"Left unexplained: {percent(left)} of the excess, most of it in the {equation}, {lines}.")
    elif left:
        text.append(f"Left unexplained: {percent(left)} of the excess.")
    return Section("Where does the residual sit?", text, place_figures(report), tables)


def _remainder(report: TraceReport) -> list[Table]:
    """The lines, or the blocks, that stand out most after mending."""
    unexplained = report.unexplained
    lines = [line for line in unexplained.get("largest_lines", ()) if line["times_noise"] > _CHANCE]
    if lines:
        rows = [
            (
                EQUATIONS[line["equation"]].split(" [")[0],
                f"{line['frequency_Hz']:.6g}",
                f"{line['times_noise']:.1f}",
                line["record"],
            )
            for line in lines
        ]
        return [Table(("equation", "frequency [Hz]", "times noise", "record"), rows, "Largest single lines left")]
    if unexplained.get("blocks"):
        rows = [
            (str(b["condition"]), f"{b['start_s']:.2f} to {b['end_s']:.2f}", b["record"], percent(b["error_after"]))
            for b in unexplained["blocks"]
        ]
        return [Table(("condition", "time [s]", "record", "error after"), rows, "Largest errors left, held out")]
    return []


def _contest(report: TraceReport) -> Section:
    if not report.candidates:
        return Section("How the candidates fared")
    shown_rows, rows = shown_candidates(report.candidates), []
    for c in shown_rows:
        z, p = c.significance.get("z"), c.significance.get("p_signflip")
        chance = f"z\u00a0=\u00a0{z:.1f}" if z is not None else f"p\u00a0=\u00a0{p:.2g}" if p is not None else "–"
        rows.append(
            (str(c.rank), name_of(c), figures(c.parameters), _gain(c), _folds(c), chance, c.status.value, c.reason)
        )
    header = ("", "effect", "parameters", "gain", "by fold [%]", "chance", "status", "why")
    rest = len(report.candidates) - len(shown_rows)
    caption = "Gain: share of the excess removed on data left out of the fit, with its 95 % interval; by fold: what "
    caption += "each fold adds to it."
    caption += f" {rest} more, all refused, are in trace.json." if rest else ""
    return Section(
        "How the candidates fared",
        figures=[candidate_figure(report)],
        tables=[Table(header, rows, caption, "Each candidate with its statistics")],
    )


def _gain(c: Candidate) -> str:
    if c.share_of_current <= 0:
        return "none"
    half = half_width(c)
    return percent(c.share_of_current) + (f" ± {percent(half, 2)}" if half > 0 else "")


def _folds(c: Candidate) -> str:
    """What each fold adds to the gain, in per cent of it; how many folds gain where there are many or it is lost."""
    up = sum(g > 0 for g in c.per_fold)
    total = sum(c.per_fold)
    if not c.per_fold:
        return "–"
    if total <= 0 or len(c.per_fold) > 8:
        return f"{up} of {len(c.per_fold)} gain"
    return "\u202f/\u202f".join(f"{100 * g / total:.0f}" for g in c.per_fold)


def _limits(report: TraceReport) -> Section:
    """What the records cannot tell, and what to do next."""
    tables = []
    if report.not_decidable:
        lines = [(d["family"], d["why"], d["needs"]) for d in report.not_decidable]
        tables.append(Table(("family", "why it cannot be decided", "what it needs"), lines, "Not decidable here"))
    text = [f"Next experiment: {report.next_experiment}"]
    return Section("What these records cannot tell, and what to do next", text, tables=tables)
