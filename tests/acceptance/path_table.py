"""Trace simulated paths with one, two and three effects, none, and effects outside the catalogue; write the table.

    python tests/acceptance/path_table.py --out paths.jsonl --seeds 2
    python tests/acceptance/path_table.py --out paths.jsonl --page docs/acceptance.md

Cases that the file holds already are skipped; a run that was stopped goes on. Each trace runs on one core.
"""

from __future__ import annotations

import os

for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import argparse  # noqa: E402
import json  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections import Counter  # noqa: E402
from collections.abc import Iterable, Sequence  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

from path_records import OUTSIDE, Case, write  # noqa: E402
from summary import PATHS, SEVERAL, share_line  # noqa: E402

from jointlib import read_joint, read_measurement, trace  # noqa: E402

Row = dict[str, Any]
SETS: dict[str, tuple[tuple[str, ...], ...]] = {
    "random": (
        ("coulomb",),
        ("cubic",),
        ("quadratic",),
        ("quadratic-damping",),
        ("viscous-by-direction",),
        ("lag",),
        ("position-stiffness",),
        ("coulomb", "cubic"),
        ("coulomb", "quadratic"),
        ("coulomb", "quadratic-damping"),
        ("coulomb", "viscous-by-direction"),
        ("coulomb", "modulation"),
        ("coulomb", "position-stiffness"),
        ("cubic", "viscous-by-direction"),
        ("quadratic", "lag"),
        ("hysteresis", "viscous-by-direction"),
        ("coulomb", "cubic", "viscous-by-direction"),
        ("coulomb", "quadratic", "lag"),
    ),
    "pulses": (
        ("coulomb",),
        ("viscous-by-direction",),
        ("missing-mass",),
        ("lag",),
        ("coulomb", "viscous-by-direction"),
        ("coulomb", "missing-mass"),
        ("coulomb", "lag"),
        ("coulomb", "missing-mass", "viscous-by-direction"),
    ),
}
"""What is hidden in the records, by how they move. ``modulation`` brings the friction that follows with it."""
FOREIGN: tuple[tuple[str, ...], ...] = (
    *((name,) for name in OUTSIDE),
    ("slow-force", "coulomb"),
    ("damping-by-displacement", "cubic"),
    ("stiffness-by-speed", "slow-force"),
)


def cases(seeds: Iterable[int], decibels: Sequence[float] = (60, 40)) -> list[Case]:
    """Of all cells, seed after seed."""
    out = []
    for seed in seeds:
        for decibel in decibels:
            out += [Case(effects, signal, decibel, seed) for signal, sets in SETS.items() for effects in sets]
            out += [Case((), signal, decibel, seed) for signal in SETS]
            out += [Case(effects, "random", decibel, seed) for effects in FOREIGN]
    return out


def run(case: Case) -> Row:
    """Simulate, trace, and keep what the table needs."""
    with tempfile.TemporaryDirectory() as folder:
        measurement, joint = write(Path(folder), case)
        start = time.process_time()
        report = trace(read_measurement(measurement), read_joint(joint))
        seconds = time.process_time() - start
    found = report.as_json()
    terms = [c["family"] for c in found["composition"]] or ([found["chosen"]["family"]] if found["chosen"] else [])
    terms += [c["family"] for c in found["chain"] if c["status"] == "accepted" and c["family"] not in terms]
    return {
        "case": case.name,
        "effects": list(case.effects),
        "signal": case.signal,
        "decibel": case.decibel,
        "seed": case.seed,
        "verdict": found["verdict"],
        "terms": terms,
        "rivals": [r["family"] for r in found["rivals"]],
        "before": found["error_before"]["relative"],
        "after": found["error_after"]["relative"],
        "seconds": seconds,
    }


def named(row: Row) -> bool:
    """The verdict carries names."""
    return row["verdict"] in ("identified", "ambiguous")


def all_named(row: Row) -> bool:
    """Everything that is hidden is among the terms or their rivals, and the verdict carries names."""
    return named(row) and set(row["effects"]) <= {*row["terms"], *row["rivals"]}


