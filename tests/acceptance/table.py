"""Run cells of the suite and keep what the program answered, one JSON line a cell.

    python tests/acceptance/table.py --cells quick --out quick.jsonl
    python tests/acceptance/table.py --cells main null outside removed coverage two small --jobs 2 --out all.jsonl

Cells that the file holds already are skipped; a run that was stopped goes on. A cell is also named by the beginning of
its name, ``main/cubic/MS/60``. Each trace runs on one core.
"""

from __future__ import annotations

import os

for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import argparse  # noqa: E402
import json  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable, Sequence  # noqa: E402
from concurrent.futures import ProcessPoolExecutor  # noqa: E402
from dataclasses import replace  # noqa: E402
from functools import lru_cache  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402
from unittest.mock import patch  # noqa: E402

from cells import Cell, cells_of  # noqa: E402
from generator import NoMotion  # noqa: E402
from measure import Simulated, simulate, write  # noqa: E402

from jointlib import read_joint, read_measurement, trace  # noqa: E402
from jointlib.loop.answer import catalogue as shelf  # noqa: E402
from jointlib.registry import Installed, installed  # noqa: E402

Row = dict[str, Any]


@lru_cache(maxsize=2)
def _simulated(effect: str, signal: str, seed: int, size: float, even: bool) -> tuple[Simulated, float]:
    start = time.process_time()
    cell = Cell("", effect, signal, 0.0, seed, size)
    return simulate(effect, cell.makers, signal, seed, size, even), time.process_time() - start


def without(families: Sequence[str]) -> Callable[[str], Installed]:
    """The registry with the effects of some families taken off the shelf."""

    def fewer(group: str) -> Installed:
        have = installed(group)
        kept = {n: e for n, e in have.found.items() if getattr(e, "family", None) not in families}
        return replace(have, found=kept)

    return fewer


def run(cell: Cell) -> Row:
    """Simulate, trace, and keep what the table needs."""
    try:
        even = cell.group in ("two", "three") or (cell.group == "followed" and "+" in cell.effect)
        test, simulating = _simulated(cell.effect, cell.signal, cell.seed, cell.size, even)
    except NoMotion as error:
        nobody: Row = {"truth": [], "site": "", "values": {}, "verdict": "error", "error": str(error)}
        return {"name": cell.name, **cell.row(), **nobody}
    truth = test.truth
    row: Row = {"name": cell.name, **cell.row(), "truth": list(truth.families), "site": truth.site}
    row |= {"values": dict(truth.values), "weaker": test.weaker, "simulating_s": round(simulating, 2)}
    start = time.process_time()
    try:
        hidden = without(truth.families if cell.group == "removed" else ())
        with tempfile.TemporaryDirectory() as folder, patch.object(shelf, "installed", hidden):
            measurement, joint = write(test, Path(folder), cell.decibel, cell.effect, cell.seed)
            start = time.process_time()
            report = trace(read_measurement(measurement), read_joint(joint)).as_json()
    except Exception as error:  # A crash is a wrong answer, not the end of the table.
        return {**row, "verdict": "error", "error": f"{type(error).__name__}: {error}"}
    row["tracing_s"] = round(time.process_time() - start, 2)
    sizes = ("where", "joint_N", "joint_floor_N", "balance_N", "balance_floor_N", "redundancy_ms2", "chi2", "relative")
    for key in ("verdict", "rivals", "chain", "secondary", "chosen", "reduction", "sentence"):
        row[key] = report.get(key)
    for key in ("error_before", "error_after"):
        row[key] = {k: report[key].get(k) for k in sizes}
    excesses = [(e, k, c) for e, cells in report["localisation"].items() for k, c in cells.items()]
    row["seen"] = {f"{e} {k}": round(c["excess"]) for e, k, c in excesses if c["excess"] > c["threshold"]}
    row["declared_pairs"] = pairs_of(row["truth"])
    return row


def pairs_of(families: Sequence[str]) -> list[str]:
    """What the catalogue itself declares to look like these families, from either side."""
    found = shelf.catalogue()
    declared = [(e.family, e.declared_pairs) for e in found.joint] + [(e.family, e.declared_pairs) for e in found.rig]
    near = {other for family, pairs in declared if family in families for other in pairs}
    return sorted(near | {family for family, pairs in declared if pairs & set(families)})


def line(row: Row) -> str:
    """A cell on one line of the screen."""
    where = f"@{row['site']}" if row["site"] else ""
    head = f"{row['name']:42s} {'+'.join(row['truth']) + where:26s} {row['verdict']:16s}"
    if row["verdict"] == "error":
        return f"{head} {row['error']}"
    chosen, before, after = row["chosen"], row["error_before"], row["error_after"]
    named = "-"
    explained = ""
    if chosen:
        site = chosen.get("channel") or chosen.get("body")
        named = chosen["family"] + (f"@{site}" if site else "")
        explained = "" if chosen["explained_first"] is None else f"{100 * chosen['explained_first']:.1f} %"
    rivals = ",".join(r["family"] for r in row["rivals"])
    chain = ",".join(t["family"] for t in row["chain"])
    force = f"{before['joint_N']:.3g}>{after['joint_N']:.3g}/{after['joint_floor_N']:.3g} N"
    times = f"{row['simulating_s']:.1f}+{row['tracing_s']:.1f} s"
    chi2 = f"chi2 {before['chi2']:.3g}>{after['chi2']:.3g}"
    return f"{head} {named:26s} {explained:7s} [{rivals}] ({chain}) {force} {chi2} {times}"


def finished(path: Path) -> set[str]:
    """Names of the cells in a result file."""
    return {json.loads(text)["name"] for text in path.read_text().splitlines()} if path.exists() else set()


def run_all(cells: Sequence[Cell], out: Path, jobs: int, say: Callable[[str], None]) -> None:
    """Run what the file does not hold yet, in the order of the cells."""
    done = finished(out)
    left = [c for c in cells if c.name not in done]
    with out.open("a") as file:

        def keep(row: Row) -> None:
            file.write(json.dumps(row) + "\n")
            file.flush()
            say(line(row))

        if jobs == 1:
            for cell in left:
                keep(run(cell))
            return
        with ProcessPoolExecutor(jobs) as pool:
            for row in pool.map(run, left, chunksize=3):
                keep(row)


def main(arguments: Sequence[str]) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description="Run cells of the acceptance suite.")
    parser.add_argument("--cells", nargs="+", default=["quick"])
    parser.add_argument("--quick", action="store_true", help="one seed, 40 dB, multisine, every effect")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--page", type=Path, help="write the summary of everything in the file as a page, too")
    given = parser.parse_args(arguments)
    run_all(
        cells_of(["quick"] if given.quick else given.cells), given.out, given.jobs, lambda text: print(text, flush=True)
    )
    if given.page:
        from summary import page, read

        given.page.write_text(page(read(given.out)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
