"""A grooving head in turning, two masses with a neck that slips a little, as a file of its own."""

from __future__ import annotations

from pathlib import Path

GROOVER = """schema = "jointlib/machine/1"
name = "groover"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[9.0]]
damping = [["900 N s/m"]]
stiffness = [["45 N/um"]]
[[component]]
name = "block"
kind = "lumped"
dofs = ["x"]
mass = [[2.4]]
[[connection]]
name = "neck"
between = ["block.x", "slide.x"]
joint = { law = [{ kind = "linear", stiffness = "30 N/um" }, { kind = "jenkins", stiffness = "12 N/um", slip_force = "25 N" }, { kind = "viscous", damping = "300 N s/m" }] }
[tool]
x = "block.x"
[response]
force = ["2 N", "20 N"]
frequency = ["100 Hz", "1500 Hz"]
[cutting]
process = "turning"
specific = "1800 N/mm^2"
feed = "0.12 mm"
diameter = "40 mm"
speed = [2000, 12000]
"""  # noqa: E501


def groover_file(folder: Path) -> Path:
    """``groover.toml`` in a folder."""
    (folder / "groover.toml").write_text(GROOVER)
    return folder / "groover.toml"
