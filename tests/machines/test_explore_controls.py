"""What can be turned of a machine: numbers as people read them, which reach the machine as the file would say them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tool_files import JOINT, SECTION, SIZES, SPINDLE, TOOL

from jointlib import Joint, read_joint
from jointlib.errors import InputError
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.motion import Motion
from machines import read_machine
from machines.explore import AMPLITUDE, Control, Explorer
from machines.tool.chatter_band import frequency_range

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
PRELOAD = Control("connection.g.joint.hertz_guide.preload", "preload", "g", "N", 600.0, 150.0, 2400.0, True)
TEETH = Control("cutting.teeth", "teeth", "cutting", "", 4.0, 1.0, 12.0, whole=True)

BAR = """
schema = "jointlib/machine/1"
name = "bar"
connection = [
    { name = "x", between = ["bar.root.x", "ground"], rigid = true },
    { name = "y", between = ["bar.root.y", "ground"], rigid = true },
    { name = "z", between = ["bar.root.z", "ground"], rigid = true },
    { name = "rx", between = ["bar.root.rx", "ground"], rigid = true },
    { name = "ry", between = ["bar.root.ry", "ground"], rigid = true },
    { name = "rz", between = ["bar.root.rz", "ground"], rigid = true },
]
[[component]]
name = "bar"
kind = "beam"
axis = [0, 0, -1]
material = [{ name = "steel", young = "210 GPa", poisson = 0.3, density = "7850 kg/m^3", loss_factor = 0.002 }]
segment = [{ length = "20 mm", diameter = "90 mm" }, { length = "100 mm", diameter = "20 mm" }]
station = [{ name = "root", at = "20 mm" }, { name = "tip", at = "120 mm" }]
[tool]
x = "bar.tip.x"
[response]
frequency = ["100 Hz", "3 kHz"]
"""


@pytest.fixture(scope="module")
def mill() -> Explorer:
    return Explorer(LIBRARY / "column_mill_a.toml")


def bar(tmp_path: Path) -> Explorer:
    (tmp_path / "bar.toml").write_text(BAR)
    return Explorer(tmp_path / "bar.toml")


@pytest.mark.parametrize(
    ("control", "value", "number"),
    [
        (PRELOAD, 700, 700.0),
        (PRELOAD, "700", 700.0),
        (PRELOAD, "0.7 kN", 700.0),
        (PRELOAD, 2400.0 * (1 + 1e-12), 2400.0),
        (TEETH, 3.0, 3.0),
    ],
)
def test_a_number_is_taken_in_the_unit_of_its_control_or_in_the_one_it_brings(
    control: Control, value: object, number: float
) -> None:
    assert control.checked(value) == pytest.approx(number, rel=1e-14)
    assert control.low <= control.checked(value) <= control.high


@pytest.mark.parametrize(
    "value", ["", "stiff", None, True, float("nan"), float("inf"), [600], 100, 2401, "3 kN", 10**400]
)
def test_what_is_no_number_inside_the_bounds_is_refused_in_words(value: object) -> None:
    with pytest.raises(InputError, match=r"g, preload: .*, expected a number from 150 to 2400 N"):
        PRELOAD.checked(value)


def test_half_a_tooth_and_a_unit_of_another_kind_are_refused_in_words() -> None:
    with pytest.raises(InputError, match=r"teeth: 2\.5, expected a whole number from 1 to 12"):
        TEETH.checked(2.5)
    with pytest.raises(InputError, match="g, preload: unit 'mm' does not fit"):
        PRELOAD.checked("600 mm")


def test_a_value_of_the_file_that_lies_beyond_what_is_sensible_may_stay() -> None:
    shallow = Control("cutting.immersion", "radial immersion", "cutting", "%", 0.5, 1.0, 100.0, scale=0.01)
    assert shallow.checked(0.5) == 0.5
    assert shallow.changes(0.5) == {}
    with pytest.raises(InputError):
        shallow.checked(0.6)


@pytest.mark.thorough
def test_controls_read_as_people_say_them(mill: Explorer) -> None:
    by = mill.by_key
    said = {key: (by[key].value, by[key].unit, by[key].label, by[key].group) for key in (
        "axis.x.position", "bundle.x_guide.preload", "bundle.x_guide.width", "cutting.tangential",
        "component.cutter.stick_out", "connection.mount.joint.linear.stiffness", "bundle.front.contact_angle",
    )}  # fmt: skip
    assert said == {
        "axis.x.position": (0.0, "mm", "position", "axis x"),
        "bundle.x_guide.preload": (1500.0, "N", "preload", "x_guide"),
        "bundle.x_guide.width": (34.0, "mm", "width", "x_guide"),
        "cutting.tangential": (1800.0, "N/mm²", "tangential pressure", "cutting"),
        "component.cutter.stick_out": (60.0, "mm", "stick-out", "cutter"),
        "connection.mount.joint.linear.stiffness": (300.0, "N/µm", "stiffness", "mount"),
        "bundle.front.contact_angle": (25.0, "deg", "contact angle", "front"),
    }
    assert "cutting.immersion" not in by  # a slot is cut at full immersion
    assert not any(key.endswith((".points", ".balls")) for key in by)
    assert mill.controls[0].key == AMPLITUDE
    assert mill.controls[0].high == 120.0  # µm, the feed per tooth


@pytest.mark.slow
def test_every_bound_of_every_control_makes_a_machine_that_can_be_read(mill: Explorer) -> None:
    for control in mill.controls:
        assert control.low <= control.value <= control.high, control.key
        for end in (control.low, control.high):
            changes = {k: v for k, v in control.changes(end).items() if ".joint." not in k}
            read_machine(mill.machine, changes)


def test_an_axis_goes_as_far_as_its_travel_and_takes_the_table_along(mill: Explorer) -> None:
    control = mill.by_key["axis.x.position"]
    assert (control.low, control.high) == (-300.0, 300.0)
    assert mill.changes({"axis.x.position": 250.0}) == {"axis.x.position": 0.25}
    centres = [
        next(c for c in mill.moment(values).machine.components if c.name == "table").centre  # type: ignore[attr-defined]
        for values in ({}, {"axis.x.position": 250.0})
    ]
    assert centres[1] - centres[0] == pytest.approx([0.25, 0.0, 0.0])


def test_mounts_alike_are_turned_together(mill: Explorer) -> None:
    (change,) = mill.changes({"connection.mount.joint.linear.stiffness": 150}).items()
    assert change == ("connection.mount.joint.linear.stiffness", 150e6)
    machine = mill.moment({"connection.mount.joint.linear.stiffness": 150}).machine
    mounts = [c.joint for c in machine.flexible if c.name.startswith("mount")]
    assert len(mounts) == 12
    assert {joint.parameters["linear.stiffness"] for joint in mounts if joint} == {150e6}


def test_a_guide_of_twice_the_rigidity_is_twice_as_stiff_in_every_row(mill: Explorer) -> None:
    def tangents(values: dict[str, float]) -> np.ndarray:
        joints = {c.name: c.joint for c in mill.moment(values).machine.flexible}
        rest = np.zeros(())
        rows = [j for name, j in joints.items() if name.startswith("y_guide") and j is not None]
        return np.array([float(j.jacobian(Motion(rest, rest), j.initial_state(rest))[0]) for j in rows])

    before = tangents({})
    assert len(before) == 16
    assert tangents({"bundle.y_guide.stiffness": 2000}) == pytest.approx(2 * before, rel=1e-12)


@pytest.mark.parametrize("length", [60.0, 100.0, 180.0])
def test_a_longer_bar_yields_as_a_cantilever_does(tmp_path: Path, length: float) -> None:
    explorer = bar(tmp_path)
    found = explorer.summary({"component.bar.stick_out": length}).static_compliance
    L, d, E, nu = length * 1e-3, 0.02, 210e9, 0.3
    I, area, G = np.pi * d**4 / 64, np.pi * d**2 / 4, E / (2 * (1 + nu))
    shear = 6 * (1 + nu) / (7 + 6 * nu)  # Cowper's coefficient of a round bar
    assert found == pytest.approx(L**3 / (3 * E * I) + L / (shear * G * area), rel=1e-6)


def test_the_stick_out_takes_the_tip_along_and_no_station_before_it(tmp_path: Path) -> None:
    explorer = bar(tmp_path)
    control = explorer.by_key["component.bar.stick_out"]
    assert (control.value, control.low, control.high) == (100.0, 50.0, 200.0)
    assert control.changes(120.0) == {
        "component.bar.segment[1].length": pytest.approx(0.12),
        "component.bar.station[1].at": pytest.approx(0.14),
    }


def test_a_tip_at_the_end_of_the_bar_goes_along_by_itself(tmp_path: Path) -> None:
    explorer = bar(tmp_path)
    text = explorer.machine.read_text()
    assert 'at = "120 mm"' in text
    (tmp_path / "end.toml").write_text(text.replace('at = "120 mm"', 'at = "end"'))
    other = Explorer(tmp_path / "end.toml")
    key = "component.bar.stick_out"
    assert other.by_key[key].changes(150.0) == {"component.bar.segment[1].length": pytest.approx(0.15)}
    one, two = (e.summary({key: 150.0}).static_compliance for e in (explorer, other))
    assert one == pytest.approx(two, rel=1e-9)


@pytest.mark.parametrize("joint", ["", pytest.param(JOINT, marks=pytest.mark.thorough)])
def test_the_stick_out_and_joint_of_a_tool_file_are_controls(tmp_path: Path, joint: str) -> None:
    band = "[response]\nfrequency = [300, 3000]\n"
    for name, sizes in (("a", SIZES), ("longer", SIZES.replace('stick_out = "60 mm"', 'stick_out = "75 mm"'))):
        (tmp_path / f"{name}.tool.toml").write_text(f"{TOOL}{sizes}[[section]]\n{SECTION}{joint}")
        text = SPINDLE.format(top=f'tool = "{name}.tool.toml"', parts=band, tool="", teeth=4)
        (tmp_path / f"{name}.toml").write_text(text)
    explorer, longer = Explorer(tmp_path / "a.toml"), Explorer(tmp_path / "longer.toml")
    key = "component.cutter.stick_out"
    control = explorer.by_key[key]
    assert (control.value, control.low, control.high, control.unit) == (60.0, 30.0, 120.0, "mm")
    found, wanted = explorer.summary({key: 75.0}).static_compliance, longer.summary({}).static_compliance
    assert found == pytest.approx(wanted, rel=1e-12)
    assert found > explorer.summary({}).static_compliance
    assert ("connection.shank.joint.linear.stiffness" in explorer.by_key) == bool(joint)


def test_what_is_nothing_may_become_something(tmp_path: Path) -> None:
    joint = Joint((Linear(1e7), Viscous(0.0)), "slide")
    text = (
        (LIBRARY / "two_mass.toml").read_text().replace('joint = "two_mass.joint.toml"', "identify = { from = ['m'] }")
    )
    (tmp_path / "m.toml").write_text(text)
    control = Explorer(tmp_path / "m.toml", joints={"guide": joint}).by_key["connection.guide.joint.viscous.damping"]
    assert (control.value, control.low, control.high, control.logarithmic) == (0.0, 0.0, 1e4, False)


def test_a_joint_that_is_still_to_be_identified_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the joint of 'guide' is not known yet, expected it identified"):
        _ = Explorer(LIBRARY / "guide_mill.toml").controls


def test_bounds_end_where_the_law_ends() -> None:
    joints = {"guide": read_joint(LIBRARY / "guide.joint.toml")}
    angle = Explorer(LIBRARY / "guide_mill.toml", joints=joints).by_key[
        "connection.guide.joint.hertz_guide.contact_angle"
    ]
    assert (angle.low, angle.value, angle.high) == (22.5, 45.0, 90.0)


def chosen_tools(folder: Path) -> Explorer:
    """Two tools with holder files, of which the second has a joint at its shank, in one machine."""
    joint = "[joint]\nstiffness = 6e7\nrotation = 2e4\n"
    for name, size, more in (("slim", "32", ""), ("wide", "50", joint)):
        section = SECTION.replace('"32 mm"', f'"{size} mm"')
        text = f'schema = "jointlib/holder/1"\n[[section]]\n{section}{more}'
        (folder / f"{name}.holder.toml").write_text(text)
    rows = ""
    for name, stick_out in (("short", 60), ("long", 75)):
        sizes = SIZES.replace('stick_out = "60 mm"', f'stick_out = "{stick_out} mm"')
        (folder / f"{name}.tool.toml").write_text(f'{TOOL}{sizes}holder = "slim.holder.toml"\n')
        rows += f'[[tools]]\nname = "{name}"\nfile = "{name}.tool.toml"\n'
    text = SPINDLE.format(top="", parts="[response]\nfrequency = [300, 3000]\n", tool=rows, teeth=4)
    (folder / "two.toml").write_text(text)
    return Explorer(folder / "two.toml")


@pytest.mark.thorough
def test_tool_and_holder_are_chosen_by_name(tmp_path: Path) -> None:
    explorer = chosen_tools(tmp_path)
    tool, holder = explorer.by_key["tool.use"], explorer.by_key["tool.holder"]
    assert [tool.told(number) for number in (tool.value, tool.low, tool.high)] == ["short", "short", "long"]
    assert [holder.told(number) for number in (holder.value, holder.low, holder.high)] == ["slim", "slim", "wide"]
    other = Explorer(explorer.machine, tool="long")
    assert "tool.use" not in other.by_key
    assert explorer.summary({"tool.use": "long"}) == other.summary({})
    both = explorer.summary({"tool.use": 2, "tool.holder": "wide"})
    assert both == other.summary({"tool.holder": "wide"})
    assert both.static_compliance != explorer.summary({"tool.use": "long"}).static_compliance
    with pytest.raises(InputError, match="tool, holder: 'wider', expected one of slim, wide"):
        explorer.summary({"tool.holder": "wider"})
    written = explorer.save({"tool.use": "long", "tool.holder": "wide"}, tmp_path, "chosen")[0]
    assert Explorer(written).summary({}).minimum_depth == pytest.approx(both.minimum_depth, rel=1e-9)


def test_a_spring_against_rotation_has_its_unit(tmp_path: Path) -> None:
    chosen_tools(tmp_path)
    text = (
        (tmp_path / "two.toml")
        .read_text()
        .replace('file = "short.tool.toml"', 'file = "short.tool.toml"\nholder = "wide.holder.toml"')
    )
    (tmp_path / "two.toml").write_text(text)
    explorer = Explorer(tmp_path / "two.toml")
    units = {key: control.unit for key, control in explorer.by_key.items() if key.endswith("linear.stiffness")}
    assert units["connection.shank.joint.linear.stiffness"] == "N/µm"
    assert units["connection.shank rotation.joint.linear.stiffness"] == "N m/rad"
    assert explorer.by_key["connection.shank rotation.joint.linear.stiffness"].value == pytest.approx(2e4)
    assert explorer.summary({"tool.holder": "slim"}).minimum_depth is not None


def test_a_connection_alone_has_its_whole_name(tmp_path: Path) -> None:
    text = (LIBRARY / "two_mass.toml").read_text().replace('name = "guide"', 'name = "c_drive"')
    (tmp_path / "two_mass.joint.toml").write_text((LIBRARY / "two_mass.joint.toml").read_text())
    (tmp_path / "m.toml").write_text(text)
    keys = Explorer(tmp_path / "m.toml").by_key
    assert "connection.c_drive.joint.linear.stiffness" in keys
    assert not any(key.startswith("connection.c.") for key in keys)


@pytest.mark.thorough
def test_a_machine_without_a_band_is_looked_at_over_that_of_its_modes(tmp_path: Path) -> None:
    text = (LIBRARY / "lathe.toml").read_text()
    for joint in LIBRARY.glob("*.joint.toml"):
        (tmp_path / joint.name).write_text(joint.read_text())
    (line,) = [each for each in text.splitlines() if each.startswith("frequency = ")]
    (tmp_path / "m.toml").write_text(text.replace(line, ""))
    explorer = Explorer(tmp_path / "m.toml")
    shown = explorer.curves({}).frequency
    assert (shown[0], shown[-1]) == pytest.approx(frequency_range(explorer.base))
    assert explorer.summary({}).minimum_depth == pytest.approx(
        Explorer(LIBRARY / "lathe.toml").summary({}).minimum_depth
    )
