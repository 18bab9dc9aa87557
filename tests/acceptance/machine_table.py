"""Trace drawn machines and keep what the program answered, one JSON line a case.

    python tests/acceptance/machine_table.py --altered 0 60 --null 0 60 --out machines.jsonl
    python tests/acceptance/machine_table.py --summary machines.jsonl --page docs/acceptance.md

Cases that the file holds already are skipped.
"""

from __future__ import annotations

import os

for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import argparse  # noqa: E402
import json  # noqa: E402
import re  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections import Counter  # noqa: E402
from collections.abc import Callable, Iterable, Sequence  # noqa: E402
from dataclasses import dataclass  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

from machine_forces import HIDDEN  # noqa: E402
from machine_records import DECIBEL, draw, measure, write  # noqa: E402
from machine_steps import NoMotion  # noqa: E402
from summary import MACHINES, PATHS, split  # noqa: E402

from jointlib import read_measurement  # noqa: E402
from machines import read_machine  # noqa: E402
from machines.loop.trace import trace_machine  # noqa: E402

Row = dict[str, Any]


def name_of(seed: int, altered: bool, decibel: float = DECIBEL, drifting: bool = False) -> str:
    """How a case is called; at 40 dB without its noise."""
    kind = ("altered" if altered else "null") + "-drifting" * drifting
    return f"{kind}/{seed}" if decibel == DECIBEL else f"{kind}-{decibel:g}dB/{seed}"


def simulated(seed: int, altered: bool, folder: Path, decibel: float = DECIBEL, drifting: bool = False) -> Row:
    """The files of a case in a folder, integrated now if they are not there yet, and the truth about it."""
    truth = folder / "truth.json"
    if truth.exists():
        return dict(json.loads(truth.read_text()))
    begun = time.process_time()
    case = draw(seed, altered)
    row: Row = {"name": name_of(seed, altered, decibel, drifting), "seed": seed, "place": case.place}
    row |= {"what": case.what, "size": case.size, "change": case.change}
    row["joints"] = {j.name: j.kind for j in case.declared.joints}
    try:
        records = measure(case, decibel, drifting)
    except NoMotion as error:
        row |= {"verdict": "none", "error": str(error)}
    else:
        write(case, records, folder)
        row["repeats"] = records.repeats
    row["simulating_s"] = round(time.process_time() - begun, 1)
    truth.write_text(json.dumps(row))
    return row


def run(seed: int, altered: bool, folder: Path | None = None, decibel: float = DECIBEL, drifting: bool = False) -> Row:
    """Integrate a case, write it, read it, trace it."""
    if folder is None:
        with tempfile.TemporaryDirectory() as passing:
            return run(seed, altered, Path(passing), decibel, drifting)
    row = simulated(seed, altered, folder, decibel, drifting)
    if row.get("verdict") == "none":
        return row
    begun = time.process_time()
    try:
        machine = read_machine(folder / "machine.toml")
        report = trace_machine(read_measurement(folder / "test.measurement.toml"), machine).as_json()
    except Exception as error:  # A crash is a wrong answer, not the end of the table.
        return {**row, "verdict": "error", "error": f"{type(error).__name__}: {error}", "rivals": []}
    row["tracing_s"] = round(time.process_time() - begun, 1)
    chosen = report["chosen"] or {}
    row |= {"verdict": report["verdict"], "named": report["place"], "family": chosen.get("family")}
    row["params"] = chosen.get("parameters", {})
    row["rivals"] = [[r["place"], r["family"]] for r in report["rivals"]]
    row["tried"] = [[c["place"], c["family"], c["share_of_current"], c["status"]] for c in report["candidates"][:6]]
    for key in ("error_before", "error_after"):
        row[key] = {k: report[key].get(k) for k in ("relative", "in_sample", "chi2", "where")}
    return row


def first(row: Row) -> bool:
    """The right connection is chosen."""
    return bool(row.get("named")) and row["named"] == row["place"]


def among(row: Row) -> bool:
    """The right connection is chosen or a rival."""
    return first(row) or (bool(row.get("named")) and row["place"] in [place for place, _ in row["rivals"]])


