"""A small gantry mill: a bridge on two carriages with its screw, a quill on two more, a carbide cutter in a collet."""

from __future__ import annotations

from pathlib import Path

GANTRY = """schema = "jointlib/machine/1"
name = "bench gantry"

[[component]]
name = "bridge"
kind = "rigid"
mass = "60 kg"
inertia = [1.2, 0.9, 1.6]
centre = [0, 0, "300 mm"]

[[component]]
name = "quill"
kind = "rigid"
mass = "9 kg"
inertia = [0.12, 0.12, 0.03]
centre = [0, "-90 mm", "230 mm"]
point = [{ name = "nose", at = [0, "-90 mm", "80 mm"] }]

[[bundle]]
name = "rails"
kind = "linear-guide"
between = ["bridge", "ground"]
at = [["-200 mm", 0, "250 mm"], ["200 mm", 0, "250 mm"]]
axes = [[0, 1, 0], [0, 0, 1]]
preload = "500 N"
stiffness = "140 N/um"
width = "18 mm"
height = "8 mm"
length = "45 mm"
damping = "900 N s/m"

[[bundle]]
name = "screw"
kind = "ball-screw"
between = ["bridge", "ground"]
at = [0, 0, "250 mm"]
axes = [[0, 1, 0]]
diameter = "14 mm"
position = "200 mm"
length = "400 mm"
nut_stiffness = "110 N/um"
bearing_stiffness = "90 N/um"
damping = "500 N s/m"

[[bundle]]
name = "zrail"
kind = "linear-guide"
between = ["quill", "bridge"]
at = [[0, "-45 mm", "180 mm"], [0, "-45 mm", "300 mm"]]
axes = [[0, 0, 1], [0, -1, 0]]
preload = "300 N"
stiffness = "110 N/um"
width = "16 mm"
height = "7 mm"
length = "40 mm"
damping = "500 N s/m"

[[connection]]
name = "zdrive"
between = ["quill", "bridge"]
at = [0, "-60 mm", "250 mm"]
direction = [0, 0, 1]
joint = { law = [
    { kind = "linear", stiffness = "40 N/um" },
    { kind = "jenkins", stiffness = "8 N/um", slip_force = "12 N" },
    { kind = "viscous", damping = "300 N s/m" },
] }

[[component]]
name = "cutter"
kind = "tool"
diameter = "8 mm"
flute_length = "20 mm"
stick_out = "38 mm"
loss_factor = 0.02
at = [0, "-90 mm", "80 mm"]
axis = [0, 0, 1]

[[connection]]
name = "collet_x"
between = ["cutter.shank.x", "quill.nose.x"]
joint = { law = [{ kind = "linear", stiffness = "60 N/um" }, { kind = "viscous", damping = "60 N s/m" }] }

[[connection]]
name = "collet_y"
between = ["cutter.shank.y", "quill.nose.y"]
joint = { law = [{ kind = "linear", stiffness = "60 N/um" }, { kind = "viscous", damping = "60 N s/m" }] }

[[connection]]
name = "collet_z"
between = ["cutter.shank.z", "quill.nose.z"]
joint = { law = [{ kind = "linear", stiffness = "60 N/um" }, { kind = "viscous", damping = "60 N s/m" }] }

[[connection]]
name = "collet_rot"
between = ["cutter", "quill"]
at = [0, "-90 mm", "80 mm"]
rigid = true
holds = ["rx", "ry", "rz"]

[static]
gravity = true

[tool]
x = "cutter.tip.x"
y = "cutter.tip.y"

[response]
force = ["2 N", "40 N"]
frequency = ["40 Hz", "1500 Hz"]

[cutting]
process = "milling"
teeth = 2
tangential = "700 N/mm^2"
normal = "210 N/mm^2"
mode = "down"
immersion = 0.25
diameter = "8 mm"
feed = "0.04 mm"
speed = ["6000 rpm", "24000 rpm"]
"""


def gantry(folder: Path, *edits: tuple[str, str]) -> Path:
    """Its file, with what stands first of each pair replaced by the second, once."""
    text = GANTRY
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "gantry.toml"
    path.write_text(text, "utf-8")
    return path
