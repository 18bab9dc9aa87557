"""A machine with a part that is only measured goes the whole road but for the check, and says why."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import jointlib
from test_measured import GOOD, files

MACHINE = (
    GOOD
    + """
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[20.0]]
[[connection]]
name = "guide"
between = ["column.x", "slide.x"]
joint = { law = [{ kind = "linear", stiffness = "30 N/um" }, { kind = "viscous", damping = 300 }] }
[response]
force = [10]
frequency = [60, 1400]
"""
)


@pytest.mark.slow
def test_measured_part_is_told_and_left_out_of_the_check(tmp_path: Path) -> None:
    files(tmp_path)
    machine = tmp_path / "m.toml"
    machine.write_text(MACHINE)
    said = jointlib(["inspect", str(machine)])
    assert said.status == 0
    assert "column: measured accelerance, 581 lines" in said.out
    refused = jointlib(["check", str(machine)])
    assert refused.status == 2
    assert "component 'column' has no equations of motion, only an FRF" in refused.err
    found = jointlib(["frf", str(machine), "-o", str(tmp_path / "f.npz"), "--json"])
    assert found.json["peaks"]
    assert any("by rational interpolation" in warning for warning in found.json["warnings"])
    road = jointlib(["run", str(machine), "-o", str(tmp_path / "out"), "--json"])
    assert road.status == 0
    assert [step["step"] for step in road.json["steps"] if step["step"] in ("check", "frf")] == ["frf"]
    assert "not checked against python-control" in (tmp_path / "out" / "report.html").read_text("utf-8")
