"""Machine files that share parts, repeat a bundle, and look at the tool relative to the workpiece."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.errors import InputError
from machines import Machine, frozen_receptance, linear_check, read_machine, response
from machines.coupling.second_order import machine_equations

HEAD = """
schema = "jointlib/parts/1"
[[component]]
name = "head"
kind = "rigid"
mass = 30
inertia = [0.3, 0.4, 0.5]
centre = [0.0, 0.0, 0.2]
[[component.point]]
name = "tip"
at = [0.0, 0.0, -0.2]
"""
BODY = """
schema = "jointlib/machine/1"
parts = ["parts/head.toml"]
[[component]]
name = "table"
kind = "lumped"
dofs = ["x", "z"]
mass = [[80, 0], [0, 80]]
damping = [["900 N s/m", 0], [0, "900 N s/m"]]
stiffness = [["60 N/um", 0], [0, "90 N/um"]]
[[bundle]]
name = "guide"
kind = "linear-guide"
between = ["head", "ground"]
at = [[-0.1, -0.05, 0.1], [0.1, -0.05, 0.1], [-0.1, 0.05, 0.1], [0.1, 0.05, 0.1]]
axes = [[0, 1, 0], [0, 0, 1]]
preload = "600 N"
stiffness = "300 N/um"
width = "20 mm"
length = "50 mm"
points = 1
damping = "2 kN s/m"
[[connection]]
name = "screw"
between = ["head", "ground"]
at = [0, 0, 0.1]
direction = [0, 1, 0]
joint = { law = [{ kind = "linear", stiffness = "80 N/um" }, { kind = "viscous", damping = 900 }] }
[tool]
x = "head.tip.x - table.x"
[response]
force = [10]
frequency = [20, 800]
"""


def written(folder: Path, body: str = BODY, head: str = HEAD) -> Machine:
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "parts" / "head.toml").write_text(head, encoding="utf-8")
    (folder / "m.toml").write_text(body, encoding="utf-8")
    return read_machine(folder / "m.toml")


def test_parts_come_first_and_a_bundle_stands_at_each_of_its_places(tmp_path: Path) -> None:
    machine = written(tmp_path)
    assert [c.name for c in machine.components] == ["head", "table"]
    names = [c.name for c in machine.connections]
    assert len(names) == 17
    assert names[1:6:4] == ["guide_1.upper_left_1", "guide_2.upper_left_1"]
    joints = machine.joints()
    assert all(joint is joints[1] for joint in joints[1:])
    # Four carriages of 300 N/um in heave, roll about y by their places and their own width.
    K = machine_equations(machine)
    rows = K.joints.T @ (np.array([80e6] + [300e6 / 2] * 16)[:, None] * K.joints)
    z = machine.dofs.index("head.uz")
    assert rows[z, z] == pytest.approx(4 * 300e6)
    # Sway acts 0.1 m below the centre; each carriage rolls as well, 2 k (width/2)²/2.
    assert rows[4, 4] == pytest.approx(4 * 300e6 * (0.1**2 + 0.1**2 + 0.01**2))


def test_the_tool_relative_to_the_table_yields_what_both_yield_together(tmp_path: Path) -> None:
    machine = written(tmp_path)
    lines = np.linspace(20.0, 800.0, 50)
    alone = [
        frozen_receptance(written(tmp_path, BODY.replace('"head.tip.x - table.x"', f'"{dof}"')), lines, 0.0).receptance
        for dof in ("head.tip.x", "table.x")
    ]
    # Nothing joins the two, so the force and its reaction move them independently.
    relative = frozen_receptance(machine, lines, 0.0)
    np.testing.assert_allclose(relative.receptance, alone[0] + alone[1], rtol=1e-12)
    assert relative.outputs == ("head.tip.x - table.x",)
    assert linear_check(machine).passed
    answer = response(machine, 10.0, [20.0, 60.0, 300.0])
    assert answer.drive == "head.tip.x - table.x"
    np.testing.assert_allclose(answer.frfs[0].receptance[0], alone[0][0] + alone[1][0], rtol=1e-3)


def test_a_tool_that_moves_no_joint_and_a_part_that_stands_alone_are_told(tmp_path: Path) -> None:
    joined = written(tmp_path)
    assert not joined.remarks()
    still = written(tmp_path, BODY.replace('"head.tip.x - table.x"', '"table.x"'))
    assert still.remarks() == (
        "head: joined to nothing that tool or drive moves, so it takes no part.",
        "tool: it moves no joint, so its response is linear whatever the amplitude.",
    )
    answer = response(still, 10.0, [20.0, 60.0, 300.0])
    omega = 2 * np.pi * np.array([20.0, 60.0, 300.0])
    expected = 1 / (60e6 - 80 * omega**2 + 900j * omega)
    np.testing.assert_allclose(answer.frfs[0].receptance.ravel(), expected, rtol=1e-12)
    assert linear_check(still).passed


def test_a_relative_tool_is_no_port_of_one_body_of_a_system(tmp_path: Path) -> None:
    from fmu.members.machine_parts import parts_of_machine

    with pytest.raises(InputError, match="the x of tool or drive moves head and table against each other, expected"):
        parts_of_machine(written(tmp_path))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("parts/head.toml", "parts/heat.toml", r"parts refers to .*heat\.toml, which does not exist"),
        ("head.tip.x - table.x", "head.tip.x - tabel.x", r"\[tool\]: x: no degree of freedom 'tabel.x', did you mean"),
        ("[-0.1, -0.05, 0.1], [0.1", "[-0.1, -0.05], [0.1", "at is .*, expected a list of rows of equal length"),
        ("[-0.1, 0.05, 0.1], [0.1", "[-0.1, 0.05, 2, 0.1], [0.1", "at is .*, expected a list of rows of equal length"),
    ],
)
def test_what_is_wrong_in_a_shared_file_is_said_in_a_sentence(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        written(tmp_path, BODY.replace(old, new, 1))


def test_a_part_file_holds_parts_only(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"head\.toml: unknown key 'tool'"):
        written(tmp_path, head=HEAD + '[tool]\nx = "head.ux"\n')
    with pytest.raises(InputError, match="schema is 'jointlib/machine/1', expected \"jointlib/parts/1\""):
        written(tmp_path, head=HEAD.replace("parts/1", "machine/1"))
    with pytest.raises(InputError, match="point 'tip' is named twice"):
        written(tmp_path, head=HEAD + '[[component.point]]\nname = "tip"\nat = [0, 0, 0]\n')
