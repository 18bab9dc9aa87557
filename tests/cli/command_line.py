"""The command line called as a user does, in this process."""

from __future__ import annotations

import contextlib
import html
import io
import json
import re
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn
from unittest import mock

from jointlib.cli import main as entry

ROOT = Path(__file__).parents[2]
LIBRARY = ROOT / "machines" / "library"


@dataclass(frozen=True)
class Done:
    """What a call left: exit status, standard output, standard error."""

    status: int
    out: str
    err: str

    @property
    def complaints(self) -> list[str]:
        """Standard error without the steps ("…", then their time) that a busy computer is told after two seconds."""
        return [line for line in self.err.splitlines() if not line.endswith("…") and not line.startswith("  ")]

    @property
    def json(self) -> Any:
        """Standard output as strict JSON: nothing else stands there, and no NaN."""

        def refuse(word: str) -> NoReturn:
            raise AssertionError(f"{word} is no JSON")

        return json.loads(self.out, parse_constant=refuse)


def jointlib(words: str | list[str]) -> Done:
    """``jointlib`` with these words, through the function the installed command calls."""
    argv = ["jointlib", *(shlex.split(words) if isinstance(words, str) else words)]
    out, err = io.StringIO(), io.StringIO()
    status: Any = None
    with mock.patch.object(sys, "argv", argv), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            entry.main()
        except SystemExit as stop:
            status = stop.code
    assert isinstance(status, int)
    return Done(status, out.getvalue(), err.getvalue())


def examples(verb: str) -> list[str]:
    """The example lines in a verb's help, without the word ``jointlib``."""
    lines = (line.strip() for line in jointlib([verb, "--help"]).out.splitlines())
    return [line.removeprefix("jointlib ") for line in lines if line.startswith("jointlib ")]


def wrote(done: Done) -> list[Path]:
    """The files that a call says it wrote."""
    return [Path(line.removeprefix("wrote ")) for line in done.out.splitlines() if line.startswith("wrote ")]


def read(folder: Path) -> str:
    """The text of the report in a folder as a reader sees it."""
    page = (folder / "report.html").read_text(encoding="utf-8")
    body = re.sub(r"<(style|svg|script)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", body)).split())


def with_library(folder: Path) -> Path:
    """A folder in which ``machines/library`` is found as in a clone."""
    folder.mkdir(exist_ok=True)
    (folder / "machines").symlink_to(ROOT / "machines")
    return folder


def files(folder: Path) -> set[Path]:
    """Every file and folder below, hidden ones too, links not followed."""
    return {path.relative_to(folder) for path in folder.rglob("*")}
