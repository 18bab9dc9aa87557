"""``jointlib compare`` and ``frf --measured``: differences in a sentence, none below the uncertainty."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from command_line import LIBRARY, jointlib


def changed(path: str, to: str, *pairs: tuple[str, str]) -> str:
    text = Path(path).read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    Path(to).write_text(text)
    return to


def test_a_thing_and_itself_do_not_differ(lathe: str) -> None:
    shutil.copy("guide.joint.toml", "same.joint.toml")
    done = jointlib("compare guide.joint.toml same.joint.toml --json")
    assert (done.status, done.json["differences"]) == (0, [])
    assert done.json["sentence"] == "same.joint.toml and guide.joint.toml: no difference above the uncertainty."


def test_a_parameter_differs_where_it_leaves_its_uncertainty(lathe: str) -> None:
    # Standard errors: 2e5 N/m of the stiffness, 40 N s/m of the damping; 1.5 errors of a difference are none.
    near = changed("guide.joint.toml", "near.joint.toml", ("damping = 954.9", "damping = 1040.0"))
    far = changed("guide.joint.toml", "far.joint.toml", ("damping = 954.9", "damping = 1200.0"))
    assert jointlib(f"compare guide.joint.toml {near} --json").json["differences"] == []
    (found,) = jointlib(f"compare guide.joint.toml {far} --json").json["differences"]
    assert (found["what"], found["first"], found["other"]) == ("viscous.damping", 954.9, 1200.0)
    assert "viscous.damping: +26 %" in jointlib(f"compare guide.joint.toml {far}").out


def test_machines_differ_in_resonance_and_depth(lathe: str) -> None:
    heavy = changed(lathe, "heavy.toml", ("25.33", "30.0"))
    done = jointlib(f"compare {lathe} {heavy} -o both.svg --json")
    rows = {row["what"].split(", ")[-1]: row for row in done.json["differences"]}
    assert rows["frequency"]["other"] / rows["frequency"]["first"] == pytest.approx((25.33 / 30) ** 0.5, rel=1e-3)
    assert {"frequency", "damping", "compliance", "lowest stable depth", "chatter there"} <= set(rows)
    assert done.json["sentence"].startswith(f"heavy.toml against {Path(lathe).name}: lowest stable depth: ")
    assert Path("both.svg").read_text().startswith("<svg")


@pytest.mark.slow
def test_machines_are_compared_with_the_tool_that_is_asked_for(lathe: str) -> None:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    tools = '[tool.low]\nx = "cutter.x"\n\n[tool.both]\nx = "cutter.x"\ny = "cutter.y"\n'
    for name in ("one", "two"):
        Path(f"{name}.toml").write_text(text.replace('[tool]\nx = "cutter.x"\ny = "cutter.y"\n', tools))
    changed("two.toml", "two.toml", ("frequency = [603, 666]", "frequency = [603, 700]"))
    assert jointlib("compare one.toml two.toml --json").json["differences"] == []
    rows = jointlib("compare one.toml two.toml --tool both --json").json["differences"]
    assert any(row["what"].startswith("tool y, resonance at 665.18 Hz") for row in rows)
    done = jointlib("compare guide.joint.toml guide.joint.toml --tool both")
    assert (done.status, done.out) == (2, "")
    assert "--tool: guide.joint.toml is no machine" in done.err


def test_runs_differ_in_what_their_files_hold(here: Path) -> None:
    for name, depth in (("one", 1e-3), ("two", 2e-3)):
        Path(name).mkdir()
        Path(name, "run.json").write_text(json.dumps({"error_before": 0.1, "error_after": None}))
        Path(name, "lobes.json").write_text(json.dumps({"amplitude": [0.0], "minimum_depth": [depth]}))
    (found,) = jointlib("compare one two --json").json["differences"]
    assert (found["what"], found["first"], found["other"]) == (
        "lowest stable depth at vanishing vibration",
        1e-3,
        2e-3,
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("guide.joint.toml lathe.toml", "is a machine, guide.joint.toml a joint: expected two of a kind"),
        ("guide.joint.toml nowhere.toml", "nowhere.toml: no such file"),
        (f"{LIBRARY / 'guide_mill.toml'} lathe.toml", "guide is to be identified"),
        (f"{LIBRARY / 'guide_mill' / 'rig.measurement.toml'} lathe.toml", "kind is 'rig', expected 'frf'"),
        ("guide.joint.toml guide.joint.toml -o x.svg", "no receptance to draw"),
        (". guide.joint.toml", "a folder without run.json"),
    ],
)
def test_what_cannot_be_compared_is_said_in_a_sentence(words: str, said: str, lathe: str) -> None:
    done = jointlib(f"compare {words}")
    assert (done.status, done.out) == (2, "")
    assert said in done.err


def test_measured_records_are_laid_over_a_forced_response(here: Path) -> None:
    words = "frf machines/library/three_joints.toml --force 3 --frequency 60:200:60 -o x.svg"
    done = jointlib(f"{words} --measured machines/library/three_joints/tip.measurement.toml --json")
    assert done.status == 0, done.err
    rows = done.json["measured"]
    assert [row["force"] for row in rows] == [1.0, 3.0, 8.0, 15.0, 20.0]
    assert all(0 < row["frac"] <= 1 for row in rows)
    assert rows[0]["resonances"][0]["differences"]["compliance"] > 0.1
    assert "at the largest resonance" in rows[0]["sentence"]
