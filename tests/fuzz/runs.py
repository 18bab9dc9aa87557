"""Damaged inputs through the command line, in one process a batch, and what became of each.

A child runs the inputs of one kind one after the other and tells after each how it ended; the parent restarts it behind
an input that killed it or that did not come back.
"""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType
from unittest import mock

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
SLOW = 20.0
"""s after which an answer is too late."""
_GIVEN_UP = 3 * SLOW
MEMORY = 4 << 30
"""Bytes of address space of the child."""
LONGEST = 300
GOOD = ("done", "refused", "check failed", "computing")
_SURROUNDINGS = {
    "MPLBACKEND": "Agg",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONDONTWRITEBYTECODE": "1",
    "PYTHONPATH": f"{HERE}{os.pathsep}{ROOT}",
}
_CHILDREN = multiprocessing.get_context("forkserver")
"""Children are forked off a process that has loaded what they need."""
_CHILDREN.set_forkserver_preload(["loaded"])
OUTCOMES = (*GOOD, "badly said", "not a number", "warned", "half written", "slow", "traceback", "died")
_PROGRESS = re.compile(r"\d+ s\)?\s*$")
"""What a command says that is still at work and tells how far it is."""
_NOT_FINITE = re.compile(r"(?<![\w.'\"\])-])[+-]?(?:nan|inf)(?![\w.'\":])")

_QUOTED = re.compile(rb'"[^"\n]*(?:nan|inf)[^"\n]*"')
"""Words of a file in which the letters stand as such."""


@dataclass(frozen=True)
class Ended:
    """How one input ended."""

    number: int
    outcome: str
    said: str = ""
    """What was wrong: exception and place, sentence, warning."""
    seconds: float = 0.0


class _Late(BaseException):
    pass


def _late(number: int, frame: FrameType | None) -> None:
    raise _Late


def judged(status: int | None, out: str, err: str, line: tuple[str, ...]) -> tuple[str, str]:
    """What exit status and texts amount to."""
    said = [text for text in err.split("\n") if text]
    if status not in (0, 1, 2):
        return "badly said", f"status {status}"
    if status == 0:
        found = _NOT_FINITE.search(out) if line[0] == "inspect" else None
        return ("not a number", out[max(0, found.start() - 40) : found.end() + 20]) if found else ("done", "")
    if not said:
        return "badly said", "no sentence"
    if "[Errno" in err or "Traceback" in err or "Error:" in err:
        return "badly said", next(text for text in said if "Errno" in text or "Error" in text or "Trace" in text)[:300]
    for text in said:
        if len(text) > LONGEST:
            return "badly said", f"{len(text)} letters: {text[:200]}"
        if not text.isprintable():
            return "badly said", f"not printable: {text[:200]!r}"
    first, *more = [text for text in said if not (text.endswith("…") or re.fullmatch(r"\s+\d+ s", text))] or said
    if not first.startswith("jointlib: ") or (more and not re.fullmatch(r"jointlib: \d+ faults", first)):
        return "badly said", " / ".join(said)[:300]
    return ("refused" if status == 2 else "check failed"), ""


