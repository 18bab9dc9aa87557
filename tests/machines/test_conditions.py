"""`[conditions]` of a machine: joints as they are at a temperature, a voltage or a preload."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib import InputError
from machines import natural_modes, read_machine

JOINT = """
schema = "jointlib/joint/1"
[[law]]
kind = "linear"
stiffness = "10 N/um"
[[law]]
kind = "viscous"
damping = "50 N s/m"
[[modulation]]
role = "stiffness"
condition = "temperature"
reference = 293
table = [[283, 1.2], [293, 1.0], [313, 0.64]]
"""
MACHINE = """
schema = "jointlib/machine/1"
name = "slide"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[2.0]]
[[connection]]
name = "guide"
between = ["ground", "slide.x"]
joint = "guide.joint.toml"
[tool]
x = "slide.x"
"""


def written(folder: Path, conditions: str = "") -> Path:
    (folder / "guide.joint.toml").write_text(JOINT)
    (folder / "slide.toml").write_text(MACHINE + conditions)
    return folder / "slide.toml"


@pytest.mark.parametrize(("temperature", "factor"), [("293 K", 1.0), ("313 K", 0.64), ("303 K", 0.82)])
def test_a_frequency_follows_the_temperature(temperature: str, factor: float, tmp_path: Path) -> None:
    machine = read_machine(written(tmp_path, f'[conditions]\ntemperature = "{temperature}"\n'))
    (found,) = natural_modes(machine).frequency
    expected = np.sqrt(factor * 1e7 / 2.0) / (2 * np.pi)
    assert found == pytest.approx(expected, rel=1e-5)


def test_conditions_may_be_changed_and_are_the_reference_where_none_are_given(tmp_path: Path) -> None:
    file = written(tmp_path, "[conditions]\ntemperature = 313\n")
    changed = read_machine(file, {"conditions.temperature": 293})
    bare = read_machine(written(tmp_path))
    assert natural_modes(bare).frequency == pytest.approx(natural_modes(changed).frequency, rel=1e-12)


@pytest.mark.parametrize(
    ("conditions", "said"),
    [
        ("voltage = 2", "no joint depends on voltage, expected one of temperature"),
        ("temperature = 330", "temperature is 330 K, expected 283 to 313, where the stiffness of its joint is known"),
        ("spindle-speed = 3000", "spindle-speed is that of `\\[response\\] speed`"),
        ("temperatur = 300", "temperatur"),
    ],
)
def test_conditions_that_tell_nothing_are_refused(conditions: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        read_machine(written(tmp_path, f"[conditions]\n{conditions}\n"))
