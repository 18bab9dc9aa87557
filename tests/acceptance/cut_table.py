"""Trace campaigns of test cuts on drawn mills and keep what the program answered, one JSON line a campaign.

    python tests/acceptance/cut_table.py --effects 0 6 --null 0 40 --out cuts.jsonl
    python tests/acceptance/cut_table.py --coverage cuts.jsonl
    python tests/acceptance/cut_table.py --advice 0 6
    python tests/acceptance/cut_table.py --summary cuts.jsonl

Campaigns that the file holds already are skipped. Everything is simulated: mills and sounds by `cut_shop`.
"""

from __future__ import annotations

import os

for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import argparse  # noqa: E402
import json  # noqa: E402
import time  # noqa: E402
from collections import Counter  # noqa: E402
from collections.abc import Sequence  # noqa: E402
from dataclasses import replace  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from cut_mills import OF_AMPLITUDE, border, machine_of  # noqa: E402
from cut_shop import EFFECTS, RUNGS, TURNS, Campaign, drawn, sounds  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from jointlib import InputError  # noqa: E402
from jointlib.cuts import heard  # noqa: E402
from jointlib.cuts.judged import judged_sound  # noqa: E402
from jointlib.cuts.sound import Sound, listen  # noqa: E402
from jointlib.cuts.tried_cut import TriedCut  # noqa: E402
from jointlib.measurement import Measurement  # noqa: E402
from machines.cut_loop.advice import apart_at, band, forecast, told_by  # noqa: E402
from machines.cut_loop.borders import condition, conditions_of  # noqa: E402
from machines.cut_loop.contest import entry, folds_of  # noqa: E402
from machines.cut_loop.distances import Place  # noqa: E402
from machines.cut_loop.problem import problem_of, shaken  # noqa: E402
from machines.cut_loop.sampled_tool import SampledTool, sampled_tool  # noqa: E402
from machines.cut_loop.suspects import AsItIs  # noqa: E402
from machines.cut_loop.tempered import posterior  # noqa: E402
from machines.cut_loop.trace_cuts import trace_cuts  # noqa: E402
from machines.cutting.process.cutting import Cutting  # noqa: E402
from machines.model.machine import Machine  # noqa: E402

Row = dict[str, Any]
Told = list[list[Sound]]
CHECKED = 3
"""Speeds at which the band of a campaign is held against the simulation."""
FINE, STEP = 43, 1.06
"""Depths of that, and times the depth from one to the next."""


def told_of(campaigns: Sequence[Campaign]) -> list[Told]:
    """The sound of every rung, [campaign][speed][rung]; all mills have as many teeth."""
    return [
        [[listen(x, rate, n, c.mill.teeth, "cut") for x, rate in row] for n, row in zip(c.speeds, rows, strict=True)]
        for c, rows in zip(campaigns, sounds(campaigns), strict=True)
    ]


def cut(name: str, c: Campaign, speed: float, depth: float, h: heard.Heard) -> TriedCut:
    """A row of the measurement; a frequency on a harmonic of the teeth is not written down."""
    f = h.chatter_frequency if h.verdict in ("chatter", "marginal") else None
    try:
        return TriedCut(name, speed, float(depth), c.mill.teeth, verdict=h.verdict, chatter_frequency=f)
    except InputError:
        return TriedCut(name, speed, float(depth), c.mill.teeth, verdict=h.verdict)


def walked(c: Campaign, told: Told) -> Measurement:
    """The shop goes deeper where it was stable and less deep where it sang until that turns, speed by speed.

    There every cut tells by itself; what is written down is what each tells beside all others.
    """
    places = []
    for n, row, begun in zip(c.speeds, told, c.begun, strict=True):
        k, seen = begun, list[int]()
        while 0 <= k < RUNGS and k not in seen and len(seen) < 4:
            seen.append(k)
            k += 1 if heard.told_by(row[k]).verdict == "stable" else -1
        places.append([(n, c.depths[k], row[k]) for k in seen])
    turns = [rows[i] for i in range(4) for rows in places if i < len(rows)][: c.cuts]
    every, tried = [sound for _, _, sound in turns], [cut("", c, n, b, heard.told_by(sound)) for n, b, sound in turns]
    cuts = tuple(cut(f"cut {i}", c, n, b, judged_sound(i, tried, every, [])[0]) for i, (n, b, _) in enumerate(turns))
    return Measurement(Path("cuts"), "cuts", (), (), cuts=cuts)