def run_here(line: tuple[str, ...]) -> tuple[str, str]:
    """One command line in this process and folder, and what became of it."""
    from jointlib.cli import main as entry

    before = set(Path().rglob("*"))
    named = any(_QUOTED.search(path.read_bytes()) for path in Path().glob("*.toml") if path.is_file())
    out, err, told = io.StringIO(), io.StringIO(), dict[str, None]()

    def show(message: object, category: type[Warning], file: str, number: int, *_: object) -> None:
        told[f"{category.__name__}: {message} ({Path(file).name}:{number})"] = None

    status = None
    with (
        mock.patch.object(sys, "argv", ["jointlib", *line]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        warnings.catch_warnings(),
        mock.patch.object(warnings, "showwarning", show),
    ):
        warnings.simplefilter("default")
        signal.signal(signal.SIGALRM, _late)
        signal.setitimer(signal.ITIMER_REAL, SLOW)
        try:
            entry.main()
        except SystemExit as stop:
            status = stop.code if isinstance(stop.code, int) else 0 if stop.code is None else 1
        except _Late:
            if _PROGRESS.search(err.getvalue()):
                return "computing", ""
            return "slow", where(sys.exc_info()[1])
        except BaseException as error:
            return "traceback", f"{type(error).__name__}: {str(error)[:120]} at {where(error)}"
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
    outcome, said = judged(status, out.getvalue(), err.getvalue(), line)
    left = [str(path) for path in set(Path().rglob("*")) - before if path.is_file()]
    if outcome == "not a number" and named:
        return "done", ""
    if outcome == "refused" and left:
        return "half written", ", ".join(left)
    if outcome in GOOD and told:
        return "warned", "; ".join(told)[:300]
    return outcome, said


def where(error: BaseException | None) -> str:
    """The last place in the project, and the last of all."""
    frames = traceback.extract_tb(error.__traceback__) if error is not None else []
    ours = [f for f in frames if Path(f.filename).is_relative_to(ROOT) and "tests" not in Path(f.filename).parts]
    ours = [f for f in ours if ".venv" not in Path(f.filename).parts]
    spots = [*(ours[-1:]), *(frames[-1:] if frames[-1:] != ours[-1:] else [])]
    return " < ".join(f"{'/'.join(Path(f.filename).parts[-3:])}:{f.lineno}" for f in spots)


def fenced(above: Path) -> None:
    """From here on this process writes below a folder alone, with so much memory."""
    from fence import fence

    with contextlib.suppress(ValueError):
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    (above / "temporary").mkdir(exist_ok=True)
    tempfile.tempdir = os.environ["TMPDIR"] = str(above / "temporary")
    fence(above)


def lay(files: Mapping[str, bytes], folder: Path) -> None:
    """Write the files of an input into a folder."""
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def child(pipe: Connection, kind: str, seed: int, first: int, last: int) -> None:
    """Run inputs one after the other; the number of each goes into the pipe before it, what became of it after."""
    from seeds import KINDS, damaged

    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    above = Path(tempfile.mkdtemp(prefix="fuzz"))
    fenced(above)
    try:
        for number in range(first, last):
            given = damaged(KINDS[kind], seed, number)
            folder = above / str(number)
            folder.mkdir()
            lay(given.files, folder)
            pipe.send(number)
            begun = time.perf_counter()
            with contextlib.chdir(folder):
                outcome, said = run_here(given.line)
            pipe.send(Ended(number, outcome, said, time.perf_counter() - begun))
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        shutil.rmtree(above, ignore_errors=True)


def ended(kind: str, seed: int, count: int, first: int = 0) -> Iterator[Ended]:
    """How each of so many inputs of a kind ended."""
    last, at = first + count, first
    while at < last:
        here, there = _CHILDREN.Pipe(duplex=False)
        process = _CHILDREN.Process(target=child, args=(there, kind, seed, at, last))
        with mock.patch.dict(os.environ, _SURROUNDINGS):
            process.start()
        there.close()
        begun, late = None, False
        with here:
            for told in _told(here):
                if isinstance(told, Ended):
                    yield told
                    begun, at = None, told.number + 1
                elif told is None:
                    late = True
                else:
                    begun = told
        process.kill()
        process.join()
        if at < last:
            stopped = at if begun is None else begun
            yield Ended(stopped, "slow" if late else "died", f"exit status {process.exitcode}")
            at = stopped + 1


def _told(pipe: Connection) -> Iterator[Ended | int | None]:
    """What the child tells until it ends; None where it stays silent for too long."""
    with contextlib.suppress(EOFError):
        while pipe.poll(_GIVEN_UP):
            yield pipe.recv()
        yield None
