"""A machine file with other values in some places is the machine that a file with those values describes."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from jointlib import read_joint
from jointlib.errors import InputError
from machines import Machine, frozen_receptance, read_machine
from machines.files.machine_writer import write_machine

LIBRARY = Path("machines/library")
TOOL, TWO_MASS, MILL = LIBRARY / "two_mode_tool.toml", LIBRARY / "two_mass.toml", LIBRARY / "column_mill_a.toml"


def receptance(machine: Machine) -> np.ndarray:
    return frozen_receptance(machine, np.linspace(200.0, 900.0, 20), 0.0).receptance


def foot(machine: Machine) -> object:
    return next(c.at for c in machine.connections if c.name == "foot.x")


def test_a_changed_value_is_read_as_if_it_stood_in_the_file(tmp_path: Path) -> None:
    text = TOOL.read_text()
    (tmp_path / "other.toml").write_text(
        text.replace("[603, 666]", '[603, "0.7 kHz"]').replace("immersion = 0.5", "immersion = 0.3")
    )
    changed = read_machine(TOOL, {"component.cutter.frequency[1]": "0.7 kHz", "cutting.immersion": 0.3})
    written = read_machine(tmp_path / "other.toml")
    assert np.array_equal(receptance(changed), receptance(written))
    assert changed.cutting == written.cutting
    assert not np.array_equal(receptance(changed), receptance(read_machine(TOOL)))


def test_parts_that_machines_share_are_changed_for_one_of_them_only() -> None:
    before = read_machine(MILL)
    after = read_machine(MILL, {"bundle.x_guide.preload": "3 kN", "connection.foot.x.at[2]": 0.7})
    assert foot(after) == (0.0, 0.62, 0.7)
    rows = [c.joint for c in after.connections if c.name.startswith("x_guide")]
    old = [c.joint for c in before.connections if c.name.startswith("x_guide")]
    assert all(a is not None and b is not None and a.laws != b.laws for a, b in zip(rows, old, strict=True))
    assert foot(read_machine(MILL)) == foot(before) == (0.0, 0.62, 0.74)


def test_a_law_of_a_joint_in_the_file_goes_by_its_name(tmp_path: Path) -> None:
    laws = ('"linear", stiffness = 5e8', '"viscous", damping = 400.0', '"viscous", damping = 9.0')
    inline = "{ law = [" + ", ".join(f"{{ kind = {law} }}" for law in laws) + "] }"
    file = tmp_path / "inline.toml"
    file.write_text(TWO_MASS.read_text().replace('"two_mass.joint.toml"', inline))
    held = "connection.guide.joint"
    changed = read_machine(file, {f"{held}.linear.stiffness": "200 N/um", f"{held}.viscous_2.damping": 7.0})
    numbered = read_machine(file, {f"{held}.law[0].stiffness": 2e8, f"{held}.law[2].damping": 7.0})
    assert changed.joints()[0].laws == numbered.joints()[0].laws != read_machine(file).joints()[0].laws
    with pytest.raises(InputError, match="no key 'viscous_3'"):
        read_machine(file, {f"{held}.viscous_3.damping": 7.0})


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("component.cuter.mass", 1.0, r"no component 'cuter', did you mean 'cutter'"),
        ("component.cutter.frequency[2]", 1.0, r"no entry \[2\], there stands a list of 2"),
        ("component.cutter.frequency.low", 1.0, "'low' is a key, but there stands"),
        ("component.cutter.frequencies", [1.0, 2.0], "frequencies"),
        ("component.cutter", 1.0, "expected it to end in a key"),
        ("component.cutter.frequency[1", 1.0, "expected it to end in a key"),
        ("cuting.immersion", 1.0, "no 'cuting', did you mean 'cutting'"),
        ("cutting.immersion.depth", 1.0, "'depth' is a key"),
        ("cutting.imersion", 0.2, "imersion"),
        ("connection.guide.joint.law[0].damping", 1.0, "no connection 'guide'"),
        ("component.cutter.frequency[1]", "4 mm", "unit 'mm'"),
    ],
)
def test_places_that_are_not_there_are_told_with_the_nearest(path: str, value: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_machine(TOOL, {path: value})


@pytest.mark.thorough
def test_a_table_changes_the_keys_it_names(tmp_path: Path) -> None:
    """Another size of a guide: several keys of its bundle at once; the rest of the table stays."""
    size = {"preload": "3 kN", "stiffness": "1200 N/um", "width": "53 mm"}
    whole = read_machine(MILL, {"bundle.x_guide": size})
    one_by_one = read_machine(MILL, {f"bundle.x_guide.{key}": value for key, value in size.items()})
    lines = np.array([10.0, 100.0])
    H = [frozen_receptance(m, lines, 0.0).receptance for m in (whole, one_by_one, read_machine(MILL))]
    assert np.array_equal(H[0], H[1])
    assert abs(H[0][0, 0, 0] / H[2][0, 0, 0] - 1) > 1e-4
    cut = read_machine(MILL, {"cutting": {"tangential": "700 N/mm^2", "normal": 2e8}}).cutting
    assert cut is not None
    assert (cut["tangential"], cut["normal"], cut["teeth"]) == (7e8, 2e8, 3)
    with pytest.raises(InputError, match="expected it to end in a key"):
        read_machine(MILL, {"bundle.x_guide": 3})
    with pytest.raises(InputError, match="unknown key 'widht', did you mean 'width'"):
        read_machine(MILL, {"bundle.x_guide": {"widht": 0.05}})


@pytest.mark.slow
def test_a_longer_cutter_takes_its_tip_along(tmp_path: Path) -> None:
    """Stick-out as one number: the station "end" lies where the last segment ends."""
    modules = (LIBRARY / "column_mill/modules.toml").read_text()
    (tmp_path / "column_mill").mkdir()
    (tmp_path / "column_mill/modules.toml").write_text(modules.replace('at = "130 mm"', 'at = "end"'))
    for name in ("column_mill_a.toml", "mount.joint.toml"):
        (tmp_path / name).write_text((LIBRARY / name).read_text())
    same, longer = (
        read_machine(tmp_path / "column_mill_a.toml", {"component.cutter.segment[2].length": length})
        for length in ("60 mm", "90 mm")
    )
    by_hand = read_machine(
        MILL, {"component.cutter.segment[2].length": "90 mm", "component.cutter.station[1].at": "160 mm"}
    )
    lines = [0.5, 200.0]
    assert frozen_receptance(same, lines, 0.0).receptance == pytest.approx(
        frozen_receptance(read_machine(MILL), lines, 0.0).receptance, rel=1e-9
    )
    assert frozen_receptance(longer, lines, 0.0).receptance == pytest.approx(
        frozen_receptance(by_hand, lines, 0.0).receptance, rel=1e-9
    )


def test_a_joint_given_takes_the_place_of_records_and_of_a_rigid_connection() -> None:
    """The guide of the mill is identified from records, and its spindle nose is rigid."""
    path = LIBRARY / "guide_mill.toml"
    file = str((LIBRARY / "mount.joint.toml").resolve())
    for name in ("guide", "spindle-nose"):
        machine = read_machine(path, {f"connection.{name}.joint": file})
        found = next(c for c in machine.connections if c.name == name)
        assert (found.joint, found.identify, found.rigid) == (read_joint(file), None, False)
    held = next(c for c in read_machine(path, {"connection.guide.rigid": True}).connections if c.name == "guide")
    assert (held.joint, held.identify, held.rigid) == (None, None, True)


def test_a_component_in_a_file_of_its_own_is_changed_in_the_machine_alone(tmp_path: Path) -> None:

    home, away = tmp_path / "home", tmp_path / "home" / "parts"
    away.mkdir(parents=True)
    table = tomllib.loads(TOOL.read_text())
    (cutter,) = table["component"]
    part = {key: value for key, value in cutter.items() if key != "name"}
    modes = {"frequency": cutter["frequency"], "damping_ratio": cutter["damping_ratio"], "shapes": cutter["shapes"]}
    np.savez(away / "modes.npz", **modes, modal_mass=cutter["modal_mass"])
    of_modes = {"kind": "modal", "dofs": cutter["dofs"], "file": "modes.npz"}
    for name, keys in (("whole", part), ("modes", of_modes)):
        file = away / f"{name}.component.toml"
        file.write_text(before := tomli_w.dumps({"schema": "jointlib/component/1", **keys}))
        machine = home / f"{name}.toml"
        machine.write_text(
            tomli_w.dumps({**table, "component": [{"name": "cutter", "file": f"parts/{name}.component.toml"}]})
        )
        new = {"component.cutter.frequency": [603.0, 700.0], "component.cutter.modal_mass": [0.8, 0.9]}
        made = write_machine(machine, new, tmp_path / f"{name}_mended.toml")[0]
        wanted = receptance(read_machine(TOOL, new))
        assert np.allclose(receptance(read_machine(machine, new)), wanted, rtol=1e-12, atol=0)
        assert np.allclose(receptance(read_machine(made)), wanted, rtol=1e-12, atol=0)
        assert file.read_text() == before