def traced(c: Campaign, told: Told) -> Row:
    """A campaign as the program answers it."""
    row: Row = {"seed": c.seed, "effect": c.effect, "size": c.size}
    m = walked(c, told)
    row |= {"cuts": len(m.cuts), "verdicts": Counter(one.verdict for one in m.cuts)}
    begun = time.process_time()
    try:
        found = trace_cuts(m, machine_of(c))
    except Exception as error:  # A crash is a wrong answer, not the end of the table.
        return row | {"verdict": "crashed", "error": repr(error), "named": [], "open": []}
    data = found.as_json()
    row |= {"verdict": data["verdict"], "odds": data["odds"], "seconds": round(time.process_time() - begun, 1)}
    row["named"] = [data["chosen"]["family"], *(r["family"] for r in data["rivals"])] if data["chosen"] else []
    row["why"] = {f"{k['family']} {k['member']}": k["reason"] for k in data["candidates"] if k["family"] == c.effect}
    row |= {"effective": data["effective_size"], "strain": data["strain"]}
    row["open"] = [r["family"] for r in data["left_open"]]
    row |= {"before": data["error_before"], "after": data["error_after"]}
    pick = np.random.default_rng([c.seed, 9]).choice(len(found.speed), CHECKED, replace=False)
    row["speed"] = [float(found.speed[i]) for i in pick]
    row["band"] = [[float(v) for v in found.band_after[:, i]] for i in pick]
    return row


def simulated(campaigns: Sequence[Campaign]) -> list[tuple[Campaign, Told]]:
    """Campaigns with what was heard, simulated together where they have as many teeth."""
    out = []
    for teeth in sorted({c.mill.teeth for c in campaigns}):
        some = [c for c in campaigns if c.mill.teeth == teeth]
        out += list(zip(some, told_of(some), strict=True))
    return out


def borders(rows: Sequence[Row]) -> None:
    """Put the depth in m at which chatter begins from rest (`true`) and that at which cuts begin to be heard in the
    simulation (`heard`) beside the bands; None beyond what is tried.

    Where the effect hangs on how far the tool moves, the first is that from which on vibration grows in the simulation.
    """
    fine = []
    for row in rows:
        c = drawn(row["seed"], row["effect"])
        fine.append(replace(c, speeds=tuple(row["speed"]), first=0.4 * c.first, step=STEP, rungs=FINE))
    found = {(c.seed, c.effect): (c, told) for c, told in simulated(fine)}
    grown = {}
    moving = [c for c in fine if c.effect in OF_AMPLITUDE]
    for teeth in sorted({c.mill.teeth for c in moving}):
        some = [c for c in moving if c.mill.teeth == teeth]
        for c, records in zip(some, sounds(some, noise=0.0), strict=True):
            grown[c.seed, c.effect] = [[grows(x) for x, _ in rungs] for rungs in records]
    for row in rows:
        c, told = found[row["seed"], row["effect"]]
        row["heard"] = [first_of(c, [heard.told_by(sound).verdict != "stable" for sound in rungs]) for rungs in told]
        if c.effect in OF_AMPLITUDE:
            row["true"] = [first_of(c, rungs) for rungs in grown[row["seed"], row["effect"]]]
        else:
            row["true"] = [border(c.mill, n) for n in c.speeds]


def first_of(c: Campaign, sings: Sequence[bool]) -> float | None:
    """The depth in m, between two rungs, at which it begins; None where that is below all or beyond."""
    first = next((k for k, one in enumerate(sings) if one), 0)
    return float(c.depths[first] / STEP**0.5) if first else None


def grows(x: NDArray[np.float64], turn: int = 0) -> bool:
    """Whether what changes from turn to turn, in a record without noise, does not die away."""
    turn = turn or 2 * len(x) // TURNS
    change = x[turn:] - x[:-turn]
    early, late = (float(np.sqrt(np.mean(part**2))) for part in np.array_split(change, 2))
    return not (late < 0.9 * early or late < 1e-6 * float(np.sqrt(np.mean(x**2))))


