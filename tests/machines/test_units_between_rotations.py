"""Joints between rotations, whose stiffness is a moment per angle; keys of a cut that a tool does not take."""

from __future__ import annotations

from pathlib import Path

import pytest

from jointlib.errors import InputError
from machines import read_machine

TURNING = """schema = "jointlib/machine/1"
name = "a disk on a shaft"

[[component]]
name = "disk"
kind = "rigid"
mass = "20 kg"
inertia = [0.2, 0.2, 0.3]
centre = [0, 0, 0]

[[connection]]
name = "shaft"
between = ["disk.rz", "ground"]
joint = { law = [{ kind = "linear", stiffness = STIFFNESS }, { kind = "viscous", damping = "20 N m s/rad" }] }

[[connection]]
name = "foot"
between = ["disk", "ground"]
at = [0, 0, 0]
direction = [1, 0, 0]
joint = { law = [{ kind = "linear", stiffness = "90 N/um" }] }
"""


def of(folder: Path, text: str) -> Path:
    path = folder / "m.toml"
    path.write_text(text, "utf-8")
    return path


@pytest.mark.parametrize("stiffness", ["30e3", '"30 kN m/rad"', '"30 kN m"', '"30 kN/m"'])
def test_between_rotations_moments_per_angle_are_the_number_in_si(stiffness: str, tmp_path: Path) -> None:
    machine = read_machine(of(tmp_path, TURNING.replace("STIFFNESS", stiffness)))
    joint = machine.flexible[0].joint
    assert joint is not None
    assert joint.parameters == pytest.approx({"linear.stiffness": 30e3, "viscous.damping": 20.0})


def test_what_is_neither_is_refused_with_the_unit_of_a_moment(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unit 'kN' does not fit, expected one like 'N m/rad'"):
        read_machine(of(tmp_path, TURNING.replace("STIFFNESS", '"30 kN"')))


def test_moments_do_not_fit_where_a_part_shifts(tmp_path: Path) -> None:
    text = TURNING.replace("STIFFNESS", "30e3").replace('"90 N/um"', '"90 kN m/rad"')
    with pytest.raises(InputError, match="unit 'kN m/rad' does not fit, expected one like 'N/m'"):
        read_machine(of(tmp_path, text))


def test_a_key_of_another_process_is_refused_by_the_tool_whose_process_it_is(tmp_path: Path) -> None:
    tools = """
[tool]
use = "od"

[tool.od]
x = "disk.x"
cutting = { process = "turning" }

[tool.live]
x = "disk.x"
y = "disk.y"
cutting = { process = "milling", teeth = 3, tangential = 1.9e9, normal = 6e8, mode = "slot" }

[cutting]
specific = 2.3e9
"""
    with pytest.raises(InputError) as refused:
        read_machine(of(tmp_path, TURNING.replace("STIFFNESS", "30e3") + tools), every_tool=True)
    assert (
        "[tool.live]: its process is 'milling', and 'specific' in [cutting] belongs to turning; milling takes "
        "'tangential' and 'normal'" in str(refused.value)
    )
