"""A gantry mill with one mistake each: the sentence that names it, and none of what merely follows from it."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from gantry_mill import GANTRY, gantry

from jointlib.cli.main import cli
from jointlib.errors import InputError
from machines import read_machine
from machines.mistakes import in_file, mistakes


def test_nothing_is_said_of_the_gantry(tmp_path: Path) -> None:
    assert mistakes(read_machine(gantry(tmp_path))) == ()


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        ("cutter.tip.x", "cutter.tip.x", r"\[tool\]: y: 'cutter.tip.x' is the same degree of freedom as x"),
        ("cutter.tip.x - quill.nose.x", "cutter.tip.x - quill.nose.x", "is the same degree of freedom as x"),
        ("cutter.tip.x - quill.nose.x", "quill.nose.x - cutter.tip.x", "is the opposite of x"),
    ],
)
def test_two_directions_of_the_tool_are_two_motions(x: str, y: str, words: str, tmp_path: Path) -> None:
    edits = (('x = "cutter.tip.x"', f'x = "{x}"'), ('y = "cutter.tip.y"', f'y = "{y}"'))
    with pytest.raises(InputError, match=words):
        read_machine(gantry(tmp_path, *edits))


DRIVE = '"-60 mm", "250 mm"]\ndirection = [0, 0, 1]'
RAILS = 'at = [["-200 mm", 0, "250 mm"], ["200 mm", 0, "250 mm"]]'
AXIS = """[[axis]]
name = "y"
direction = [0, 1, 0]
moves = ["bridge"]
travel = [-150, 200]

"""
PRESSED = 'gravity = true\nforce = { "bridge.uz" = "-600 kN" }'
SHIMMED = 'gravity = true\noffset = { "rails_1.upper_left_1" = "20 mm" }'
ALONE = [
    # what stands there, what is written instead, how the only sentence begins
    (RAILS, "at = [[-200, 0, 250], [200, 0, 250]]", "rails: it lies 319.9 m from the centre of bridge, a body of"),
    ('at = [0, "-90 mm", "80 mm"] }]', "at = [0, -90, 80] }]", "quill.nose: it lies 120.2 m from the centre of quill"),
    ('width = "18 mm"', 'width = "18 m"', "rails: the width of a linear-guide is 1.8e+04 mm, expected 0.1 to 5000 mm"),
    ('centre = [0, "-90 mm", "230 mm"]', "centre = [0, -90, 230]", "quill: its centre lies 246.7 m from the nearest"),
    ("inertia = [1.2, 0.9, 1.6]", "inertia = [1.2e6, 0.9e6, 1.6e6]", "bridge: the density of the block"),
    ('mass = "9 kg"', "mass = 9000", "quill: the density of the block"),
    (
        "axes = [[0, 1, 0], [0, 0, 1]]",
        "axes = [[1, 0, 0], [0, 0, 1]]",
        "screw: it drives along (0, 1, 0), where rails_1",
    ),
    ("axes = [[0, 1, 0]]", "axes = [[1, 0, 0]]", "screw: it drives along (1, 0, 0), where rails_1 holds already"),
    (DRIVE, DRIVE.replace("0, 0, 1", "1, 0, 0"), "zdrive: it acts along (1, 0, 0), where zrail_1 holds already; its "),
    ('diameter = "8 mm"\nflute', 'diameter = "8 cm"\nflute', "[cutting]: diameter is 8 mm, and cutter is by its sizes"),
    ('0.25\ndiameter = "8 mm"', '0.25\ndiameter = "8 cm"', "[cutting]: diameter is 80 mm, and cutter is by its sizes"),
    ('stick_out = "38 mm"', 'stick_out = "380 mm"', "cutter: it sticks out 380 mm at a diameter of 8 mm, 47.5 times"),
    ("axis = [0, 0, 1]", "axis = [0, 0, -1]", "cutter: its tip lies at (0, -0.09, 0.118) m, inside of quill, which"),
    ('x = "cutter.tip.x"', 'x = "cutter.tip.z"', "[tool]: x is cutter.tip.z, along the axis of cutter; a mill cuts"),
    ('["40 Hz", "1500 Hz"]', "[0.04, 1.5]", "[response]: frequency ends at 1.5 Hz, far below the first mode at 26.3"),
    ('force = ["2 N", "40 N"]', 'force = ["2 N", "40 kN"]', "[response]: a force of 40000 N at the tool, expected at"),
    ("gravity = true", PRESSED, "[static]: a constant force of -600000 N on bridge.uz, expected at most"),
    ("gravity = true", SHIMMED, "[static]: an offset of 20 mm in rails_1"),
    ("[static]", AXIS + "[static]", "axis y: it travels 350 m, expected at most 100 m: were mm read as m?"),
    ('damping = "900 N s/m"', 'damping = "900 N s/mm"', "rails_1 and rails_2: at 100 Hz its damping, 2.25e+05 N s/m"),
    ('preload = "500 N"', 'preload = "0.5 N"', "rails_1 and rails_2: its preload presses its rolling contacts"),
    ('length = "40 mm"\ndamping = "500 N s/m"', 'length = "40 mm"', "zrail: this linear-guide has no damping, while"),
]


@pytest.mark.parametrize(("old", "new", "words"), ALONE, ids=lambda value: None)
def test_what_follows_from_a_mistake_is_no_mistake_of_its_own(old: str, new: str, words: str, tmp_path: Path) -> None:
    (said,) = mistakes(read_machine(gantry(tmp_path, (old, new))))
    assert said.startswith(words)


def test_a_joint_between_nodes_far_apart_is_named_once(tmp_path: Path) -> None:
    turns = GANTRY[GANTRY.index('[[connection]]\nname = "collet_rot"') : GANTRY.index("[static]")]
    edits = (turns, ""), ('at = [0, "-90 mm", "80 mm"]\naxis', "at = [0, -90, 80]\naxis")
    (said,) = mistakes(read_machine(gantry(tmp_path, *edits)))
    assert said.startswith("collet_x: cutter.shank and quill.nose, which it joins, lie 120.3 m apart: were mm read")


IN_A_SPINDLE = """schema = "jointlib/machine/1"
name = "spindle"