def kind(row: Row) -> bool:
    """The right connection is chosen; what changed there (its own parameters, or a force) is chosen or a rival."""
    truth = row["what"] if row["what"] in HIDDEN else "refit"
    here = [family for place, family in row["rivals"] if place == row["place"]]
    return first(row) and truth in (row["family"], *here)


@dataclass(frozen=True)
class Figure:
    """A demanded figure and what was reached."""

    demand: str
    runs: int
    share: float
    least: float | None = None
    most: float | None = None

    @classmethod
    def of(
        cls,
        demand: str,
        rows: Sequence[Row],
        test: Callable[[Row], bool],
        least: float | None = None,
        most: float | None = None,
    ) -> Figure:
        """The share of the rows that pass a test."""
        return cls(demand, len(rows), sum(map(test, rows)) / len(rows) if rows else float("nan"), least, most)

    @property
    def met(self) -> bool:
        return (self.least is None or self.share >= self.least) and (self.most is None or self.share <= self.most)


def figures(rows: Iterable[Row]) -> list[Figure]:
    """The demands on machines; cases without a steady motion are none."""
    kept = [r for r in rows if r["verdict"] != "none"]
    altered = [r for r in kept if r["name"].startswith("altered/")]
    null = [r for r in kept if r["name"].startswith("null/")]
    alone = [r for r in altered if r["verdict"] == "identified"]
    out = [
        Figure.of("one joint altered: the right connection among those named", altered, among, least=0.95),
        Figure.of("one joint altered: the right connection in first place", altered, first, least=0.9),
        Figure.of("the same, and what changed in it chosen or a rival", altered, kind),
        Figure.of("`identified`: the right connection", alone, first),
        Figure.of("nothing altered: a connection named", null, lambda r: bool(r.get("named")), most=0.02),
    ]
    drifting = [r for r in kept if r["name"].startswith("altered-drifting/")]
    if drifting:
        still = [r for r in kept if r["name"].startswith("null-drifting/")]
        there = "the machine drifts and the force varies"
        out += [
            Figure.of(f"{there}: the right connection, and what changed in it chosen or a rival", drifting, kind, 0.9),
            Figure.of(f"{there}: the right connection among those named", drifting, among),
            Figure.of(f"{there}: `identified` with χ² above 3", drifting, _overstated, most=0.0),
            Figure.of(
                f"{there}, nothing altered: a connection named", still, lambda r: bool(r.get("named")), most=0.02
            ),
        ]
    for decibel in sorted({_louder(r) for r in kept} - {0}, reverse=True):
        there = [r for r in kept if _louder(r) == decibel]
        out.append(Figure.of(f"noise at {decibel} dB: the right connection among those named", there, among))
        out.append(Figure.of(f"noise at {decibel} dB: the right connection in first place", there, first))
        wrong = "another connection named, the right one not among its rivals"
        out.append(Figure.of(f"noise at {decibel} dB: {wrong}", there, lambda r: bool(r.get("named")) and not among(r)))
    return out


def _overstated(row: Row) -> bool:
    return bool(row["verdict"] == "identified" and row["error_after"]["chi2"] > 3)


def _louder(row: Row) -> int:
    """Decibels of an altered case with more noise than demanded, else 0."""
    found = re.match(r"altered-(\d+)dB/", row["name"])
    return int(found[1]) if found else 0


_TEXT = """
Machines drawn from a seed: four to six masses in a row, or a slide that rocks on two of its joints, with three or four
flexible joints, of which some harden, some are preloaded guides, some rub. One joint is altered, in its stiffness,
damping, preload or hardening or by a force that is hidden in it (formulas of their own), so that the responses change
by 5 to 25 % in the mean, as far as sizes that are not absurd allow. Driving point at the tool, in two fifths of the
cases another response as well; three to five forces over a factor of 6 to 25, in some cases one of them sealed; 110 to
190 lines. Integrated in time until the period repeats (`tests/acceptance/machine_steps.py`, which shares nothing with
the program), noise 40 dB below the rms of each response, its size to be found from the lines. Seeds 0 to {last}.
Written by `tests/acceptance/machine_table.py`.
"""