def halving(seed: int, advised: bool, most: int = 24) -> int:
    """Cuts until the band of depth is half as wide (in ln, over all speeds) as before the first."""
    c = drawn(seed, "")
    ((_, told),) = simulated([c])
    machine, rng = machine_of(c), np.random.default_rng([seed, 11])
    table = Cutting(**dict(machine.cutting or {}))
    places = [Place(condition(table, n, machine.tool_axes), c.depths, i) for i, n in enumerate(c.speeds)]
    cells = [(i, k) for k in (4, 2, 6, 0, 8, 3, 5, 1, 7) for i in range(len(c.speeds))]  # coarse depths first
    tool = sampled_tool(machine, 300, 0, min(p.at.tooth_frequency for p in places))
    forced = shaken(machine, table, np.array(c.speeds)[:, None], c.depths)
    width, cuts = list[float](), list[TriedCut]()
    while len(cuts) <= most and cells:
        bits = None
        found = as_it_is(cuts, machine, table, tool, rng, places)
        if found is not None:
            apart, sigma = found
            low, _, high = band(places, apart, np.zeros_like(sigma))
            width.append(float(np.mean(np.log(high / low))))
            bits = told_by(apart, sigma, forced)[1]
        if width and width[-1] < 0.5 * width[0]:
            return len(cuts)
        at = max(cells, key=lambda cell: bits[cell]) if advised and bits is not None else cells[0]
        cells.remove(at)
        i, k = at
        cuts.append(cut(f"cut {len(cuts)}", c, c.speeds[i], c.depths[k], heard.told_by(told[i][k])))
    return most + 1


def as_it_is(
    cuts: Sequence[TriedCut],
    machine: Machine,
    table: Cutting,
    tool: SampledTool,
    rng: np.random.Generator,
    places: Sequence[Place],
) -> Any:
    """Borders of the machine as it is after some cuts."""
    clear = tuple(one for one in cuts if one.verdict != "unknown")
    asked = clear or (TriedCut("none", 1e4, 1e-9, table.cuts_per_revolution, verdict="stable"),)
    conditions, index = conditions_of(asked, table, machine.tool_axes)
    problem = problem_of(asked, conditions, index, machine, tool, 0)
    one = entry(posterior(AsItIs(), problem), problem, folds_of(problem))
    drawn, sigma = forecast([one], problem, rng)
    return apart_at(drawn, places), sigma


def summary(rows: Sequence[Row]) -> str:
    """The table in Markdown."""
    lines = ["| undeclared | campaigns | named alone, rightly | among the named | left open | missed | wrong alone |"]
    lines.append("|---|---|---|---|---|---|---|")
    for effect in EFFECTS:
        some = [r for r in rows if r["effect"] == effect]
        alone = sum(r["named"] == [effect] for r in some)
        among = sum(effect in r["named"] for r in some)
        left = sum(not r["named"] and effect in r["open"] for r in some)
        wrong = sum(len(r["named"]) == 1 and r["named"] != [effect] for r in some)
        lines.append(f"| {effect} | {len(some)} | {alone} | {among} | {left} | {len(some) - among - left} | {wrong} |")
    nulls = [r for r in rows if not r["effect"]]
    lines.append(f"\nnothing: {len(nulls)} campaigns, nothing named on {sum(not r['named'] for r in nulls)}")
    for name in ("true", "heard"):
        held = [
            (low <= depth <= high)
            for r in rows
            for depth, (low, _, high) in zip(r.get(name, []), r.get("band", []), strict=name in r)
            if depth is not None
        ]
        if held:
            lines.append(f"coverage of the 90 % band ({name}): {np.mean(held):.3f} of {len(held)} depths")
    lines.append(f"seconds on one core: median {np.median([r.get('seconds', np.nan) for r in rows]):.0f}")
    return "\n".join(lines)


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--effects", nargs=2, type=int, default=(0, 0))
    p.add_argument("--null", nargs=2, type=int, default=(0, 0))
    p.add_argument("--out", type=Path)
    p.add_argument("--coverage", type=Path)
    p.add_argument("--advice", nargs=2, type=int)
    p.add_argument("--summary", type=Path)
    args = p.parse_args()
    if args.out:
        done = {(r["seed"], r["effect"]) for r in read(args.out)} if args.out.exists() else set()
        wanted = [(s, "") for s in range(*args.null)] + [(s, e) for s in range(*args.effects) for e in EFFECTS]
        todo = [drawn(s, e) for s, e in wanted if (s, e) not in done]
        with args.out.open("a") as file:
            for c, told in simulated(todo):
                file.write(json.dumps(traced(c, told)) + "\n")
                file.flush()
    if args.coverage:
        rows = read(args.coverage)
        borders([r for r in rows if "band" in r])
        args.coverage.write_text("".join(json.dumps(r) + "\n" for r in rows))
    if args.advice:
        pairs = [(halving(s, True), halving(s, False)) for s in range(*args.advice)]
        print(pairs, "ratio of the sums", sum(a for a, _ in pairs) / sum(b for _, b in pairs))
    if args.summary:
        print(summary(read(args.summary)))


def read(path: Path) -> list[Row]:
    """The rows of a file."""
    return [json.loads(line) for line in path.read_text().splitlines()]


if __name__ == "__main__":
    main()