def wrong(row: Row) -> bool:
    """A name is among the terms that is hidden neither itself nor as a rival of it."""
    hidden = set(row["effects"]) - set(OUTSIDE)
    spare = [t for t in row["terms"] if t not in hidden]
    rivals = hidden & set(row["rivals"])
    return named(row) and (len(spare) > len(rivals - set(row["terms"])) or bool(set(row["effects"]) & set(OUTSIDE)))


def page(rows: Sequence[Row]) -> str:
    """The section of ``docs/acceptance.md``."""
    ours = [r for r in rows if r["effects"] and not set(r["effects"]) & set(OUTSIDE)]
    alone = {
        (r["effects"][0], r["signal"], r["decibel"], r["seed"]): all_named(r) for r in ours if len(r["effects"]) == 1
    }
    lines = [PATHS, ""]
    lines += [TEXT.format(runs=len(rows), last=max(r["seed"] for r in rows)), ""]
    lines += ["| | runs | demanded | reached |", "|---|---|---|---|"]
    for count, word in ((1, "one effect"), (2, "two effects"), (3, "three effects")):
        for decibel in (60, 40):
            some = [r for r in ours if len(r["effects"]) == count and r["decibel"] == decibel]
            lines.append(
                share_line(f"{word}, {decibel} dB: all named", some, all_named, "–" if count == 1 else "≥ 90 %")
            )
            if count > 1:
                each = [r for r in some if all(alone.get((e, *_of(r)), True) for e in r["effects"])]
                lines.append(share_line("the same, where each alone is named", each, all_named, "≥ 90 %"))
    nothing = [r for r in rows if not r["effects"]]
    lines.append(share_line("nothing hidden: named", nothing, named, "≤ 1 %"))
    lines.append(
        share_line("nothing hidden: `nothing_missing`", nothing, lambda r: r["verdict"] == "nothing_missing", "–")
    )
    foreign = [r for r in rows if set(r["effects"]) & set(OUTSIDE)]
    lines.append(share_line("outside the catalogue, alone or beside an effect of it: named", foreign, named, "≤ 2 %"))
    lines.append(share_line("a wrong name among all", rows, wrong, "≤ 1 %"))
    lines += ["", "| hidden | runs | all named | named in part | else |", "|---|---|---|---|---|"]
    for effects in dict.fromkeys(tuple(r["effects"]) for r in rows):
        own = [r for r in rows if tuple(r["effects"]) == effects]
        every = sum(all_named(r) for r in own) if effects else 0
        rest = [r for r in own if not (effects and all_named(r))]
        other = Counter(r["verdict"].replace("_", " ") for r in rest)
        part = sum(bool(set(r["terms"]) & set(effects)) for r in rest)
        said = ", ".join(f"{word} {n}" for word, n in sorted(other.items())) or "–"
        lines.append(f"| {' + '.join(effects) or 'nothing'} | {len(own)} | {every} | {part} | {said} |")
    return "\n".join(lines) + "\n"


TEXT = """Records of a force along a path, made by `tests/acceptance/path_records.py` with formulas of its own: sums of
sines, random or as strokes to and fro, 12 s at each of three levels. Each effect has 20 to 30 % of the rms of the
force of spring, damper and mass, a lag 12 to 20 ms; the noise of the force lies 60 or 40 dB below its rms, that of
the displacement 20 dB further down. {runs} traces, seeds 0 to {last}. Named means that the
verdict is `identified` or `ambiguous` and that all that is hidden is among the terms or their rivals. In the strokes
a lag moves 2 % of the force, a hundredth of what friction leaves.
Written by `tests/acceptance/path_table.py`."""


def _of(row: Row) -> tuple[str, float, int]:
    return row["signal"], row["decibel"], row["seed"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    have = [json.loads(x) for x in options.out.read_text().splitlines()] if options.out.exists() else []
    known = {row["case"] for row in have}
    for case in cases(range(options.first, options.first + options.seeds)):
        if case.name not in known:
            row = run(case)
            have.append(row)
            with options.out.open("a") as file:
                file.write(json.dumps(row) + "\n")
    if options.page:
        before, _, rest = options.page.read_text().partition(PATHS)
        _, heading, after = rest.partition(SEVERAL)
        options.page.write_text(before + page(have) + (f"\n{heading}{after}" if heading else ""))


if __name__ == "__main__":
    main()