def summary(rows: Sequence[Row]) -> str:
    """The part of ``docs/acceptance.md`` on machines."""
    last = max(r["seed"] for r in rows)
    out = [MACHINES, _TEXT.format(last=last), "| | runs | demanded | reached |", "|---|---|---|---|"]
    for f in figures(rows):
        wanted = (
            f"≥ {100 * f.least:.0f} %" if f.least is not None else "–" if f.most is None else f"≤ {100 * f.most:.0f} %"
        )
        out.append(f"| {f.demand} | {f.runs} | {wanted} | {100 * f.share:.1f} %{'' if f.met else ' **missed**'} |")
    altered = [r for r in rows if r["name"].startswith("altered/") and r["verdict"] != "none"]
    out += [
        "",
        "| altered | runs | right, alone | right, rivals | right place a rival | else |",
        "|---|---|---|---|---|---|",
    ]
    for what in sorted({r["what"] for r in altered}):
        mine = [r for r in altered if r["what"] == what]
        alone = [r for r in mine if first(r) and not r["rivals"]]
        shared = [r for r in mine if first(r) and r["rivals"]]
        rival = [r for r in mine if among(r) and not first(r)]
        rest = Counter(str(r["verdict"]) + (", another place" if r.get("named") else "") for r in mine if not among(r))
        said = "; ".join(f"{word.replace('_', ' ')} {n}" for word, n in sorted(rest.items())) or "–"
        out.append(f"| {what} | {len(mine)} | {len(alone)} | {len(shared)} | {len(rival)} | {said} |")
    return "\n".join(out) + "\n"


def line(row: Row) -> str:
    """A case on one line of the screen."""
    head = f"{row['name']:12s} {row['place'] or '-'}:{row['what'] or 'nothing':18s} {row['verdict']:16s}"
    if "error" in row:
        return f"XX {head} {row['error']}"
    rivals = ",".join(f"{p}:{f}" for p, f in row["rivals"])
    mark = "  " if (among(row) if row["place"] else not row["named"]) else "XX"
    before, after = (row[k]["relative"] for k in ("error_before", "error_after"))
    errors = f"{100 * before:.2f} > {100 * after:.2f} %"
    return (
        f"{mark} {head} {row['named']}:{row['family']} [{rivals}] {errors} {row['simulating_s']}+{row['tracing_s']} s"
    )


def read(path: Path) -> list[Row]:
    """Rows of a result file."""
    return [json.loads(text) for text in path.read_text().splitlines()] if path.exists() else []


def main(arguments: Sequence[str]) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description="Trace drawn machines.")
    parser.add_argument("--altered", nargs=2, type=int, default=[0, 0])
    parser.add_argument("--null", nargs=2, type=int, default=[0, 0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--summary", type=Path, help="print the tables of a result file")
    parser.add_argument("--page", type=Path, help="write them into a page, too")
    parser.add_argument("--cases", type=Path, help="folder that keeps the simulated files")
    parser.add_argument("--decibel", type=float, default=DECIBEL)
    parser.add_argument("--drifting", action="store_true", help="the machine drifts, and the force varies")
    given = parser.parse_args(arguments)
    both = [(s, True) for s in range(*given.altered)] + [(s, False) for s in range(*given.null)]
    wanted = sorted(both, key=lambda case: case[0])
    done = {r["name"] for r in read(given.out)} if given.out else set()
    for seed, altered in wanted:
        name = name_of(seed, altered, given.decibel, given.drifting)
        folder = None if given.cases is None else given.cases / name
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        if name not in done:
            row = run(seed, altered, folder, given.decibel, given.drifting)
            print(line(row), flush=True)
            if given.out:
                with given.out.open("a") as file:
                    file.write(json.dumps(row) + "\n")
    if given.summary:
        print(summary(read(given.summary)))
    if given.summary and given.page:
        before, old = split(given.page)
        _, heading, paths = old.partition(PATHS)
        new = f"{before.rstrip()}\n\n{summary(read(given.summary))}"
        given.page.write_text(f"{new.rstrip()}\n\n{heading}{paths}" if paths else new)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
