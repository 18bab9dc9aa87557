"""A spindle, a cutter with its holder and the joint between them: as a tool file, and written out as components."""

from __future__ import annotations

from pathlib import Path

SPINDLE = """
schema = "jointlib/machine/1"
{top}
[[component]]
name = "spindle"
kind = "beam"
axis = [0, 0, 1]
[[component.material]]
name = "steel"
young = 210e9
poisson = 0.3
density = 7850
viscous = 2e-6
[[component.segment]]
length = "200 mm"
diameter = "60 mm"
[[component.station]]
name = "nose"
at = 0
[[component.station]]
name = "rear"
at = "end"
{parts}
[[connection]]
name = "housing"
between = ["spindle", "ground"]
at = [0, 0, "200 mm"]
rigid = true
{tool}
[cutting]
process = "milling"
teeth = {teeth}
tangential = 8e8
normal = 2.4e8
mode = "down"
immersion = 0.5
speed = [6000, 12000]
"""
SIZES = """
diameter = "12 mm"
flute_length = "30 mm"
stick_out = "60 mm"
equivalent = 0.8
loss_factor = 2e-2
"""
SECTION = """
length = "40 mm"
diameter = "32 mm"
bore = "8 mm"
"""
JOINT = """
[joint]
stiffness = "60 N/um"
rotation = 2e4
damping = 300
rotation_damping = 0.1
"""
AXES = '[tool]\nx = "cutter.tip.x"\ny = "cutter.tip.y"\n'
ONE_PIECE = f"""
[[component]]
name = "cutter"
kind = "tool"
at = [0, 0, 0]
axis = [0, 0, 1]
{SIZES}
[[component.section]]
{SECTION}
[[connection]]
name = "nose"
between = ["cutter", "spindle"]
at = [0, 0, 0]
rigid = true
"""
JOINED = f"""
[[component]]
name = "cutter"
kind = "tool"
at = [0, 0, "-40 mm"]
{SIZES}
[[component]]
name = "holder"
kind = "beam"
start = [0, 0, "-40 mm"]
axis = [0, 0, 1]
held = ["face"]
[[component.material]]
name = "steel"
young = 210e9
poisson = 0.3
density = 7850
loss_factor = 2e-2
[[component.segment]]
{SECTION}
[[component.station]]
name = "front"
at = 0
[[component.station]]
name = "face"
at = "end"
[[connection]]
name = "nose"
between = ["holder", "spindle"]
at = [0, 0, 0]
rigid = true
""" + "".join(
    f'[[connection]]\nname = "shank_{word}"\nbetween = ["cutter.shank.{word}", "holder.front.{word}"]\n{held}\n'
    for word, held in (
        *(
            (w, 'joint = { law = [{ kind = "linear", stiffness = 6e7 }, { kind = "viscous", damping = 300 }] }')
            for w in "xy"
        ),
        *(
            (w, 'joint = { law = [{ kind = "linear", stiffness = 2e4 }, { kind = "viscous", damping = 0.1 }] }')
            for w in ("rx", "ry")
        ),
        ("z", "rigid = true"),
        ("rz", "rigid = true"),
    )
)
TOOL = 'schema = "jointlib/tool/1"\n'
HOLDER = f'schema = "jointlib/holder/1"\n[[section]]\n{SECTION}'
CUT = "[cutting]\nteeth = 3\n"
TWO = """
[[tools]]
name = "short"
file = "a.tool.toml"
[[tools]]
name = "long"
file = "a.tool.toml"
stick_out = "80 mm"
holder = "a.holder.toml"
cutting = { teeth = 2 }
"""


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def machine(folder: Path, top: str = "", parts: str = "", tool: str = "", teeth: int = 5) -> Path:
    return written(folder, "mill.toml", SPINDLE.format(top=top, parts=parts, tool=tool, teeth=teeth))
