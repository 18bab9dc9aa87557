"""Trace simulated free decays with one effect, two, none, and effects outside the catalogue; write the table.

    python tests/acceptance/decay_table.py --out decays.jsonl --seeds 3
    python tests/acceptance/decay_table.py --out decays.jsonl --page docs/ringdown.md

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
from collections.abc import Callable, Iterable, Sequence  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

from decay_records import OUTSIDE, Case, write  # noqa: E402

from jointlib import read_joint, read_measurement, trace  # noqa: E402
from jointlib.errors import InputError  # noqa: E402

Row = dict[str, Any]
ONE = ("coulomb", "cubic", "quadratic", "quadratic-damping", "gap", "contact-loss", "hysteresis")
TWO = (("coulomb", "cubic"), ("cubic", "quadratic-damping"), ("coulomb", "gap"))
MARK = "## How often it is right"


def cases(seeds: Iterable[int], decibels: Sequence[float] = (60, 40)) -> list[Case]:
    """Of all cells, seed after seed."""
    out = []
    for seed in seeds:
        for decibel in decibels:
            for masses in (1, 2, 3):
                out += [Case((), masses, decibel, seed)]
                out += [Case((name,), masses, decibel, seed) for name in ONE]
            out += [Case(names, 1, decibel, seed) for names in TWO]
            out += [Case((name,), 1, decibel, seed) for name in OUTSIDE]
    return out


def run(case: Case) -> Row:
    """Simulate, trace, and keep what the table needs."""
    with tempfile.TemporaryDirectory() as folder:
        measurement, joint = write(Path(folder), case)
        start = time.process_time()
        try:
            report = trace(read_measurement(measurement), read_joint(joint))
        except InputError as error:
            return {**_of(case), **_REFUSED, "why": str(error), "seconds": time.process_time() - start}
        seconds = time.process_time() - start
    found = report.as_json()
    terms = [c["family"] for c in found["composition"]] or ([found["chosen"]["family"]] if found["chosen"] else [])
    return {
        **_of(case),
        "verdict": found["verdict"],
        "terms": terms,
        "rivals": [r["family"] for r in found["rivals"]],
        "before": found["error_before"]["relative"],
        "after": found["error_after"]["relative"],
        "misfit": found["reduction"]["misfit_after"],
        "explained": found["chosen"]["explained_first"] if found["chosen"] else None,
        "seconds": seconds,
    }


_REFUSED: Row = {
    "verdict": "refused", "terms": [], "rivals": [], "before": None, "after": None, "misfit": None, "explained": None
}  # fmt: skip


def _of(case: Case) -> Row:
    return {
        "case": case.name,
        "effects": list(case.effects),
        "masses": case.masses,
        "decibel": case.decibel,
        "seed": case.seed,
    }


def named(row: Row) -> bool:
    """The verdict carries names."""
    return row["verdict"] in ("identified", "ambiguous")


def in_set(row: Row) -> bool:
    """All that is hidden is among the terms or their rivals, and the verdict carries names."""
    return named(row) and set(row["effects"]) <= {*row["terms"], *row["rivals"]}


def wrong(row: Row) -> bool:
    """Something hidden is named by another name, and the right one is not among the rivals."""
    return named(row) and not in_set(row)


def page(rows: Sequence[Row]) -> str:
    """The section of ``docs/ringdown.md``."""
    foreign = [r for r in rows if set(r["effects"]) & set(OUTSIDE)]
    nothing = [r for r in rows if not r["effects"]]
    ours = [r for r in rows if r["effects"] and r not in foreign]
    seeds = [r["seed"] for r in rows]
    lines = [MARK, "", TEXT.format(runs=len(rows), first=min(seeds), last=max(seeds)), ""]
    lines += ["| | runs | demanded | reached |", "|---|---|---|---|"]
    for decibel in (60, 40):
        some = [r for r in ours if len(r["effects"]) == 1 and r["decibel"] == decibel]
        lines.append(_line(f"one effect, {decibel} dB: the right family in the set", some, in_set, "≥ 90 %"))
        two = [r for r in ours if len(r["effects"]) == 2 and r["decibel"] == decibel]
        lines.append(_line(f"two effects, {decibel} dB: both in the set", two, in_set, "–"))
    lines.append(_line("nothing hidden: `nothing_missing`", nothing, lambda r: r["verdict"] == "nothing_missing", "–"))
    lines.append(_line("nothing hidden: named", nothing, named, "0"))
    lines.append(_line("outside the catalogue: named", foreign, named, "–"))
    lines.append(_line("a wrong name among all", rows, wrong, "≤ 1 %"))
    lines += ["", "| hidden | masses | runs | in the set | alone | else |", "|---|---|---|---|---|---|"]
    for effects, masses in dict.fromkeys((tuple(r["effects"]), r["masses"]) for r in rows):
        own = [r for r in rows if tuple(r["effects"]) == effects and r["masses"] == masses]
        hit = [r for r in own if effects and in_set(r)]
        alone = sum(not r["rivals"] for r in hit)
        other = Counter(r["verdict"].replace("_", " ") for r in own if r not in hit)
        said = ", ".join(f"{word} {n}" for word, n in sorted(other.items())) or "–"
        lines.append(f"| {' + '.join(effects) or 'nothing'} | {masses} | {len(own)} | {len(hit)} | {alone} | {said} |")
    return "\n".join(lines) + "\n"


TEXT = """Decays of a chain of one to three masses on a joint, made by `tests/acceptance/decay_records.py` with formulas
of its own and integrated step by step: three levels, noise 60 or 40 dB below the first amplitude of the highest,
displacement, velocity or acceleration in turn. {runs} traces, seeds {first} to {last}. In the set means that the
verdict is `identified` or `ambiguous` and that what is hidden is the name or one of its rivals; alone, that there is
no rival. Written by `tests/acceptance/decay_table.py`."""


def _line(what: str, rows: Sequence[Row], test: Callable[[Row], bool], demanded: str) -> str:
    hits = sum(map(test, rows))
    reached = f"{hits} ({100 * hits / len(rows):.1f} %)" if rows else "–"
    return f"| {what} | {len(rows)} | {demanded} | {reached} |"


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
        text = options.page.read_text()
        head, _, rest = text.partition(MARK)
        after = rest.find("\n## ")
        options.page.write_text(head.rstrip() + "\n\n" + page(have) + (rest[after:] if after >= 0 else ""))


if __name__ == "__main__":
    main()
