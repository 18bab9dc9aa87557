"""Results to standard output, progress to standard error."""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import Any

import click

from jointlib.errors import InputError, told
from jointlib.shown.json_values import plain
from jointlib.shown.progress import Follower, followed


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
    """The line every verb prints for a file it made, which is there still."""
    if not Path(path).exists():
        raise InputError(f"{path}: is gone since it was written, expected to be left alone until the command ends")
    return f"wrote {path}"


_SHOW_AFTER, _AGAIN, _AGAIN_IN_LONG = 2.0, 15.0, 60.0
"""Seconds after which a part is told, and how often how far it is; in a job of hours less often."""


def _silent() -> bool:
    """Whether the command was asked for JSON and nothing else."""
    asked = click.get_current_context(silent=True)
    return asked is not None and bool(asked.params.get("as_json"))


@contextmanager
def working(what: str) -> Iterator[None]:
    """Say on standard error what is being done, and how far it is; nothing with ``--json``.

    A spinner on a terminal; elsewhere a line once it took two seconds, and one every quarter of a minute from there on.
    """
    if _silent():
        yield
        return
    if sys.stderr.isatty():
        from rich.console import Console

        console = Console(stderr=True)
        spinner = console.status(what)
        with spinner, _told(lambda how_far: spinner.update(f"{what}: {how_far}"), console.print, 1.0, 1.0):
            yield
        return
    begun = Event()

    def say(text: str) -> None:
        if not begun.is_set():
            begun.set()
            click.echo(f"{what} …", err=True)
        if text:
            click.echo(f"  {text}", err=True)

    with _told(lambda how_far: say(how_far if begun.is_set() else ""), say, _SHOW_AFTER, _AGAIN):
        yield


@contextmanager
def _told(line: Callable[[str], None], remark: Callable[[str], None], first: float, again: float) -> Iterator[None]:
    """Call ``line`` with how far what is done inside is, after ``first`` seconds and ``again`` and again."""
    follower, done, begun = Follower(remark), Event(), time.perf_counter()

    def tell() -> None:
        wait = first
        while not done.wait(wait):
            wait = again
            spent = f"{time.perf_counter() - begun:.0f} s"
            line(f"{follower} ({spent})" if follower.loops else spent)

    thread = Thread(target=tell, daemon=True)
    thread.start()
    try:
        with followed(follower):
            yield
    finally:
        done.set()
        thread.join()


class Steps:
    """Numbered steps of a long job; each is announced on standard error and timed."""

    @contextmanager
    def step(self, what: str) -> Iterator[None]:
        """Announce a step, say how far it is every minute, and how long it took or why it ended early."""
        if _silent():
            yield
            return
        begun = time.perf_counter()
        click.echo(f"{what} …", err=True)

        def line(said: str) -> None:
            click.echo(f"  {said}", err=True)

        try:
            with _told(line, line, _AGAIN_IN_LONG, _AGAIN_IN_LONG):
                yield
        except Exception as error:
            line(f"ended after {time.perf_counter() - begun:.0f} s: {str(error) or type(error).__name__}")
            raise
        spent = time.perf_counter() - begun
        if spent > _SHOW_AFTER:
            line(f"{spent:.0f} s")


class Working:
    """Each part of a computation by a spinner, as `working` has it."""

    def step(self, what: str) -> AbstractContextManager[None]:
        """The spinner of a part."""
        return working(what)
