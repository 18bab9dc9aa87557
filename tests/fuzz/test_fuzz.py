"""Damaged inputs of every kind end in an answer or in a sentence: no traceback, no death, nothing half written."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from keep import CORPUS
from runs import GOOD, ended, run_here
from seeds import KINDS

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the runs are timed by signals and limited as on POSIX")
SEEDS = (31, 59, 97)
"""Those that nothing was looked at with while the program was repaired."""
COSTLY = (
    "command line",
    "machine",
    "machine computed",
    "measurement",
    "tool",
    "component",
    "cutting forces",
    "npz response",
    "hdf5",
    "harwell-boeing",
    "stl",
    "stl binary",
)
"""Kinds of which an input takes more than a hundredth of a second."""
FEW = 40
MANY = 751
"""Inputs of a kind; 20 006 of all."""


@pytest.mark.parametrize("case", sorted(CORPUS.iterdir()), ids=lambda case: case.name)
def test_what_was_ever_found_stays_repaired(case: Path, tmp_path: Path) -> None:
    shutil.copytree(case, tmp_path / "case")
    line = json.loads((tmp_path / "case" / "line.json").read_text("utf-8"))
    (tmp_path / "case" / "line.json").unlink()
    before = signal.getsignal(signal.SIGALRM)
    try:
        with contextlib.chdir(tmp_path / "case"):
            outcome, said = run_here(tuple(line))
    finally:
        signal.signal(signal.SIGALRM, before)
    assert outcome in GOOD, said


def test_the_runs_write_nothing_outside_their_folder(tmp_path: Path) -> None:
    """Inputs name any path there is; what they make the program write must stay where the run can be thrown away."""
    code = f"""
import os, pathlib, shutil, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from fence import fence
inside, outside = pathlib.Path("inside"), pathlib.Path("outside")
inside.mkdir(); outside.mkdir(); (outside / "kept").write_text("kept"); (inside / "link").symlink_to(outside.resolve())
(inside / "tree" / "deep").mkdir(parents=True); (inside / "tree" / "deep" / "leaf").write_text("a")
(outside / "tree").mkdir(); (outside / "tree" / "leaf").write_text("kept")
fence(inside)
shutil.rmtree(inside / "tree")
(inside / "a").write_text("a"); os.replace(inside / "a", inside / "b"); (inside / "c").mkdir()
for wrong in (
    lambda: (outside / "new").write_text("x"),
    lambda: (inside / ".." / "outside" / "new").write_text("x"),
    lambda: (inside / "link" / "new").write_text("x"),
    lambda: os.replace(inside / "b", outside / "kept"),
    lambda: (outside / "kept").unlink(),
    lambda: (outside / "d").mkdir(),
    lambda: shutil.rmtree(outside / "tree"),
    lambda: os.open(outside / "kept", os.O_WRONLY),
    lambda: shutil.copy(inside / "b", outside / "b"),
):
    try:
        wrong()
    except PermissionError:
        continue
    raise SystemExit("went through")
"""
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    assert sorted(path.name for path in (tmp_path / "outside").rglob("*")) == ["kept", "leaf", "tree"]
    assert (tmp_path / "outside" / "kept").read_text() == "kept"


def _bad(kind: str, seed: int, count: int) -> list[str]:
    found = list(ended(kind, seed, count))
    assert len(found) == count
    return [f"{one.number}: {one.outcome}: {one.said}" for one in found if one.outcome not in GOOD]


@pytest.mark.thorough
def test_a_run_that_dies_is_told_and_the_others_go_on() -> None:
    outcome = []
    for one in ended("wav", 1, 40):
        outcome.append(one.outcome)
        if len(outcome) == 5:
            (child,) = multiprocessing.active_children()
            child.kill()
    assert outcome.count("died") == 1
    assert len(outcome) == 40


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_twenty_thousand_damaged_inputs_are_answered(kind: str) -> None:
    assert _bad(kind, 2, FEW if kind in COSTLY else MANY) == []


@pytest.mark.slow
def test_inputs_that_reach_new_lines_are_damaged_on() -> None:
    """The lines that inputs reach are told, and those that reached new ones are kept."""
    command = [sys.executable, str(Path(__file__).parent / "guided.py"), "--inputs", "40", "--kind", "matrix market"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    head, row = (line.split(" | ") for line in done.stdout.splitlines())
    said = dict(zip(head[1:], map(int, row[1:]), strict=True))
    assert said["inputs of either sort"] == 40
    assert said["lines of right inputs"] > 1000
    assert said["more, damaged once"] > 0
    assert said["more, damaged on"] > 0
    assert said["kept"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_inputs_of_other_seeds_are_answered(kind: str) -> None:
    for seed in SEEDS:
        assert _bad(kind, seed, 220) == []
