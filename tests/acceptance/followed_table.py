"""Trace rigs whose parameters follow a temperature, alone and beside another effect, or do not; write the table.

    python tests/acceptance/followed_table.py --out followed.jsonl --seeds 3
    python tests/acceptance/followed_table.py --out followed.jsonl --page docs/acceptance.md

Cells that the file holds already are skipped; a run that was stopped goes on. Each trace runs on one core.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from cells import DECIBELS, Cell, grid
from several_table import all_named, wrong
from summary import SEVERAL, read, share_line
from table import run_all

Row = dict[str, Any]
HEADING = "## Parameters of a rig that follow an input"
ALONE = ("stiffness-by-temperature", "saturating-stiffness", "damping-by-temperature", "warming-stiffness")
PAIRS = (
    "stiffness-by-temperature+cubic",
    "stiffness-by-temperature+coulomb",
    "stiffness-by-temperature+gain-carried",
    "saturating-stiffness+quadratic-damping",
)
IDLE = ("idle-temperature", "cubic+idle-temperature", "coulomb+idle-temperature", "stiffness-drift+idle-temperature")


def cells(seeds: Iterable[int]) -> list[Cell]:
    """Everything, at 60 and 40 dB."""
    return grid("followed", [*ALONE, *PAIRS, *IDLE], ["MS"], DECIBELS[:2], seeds)


def page(rows: Sequence[Row]) -> str:
    """The section of ``docs/acceptance.md``."""
    lines = [HEADING, "", TEXT.format(runs=len(rows), last=max(r["seed"] for r in rows)), ""]
    lines += ["| | runs | demanded | reached |", "|---|---|---|---|"]
    for effects, word in ((ALONE, "alone"), (PAIRS, "beside another effect")):
        for decibel in DECIBELS[:2]:
            some = [r for r in rows if r["effect"] in effects and r["decibel"] == decibel]
            lines.append(share_line(f"{word}, {decibel:g} dB: all named", some, all_named, "≥ 90 %"))
    idle = [r for r in rows if r["effect"] == IDLE[0]]
    lines.append(share_line("nothing hidden, an idle input: not `nothing_missing`", idle, _is_not_quiet, "≤ 1 %"))
    beside = [r for r in rows if r["effect"] in IDLE[1:]]
    lines.append(share_line("another effect, an idle input: that effect named", beside, all_named, "≥ 90 %"))
    lines.append(share_line("a wrong name among all", rows, wrong, "≤ 1 %"))
    lines += ["", "| hidden | runs | all named | else |", "|---|---|---|---|"]
    for effect in (*ALONE, *PAIRS, *IDLE):
        own = [r for r in rows if r["effect"] == effect]
        rest = Counter(r["verdict"].replace("_", " ") for r in own if not (r["truth"] and all_named(r)))
        said = ", ".join(f"{word} {n}" for word, n in sorted(rest.items())) or "–"
        right = sum(bool(r["truth"]) and all_named(r) for r in own)
        lines.append(f"| {effect.replace('+', ' + ')} | {len(own)} | {right} | {said} |")
    return "\n".join(lines) + "\n"


def _is_not_quiet(row: Row) -> bool:
    return bool(row["verdict"] != "nothing_missing")


TEXT = """Rigs as above, driven by the multisine, with a temperature beside the other channels: 288 to 318 K, two
records to fit cold and two warm, or rising by 4 K and back along each record; its sensor has 0.05 K of noise. The
stiffness changes by 2 to 6 % over the range, in a straight line or along a curve, the damping by 30 to 90 %; beside
another effect both have even weight in the records. Or nothing follows it. {runs} traces, seeds 0 to {last}. Not among
them: a damping that follows the temperature beside friction of even weight, tried once, is `partial`, as friction takes
the place of all damping. Written by `tests/acceptance/followed_table.py`."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    run_all(cells(range(options.seeds)), options.out, options.jobs, print)
    if options.page:
        text, own = options.page.read_text(), page(read(options.out))
        before, _, after = text.partition(HEADING)
        last = after[after.index(SEVERAL) :] if SEVERAL in after else ""
        before, _, further = before.partition(SEVERAL)
        options.page.write_text(f"{before.rstrip()}\n\n{own}\n{last or SEVERAL + further}".rstrip() + "\n")


if __name__ == "__main__":
    main()
