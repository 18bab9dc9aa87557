"""Several tools by name: one of them is in the machine, and what belongs to the others is not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from jointlib.cli.main import cli
from jointlib.errors import InputError
from machines import frozen_receptance, lobes_at_amplitude, read_machine

HEAD = """
schema = "jointlib/machine/1"
[[component]]
name = "spindle"
kind = "lumped"
dofs = ["x", "y"]
mass = [[20.0, 0.0], [0.0, 20.0]]
damping = [["900 N s/m", 0.0], [0.0, "900 N s/m"]]
stiffness = [["80 N/um", 0.0], [0.0, "90 N/um"]]
"""
TOOL = """
[[component]]
name = "{name}"
kind = "lumped"
dofs = ["x", "y"]
mass = [[{mass}, 0.0], [0.0, {mass}]]
[[connection]]
name = "{name}_x"
between = ["{name}.x", "spindle.x"]
joint = {{ law = [{{ kind = "linear", stiffness = "20 N/um" }}, {{ kind = "viscous", damping = 60 }}] }}
[[connection]]
name = "{name}_y"
between = ["{name}.y", "spindle.y"]
joint = {{ law = [{{ kind = "linear", stiffness = "22 N/um" }}, {{ kind = "viscous", damping = 60 }}] }}
"""
LONG, SHORT = TOOL.format(name="long_cutter", mass=1.4), TOOL.format(name="short_cutter", mass=0.5)
CUT = """
[response]
frequency = [100, 4000]
force = [10]
[static]
force = {{ "short_cutter.x" = 100.0 }}
[cutting]
process = "milling"
teeth = {teeth}
tangential = 8e8
normal = 2e8
mode = "down"
immersion = 0.5
speed = [3000, 9000]
"""
NAMED = """
[tool.short]
x = "short_cutter.x"
y = "short_cutter.y"
components = ["short_cutter"]
[tool.long]
x = "long_cutter.x"
y = "long_cutter.y"
components = ["long_cutter"]
cutting = { teeth = 2 }
"""
BOTH = HEAD + LONG + SHORT + CUT.format(teeth=4) + NAMED


def written(folder: Path, text: str) -> Path:
    path = folder / "mill.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_first_tool_is_in_the_machine_and_another_one_by_its_name(tmp_path: Path) -> None:
    path = written(tmp_path, BOTH)
    short, long = read_machine(path), read_machine(path, {"tool.use": "long"})
    assert (short.tool_name, long.tool_name) == ("short", "long")
    assert [c.name for c in short.components] == ["spindle", "short_cutter"]
    assert [c.name for c in long.connections] == ["long_cutter_x", "long_cutter_y"]
    assert short.cutting is not None
    assert long.cutting is not None
    assert (short.cutting["teeth"], long.cutting["teeth"]) == (4, 2)
    assert "The tool is 'long'." in long.remarks()


def test_a_named_tool_makes_the_machine_of_a_file_that_has_no_other(tmp_path: Path) -> None:
    lines = np.linspace(200.0, 1500.0, 40)
    long = frozen_receptance(read_machine(written(tmp_path, BOTH), {"tool.use": "long"}), lines, 0.0).receptance
    alone = HEAD + LONG + CUT.format(teeth=2).replace("short_cutter", "long_cutter")
    alone = alone.replace('[static]\nforce = { "long_cutter.x" = 100.0 }\n', "")
    only = read_machine(written(tmp_path, alone + '[tool]\nx = "long_cutter.x"\ny = "long_cutter.y"\n'))
    np.testing.assert_allclose(long, frozen_receptance(only, lines, 0.0).receptance, rtol=1e-12)


def test_a_file_may_say_which_tool_it_has_and_the_verbs_another(tmp_path: Path) -> None:
    path = written(tmp_path, BOTH.replace("[tool.short]", '[tool]\nuse = "long"\n[tool.short]'))
    assert read_machine(path).tool_name == "long"
    for name in ("short", "long"):
        asked = ["lobes", str(path), "--tool", name, "--speed", "6000", "--method", "zero-order", "--json"]
        done = CliRunner().invoke(cli, asked, catch_exceptions=False)
        assert done.exit_code == 0, done.output
        tool = read_machine(path, {"tool.use": name})
        chart = lobes_at_amplitude(tool, np.array([6000.0]), 0.0, "zero-order")
        assert json.loads(done.stdout)["minimum_depth"] == chart.minimum_depth
        assert json.loads(done.stdout)["depth"] == chart.depth.tolist()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[tool.short]", '[tool]\nuse = "lang"\n[tool.short]', "did you mean 'long'"),
        ("[tool.short]", '[tool]\nx = "spindle.x"\n[tool.short]', "stands beside named tools"),
        ('components = ["long_cutter"]', 'components = ["cutter_long"]', "components names 'cutter_long'"),
        ("cutting = { teeth = 2 }", "cutting = 2", "expected a table with keys of [cutting]"),
        (NAMED, '[tool]\nuse = "long"\nx = "short_cutter.x"\n', "no tool has a name"),
    ],
)
def test_a_tool_that_cannot_be_chosen_is_refused_in_a_sentence(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in BOTH
    with pytest.raises(InputError) as refused:
        read_machine(written(tmp_path, BOTH.replace(old, new)))
    assert words in str(refused.value)