[[component]]
name = "spindle"
kind = "beam"
start = [0, 0, 0]
axis = [0, 0, -1]
up_to = "5 kHz"
material = [{ name = "steel", young = "210 GPa", poisson = 0.3, density = "7850 kg/m^3", loss_factor = 0.004 }]
segment = [{ length = "320 mm", diameter = "70 mm" }]
station = [{ name = "rear", at = "60 mm" }, { name = "nose", at = "end" }]

[[component]]
name = "work"
kind = "rigid"
mass = "20 kg"
inertia = [0.1, 0.1, 0.1]
centre = [0, 0, "-500 mm"]
point = [{ name = "cut", at = [0, 0, "-425 mm"] }]

[[component]]
name = "cutter"
kind = "tool"
diameter = "20 mm"
flute_length = "40 mm"
stick_out = "100 mm"
at = [0, 0, "-320 mm"]
axis = [0, 0, 1]

[[connection]]
name = "nose"
between = ["cutter", "CARRIER"]
at = [0, 0, "-320 mm"]
rigid = true

[tool]
x = "cutter.tip.x - work.cut.x"

[cutting]
process = "milling"
teeth = 4
tangential = "700 N/mm^2"
normal = "210 N/mm^2"
mode = "down"
immersion = 0.25
diameter = "20 mm"
speed = ["3000 rpm", "9000 rpm"]
"""
HEAD = """name = "head"
kind = "rigid"
mass = "180 kg"
inertia = [3.2, 2.7, 3.2]
centre = [0, "300 mm", "-200 mm"]

