"""Results to standard output, progress to standard error."""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import click

from jointlib.errors import InputError, told
from jointlib.shown.json_values import plain


def emit(as_json: bool, data: Mapping[str, Any], lines: Sequence[str]) -> None:
    """Print the promised keys as JSON, or the same in words."""
    if as_json:
        click.echo(json.dumps(plain(data), allow_nan=False, indent=1))
    elif lines:
        click.echo("\n".join(lines))


class SoFar:
    """Prints what is said as it comes; with JSON nothing."""

    def __init__(self, as_json: bool) -> None:
        self.as_json, self.printed = as_json, 0

    def __call__(self, lines: Sequence[str]) -> None:
        """Print those of the lines that came since."""
        emit(False, {}, [] if self.as_json else lines[self.printed :])
        self.printed = len(lines)


_FAULT = re.compile(r"(?:(?P<file>(?!--)[^:]+\.\w+): )?(?P<fault>.*?)(?: \(line (?P<line>\d+): .*\))?", re.DOTALL)


def faults(error: InputError) -> str:
    """What is wrong with the input, as JSON: the sentences with their file and line, null where they are of none."""
    found = []
    for said in error.sentences:
        match = _FAULT.fullmatch(said)
        file, fault, line = match.group("file", "fault", "line") if match else (None, said, None)
        found.append({"file": file, "line": int(line) if line else None, "fault": told(fault)})
    return json.dumps({"faults": found}, indent=1)


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


class Workings:
    """Parts of a job that usually is short: each is said as :func:`working` says it."""

    def step(self, what: str) -> AbstractContextManager[None]:
        """Say it if it takes long."""
        return working(what)


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


class Working:
    """Each part of a computation by a spinner, as `working` has it."""

    def step(self, what: str) -> AbstractContextManager[None]:
        """The spinner of a part."""
        return working(what)
