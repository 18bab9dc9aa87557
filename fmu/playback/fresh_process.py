"""A script of this folder run in a fresh process, which an FMU may end, hang or shout in: both ends of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NoReturn

from jointlib.errors import CheckFailed

_LONGEST = 300


def answer_of(
    script: str, request: Mapping[str, object], scratch: Path, where: str, limit: float, run: str = "run"
) -> Any:
    """What a script answers to a request; ``where`` is the file and what it is, for the sentence where it does not."""
    answer = scratch / "answer.json"
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-m", f"{__package__}.{script}"],
            input=json.dumps({**request, "answer": str(answer)}),
            capture_output=True,
            text=True,
            errors="replace",
            timeout=limit,
            cwd=scratch,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )
    except subprocess.TimeoutExpired:
        raise CheckFailed(f"{where} did not finish its {run} in {limit:g} s") from None
    said = [_last_line(text) for text in (done.stdout, done.stderr) if text.strip()]
    if done.returncode < 0:
        ended = "; ".join([f"signal {-done.returncode}", *said])
        raise CheckFailed(f"{where} ended the process that ran it ({ended})")
    if done.returncode or not answer.is_file():
        raise CheckFailed(f"{where} does not run in FMPy ({'; '.join(said) or 'no message'})")
    return json.loads(answer.read_text(encoding="utf-8"))


def answering(work: Callable[[Any], object]) -> NoReturn:
    """The other end: answer the request on standard input into the file that it names, as the FMU may print.

    The process ends at once: pythonfmu's library reads its interpreter after it was freed, where one ends in order.
    """
    asked = json.load(sys.stdin)
    Path(asked["answer"]).write_text(json.dumps(work(asked)), encoding="utf-8")
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(0)


def _last_line(text: str) -> str:
    """What a terminal may show of what an FMU printed."""
    line = text.strip().splitlines()[-1]
    return "".join(c if c.isprintable() else "?" for c in line[:_LONGEST]) + ("…" if len(line) > _LONGEST else "")