"""


def test_a_tool_within_its_own_spindle_is_named(tmp_path: Path) -> None:
    path, right = tmp_path / "spindle.toml", IN_A_SPINDLE.replace("CARRIER", "spindle")
    path.write_text(right, "utf-8")
    assert in_file(read_machine(path)) == ()
    path.write_text(right.replace('mm"]\naxis = [0, 0, 1]', 'mm"]\naxis = [0, 0, -1]'), "utf-8")
    (said,) = in_file(read_machine(path))
    assert said.startswith(
        "cutter: its tip lies at (0, 0, -0.22) m, inside of spindle, which holds it at (0, 0, -0.32)"
    )


def test_a_tool_that_points_away_from_the_workpiece_is_named(tmp_path: Path) -> None:
    path = tmp_path / "head.toml"
    parts = IN_A_SPINDLE.replace("CARRIER", "head").split("[[component]]\n")
    right = "[[component]]\n".join([parts[0], HEAD, *parts[2:]])
    path.write_text(right, "utf-8")
    assert in_file(read_machine(path)) == ()
    path.write_text(right.replace('mm"]\naxis = [0, 0, 1]', 'mm"]\naxis = [0, 0, -1]'), "utf-8")
    (said,) = in_file(read_machine(path))
    assert said.startswith("cutter: its tip lies 205 mm from work.cut and the end that is held 105 mm, so that it")


BED = """schema = "jointlib/machine/1"
name = "long bed"

[[component]]
name = "bed"
kind = "rigid"
mass = "150 t"
inertia = [5e4, 6.2e7, 6.2e7]
centre = [0, 0, 0]

[[bundle]]
name = "rails"
kind = "linear-guide"
between = ["bed", "ground"]
at = [[-35, 0, 0], [35, 0, 0]]
axes = [[0, 1, 0], [0, 0, 1]]
preload = "9 kN"
stiffness = "900 N/um"
width = "60 mm"
length = "120 mm"
damping = "9 kN s/m"
"""


def test_a_machine_larger_than_any_is_named_by_its_farthest_point(tmp_path: Path) -> None:
    path = tmp_path / "long.toml"
    path.write_text(BED, "utf-8")
    (said,) = in_file(read_machine(path))
    assert said.startswith("rails_1.")
    assert "m, and the machine is 70.06 m long, expected at most 60 m: were mm read as m?" in said


def test_what_a_wrong_place_does_to_the_load_is_not_told_beside_it(tmp_path: Path) -> None:
    path = gantry(tmp_path, ('centre = [0, "-90 mm", "230 mm"]', "centre = [0, -90, 230]"))
    done = CliRunner().invoke(cli, ["inspect", str(path)], catch_exceptions=False)
    assert "looks wrong: quill: its centre lies 246.7 m" in done.stdout
    assert "nothing holds" not in done.stdout


def test_a_mode_that_its_damping_hardly_slows_is_not_called_without_damping(tmp_path: Path) -> None:
    edits = ('damping = "900 N s/m"', 'damping = "0.09 N s/m"'), ('damping = "500 N s/m"', 'damping = "0.05 N s/m"')
    said = mistakes(read_machine(gantry(tmp_path, *edits)))
    assert not [sentence for sentence in said if "dissipates nothing" in sentence]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('stiffness = "140 N/um"', 'stiffness = "140 N/mm"', r"its stiffness is so low .* \(line 26: stiffness = "),
        ('preload = "500 N"', 'preload = "500 kN"', r"the preload presses its contacts in .* \(line 25: preload = "),
    ],
)
def test_a_preload_that_presses_too_deep_is_told_by_the_value_that_is_off(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=words):
        read_machine(gantry(tmp_path, (old, new)))


def test_a_load_that_a_mistake_leaves_unheld_is_refused_by_that_mistake(tmp_path: Path) -> None:
    path = gantry(tmp_path, ('centre = [0, "-90 mm", "230 mm"]', "centre = [0, -90, 230]"))
    with pytest.raises(InputError, match=r"quill: its centre lies 246.7 m") as refused:
        CliRunner().invoke(cli, ["modes", str(path)], catch_exceptions=False)
    assert "nothing holds" not in str(refused.value)


def test_a_forgotten_drive_that_carries_a_weight_is_named_by_the_body_that_falls(tmp_path: Path) -> None:
    drive = GANTRY[GANTRY.index('[[connection]]\nname = "zdrive"') : GANTRY.index('[[component]]\nname = "cutter"')]
    path = gantry(tmp_path, (drive, ""))
    falls = (
        "quill: nothing holds it along (0, 0, 1), it drifts freely; expected a connection there, a screw for example"
    )
    assert falls in mistakes(read_machine(path))
    refused = CliRunner().invoke(cli, ["modes", str(path)])
    assert refused.exit_code != 0
    assert falls in str(refused.exception)
