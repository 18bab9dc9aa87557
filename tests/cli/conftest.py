"""One run and one trace, made as their help shows them, for all tests that look at what they leave."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from browser import Browser, running
from command_line import Done, examples, jointlib, with_library
from tools import package, require


@dataclass(frozen=True)
class Left:
    """A call that wrote a folder."""

    command: str
    done: Done
    folder: Path


@pytest.fixture
def here(tmp_path: Path) -> Iterator[Path]:
    """An empty working folder with the library in reach."""
    with contextlib.chdir(with_library(tmp_path / "here")):
        yield tmp_path / "here"


@pytest.fixture(scope="session")
def guide_mill_run(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """``jointlib run machines/library/guide_mill.toml -o out``."""
    (command,) = examples("run")
    folder = with_library(tmp_path_factory.mktemp("run") / "here")
    with contextlib.chdir(folder):
        return Left(command, jointlib(command), folder / "out")


@pytest.fixture(scope="session")
def guide_trace(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """The first example of ``jointlib trace``, of a joint, with ``--json``."""
    command, _ = examples("trace")
    folder = with_library(tmp_path_factory.mktemp("trace") / "here")
    with contextlib.chdir(folder):
        return Left(command, jointlib(f"{command} --json"), folder / "traced")


@pytest.fixture(scope="session")
def machine_trace(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """The second example of ``jointlib trace``, of a machine."""
    _, command = examples("trace")
    folder = with_library(tmp_path_factory.mktemp("machine_trace") / "here")
    with contextlib.chdir(folder):
        return Left(command, jointlib(command), folder / "traced")


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser to be driven; without Chromium what needs it skips."""
    package("websocket")
    with running(require("chromium"), tmp_path_factory.mktemp("profile")) as browser:
        yield browser
