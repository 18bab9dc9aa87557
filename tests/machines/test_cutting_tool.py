"""A tool by its sizes is the stepped beam that they make, and its tip moves with the stick-out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from jointlib.errors import InputError
from machines import Beam, Machine, Material, Segment, frozen_receptance, read_machine
from machines.components.flange import flange
from machines.files.component_file import read_component

LIBRARY = Path(machines.__file__).parent / "library"
TOOL = """
schema = "jointlib/component/1"
kind = "tool"
diameter = "10 mm"
flute_length = "25 mm"
shank = "12 mm"
stick_out = "60 mm"
"""
HOLDER = '[[section]]\nlength = "20 mm"\ndiameter = "30 mm"\nbore = "6 mm"\n'


def tool(folder: Path, text: str) -> Beam:
    path = folder / "t.component.toml"
    path.write_text(text)
    part = read_component(path, "t")
    assert isinstance(part, Beam)
    return part


def test_it_is_the_stepped_beam_of_its_sizes(tmp_path: Path) -> None:
    found = tool(tmp_path, TOOL + 'material = "hss"\nyoung = 200e9\n' + HOLDER)
    hss, steel = Material("hss", 200e9, 0.29, 8150.0), Material("steel", 210e9, 0.3, 7850.0)
    bars = (Segment(0.025, hss, 0.008), Segment(0.035, hss, 0.012), Segment(0.02, steel, 0.03, 0.006))
    same = Beam("t", bars, {"tip": 0.0, "shank": 0.06, "face": 0.08}, np.array([0, 0, -0.08]), np.array([0, 0, 1.0]))
    omega = 2 * np.pi * np.linspace(100.0, 9000.0, 40)
    assert found.dofs == same.dofs
    np.testing.assert_allclose(found.nodes.positions, same.nodes.positions, atol=1e-15)
    np.testing.assert_allclose(found.receptance(omega), same.receptance(omega), rtol=1e-9, atol=1e-18)


def test_a_long_slender_tool_held_at_its_shank_bends_by_the_cube_of_its_stick_out(tmp_path: Path) -> None:
    compliance = []
    for stick_out in (0.1, 0.2):
        text = TOOL.replace("60 mm", f"{1e3 * stick_out} mm").replace("25 mm", "0 mm")
        part = tool(tmp_path, text)
        machine = Machine((part,), flange("held", ("t", "ground"), (0.0, 0.0, 0.0)), tool={"x": "t.tip.x"})
        compliance.append(abs(frozen_receptance(machine, [1.0, 2.0], 0.0).receptance[0, 0, 0]))
        bending = stick_out**3 / (3 * 580e9 * np.pi * 0.012**4 / 64)
        assert compliance[-1] == pytest.approx(bending, rel=0.03)
    assert compliance[1] / compliance[0] == pytest.approx(8, rel=0.02)


def test_the_tip_moves_and_not_where_it_is_held(tmp_path: Path) -> None:
    for stick_out in (0.04, 0.055):
        machine = read_machine(LIBRARY / "end_mill.toml", {"component.cutter.stick_out": stick_out})
        cutter = machine.components[1]
        assert isinstance(cutter, Beam)
        places = dict(zip(cutter.nodes.names, cutter.nodes.positions, strict=True))
        np.testing.assert_allclose(places["tip"], [0, 0, -stick_out], atol=1e-15)
        np.testing.assert_allclose(places["shank"], 0, atol=1e-15)


def test_a_taper_that_finds_no_node_of_a_tool_speaks_of_no_key_that_it_lacks(tmp_path: Path) -> None:
    part = tool(tmp_path, TOOL + HOLDER)
    beside, along = (0.02, 0.0, 0.0), np.eye(3)[0]
    with pytest.raises(InputError, match=r"; expected a flange there, or the tool as a beam with a tolerance$"):
        part.motion_at(np.array(beside), along)
    with pytest.raises(InputError, match=r"expected a \[\[component.station\]\] at 0\.0\d+ m$") as refused:
        part.motion_at(np.array([0.0, 0.0, -0.01]), along)
    assert "tolerance" not in str(refused.value)


def test_what_is_assumed_of_the_flutes_is_said(tmp_path: Path) -> None:
    assert any("assumed equivalent = 0.8" in said for said in tool(tmp_path, TOOL).remarks())
    assert not any("assumed" in said for said in tool(tmp_path, TOOL + "equivalent = 0.75\n").remarks())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"25 mm"', '"70 mm"', "flute_length is 0.07 m, expected at most the stick_out, 0.06 m"),
        ('"60 mm"', "0", "stick_out is 0.0 m, expected more than 0"),
        ('"12 mm"', '"12 mm"\nequivalent = 1.2', "equivalent is 1.2, expected above 0"),
        ('"12 mm"', '"12 mm"\nmaterial = "carbid"', "carbide"),
        ('"12 mm"', '"12 mm"\nstickout = 1', "stick_out"),
    ],
)
def test_a_tool_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        tool(tmp_path, TOOL.replace(old, new))


def test_how_far_its_edges_reach_is_known_to_the_cut(tmp_path: Path) -> None:
    text = """
schema = "jointlib/machine/1"
name = "held"
[[component]]
name = "t"
kind = "tool"
diameter = "10 mm"
flute_length = "25 mm"
stick_out = "60 mm"
at = [0, 0, 0]
axis = [0, 0, 1]
[[connection]]
name = "nose"
between = ["t", "ground"]
at = [0, 0, 0]
rigid = true
[tool]
x = "t.tip.x"
y = "t.tip.y"
[cutting]
process = "milling"
teeth = 2
mode = "slot"
tangential = 7e8
normal = 2e8
"""
    (tmp_path / "m.toml").write_text(text)
    assert (read_machine(tmp_path / "m.toml").cutting or {})["flute_length"] == 0.025
    (tmp_path / "m.toml").write_text(text + 'flute_length = "20 mm"\n')
    assert (read_machine(tmp_path / "m.toml").cutting or {})["flute_length"] == 0.02
