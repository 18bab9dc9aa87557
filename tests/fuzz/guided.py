"""Damages on, again and again, the inputs that reached lines of the program which none before them had reached.

``python tests/fuzz/guided.py --minutes 5 --kind machine`` runs as many inputs damaged once beside them, and tells how
many lines each of the two reached beyond those of the right inputs. What ends badly is laid into a folder, in the form
of the corpus.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from keep import keep
from runs import GOOD, HERE, ROOT, fenced, lay, run_here
from seeds import KINDS, Drawn, Input, Kind, drawn

_OURS = tuple(f"{ROOT}{os.sep}{name}{os.sep}" for name in ("jointlib", "machines", "fmu"))
_LARGEST = 200_000
"""Bytes up to which an input is damaged on: inserted copies add up."""


class Lines:
    """Lines of the program that were run."""

    def __init__(self, first: Lines | None = None) -> None:
        self.count = first.count if first else 0
        self._left = {code: set(left) for code, left in first._left.items()} if first else {}
        """Of each piece of code the lines that were not; one that has none any more is not watched."""

    @contextlib.contextmanager
    def watched(self) -> Iterator[None]:
        """Within it the lines that run are noted."""

        def reached(code: CodeType, number: int) -> None:
            if number in self._left[code]:
                self._left[code].remove(number)
                self.count += 1

        def line(frame: FrameType, event: str, _: Any) -> Any:
            if event == "line":
                reached(frame.f_code, frame.f_lineno)
            return line

        def call(frame: FrameType, event: str, _: Any) -> Any:
            code = frame.f_code
            if not code.co_filename.startswith(_OURS):
                return None
            if code not in self._left:
                self._left[code] = {number for *_, number in code.co_lines() if number}
            reached(code, frame.f_lineno)
            return line if self._left[code] else None

        sys.settrace(call)
        try:
            yield
        finally:
            sys.settrace(None)


def child(name: str, seed: int, minutes: float, most: int, found: Path) -> None:
    """Run inputs of a kind, damaged once and damaged on in turn; print what ended badly, at last the numbers."""
    kind, rng = KINDS[name], random.Random(f"{name} {seed} guided")
    pipe = os.fdopen(os.dup(1), "w", buffering=1)
    running, last = found / "running", found / "last"
    number = 0

    def run(given: Input, lines: Lines) -> tuple[bool, str]:
        """Whether an input reached something new, and how it ended; badly where it does so without the watch too."""
        before = lines.count
        outcome, said = "", ""
        for watch in (lines.watched(), contextlib.nullcontext()):
            keep(given, last)
            lay(given.files, running)
            with contextlib.chdir(running), watch:
                outcome, said = run_here(given.line)
            shutil.rmtree(running, ignore_errors=True)
            shutil.rmtree(last, ignore_errors=True)
            if outcome in GOOD:
                break
        else:
            print(json.dumps({"outcome": outcome, "said": said}), file=pipe)
            keep(given, found / f"{number}_{outcome.replace(' ', '_')}")
        return lines.count > before, outcome

    fenced(found)
    right = Lines()
    for one in _right(kind):
        run(one.among(kind), right)
    blind, guided, begun = Lines(right), Lines(right), time.monotonic()
    answered, refused = list[Drawn](), list[Drawn]()
    while number < most and time.monotonic() - begun < 60 * minutes:
        number += 1
        run(drawn(kind, rng).damaged(kind, rng).among(kind), blind)
        # What was answered leads further in than what was refused.
        pool = rng.choice([answered, answered, refused, []])
        one = (rng.choice(pool) if pool else drawn(kind, rng)).damaged(kind, rng)
        new, outcome = run(one.among(kind), guided)
        if new and len(one.data) <= _LARGEST:
            (refused if outcome == "refused" else answered).append(one)
    shutil.rmtree(found / "temporary", ignore_errors=True)
    reached = {"right": right.count, "once": blind.count, "on": guided.count}
    print(json.dumps({"inputs": number, "kept": len(answered) + len(refused), **reached}), file=pipe)


def _right(kind: Kind) -> Iterator[Drawn]:
    """Every right input of a kind, with every command."""
    seen = set()
    for number in range(40 * len(kind.files) * len(kind.commands)):
        one = drawn(kind, random.Random(number))
        if (one.name, one.line) not in seen:
            seen.add((one.name, one.line))
            yield one


def main() -> int:
    """Run the kinds that are asked for and print a line on each; the exit status is 1 where anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", action="append", choices=[*KINDS], help="default: all")
    parser.add_argument("--minutes", type=float, default=1.0, help="for each kind")
    parser.add_argument("--inputs", type=int, default=10**9, help="of either sort and kind at most")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    found, bad = Path(tempfile.mkdtemp(prefix="found")), 0
    print("kind | inputs of either sort | lines of right inputs | more, damaged once | more, damaged on | kept | bad")
    for kind in asked.kind or KINDS:
        folder = found / kind.replace(" ", "_")
        folder.mkdir()
        command = [sys.executable, str(HERE / "guided.py"), "child", kind, str(asked.seed), str(asked.minutes)]
        threads = {"MPLBACKEND": "Agg", "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
        environment = {**os.environ, **threads, "PYTHONPATH": f"{HERE}:{ROOT}"}
        done = subprocess.run(
            [*command, str(asked.inputs), str(folder)],
            capture_output=True,
            env=environment,
        )
        *told, last = [json.loads(line) for line in done.stdout.splitlines() if line.startswith(b"{")] or [{}]
        if done.returncode or "right" not in last:
            said = f"exit status {done.returncode}, {done.stderr[-200:]!r}, at {folder / 'last'}"
            told.append({"outcome": "died", "said": said})
        for one in told:
            print(f"    {one['outcome']}: {one['said']}", file=sys.stderr)
        bad += len(told)
        if "right" in last:
            more = [str(last[word] - last["right"]) for word in ("once", "on")]
            cells = [kind, str(last["inputs"]), str(last["right"]), *more, str(last["kept"]), str(len(told))]
            print(" | ".join(cells), flush=True)
    if bad:
        print(f"in the form of the corpus: {found}", file=sys.stderr)
    else:
        shutil.rmtree(found)
    return int(bad > 0)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if sys.argv[1:2] == ["child"]:
        name, seed, minutes, most, found = sys.argv[2:]
        child(name, int(seed), float(minutes), int(most), Path(found))
    else:
        sys.exit(main())
