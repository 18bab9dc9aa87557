"""The verb uncouple: a spindle out of files, machines with it, and one sentence for what cannot be right."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

import machines
from machines.components.measured import Measured
from machines.files.component_file import read_component

LIBRARY = Path("machines/library")
BAR, BLANK = LIBRARY / "bar.measurement.toml", LIBRARY / "bar.component.toml"
NAMES = ("tip.x", "neck.x")
MILL = """
schema = "jointlib/machine/1"
[[component]]
name = "spindle"
file = "end.component.toml"
[[component]]
name = "bar"
file = "machines/library/bar.component.toml"
[[connection]]
name = "face"
between = ["bar", "spindle"]
at = [0, 0, 0]
rigid = true
holds = ["x", "y", "rx", "ry"]
[tool]
x = "bar.tip.x"
y = "bar.tip.y"
"""
SOFT = """
[[connection]]
name = "face_{0}"
between = ["bar.face.{0}", "spindle.nose.{0}"]
joint = {{ law = [{{ kind = "linear", stiffness = {1} }}] }}
"""


@pytest.fixture
def end(here: Path) -> Path:
    done = jointlib(f"uncouple {BAR} --remove {BLANK} -o end.component.toml --json")
    assert done.status == 0, done.err
    data = done.json
    assert data["file"] == "end.component.toml"
    assert data["weak"] == []
    assert data["dofs"] == ["nose.x", "nose.ry", "nose.y", "nose.rx"]
    return Path("end.component.toml")


@pytest.mark.thorough
def test_the_blank_coupled_again_gives_the_measurement_back(end: Path) -> None:
    Path("mill.toml").write_text(MILL)
    machine = machines.read_machine("mill.toml")
    for axis in "xy":
        table = np.loadtxt(LIBRARY / "bar" / f"tip_tip_{axis}.csv", delimiter=",", skiprows=1)
        found = machines.frozen_receptance(machine, table[:, 0], 0.0).between(f"bar.tip.{axis}", f"bar.tip.{axis}")
        off = np.abs(found - (table[:, 1] + 1j * table[:, 2])) / table[:, 3]
        assert np.mean(off < 3) > 0.99


@pytest.mark.slow
def test_a_machine_with_it_has_a_response_modes_and_lobes(end: Path) -> None:
    Path("mill.toml").write_text(
        MILL + '[cutting]\nprocess = "milling"\nteeth = 3\ntangential = 8e8\nnormal = 2e8\nmode = "down"\n'
        "immersion = 0.25\nspeed = [8000, 20000]\n"
    )
    peaks = jointlib("frf mill.toml --force 1 -o frf.npz --json").json["tool_peaks"]
    top = max((peak for peak in peaks if peak["drive"] == "bar.tip.x"), key=lambda peak: peak["compliance"])
    modes = jointlib("modes mill.toml --json").json
    assert any(abs(mode["frequency"] - top["frequency"]) < 0.03 * top["frequency"] for mode in modes["modes"])
    assert any("fitted to the receptance of the tool" in said for said in modes["warnings"])
    assert jointlib("lobes mill.toml --method zero-order --json").json["minimum_depth"] > 0


@pytest.mark.thorough
def test_a_tool_is_coupled_through_a_joint_too(end: Path) -> None:
    head, tail = MILL.split("[[connection]]")[0], "[tool]" + MILL.split("[tool]")[1]
    found = []
    for stiffness in ("1e12", "2e7"):
        joints = "".join(SOFT.format(dof, stiffness) for dof in ("x", "y", "rx", "ry"))
        Path("soft.toml").write_text(head + joints + tail)
        machine = machines.read_machine("soft.toml")
        found.append(np.abs(machines.frozen_receptance(machine, [200.0, 300.0], 0.0).receptance[:, 0, 0]))
    Path("mill.toml").write_text(MILL)
    rigid = machines.frozen_receptance(machines.read_machine("mill.toml"), [200.0, 300.0], 0.0).receptance[:, 0, 0]
    np.testing.assert_allclose(found[0], np.abs(rigid), rtol=1e-3)
    assert np.all(found[1] > 1.5 * np.abs(rigid))


@pytest.mark.slow
def test_the_same_input_gives_the_same_bytes(end: Path) -> None:
    first = end.read_bytes(), end.with_name("end.npz").read_bytes()
    jointlib(f"uncouple {BAR} --remove {BLANK} -o end.component.toml")
    assert (end.read_bytes(), end.with_name("end.npz").read_bytes()) == first
    part = read_component(end, "spindle")
    assert isinstance(part, Measured)
    assert part.variance is not None
    assert part.motion_at(np.zeros(3), np.array([1.0, 0, 0])).tolist() == [1, 0, 0, 0]


@pytest.mark.slow
def test_the_function_is_what_the_verb_prints(end: Path) -> None:
    found = machines.uncouple(BAR, remove=BLANK, output="end.component.toml")
    done = jointlib(f"uncouple {BAR} --remove {BLANK} -o end.component.toml --json")
    assert json.loads(json.dumps(found.as_json())) == done.json
    assert "every line tells it" in repr(found)
    with np.load("end.npz") as written:
        H, variance = written["receptance"], written["variance"]
    for name, i, k in (("deflection by force", 0, 0), ("rotation by force", 1, 0), ("rotation by moment", 1, 1)):
        share = [np.sqrt(variance[:, a + i, a + k]) / np.abs(H[:, a + i, a + k]) for a in (0, 2)]
        middle, tenth = (max(float(np.quantile(each, q)) for each in share) for q in (0.5, 0.9))
        assert f"{name} {100 * middle:.2g} ({100 * tenth:.2g}) %" in found.finding()
    assert found.plot().get_xlabel() == "frequency [Hz]"
    assert len(found.columns()["frequency"][0]) == 381


def variant(name: str, text: str) -> Path:
    path = Path(name)
    path.write_text(text)
    return path


def refused(words: str) -> str:
    done = jointlib(words)
    assert done.status == 2
    assert not Path("no.toml").exists()
    assert not Path("no.npz").exists()
    (said,) = done.complaints
    return said


def test_what_cannot_be_right_gets_one_sentence(here: Path) -> None:
    blank, measured = BLANK.read_text(), BAR.read_text().replace('"bar/', '"machines/library/bar/')
    tip_only = "".join(re.split(r"(?=\[\[record\]\])", measured)[k] for k in (0, 1, 4))
    longer, low = "expected a blank no longer than the assembly", "axis = [0, 0, 1]\nup_to = 2000"
    askew = "axis = [0, 1, 1]"
    cases = [
        (BAR, BLANK, "--overhang 50mm", f"60 mm long to its coupled end, {longer}"),
        (variant("tip.toml", tip_only), BLANK, "", "all responses are those of one place, which tells no rotation"),
        (BAR, variant("same.toml", blank.replace("45 mm", "0 mm")), "", "lie at one place"),
        (BAR, variant("few.toml", blank.replace("neck", "ring")), "", "without a measured response: ring, face"),
        (BAR, LIBRARY / "guide.joint.toml", "", 'expected "jointlib/component/1"'),
        (LIBRARY / "tap_test" / "hits.measurement.toml", BLANK, "", "kind is 'impact'"),
        (BAR, BLANK, "--at neck", "responses were measured at 'neck'"),
        (BAR, variant("low.toml", blank.replace("axis = [0, 0, 1]", low)), "", "made up to 2000 Hz"),
        (BAR, variant("askew.toml", blank.replace("axis = [0, 0, 1]", askew)), "", "expected one along x, y or z"),
    ]
    for one, tool, more, said in cases:
        assert said in refused(f"uncouple {one} --remove {tool} {more} -o no.toml")


def test_a_blank_heavier_than_the_mass_that_was_measured_is_refused(here: Path) -> None:
    """A hung bar alone is measured, simulated as free; the blank in the file weighs twice as much."""
    blank = read_component(BLANK, "bar")
    lines = np.linspace(200.0, 4000.0, 191)
    at = [blank.dofs.index(dof) for dof in NAMES]
    H = blank.receptance(2 * np.pi * lines)[:, at][:, :, at] * (1 + 1e-4j)
    text = 'schema = "jointlib/measurement/1"\nkind = "frf"\nsimulated = true\n'
    for o, d in ((0, 0), (1, 0), (1, 1)):
        table = np.column_stack([lines, H[:, o, d].real, H[:, o, d].imag])
        np.savetxt(f"free_{o}{d}.csv", table, delimiter=",", header="f,re,im", comments="")
        sides = f'drive = "{NAMES[d]}"\nresponse = "{NAMES[o]}"\n'
        text += f'[[record]]\nfile = "free_{o}{d}.csv"\n{sides}quantity = "receptance"\nforce = "1 N"\n'
    heavy = variant("heavy.toml", BLANK.read_text().replace("7850", "15700"))
    said = refused(f"uncouple {variant('free.measurement.toml', text)} --remove {heavy} -o no.toml")
    assert "expected a blank lighter than the assembly" in said
    said = refused(f"uncouple free.measurement.toml --remove {BLANK} -o no.toml")
    assert "along x the responses are those of machines/library/bar.component.toml alone" in said


TOOL = """schema = "jointlib/tool/1"
material = "steel"
young = 210e9
poisson = 0.3
density = 7850
diameter = "40 mm"
flute_length = 0
stick_out = "60 mm"
[[station]]
name = "neck"
at = "45 mm"
"""
HOLDER = '[[section]]\nlength = "20 mm"\ndiameter = "50 mm"\n[joint]\nstiffness = 1e8\nrotation = 1e4\n'


@pytest.mark.slow
def test_a_tool_file_is_a_blank_as_well(end: Path) -> None:
    variant("bar.tool.toml", TOOL)
    done = jointlib(f"uncouple {BAR} --remove bar.tool.toml -o by_tool.component.toml")
    assert done.status == 0, done.err
    of_bar, of_tool = (read_component(path, "s") for path in (end, Path("by_tool.component.toml")))
    assert isinstance(of_bar, Measured)
    assert isinstance(of_tool, Measured)
    assert of_tool.nodes is not None
    assert np.all(of_tool.nodes.positions == 0.0)
    # The tool has no Kelvin-Voigt damping, of 0.25 % at 2 kHz in the bar.
    assert np.linalg.norm(of_tool.value - of_bar.value) < 5e-3 * np.linalg.norm(of_bar.value)
    variant("loose.tool.toml", TOOL + HOLDER)
    said = refused(f"uncouple {BAR} --remove loose.tool.toml -o no.toml")
    assert "[joint] lies between shank and holder, expected a blank of one piece" in said
