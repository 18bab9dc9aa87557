"""Results to standard output, progress to standard error."""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import click

from jointlib.errors import InputError
from jointlib.loop.answer.report import plain


def emit(as_json: bool, data: Mapping[str, Any], lines: Sequence[str]) -> None:
    """Print the promised keys as JSON, or the same in words."""
    if as_json:
        click.echo(json.dumps(plain(data), allow_nan=False, indent=1))
    elif lines:
        click.echo("\n".join(lines))


def emit_so_far(as_json: bool, lines: list[str]) -> None:
    """Print the words that stand already and clear them, before something that may take long; with JSON nothing."""
    if not as_json and lines:
        click.echo("\n".join(lines))
        lines.clear()


_FAULT = re.compile(r"(?:(?P<file>(?!--)[^:]+\.\w+): )?(?P<fault>.*?)(?: \(line (?P<line>\d+): .*\))?", re.DOTALL)


def faults(error: InputError) -> str:
    """What is wrong with the input, as JSON: the sentences with their file and line, null where they are of none."""
    told = []
    for said in error.sentences:
        match = _FAULT.fullmatch(said)
        file, fault, line = match.group("file", "fault", "line") if match else (None, said, None)
        told.append({"file": file, "line": int(line) if line else None, "fault": fault})
    return json.dumps({"faults": told}, indent=1)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Columns padded to their width."""
    widths = [max(len(str(r[i])) for r in (header, *rows)) for i in range(len(header))]
    return ["  ".join(str(cell).ljust(w) for cell, w in zip(r, widths, strict=True)).rstrip() for r in (header, *rows)]


def wrote(path: Any) -> str:
    """The line every verb prints for a file it made."""
    return f"wrote {path}"


_SHOW_AFTER = 2.0


@contextmanager
def working(what: str) -> Iterator[None]:
    """Say on standard error what is being done: a spinner on a terminal, a line once it took two seconds elsewhere."""
    if sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status(what):
            yield
        return
    import threading

    timer = threading.Timer(_SHOW_AFTER, lambda: click.echo(f"{what} …", err=True))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


class Steps:
    """Numbered steps of a long job; each is announced on standard error and timed."""

    @contextmanager
    def step(self, what: str) -> Iterator[None]:
        """Announce a step, and say how long it took if that was more than two seconds."""
        begun = time.perf_counter()
        click.echo(f"{what} …", err=True)
        yield
        spent = time.perf_counter() - begun
        if spent > _SHOW_AFTER:
            click.echo(f"  {spent:.0f} s", err=True)
