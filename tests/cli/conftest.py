"""A working folder with the library in reach, a machine in it, and a browser."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from browser import Browser, running
from command_line import Done, with_library
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
def browser() -> str:
    """The program Chromium; what needs it skips without."""
    return require("chromium")


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser to be driven; without Chromium what needs it skips."""
    package("websocket")
    with running(require("chromium"), tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def at_bench(bench: Path) -> Iterator[Path]:
    """In the folder that a module has as its ``bench``."""
    with contextlib.chdir(bench):
        yield bench
