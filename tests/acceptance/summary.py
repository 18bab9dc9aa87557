"""From a result file to the figures of the suite, and to the page ``docs/acceptance.md``.

python tests/acceptance/summary.py RESULTS.jsonl docs/acceptance.md
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from cells import CATALOGUE, HELD, IN_JOINT, LOUD, OUTSIDE

Row = dict[str, Any]
Test = Callable[[Row], bool]
MISSED: dict[str, str] = {
    "longest trace, s of one core": "a ripple of the force, which is outside the catalogue, asks for two hypotheses "
    "and their exchange, 11 to 16 s; five more records take 10.1 to 10.9. One effect of the catalogue alone takes 3 s "
    "in the median and less than 10 in all runs",
}
"""Demands that were measured and not met, each with the reason; the page says them."""
MACHINES = "## Measured FRFs of a machine"
"""Where the part on machines begins."""
PATHS = "## Several effects along a path"
"""Where the part on paths begins."""
SEVERAL = "## Several effects on a rig"
"""Where the part on rigs with several effects begins, the last one."""
INTERVALS = ("gain", "delay", "mass", "stiffness3", "slip_force")


def share_line(what: str, rows: Sequence[Row], test: Test, demanded: str) -> str:
    """A row of a table: how many of the runs pass a test."""
    reached = f"{100 * sum(map(test, rows)) / len(rows):.1f} %" if rows else "–"
    return f"| {what} | {len(rows)} | {demanded} | {reached} |"


def read(path: Path) -> list[Row]:
    """Rows of a result file."""
    return [json.loads(text) for text in path.read_text().splitlines()]


def same(row: Row, answer: Row | None, which: int = 0) -> bool:
    """True where an answer is the truth: its family, and the channel or body where one is faulty, or the member of a
    modulation, ``stiffness-by-temperature``."""
    if not answer or which >= len(row["truth"]) or answer["family"] != row["truth"][which]:
        return False
    sites = row["site"].split()
    site = sites[which] if which < len(sites) else ""
    said = answer.get("channel") or answer.get("body")
    if answer["family"] == "modulation":
        said = answer["member"].replace(" ", "-")
    return site in ("", "-") or said is None or said == site


def named(row: Row) -> bool:
    """The verdict carries a name."""
    return row["verdict"] in ("identified", "ambiguous")


def first(row: Row) -> bool:
    """The truth is chosen, whatever the verdict."""
    return same(row, row.get("chosen"))


def in_set(row: Row) -> bool:
    """The truth is chosen or a rival."""
    return first(row) or any(same(row, r) for r in row.get("rivals") or ())


def found(row: Row, terms: Sequence[Row | None]) -> bool:
    """Every truth is one of the terms, or a rival of one."""
    answers = [t for t in terms if t] + [r for t in terms if t for r in t.get("rivals") or ()]
    answers += row.get("rivals") or ()
    return all(any(same(row, a, k) for a in answers) for k in range(len(row["truth"])))


def both(row: Row) -> bool:
    """Two truths, both among the terms."""
    return found(row, [row.get("chosen"), *(row.get("chain") or ())])


def both_listed(row: Row) -> bool:
    """The same, those counted that passed every test but the size beside the first."""
    return found(row, [row.get("chosen"), *(row.get("chain") or ()), *(row.get("secondary") or ())])


def wrong_without_pair(row: Row) -> bool:
    """A family stands for the removed one, and the catalogue does not say that the two look alike."""
    return named(row) and row["chosen"]["family"] not in row.get("declared_pairs", ())


def removed(row: Row) -> float | None:
    """Share of the power above the floor that is gone from the joint equation of the sealed record."""
    before, after = row["error_before"], row["error_after"]
    excess = [max(e["joint_N"] ** 2 - e["joint_floor_N"] ** 2, 0.0) for e in (before, after)]
    # Less than a tenth above the floor there is nothing to remove that could be told from noise.
    if before["joint_N"] < 1.1 * before["joint_floor_N"]:
        return None
    return float(1 - excess[1] / excess[0])


def covered(row: Row) -> list[bool]:
    """For every parameter with a true value that was estimated with an interval: does it hold the truth?"""
    if not named(row) or not first(row):
        return []
    out = []
    for name, value in row["values"].items():
        for key, estimate in row["chosen"]["params"].items():
            interval = estimate.get("ci95")
            if name in INTERVALS and key.split(".")[-1] == name and interval and None not in interval:
                out.append(interval[0] <= value <= interval[1])
    return out


@dataclass(frozen=True)
class Figure:
    """One demand and what was reached."""

    number: int
    demand: str
    cells: int
    reached: float
    bound: float
    at_least: bool = True
    percent: bool = True

    @property
    def met(self) -> bool:
        """Within the demand; nothing measured is not met."""
        good = self.reached >= self.bound if self.at_least else self.reached <= self.bound
        return self.cells > 0 and bool(good)

    def words(self) -> str:
        """What was reached, as the page shows it."""
        if not self.cells:
            return "–"
        return f"{100 * self.reached:.1f} %" if self.percent else f"{self.reached:.3g}"


def share(rows: Iterable[Row], test: Test) -> tuple[int, float]:
    """Number of rows, and the share that passes."""
    hits = [test(r) for r in rows]
    return len(hits), float(np.mean(hits)) if hits else float("nan")


def quantile(values: Sequence[float], q: float) -> tuple[int, float]:
    """Number of values, and their quantile."""
    return len(values), float(np.quantile(values, q)) if values else float("nan")


def figures(rows: Sequence[Row]) -> list[Figure]:
    """All figures of the suite."""
    by = {
        g: [r for r in rows if r["group"] == g]
        for g in ("main", "null", "outside", "removed", "coverage", "two", "peaks", "small", "held", "loud")
    }
    alive = [r for r in by["main"] if r["verdict"] != "error"]
    ms = [r for r in by["main"] if r["signal"] == "MS"]
    am = [r for r in by["main"] if r["signal"] == "AM" and r["decibel"] > 30]
    am30 = [r for r in by["main"] if r["signal"] == "AM" and r["decibel"] == 30]
    identified = [r for r in alive if r["verdict"] == "identified"]
    joint = [r for r in alive if r["effect"] in IN_JOINT and named(r)]
    gone = [x for r in joint if (x := removed(r)) is not None]
    noisy, quiet = ([r for r in joint if (r["decibel"] == 60) == at60] for at60 in (False, True))
    empty = [r for r in by["null"] if r["verdict"] != "error"]
    chi2 = np.array([r["error_before"]["chi2"] for r in empty])
    intervals = [hit for r in (*by["coverage"], *alive) for hit in covered(r)]
    seconds = [r["tracing_s"] for r in rows if "tracing_s" in r]
    biased = [r for r in by["coverage"] if r["effect"] == "exact-quadratic" and named(r) and first(r)]

    def above(bound: float) -> Test:
        return lambda r: r["error_after"]["joint_N"] <= bound * r["error_after"]["joint_floor_N"]

    def flagged(row: Row) -> bool:
        return all(p.get("biased") for k, p in row["chosen"]["params"].items() if k.endswith("stiffness2"))

    return [
        Figure(1, "MS: truth chosen or a rival", *share(ms, in_set), 0.95),
        Figure(1, "MS: truth in first place", *share(ms, first), 0.90),
        Figure(2, "AM, 60 and 40 dB: truth chosen or a rival", *share(am, in_set), 0.95),
        Figure(2, "AM, 60 and 40 dB: truth in first place", *share(am, first), 0.90),
        Figure(2, "AM, 30 dB: truth chosen or a rival", *share(am30, in_set), 0.90),
        Figure(2, "AM, 30 dB: truth in first place", *share(am30, first), 0.85),
        Figure(3, "`identified` is right", *share(identified, first), 0.99),
        Figure(
            3, "`identified` or `ambiguous`: truth in the set", *share([r for r in alive if named(r)], in_set), 0.98
        ),
        Figure(
            4, "nothing injected: named", *share(by["null"], lambda r: r["verdict"] != "nothing_missing"), 0.01, False
        ),
        Figure(
            4,
            "nothing injected: mean χ² off 1",
            len(chi2),
            abs(float(chi2.mean()) - 1) if len(chi2) else 0.0,
            0.04,
            False,
            False,
        ),
        Figure(5, "outside the catalogue: named", *share(by["outside"], named), 0.02, False),
        Figure(
            5, "family removed: named outside declared pairs", *share(by["removed"], wrong_without_pair), 0.05, False
        ),
        Figure(6, "sealed record, joint effects: excess removed, median", *quantile(gone, 0.5), 0.99),
        Figure(6, "the same, tenth percentile", *quantile(gone, 0.1), 0.80),
        Figure(6, "joint rms at most 1.1 × floor, 40 and 30 dB", *share(noisy, above(1.1)), 0.90),
        Figure(6, "joint rms at most 2 × floor, 60 dB", *share(quiet, above(2.0)), 0.90),
        Figure(
            7,
            "95 % intervals hold the truth, at least",
            len(intervals),
            float(np.mean(intervals)) if intervals else 0.0,
            0.85,
        ),
        Figure(
            7,
            "95 % intervals hold the truth, at most",
            len(intervals),
            float(np.mean(intervals)) if intervals else 1.0,
            0.99,
            False,
        ),
        Figure(7, "k2 is flagged `biased`", *share(biased, flagged), 1.0),
        Figure(8, "two effects of even weight: both among the terms", *share(by["two"], both), 0.75),
        Figure(8, "two effects of even peaks: both listed", *share(by["peaks"], both_listed), 0.75),
        Figure(
            8,
            "five times smaller, MS, 40 dB: detected",
            *share(by["small"], lambda r: r["verdict"] not in ("nothing_missing", "error")),
            0.90,
        ),
        Figure(9, "a body held to ground: truth chosen or a rival", *share(by["held"], in_set), 0.90),
        Figure(
            9,
            "a body held to ground: named, and the truth not in the set",
            *share(by["held"], lambda r: named(r) and not in_set(r)),
            0.01,
            False,
        ),
        Figure(
            9,
            "noise that grows with the drive: named, or not `nothing_missing`",
            *share(by["loud"], lambda r: r["verdict"] != "nothing_missing"),
            0.0,
            False,
        ),
        Figure(10, "longest trace, s of one core", len(seconds), max(seconds, default=0.0), 10.0, False, False),
    ]


def answer(row: Row) -> str:
    """The verdict, with the family where one is named."""
    return str(row["chosen"]["family"] if named(row) else row["verdict"].replace("_", " "))


def confusion(rows: Sequence[Row], effects: Iterable[str]) -> list[str]:
    """A table: what was injected against what was answered."""
    out = ["| injected | runs | right, alone | right, rivals | truth a rival | else |", "|---|---|---|---|---|---|"]
    for effect in effects:
        mine = [r for r in rows if r["effect"] == effect]
        kinds: Counter[str] = Counter()
        other: Counter[str] = Counter()
        for r in mine:
            if named(r) and first(r):
                kinds[r["verdict"]] += 1
            elif named(r) and in_set(r):
                kinds["rival"] += 1
            else:
                other[answer(r) + (" (truth first)" if not named(r) and first(r) else "")] += 1
        rest = ", ".join(f"{what} {n}" for what, n in sorted(other.items())) or "–"
        out.append(
            f"| {effect} | {len(mine)} | {kinds['identified']} | {kinds['ambiguous']} | {kinds['rival']} | {rest} |"
        )
    return out


def held_and_loud(rows: Sequence[Row]) -> list[str]:
    """The sections on bodies held to ground and on noise that grows with the drive."""
    out = []
    held = [r for r in rows if r["group"] == "held"]
    if held:
        out += [
            "",
            "## Bodies held to ground",
            "",
            "Cords between ground and the driven body, or what is behind the joint: its side of the rig would swing",
            "on them at about 60 to 300 Hz, damped by 0.2 to 20 %, drawn on logarithmic scales. At 2 kHz, where the",
            "band begins, they pull with a twentieth of a per cent to 8 % of what the mass takes, and with less above.",
        ]
        for signal, decibel in sorted({(r["signal"], r["decibel"]) for r in held}, reverse=True):
            part = [r for r in held if (r["signal"], r["decibel"]) == (signal, decibel)]
            out += ["", f"{signal}, {decibel:g} dB:", "", *confusion(part, HELD)]
    loud = [r for r in rows if r["group"] == "loud"]
    if loud:
        out += [
            "",
            "## Noise that grows with the drive",
            "",
            "Nothing is hidden, and noise is added whose size follows the level of the drive: at the highest level",
            "1 to 2.5 times that at rest in all channels, 0 to 3 times in each by itself, or 1 to 2.5 times in another",
            "colour.",
            "",
            "| injected | runs | answered |",
            "|---|---|---|",
        ]
        for effect in LOUD:
            said = Counter(answer(r) for r in loud if r["effect"] == effect)
            out.append(
                f"| {effect} | {sum(said.values())} | {', '.join(f'{w} {n}' for w, n in sorted(said.items()))} |"
            )
    return out


def page(rows: Sequence[Row]) -> str:
    """``docs/acceptance.md``."""
    out = [
        "# What a trace can tell",
        "",
        "All records of this page are simulated, by a generator in `tests/acceptance/` that shares no code and no",
        "formula with the program: Fourier collocation instead of steps in time, rounded and uneven shapes of",
        "every effect, noise of first order, sizes of 2 to 6 % of the peak joint force (gains and masses 1 to 3 %,",
        "delays 1 to 3 µs) drawn from a stored seed; close to its resonance the AM rig has no steady motion with some",
        "of them, which are then made smaller. The drive is set so that the highest level moves the joint by 3 µm with",
        "the effect in it. Four records to fit at three levels, the highest twice, one sealed, one",
        "with the exciter off; four periods of 50 ms at 102.4 kHz. MS is a multisine of random phases from 2 to 8 kHz,",
        "AM a sine of 4.8 kHz whose amplitude swings by 80 % at 20 Hz; relaxation, there no more than a spring and a",
        "damper, is tried with MS only. Pairs of effects have even weight in the records, or even peaks. Noise lies",
        "60, 40 or 30 dB below each channel; five seeds each in the first tables, in the others as the tables say.",
        "The page is written by `tests/acceptance/summary.py` from the results of `tests/acceptance/table.py`.",
        "",
        "## Demanded and reached",
        "",
        "| # | | runs | demanded | reached |",
        "|---|---|---|---|---|",
    ]
    for f in figures(rows):
        bound = f"{100 * f.bound:g} %" if f.percent else f"{f.bound:g}"
        mark = "" if f.met or not f.cells else " **missed**"
        out.append(
            f"| {f.number} | {f.demand} | {f.cells} | {'≥' if f.at_least else '≤'} {bound} | {f.words()}{mark} |"
        )
    missed = [f for f in figures(rows) if f.cells and not f.met]
    if missed:
        out += ["", "Why figures are missed, as far as it is known:", ""]
        out += [f"- {f.demand}: {MISSED.get(f.demand, 'not known')}." for f in missed]
    main = [r for r in rows if r["group"] == "main"]
    for title, part in (
        ("MS", [r for r in main if r["signal"] == "MS"]),
        ("AM, 60 and 40 dB", [r for r in main if r["signal"] == "AM" and r["decibel"] > 30]),
        ("AM, 30 dB", [r for r in main if r["signal"] == "AM" and r["decibel"] == 30]),
    ):
        if part:
            out += ["", f"## Injected and answered: {title}", "", *confusion(part, CATALOGUE)]
    for title, group, effects in (
        ("Effects outside the catalogue", "outside", OUTSIDE),
        ("The true family removed from the catalogue", "removed", CATALOGUE),
        ("Effects five times smaller", "small", CATALOGUE),
    ):
        part = [r for r in rows if r["group"] == group]
        if part:
            out += ["", f"## {title}", "", "| injected | runs | answered |", "|---|---|---|"]
            for effect in effects:
                mine = [r for r in part if r["effect"] == effect]
                said = Counter(answer(r) for r in mine)
                out.append(f"| {effect} | {len(mine)} | {', '.join(f'{w} {n}' for w, n in sorted(said.items()))} |")
    out += held_and_loud(rows)
    failed = [r for r in rows if r["verdict"] == "error"]
    if failed:
        out += ["", "## Runs that broke", "", *(f"- {r['name']}: {r['error']}" for r in failed)]
    return "\n".join(out) + "\n"


def split(path: Path) -> tuple[str, str]:
    """A page up to the part on machines, and that part, which `machine_table.py` writes."""
    text = path.read_text() if path.exists() else ""
    before, heading, after = text.partition(MACHINES)
    return before, heading + after


if __name__ == "__main__":
    target = Path(sys.argv[2])
    of_machines = split(target)[1]
    target.write_text(page(read(Path(sys.argv[1]))) + ("\n" + of_machines if of_machines else ""))
