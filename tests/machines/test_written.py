"""A machine file that the program writes is the machine it was made from, wherever it is carried."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointlib import Joint, read_joint
from jointlib.errors import InputError
from jointlib.io.joint_file import joint_table
from jointlib.io.toml_file import write_toml
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.linear import Linear
from machines import Machine, frozen_receptance, read_machine
from machines.files.machine_writer import write_machine
from machines.road.open_joints import with_joints

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
LINES = np.linspace(80.0, 600.0, 20)


def receptance(machine: Machine, amplitude: float = 1e-6) -> np.ndarray:
    return frozen_receptance(machine, LINES, amplitude).receptance


def carried(target: Path, made: tuple[Path, ...], elsewhere: Path) -> Machine:
    """The machine read in a place where none of its originals can be found."""
    assert made[0] == target
    assert all(path.is_file() for path in made)
    assert all(path == target or target.with_suffix("") in path.parents for path in made)
    shutil.move(target.parent, elsewhere)
    return read_machine(elsewhere / target.name)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("file", "changes"),
    [
        ("two_mass.toml", {"component.slide.mass[0][0]": np.float64(0.7), "response.force": ["3 N"]}),
        ("column_mill_a.toml", {"bundle.x_guide.preload": "3 kN", "connection.foot.x.at": [0.0, 0.62, 0.7]}),
        ("column_mill_b.toml", {"axis.x.position": "150 mm", "axis.z.position": 0.1}),
        ("three_joints.toml", {"component.base.damping[0][0]": 150.0}),
        ("two_mode_tool.toml", {"component.cutter.frequency[1]": "0.7 kHz"}),
    ],
)
def test_a_written_machine_answers_a_force_as_the_changed_one_does(
    tmp_path: Path, file: str, changes: dict[str, Any]
) -> None:
    target = tmp_path / "here" / "best.toml"
    made = write_machine(LIBRARY / file, changes, target)
    old, new = read_machine(LIBRARY / file, changes), carried(target, made, tmp_path / "there")
    assert np.array_equal(receptance(old), receptance(new))
    assert (new.name, new.cutting, new.force, new.tool) == (old.name, old.cutting, old.force, old.tool)


def test_a_joint_that_was_identified_stands_in_the_written_machine(tmp_path: Path) -> None:
    source, target = LIBRARY / "guide_mill.toml", tmp_path / "here" / "best.toml"
    known, _ = with_joints(read_machine(source))
    guide = next(c.joint for c in known.flexible if c.name == "guide")
    assert guide is not None
    path = "connection.guide.joint.hertz_guide.preload"
    made = write_machine(source, {path: "0.7 kN", "component.column.frequency[0]": 170}, target, {"guide": guide})
    new = carried(target, made, tmp_path / "there")
    found = next(c for c in new.flexible if c.name == "guide")
    wanted = guide.with_parameters({"hertz_guide.preload": 700.0})
    assert found.joint is not None
    assert joint_table(found.joint) == joint_table(wanted)
    assert found.identify is None
    there = read_machine(source, {"component.column.frequency[0]": 170}).with_joint("guide", wanted)
    assert np.array_equal(receptance(there), receptance(new))
    assert {path.name for path in made} == {"best.toml", "guide.joint.toml"}


def test_a_joint_still_to_be_identified_takes_its_records_along(tmp_path: Path) -> None:
    source, target = LIBRARY / "guide_mill.toml", tmp_path / "here" / "best.toml"
    made = write_machine(source, {}, target)
    new = carried(target, made, tmp_path / "there")
    assert {"rig_1.npz", "rig_sealed.npz", "static.csv", "start.joint.toml"} <= {path.name for path in made}
    for name in ("rig.measurement.toml", "rig_3.npz"):
        copy = tmp_path / "there" / "best" / "guide_mill" / name
        assert copy.read_bytes() == (LIBRARY / "guide_mill" / name).read_bytes()
    a, _ = with_joints(read_machine(source))
    b, _ = with_joints(new)
    assert np.array_equal(receptance(a), receptance(b))


def test_other_parameters_in_joint_files_and_bundles_stay_with_their_connections(tmp_path: Path) -> None:
    source, target = LIBRARY / "column_mill_b.toml", tmp_path / "here" / "best.toml"
    changes = {
        "bundle.x_guide.joint.hertz_contact.preload": "2 kN",
        "connection.mount_2.z.joint.viscous.damping": "3 kN s/m",
    }
    made = write_machine(source, changes, target)
    new = carried(target, made, tmp_path / "there")
    old = {c.name: c for c in read_machine(source).flexible}
    assert {c.name for c in new.flexible} == set(old)
    for c in new.flexible:
        moved = {}
        if c.name.startswith("x_guide"):
            moved = {"hertz_contact.preload": 2000.0}
        elif c.name == "mount_2.z":
            moved = {"viscous.damping": 3000.0}
        before = old[c.name].joint
        assert c.joint is not None
        assert before is not None
        assert c.joint.parameters == before.with_parameters(moved).parameters
        assert (c.at, c.direction, c.between) == (old[c.name].at, old[c.name].direction, old[c.name].between)


@pytest.mark.thorough
def test_a_bundle_with_another_joint_is_written_where_its_axis_stands(tmp_path: Path) -> None:
    source, target = LIBRARY / "column_mill_a.toml", tmp_path / "here" / "best.toml"
    moved = {"axis.x.position": 0.15, "axis.z.position": -0.05}
    made = write_machine(source, {**moved, "bundle.x_guide.joint.hertz_contact.preload": 2000.0}, target)
    new, old = carried(target, made, tmp_path / "there"), read_machine(source, moved)
    stands = {c.name: (c.at, c.direction) for c in old.connections}
    assert {c.name: (c.at, c.direction) for c in new.connections} == stands
    for c in old.flexible:
        if c.name.startswith("x_guide") and c.joint is not None:
            old = old.with_joint(c.name, c.joint.with_parameters({"hertz_contact.preload": 2000.0}))
    wanted = receptance(old, 0.0)
    np.testing.assert_allclose(receptance(new, 0.0), wanted, rtol=0, atol=1e-9 * np.max(np.abs(wanted)))
    assert [axis.position for axis in new.axes] == [0.0, 0.0, 0.0]
    travel = {axis.name: axis.travel for axis in new.axes}
    assert travel["x"] == pytest.approx((-0.45, 0.15))
    assert travel["y"] == (-0.225, 0.225)


def machine_of_files(folder: Path) -> Path:
    """Matrices, measured FRFs and joints in folders of their own, two of which have the same name."""
    for name in ("fe/data", "frf/data", "joints"):
        (folder / name).mkdir(parents=True)
    np.savez(folder / "fe/data/frame.npz", mass=np.diag([3.0, 2.0]), stiffness=1e6 * np.array([[2.0, -1], [-1, 1]]))
    f = np.linspace(50.0, 700.0, 400)
    H = 1e-7 / (1 - (f / 300) ** 2 + 0.05j * f / 300)
    columns = np.stack([f, H.real, H.imag], axis=1)
    np.savetxt(folder / "frf/data/frame.csv", columns, delimiter=",", header="f,Re,Im", comments="")
    laws = [{"kind": "linear", "stiffness": "3 N/um"}, {"kind": "viscous", "damping": 90.0}]
    noted = {"files": ["../frf/data/frame.csv"]}
    write_toml(folder / "joints/foot.joint.toml", "joint", {"law": laws, "provenance": noted})
    (folder / "parts.toml").write_text("""schema = "jointlib/parts/1"
    [[component]]
    name = "frame"
    kind = "matrices"
    mass = { file = "fe/data/frame.npz", name = "mass" }
    stiffness = { file = "fe/data/frame.npz", name = "stiffness" }
    damping_ratio = 0.02
    [[component.node]]
    name = "low"
    rows = { x = 1 }
    [[component.node]]
    name = "high"
    rows = { x = 2 }
    """)
    (folder / "machine.toml").write_text("""schema = "jointlib/machine/1"
    parts = ["parts.toml"]
    [[component]]
    name = "tool"
    kind = "frf"
    dofs = ["x"]
    interpolation = "rational"
    [[component.record]]
    file = "frf/data/frame.csv"
    response = "x"
    drive = "x"
    quantity = "receptance"
    [[connection]]
    name = "foot"
    between = ["frame.high.x", "tool.x"]
    joint = "joints/foot.joint.toml"
    [[connection]]
    name = "ground"
    between = ["frame.low.x", "ground"]
    joint = "joints/foot.joint.toml"
    [tool]
    x = "tool.x"
    [response]
    frequency = [80, 600]
    """)
    return folder / "machine.toml"


def test_matrices_and_measured_responses_go_with_the_machine_and_keep_their_names(tmp_path: Path) -> None:
    source, target = machine_of_files(tmp_path / "in"), tmp_path / "here" / "best.toml"
    made = write_machine(source, {"connection.ground.joint.linear.stiffness": "5 N/um"}, target)
    old = read_machine(source)
    ground = next(c.joint for c in old.flexible if c.name == "ground")
    assert ground is not None
    wanted = receptance(old.with_joint("ground", ground.with_parameters({"linear.stiffness": 5e6})))
    assert not np.array_equal(wanted, receptance(old))
    names = sorted(path.relative_to(target.parent).as_posix() for path in made)
    assert names == [
        "best.toml",
        "best/data/frame.npz",
        "best/data_2/frame.csv",
        "best/joints/foot.joint.toml",
        "best/joints_2/foot.joint.toml",
    ]
    shutil.rmtree(source.parent)
    new = carried(target, made, tmp_path / "there")
    assert np.array_equal(receptance(new), wanted)
    assert new.name == "machine"


def test_a_written_machine_can_be_changed_and_written_again(tmp_path: Path) -> None:
    first, second = tmp_path / "first.toml", tmp_path / "second" / "best.toml"
    changes = {"bundle.x_guide.joint.hertz_contact.preload": 2000.0}
    write_machine(LIBRARY / "column_mill_a.toml", changes, first)
    made = write_machine(first, {"connection.x_guide_1.upper_left_1.joint.hertz_contact.preload": 1800.0}, second)
    new = carried(second, made, tmp_path / "there")
    joints = {c.name: c.joint for c in new.flexible}
    preloads = {n: j.parameters["hertz_contact.preload"] for n, j in joints.items() if j and n.startswith("x_guide")}
    assert preloads.pop("x_guide_1.upper_left_1") == 1800.0
    assert set(preloads.values()) == {2000.0}


def test_the_files_of_a_machine_are_never_replaced(tmp_path: Path) -> None:
    source = machine_of_files(tmp_path / "in")
    with pytest.raises(InputError, match=r"machine.toml: belongs to the machine .* expected another name"):
        write_machine(source, {}, source)
    before = {path: path.read_bytes() for path in (tmp_path / "in").rglob("*.*") if path.is_file()}
    made = write_machine(source, {}, tmp_path / "in" / "best.toml")
    with pytest.raises(InputError, match="belongs to the machine"):
        write_machine(made[0], {}, made[0])
    assert all(path.read_bytes() == text for path, text in before.items())


def test_a_joint_for_a_connection_that_is_not_there_is_refused_by_the_nearest_name(tmp_path: Path) -> None:
    joint = Joint((Linear(1e6), Coulomb(3.0, 1e-4)), "x")
    with pytest.raises(InputError, match="no flexible connection 'gide', did you mean 'guide'"):
        write_machine(LIBRARY / "two_mass.toml", {}, tmp_path / "best.toml", {"gide": joint})
    assert not list(tmp_path.iterdir())
    made = write_machine(LIBRARY / "two_mass.toml", {}, tmp_path / "best.toml", {"guide": joint})
    assert joint_table(read_joint(made[1])) == joint_table(joint)
