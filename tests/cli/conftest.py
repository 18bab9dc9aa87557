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

LATHE = """
schema = "jointlib/machine/1"
name = "lathe"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[25.33]]
[[connection]]
name = "guide"
between = ["slide.x", "ground"]
joint = "guide.joint.toml"
[tool]
x = "slide.x"
[response]
frequency = ["60 Hz", "200 Hz"]
[cutting]
process = "turning"
specific = 1e9
speed = [2000, 3000]
"""
GUIDE = """
schema = "jointlib/joint/1"
name = "guide"
[[law]]
kind = "linear"
stiffness = 1e7
[[law]]
kind = "viscous"
damping = 954.9
[[law]]
kind = "cubic"
stiffness3 = 1.33332e14
[covariance]
names = ["linear.stiffness", "viscous.damping"]
matrix = [[4e10, 0.0], [0.0, 1600.0]]
"""


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


@pytest.fixture
def lathe(here: Path) -> str:
    """A slide on a hardening guide whose parameters have a covariance, and what it turns."""
    (here / "lathe.toml").write_text(LATHE, encoding="utf-8")
    (here / "guide.joint.toml").write_text(GUIDE, encoding="utf-8")
    return "lathe.toml"


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
