"""The verb stickout: where a pocket lies at a speed, by the modes of the tool and by brute force."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

import machines
from jointlib.errors import InputError
from machines import lobes_at_amplitude, natural_modes, read_machine
from machines.answers.stickout import Pocket, StickOuts

MILL = """
schema = "jointlib/machine/1"
[[component]]
name = "cutter"
kind = "tool"
diameter = "12 mm"
flute_length = "25 mm"
stick_out = "60 mm"
equivalent = 0.8
loss_factor = 0.05
[[connection]]
name = "holder"
between = ["cutter", "ground"]
at = [0, 0, 0]
rigid = true
holds = ["x", "y", "z", "rx", "ry", "rz"]
[tool]
x = "cutter.tip.x"
y = "cutter.tip.y"
[cutting]
process = "milling"
teeth = 3
tangential = 8e8
normal = 2.4e8
mode = "down"
immersion = 0.5
speed = [6000, 24000]
"""
WORDS = "stickout mill.toml --between 62mm 76mm --speed 15000 --method zero-order"


@pytest.mark.slow
def test_the_pocket_lies_where_a_mode_is_met_by_a_multiple_of_the_teeth(here: Path) -> None:
    Path("mill.toml").write_text(MILL)
    data = jointlib(f"{WORDS} --count 9 --json").json
    assert len(data["depth"]) == len(data["stick_out"]) == 9
    best = data["pockets"][0]
    machine = read_machine("mill.toml", {"component.cutter.stick_out": best["stick_out"]})
    ratio = natural_modes(machine).frequency[0] / (3 * 15000 / 60)
    assert abs(ratio - round(ratio)) < 0.08
    fine = np.linspace(best["stick_out"] - 1e-3, best["stick_out"] + 1e-3, 9)
    depths = []
    for stick_out in fine:
        machine = read_machine("mill.toml", {"component.cutter.stick_out": float(stick_out)})
        depths.append(lobes_at_amplitude(machine, [15000.0], method="zero-order").depth[0])
    assert best["depth"] >= 0.97 * max(depths)
    assert best["depth"] > 3 * min(data["depth"])


def test_the_function_is_what_the_verb_prints_and_writes_the_curve(here: Path) -> None:
    Path("mill.toml").write_text(MILL)
    done = jointlib(f"{WORDS} --count 4 -o curve.csv --json")
    found = machines.stickout(
        "mill.toml", between=["62 mm", "76 mm"], speed=15000, method="zero-order", count=4, output="curve.csv"
    )
    assert json.loads(json.dumps(found.as_json())) == done.json
    table = np.loadtxt("curve.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], found.depth, rtol=1e-8)
    assert jointlib(f"{WORDS} --count 3 -o curve.svg").status == 0
    assert Path("curve.svg").read_text().lstrip().startswith("<?xml")


@pytest.mark.parametrize("method", ["zero-order", pytest.param(None, marks=pytest.mark.thorough)])
def test_what_lobes_doubts_or_refuses_is_not_recommended(method: str | None) -> None:
    """The spindle was measured up to 4 kHz, which a mode of the tool passes as it is drawn in."""
    mill = "machines/library/end_mill.toml"
    found = machines.stickout(mill, between=["34 mm", "64 mm"], speed=15000, method=method, count=3)
    assert np.any(found.doubtful | np.isnan(found.depth))
    assert found.doubtful[0] or np.isnan(found.depth[0])
    for out, depth, doubted in zip(found.stick_out, found.depth, found.doubtful, strict=True):
        model = read_machine(mill, {"component.cutter.stick_out": float(out)})
        if np.isnan(depth):
            with pytest.raises(InputError):
                machines.lobes(model, speed=15000, method=method, budget=0)
            continue
        beside = machines.lobes(model, speed=15000, method=method, budget=0)
        assert beside.charts[0].depth[0] == depth
        assert any(line.startswith("15000 ") and "at most" in line for line in beside.lines) == doubted
    assert not found.pockets
    assert "is known to put a pocket" in found.finding()
    assert "records to a higher frequency tell more" in found.finding()


def test_no_depth_past_the_flutes_is_told() -> None:
    grid, depth = np.array([0.06, 0.07, 0.08]), np.array([1e-3, 40e-3, 12e-3])
    found = StickOuts(
        "cutter", 9000.0, grid, depth, np.array([False, False, True]), 4000.0, 0.025, (Pocket(0.07, 40e-3),), ()
    )
    assert found.finding().endswith("stable below 25 mm, where the flutes end")
    assert [line.split(maxsplit=1)[1] for line in found.words()[2:]] == [
        "1 mm",
        "25 mm, where the flutes end",
        "at most 12 mm, up to 4000 Hz",
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("stickout mill.toml --between 76mm 62mm --speed 15000", "expected the shortest and the longest"),
        ("stickout mill.toml --between 62mm --speed 15000", "expected the shortest and the longest"),
        ("stickout mill.toml --between 62mm 76mm --speed 15000 --count 2", "--count: 2, expected 3 to 500"),
        ("stickout mill.toml --between 10mm 20mm --speed 15000", "flute_length is 0.025 m, expected at most"),
        (f"{WORDS} --component holder", "no component 'holder' of kind 'tool'"),
        (
            "stickout machines/library/two_mode_tool.toml --between 62mm 76mm --speed 15000",
            "components of kind 'tool': none",
        ),
    ],
)
def test_what_cannot_be_asked_gets_one_sentence(here: Path, words: str, said: str) -> None:
    Path("mill.toml").write_text(MILL)
    done = jointlib(words)
    assert done.status == 2
    (complaint,) = done.complaints
    assert said in complaint


def test_a_joint_that_records_tell_is_identified_once(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`modes`, `lobes` and `study` do it by themselves; the depths are those of the machine with the joint written."""
    from jointlib.joint import Joint
    from jointlib.laws.linear import Linear
    from jointlib.laws.viscous import Viscous
    from machines.answers.told import stickout_depths

    joint, asked = Joint((Linear(5e8), Viscous(2e3))), []
    slide = (
        MILL.replace('"ground"]\nat = [0, 0, 0]\nrigid', '"slide"]\nat = [0, 0, 0]\nrigid')
        + """
[[component]]
name = "slide"
kind = "rigid"
mass = 20.0
inertia = [0.1, 0.1, 0.1]
centre = [0, 0, 0]
[[connection]]
name = "guide"
between = ["slide", "ground"]
at = [0, 0, 0]
direction = [1, 0, 0]
{}
[[connection]]
name = "rest"
between = ["slide", "ground"]
at = [0, 0, 0]
rigid = true
holds = ["y", "z", "rx", "ry", "rz"]
"""
    )
    Path("x.csv").write_text("z,F\n0,0\n1,500\n")
    Path("x.measurement.toml").write_text('schema = "jointlib/measurement/1"\nkind = "static"\n')
    Path("open.toml").write_text(slide.format('identify = { from = ["x.measurement.toml"] }'))
    Path("given.toml").write_text(
        slide.format('joint = { law = [{ kind = "linear", stiffness = 5e8 }, { kind = "viscous", damping = 2e3 }] }')
    )

    def identified(machine: machines.Machine) -> tuple[machines.Machine, tuple[str, ...]]:
        asked.append(machine)
        return machine.with_joint("guide", joint), ("guide: as identified from its records.", "something else")

    monkeypatch.setattr(stickout_depths, "with_joints", identified)
    found, known = (
        machines.stickout(f, between=["62 mm", "70 mm"], speed=15000, method="zero-order", count=3)
        for f in ("open.toml", "given.toml")
    )
    np.testing.assert_array_equal(found.depth, known.depth)
    assert len(asked) == 1
    assert "guide: as identified from its records." in found.notes
    assert "something else" not in found.notes
