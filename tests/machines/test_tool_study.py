"""Studies that vary tool, holder and stick-out: every design is the machine that `lobes` computes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from tool_files import CUT, HOLDER, JOINT, SIZES, TOOL, TWO, machine, written

from jointlib.cli.main import cli
from machines import lobes_at_amplitude, read_machine, stickout
from machines.study.evaluation import Evaluation
from machines.study.study_file import read_study

STUDY = """
schema = "jointlib/study/1"
base = "mill.toml"
[[factor]]
name = "tool"
{tool}
[[factor]]
name = "holder"
path = "tool.holder"
values = ["a.holder.toml", "b.holder.toml"]
[[factor]]
name = "stick-out"
path = "tool.stick_out"
range = ["55 mm", "75 mm"]
levels = 2
{more}
[conditions]
speed = [6000, 12000]
speeds = 60
[[objective]]
quantity = "minimum-depth"
goal = "max"
"""
FILES = 'path = "tool.file"\nvalues = ["a.tool.toml", "b.tool.toml"]'
NAMES = 'path = "tool.use"\nvalues = ["short", "long"]'
IMMERSION = '[[factor]]\nname = "immersion"\npath = "cutting.immersion"\nvalues = [0.5, 0.3]'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    written(tmp_path, "a.tool.toml", f"{TOOL}{SIZES}{CUT}")
    written(tmp_path, "b.tool.toml", f"{TOOL}{SIZES.replace('12 mm', '16 mm')}[cutting]\nteeth = 4\n")
    written(tmp_path, "a.holder.toml", HOLDER)
    written(tmp_path, "b.holder.toml", HOLDER + JOINT)
    return tmp_path


def depth(path: Path, changes: dict[str, object]) -> float:
    found = lobes_at_amplitude(read_machine(path, changes), np.linspace(6000.0, 12000.0, 60), 0.0, "zero-order")
    return found.minimum_depth


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tool", "values", "more"),
    [
        (NAMES, ("short", "long"), ""),
        (FILES, ("a.tool.toml", "b.tool.toml"), IMMERSION),
        (NAMES, ("short", "long"), IMMERSION),
    ],
)
def test_every_design_of_a_study_is_the_machine_of_lobes(
    folder: Path, tool: str, values: tuple[str, ...], more: str
) -> None:
    named = tool == NAMES
    path = machine(folder, "" if named else 'tool = "a.tool.toml"', tool=TWO if named else "")
    study = read_study(written(folder, "a.study.toml", STUDY.format(tool=tool, more=more)))
    found = Evaluation(study.source)(0, study.total)["minimum-depth"]
    wanted = [
        depth(
            path,
            {
                "tool.use" if named else "tool.file": which,
                "tool.holder": holder,
                "tool.stick_out": stick_out,
                **({"cutting.immersion": immersion} if more else {}),
            },
        )
        for which in values
        for holder in ("a.holder.toml", "b.holder.toml")
        for stick_out in (0.055, 0.075)
        for immersion in ((0.5, 0.3) if more else (0.5,))
    ]
    assert len(set(wanted)) == len(wanted)
    np.testing.assert_allclose(np.ravel(found), wanted, rtol=1e-9)


@pytest.mark.slow
def test_the_best_of_a_study_is_written_and_read_back_by_lobes(folder: Path) -> None:
    machine(folder, 'tool = "a.tool.toml"')
    written(folder, "a.study.toml", STUDY.format(tool=FILES, more=""))
    asked = ["study", "run", str(folder / "a.study.toml"), "-o", str(folder / "out"), "--workers", "1", "--json"]
    done = CliRunner().invoke(cli, asked, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    best = depth(folder / "out" / "best.toml", {})
    found = Evaluation(folder / "a.study.toml")(0, 8)["minimum-depth"]
    assert best == pytest.approx(np.max(found), rel=1e-9)
    assert "best" in json.loads(done.stdout)
    for file in folder.glob("*.tool.toml"):
        file.unlink()
    assert depth(folder / "out" / "best.toml", {}) == best


def test_the_stick_out_of_a_tool_file_is_tuned_as_one_written_out(folder: Path) -> None:
    path = machine(folder, 'tool = "a.tool.toml"')
    found = stickout(path, between=("55 mm", "65 mm"), speed=9000, count=3, method="zero-order")
    for length, limit in zip(found.stick_out, found.depth, strict=True):
        told = read_machine(path, {"tool.stick_out": float(length)})
        assert lobes_at_amplitude(told, [9000.0], 0.0, "zero-order").depth[0] == limit
