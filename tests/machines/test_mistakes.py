"""Machine files with one mistake each, and the sentence that names it; none for machines that are right."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

import machines
from jointlib.cli.main import cli
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from machines import Machine, read_machine
from machines.mistakes import in_file, mistakes

ROOT = Path(__file__).parents[2]
LIBRARY = Path(machines.__file__).parent / "library"
SHIPPED = sorted(p for p in LIBRARY.glob("*.toml") if 'schema = "jointlib/machine/1"' in p.read_text("utf-8"))
LATHE, TOOL, PAIR, MILL = "lathe", "two_mode_tool", "two_mass", "bed_mill"
GUIDE = 'name = "x_guide"                    # size 30\nkind = "linear-guide"\nbetween = ["post", "slide"]\n'
AGAIN = """
[[bundle]]
name = "again"
kind = "ball-screw"
between = ["post", "slide"]
at = [0.22, 0.84, 0.25]
axes = [[1, 0, 0]]
diameter = "27 mm"
position = "150 mm"
length = "400 mm"
mounting = "fixed-fixed"
nut_stiffness = "520 N/um"
bearing_stiffness = "750 N/um"
damping = "14 kN s/m"

[[axis]]
name = "z" """
ACROSS = """
[[bundle]]
name = "other"
kind = "linear-guide"
between = ["post", "slide"]
at = [0.2, 0.84, 0.2]
axes = [[0, 0, 1], [0, 1, 0]]
preload = "1100 N"
stiffness = "520 N/um"
width = "28 mm"
height = "14 mm"
length = "70 mm"
damping = "20 kN s/m"

[[axis]]
name = "z" """
TWICE = """
[[component]]
name = "post_2"
kind = "rigid"
mass = "130 kg"
inertia = [4, 4, 3.5]
centre = [0.22, 0.96, 0.25]

[[bundle]]
name = "link"
kind = "ball-screw"
between = ["post_2", "slide"]
at = [0.2, 0.84, 0.2]
axes = [[1, 0, 0]]
diameter = "27 mm"
position = "150 mm"
length = "400 mm"
mounting = "fixed-fixed"
nut_stiffness = "520 N/um"
bearing_stiffness = "750 N/um"

[[axis]]
name = "z" """
MOUNTS = "connection = [                      # the bed on its mounts"
SHIM = 'between = ["slide", "bed"], at = [0.0, 0.72, 0.1], direction = [1, 0, 0]'
BESIDE_RIGID = f"""connection = [
    {{ name = "bolted", {SHIM}, rigid = true }},
    {{ name = "shim", {SHIM}, joint = {{ law = [{{ kind = "linear", stiffness = "300 N/um" }}] }} }},"""
AXIS = '\n[[axis]]\nname = "z" '

WRONG = [
    # file, what stands there, what is written instead, words of the sentence
    (
        LATHE,
        'stiffness = "700 N/um"',
        'stiffness = "700 N/mm"',
        "(z_guide): its stiffness is so low that the preload presses its contacts in by 6.43 mm",
    ),
    (
        LATHE,
        'stiffness = "520 N/um"\nwidth',
        "stiffness = 520e9\nwidth",
        "x_guide_1, x_guide_2, x_guide_3 and x_guide_4: the stiffness of a carriage is",
    ),
    (LATHE, 'nut_stiffness = "700 N/um"', 'nut_stiffness = "700 N/mm"', "z_screw: the stiffness of a ball screw"),
    (
        LATHE,
        'bearing_stiffness = "750 N/um"',
        'bearing_stiffness = "750 N/mm"',
        "x_screw: the stiffness of a ball screw",
    ),
    (LATHE, 'mass = "160 kg"', 'mass = "160 t"', "slide: the density of the block"),
    (LATHE, 'mass = "160 kg"', 'mass = "15 t"', "slide: the density of the block"),
    (LATHE, 'mass = "130 kg"', 'mass = "130 g"', "post: the density of the block"),
    (LATHE, 'mass = "1600 kg"', 'mass = "-1600 kg"', "mass is -1600"),
    (LATHE, "inertia = [550, 565, 150]", "inertia = [550, 565, 1500]", "bed: no body has the inertia"),
    (LATHE, "inertia = [4.5, 9, 6]", "inertia = [4.5e-3, 9e-3, 6e-3]", "slide: the density of the block"),
    (LATHE, "centre = [0.1, 0.79, 0.25]", "centre = [100, 790, 250]", "slide: its centre lies"),
    (LATHE, 'density = "7850 kg/m^3"', "density = 7.85", "spindle: the density of 'steel' is 7.85 kg/m^3"),
    (LATHE, 'density = "7850 kg/m^3"', 'density = "7850 g/cm^3"', "spindle: the density of 'steel' is 7.85e+06 kg/m^3"),
    (LATHE, 'young = "210 GPa"', 'young = "210 MPa"', "spindle: the modulus young of 'steel' is 0.21 GPa"),
    (LATHE, 'young = "210 GPa"', "young = 210e12", "spindle: the modulus young of 'steel' is 2.1e+05 GPa"),
    (LATHE, 'young = "210 GPa"', "young = 210", "times 1e+09 it would lie there"),
    (LATHE, "loss_factor = 0.02", "loss_factor = 2", "was it given in percent"),
    (LATHE, 'length = "420 mm"', 'length = "420 m"', "spindle: it is 420.3 m long"),
    (LATHE, 'bore = "52 mm"', 'bore = "99.5 mm"', "leaves a wall of 0.25 mm"),
    (
        LATHE,
        'length = "150 mm"                   # bar\ndiameter = "60 mm"',
        'length = "150 mm"\nwidth = "300 mm"\nheight = "300 mm"\nwall = "1 mm"',
        "a wall of 1 mm in a box of 300 mm",
    ),
    (LATHE, 'bore = "52 mm"', 'bore = "150 mm"', "expected at least 0 and less than the diameter"),
    (
        LATHE,
        'length = "150 mm"                   # bar\ndiameter = "60 mm"',
        'length = "150 mm"\ndiameter = 60',
        "its section is 6e+04 mm",
    ),
    (LATHE, GUIDE, GUIDE + 'contact_angle = "88 deg"\n', "x_guide_4: it carries"),
    (LATHE, 'damping = "25 kN s/m"', 'damping = "25 MN s/m"', "z_guide_4: at 100 Hz its damping"),
    (
        LATHE,
        'name = "x"\ndirection = [1, 0, 0]',
        'name = "x"\ndirection = [0, 1, 0]',
        "axis x: it moves post along (0, 1, 0), where x_guide_1 holds",
    ),
    (
        LATHE,
        'axes = [[1, 0, 0], [0, 1, 0]]\npreload = "1100 N"',
        'axes = [[0, 0, 1], [0, 1, 0]]\npreload = "1100 N"',
        "x_screw: it drives along (1, 0, 0), where x_guide_1 holds",
    ),
    (LATHE, "axes = [[1, 0, 0]]", "axes = [[0, 0, 1]]", "x_screw: it drives along (0, 0, 1)"),
    (LATHE, AXIS, AGAIN, "x_screw and again: they hold the same parts at the same place"),
    (LATHE, AXIS, AGAIN.replace("14 kN", "15 kN"), "hold the same motion by the same joint"),
    (LATHE, AXIS, ACROSS, "other: it runs along (0, 0, 1) and x_guide_1"),
    (LATHE, AXIS, TWICE, "post and post_2: two parts of the same mass at the same place"),
    (LATHE, MOUNTS, BESIDE_RIGID, "shim: rigid connections hold its motion already"),
    (
        LATHE,
        'direction = [1, 0, 0], joint = "mount.joint.toml"',
        'direction = [1, 0, 0], joint = { law = [{ kind = "linear", stiffness = 300 }] }',
        "mount_1.x: its stiffness is 0.0003 N/um",
    ),
    (
        LATHE,
        'direction = [1, 0, 0], joint = "mount.joint.toml"',
        'direction = [1, 0, 0], joint = { law = [{ kind = "linear", stiffness = -3e8 }] }',
        "mount_1.x: its stiffness is -300 N/um, so it pushes",
    ),
    (LATHE, 'damping = "25 kN s/m"', 'damping = "25 N s/m"', "z_guide_4: at 100 Hz its damping"),
    (LATHE, "loss_factor = 0.02", "loss_factor = 2e-5", "less than of a bell"),
    (
        MILL,
        "tool.tip.x - workpiece.cut.x",
        "tool.tip.x - workpiece.cut.y",
        "[tool]: x is the difference of tool.tip.x and",
    ),
    (
        MILL,
        'x = "tool.tip.x - workpiece.cut.x"\ny = "tool.tip.y - workpiece.cut.y"',
        'x = "tool.tip.x"\ny = "tool.tip.y"',
        "and workpiece, which axis x moves, is left out: does it carry the workpiece? Then write tool.tip.x - "
        "workpiece.cut.x",
    ),
    (
        LATHE,
        "post.tip.x - spindle.cut.x",
        "post.tip.x",
        "[tool]: post.tip.x is taken against the ground, as if the workpiece stood still, and spindle, which turns in "
        "its bearings, is left out: does it carry the workpiece? Then write post.tip.x - spindle.cut.x",
    ),
    (
        MILL,
        "tool.tip.x - workpiece.cut.x",
        "tool.tip.x",
        "and x is tool.tip.x alone, as if the workpiece stood still in it; expected tool.tip.x - workpiece.cut.x",
    ),
    (
        MILL,
        'moves = ["carrier"]',
        'moves = ["column"]',
        "axis z: it moves column away from bed, to which foot holds rigidly; expected both in moves, or neither",
    ),
    (
        LATHE,
        'moves = ["slide"]',
        'moves = ["spindle"]',
        "axis z: it moves spindle away from bed, to which front holds, a",
    ),
    (MILL, 'damping = "1.5 kN s/m"\n', "", "rear_bearing: this bearing-pair has no damping, while front_bearing has"),
    (LATHE, 'damping = "25 kN s/m"\n', "", "z_guide: this linear-guide has no damping, while x_guide has some"),
    (TOOL, "damping_ratio = [0.039, 0.035]", "damping_ratio = [3.9e-6, 0.035]", "a damping_ratio of 3.9e-06"),
    (LATHE, 'preload = "1.5 kN"', 'preload = "1500 kN"', "front: its preload presses its rolling contacts"),
    (LATHE, 'preload = "1100 N"', 'preload = "1.1 N"', "x_guide_4: its preload presses its rolling contacts"),
    (MILL, 'drawbar = "9 kN"', 'drawbar = "9 MN"', "taper: its preload presses its faces together by"),
    (MILL, "at = [0, 0, 1.093]", "at = [0, 0, 1093]", "workpiece.cut: it lies at (0, 0, 1093) m, 1092 m from tool.tip"),
    (MILL, "at = [0, 0, 1.093]", "at = [0, 0.5, 1.093]", "workpiece.cut: it lies at (0, 0.5, 1.093) m, 0.5 m"),
    (LATHE, '"-9.80665 m/s^2"', "-9806.65", "[static]: gravity is 9807 m/s^2"),
    (
        LATHE,
        '"-9.80665 m/s^2"',
        '"9.80665 m/s^2"',
        "gravity acts along (0, 1, 0), and the centre of gravity lies 526 mm",
    ),
    (LATHE, '"-9.80665 m/s^2"', '"9.80665 km/s^2"', "gravity acts along (0, 1, 0), and the centre of gravity lies"),
    ("carriage", "gravity = true", "gravity = [0, 0, 9.81]", "lies 30 mm or more below all that joins the machine"),
    ("carriage", "gravity = true", "gravity = [0, 0, -9810]", "[static]: gravity is 9810 m/s^2"),
    (LATHE, 'specific = "2200 N/mm^2"', "specific = 2200e12", "[cutting]: specific is"),
    (LATHE, 'specific = "2200 N/mm^2"', "specific = 2200", "far below any material"),
    (LATHE, 'feed = "0.15 mm"', "feed = 0.15", "[cutting]: feed is 150 mm"),
    (TOOL, 'normal = "42 N/mm^2"', "normal = 0.07", "if it was meant as a ratio, write 4.2e+07"),
    (
        TOOL,
        'normal = "42 N/mm^2"',
        'normal = "-42 N/mm^2"',
        "[cutting]: normal is -42 N/mm^2, so the cut pulls the teeth into the work",
    ),
    (
        TOOL,
        'tangential = "600 N/mm^2"',
        'tangential = "-600 N/mm^2"',
        "[cutting]: tangential is -600000000.0, expected",
    ),
    (TOOL, 'diameter = "20 mm"', "diameter = 20", "[cutting]: diameter is 2e+04 mm"),
    (
        TOOL,
        "damping_ratio = [0.039, 0.035]",
        "damping_ratio = [3.9, 3.5]",
        "cutter: the mode at 603 Hz has a damping_ratio of 3.9",
    ),
    (
        TOOL,
        "damping_ratio = [0.039, 0.035]",
        "damping_ratio = [0.6, 0.035]",
        "cutter: the mode at 603 Hz has a damping_ratio of 0.6, that of a shock absorber",
    ),
    (
        LATHE,
        'length = "420 mm"\ndiameter = "100 mm"',
        'length = "420 mm"\ndiameter = "100 cm"',
        "spindle: segment 1 has a",
    ),
    (
        LATHE,
        "speed = [500, 4000]",
        'speed = [7, 67]\ndiameter = "50 mm"',
        "[cutting]: speeds of 7 to 67 rpm with a diameter of 50 mm cut at",
    ),
    (TOOL, "speed = [4000, 25000]", "speed = [4, 9]", "[cutting]: speeds of 4 to 9 rpm"),
    (
        MILL,
        "speed = [2000, 12000]",
        "speed = [50, 200]",
        "[cutting]: speeds of 50 to 200 rpm with a diameter of 16 mm cut at 2.51 to 10.1 m/min",
    ),
    (
        TOOL,
        'diameter = "20 mm"\nspeed = [4000, 25000]',
        'diameter = "63 mm"\nspeed = [20, 100]',
        "[cutting]: speeds of 20 to 100 rpm with a diameter of 63 mm cut at 3.96 to 19.8 m/min",
    ),
    (
        PAIR,
        'joint = "two_mass.joint.toml"',
        'joint = { law = [{ kind = "linear", stiffness = "90 N/um" }, { kind = "gap", stiffness = "60 N/um", clearance '
        '= "1 mm" }] }',
        "guide: its gap has a clearance of 1 mm",
    ),
    (TOOL, "frequency = [603, 666]", "frequency = [603e3, 666e3]", "cutter: the frequency of a mode is 6.03e+05 Hz"),
    (
        TOOL,
        "modal_mass = [0.38941927768610524, ",
        "modal_mass = [389e9, ",
        "cutter: the stiffness of its mode at 603 Hz",
    ),
    (
        PAIR,
        'joint = "two_mass.joint.toml"',
        'joint = { law = [{ kind = "linear", stiffness = "550 N/mm" }] }',
        "guide: its stiffness is 0.55 N/um",
    ),
    (PAIR, "mass = [[0.942]]", "mass = [[0.942e-9]]", "slide: the mass of x is"),
    (
        LATHE,
        'ball_diameter = "12.7 mm"',
        'ball_diameter = "1.27 mm"',
        "22 balls of 1.27 mm fill 8 % of a circle of 115 mm, expected 40 to 95 %",
    ),
]


def written(folder: Path, name: str, old: str, new: str) -> Path:
    """A shipped file with one edit, beside the files that it names."""
    for joint in LIBRARY.glob("*.joint.toml"):
        shutil.copy(joint, folder)
    text = ((ROOT / "docs" if name == MILL else LIBRARY) / f"{name}.toml").read_text("utf-8")
    assert old in text
    path = folder / "wrong.toml"
    path.write_text(text.replace(old, new, 1), "utf-8")
    return path


def without(folder: Path, bundle: str) -> Path:
    """The lathe without one of its bundles."""
    path = written(folder, LATHE, "schema", "schema")
    head, *tables = path.read_text("utf-8").split("\n[[bundle]]\n")
    last = tables[-1].partition("\n[[axis]]")
    kept = [t for t in [*tables[:-1], last[0]] if f'name = "{bundle}"' not in t]
    path.write_text("\n[[bundle]]\n".join([head, *kept]) + "\n[[axis]]" + last[2], "utf-8")
    return path


@pytest.mark.parametrize(("name", "old", "new", "words"), WRONG, ids=lambda value: None)
def test_one_wrong_value_is_named(name: str, old: str, new: str, words: str, tmp_path: Path) -> None:
    path = written(tmp_path, name, old, new)
    try:
        said = in_file(read_machine(path))
    except InputError as error:
        said = (str(error),)
    assert any(words in sentence for sentence in said), said
    assert len(said) <= 8


def test_there_are_more_than_forty_of_them() -> None:
    assert len({(old, new) for _, old, new, _ in WRONG}) >= 40


@pytest.mark.parametrize(
    ("bundle", "words"),
    [
        ("x_screw", "tool: nothing holds it in x against a constant force"),
        ("z_screw", "slide: nothing holds it along (0, 0, 1), it drifts freely"),
    ],
)
def test_a_slide_without_its_screw_is_named(bundle: str, words: str, tmp_path: Path) -> None:
    assert any(words in sentence for sentence in mistakes(read_machine(without(tmp_path, bundle))))


def test_a_mode_without_damping_is_named(tmp_path: Path) -> None:
    path = written(tmp_path, TOOL, "damping_ratio = [0.039, 0.035]", "damping_ratio = [0.0, 0.035]")
    (said,) = mistakes(read_machine(path))
    assert said.startswith(
        "the mode at 603 Hz that the tool feels is undamped, its damping ratio is 0: cutter dissipates"
    )


def test_a_load_that_nothing_carries_hides_no_mistake(tmp_path: Path) -> None:
    path = written(tmp_path, LATHE, '"-9.80665 m/s^2"', "-980665")
    done = CliRunner().invoke(cli, ["inspect", str(path)], catch_exceptions=False)
    assert done.exit_code == 0
    assert "looks wrong: [static]: gravity is 9.807e+05 m/s^2" in done.stdout
    assert "no equilibrium under the static load" in done.stdout


def test_gravity_of_the_wrong_sign_is_named_in_a_machine_of_a_hundred_contacts(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "bed_mill.toml").read_text("utf-8").replace("gravity = true", "gravity = [0, 0, 9.81]")
    path = tmp_path / "hanging.toml"
    path.write_text(text, "utf-8")
    (said,) = in_file(read_machine(path))
    assert said.startswith("[static]: gravity acts along (0, 0, 1), and the centre of gravity lies 676 mm")


@pytest.mark.parametrize(
    "path", [*SHIPPED, pytest.param(ROOT / "docs" / "bed_mill.toml", marks=pytest.mark.thorough)], ids=lambda p: p.stem
)
def test_nothing_is_said_of_machines_that_are_right(path: Path) -> None:
    machine: Machine = read_machine(path)
    for connection in machine.flexible:
        if connection.identify is not None:
            assert connection.identify.start is not None
            machine = machine.with_joint(connection.name, read_joint(connection.identify.start))
    assert mistakes(machine) == ()


def test_a_workpiece_that_an_axis_has_moved_away_is_no_mistake(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "bed_mill.toml").read_text("utf-8")
    path = tmp_path / "moved.toml"
    path.write_text(text.replace('name = "x"\ndirection', 'name = "x"\nposition = "390 mm"\ndirection', 1), "utf-8")
    machine = read_machine(path)
    assert machine.axes[0].position == pytest.approx(0.39)
    assert in_file(machine) == ()


def test_a_tool_that_is_tapped_and_does_not_cut_may_be_against_the_ground(tmp_path: Path) -> None:
    path = written(tmp_path, LATHE, "post.tip.x - spindle.cut.x", "post.tip.x")
    path.write_text(path.read_text("utf-8").partition("\n[cutting]")[0], "utf-8")
    assert in_file(read_machine(path)) == ()


@pytest.mark.parametrize(
    ("table", "stands"),
    [
        ('[tool]\nname = "VHM 16"', "[tool]"),
        ("[tool.long]", "[tool.long]"),
        ('[[tools]]\nname = "long"', "[[tools]] 1 (long)"),
    ],
)
def test_directions_that_are_mixed_up_are_named_in_the_table_that_tells_them(
    table: str, stands: str, tmp_path: Path
) -> None:
    path = written(tmp_path, MILL, "tool.tip.x - workpiece.cut.x", "tool.tip.x - workpiece.cut.y")
    path.write_text(path.read_text("utf-8").replace("\n[tool]\n", f"\n{table}\n"), "utf-8")
    (said,) = in_file(read_machine(path))
    assert said.startswith(f"{stands}: x is the difference of")


def test_what_drives_an_axis_rigidly_is_no_mistake(tmp_path: Path) -> None:
    drive = (
        '{ name = "drive", between = ["post", "slide"], at = [0.22, 0.84, 0.25], direction = [1, 0, 0], rigid = true },'
    )
    path = without(tmp_path, "x_screw")
    path.write_text(path.read_text("utf-8").replace(MOUNTS, f"{MOUNTS}\n    {drive}"), "utf-8")
    assert in_file(read_machine(path)) == ()


def with_a_wire(path: Path) -> Path:
    """The same machine with a workpiece of 0.3 mm instead of 30 mm, held by springs at the end of the spindle."""
    held = "".join(
        f'    {{ name = "jaw.{way}", between = ["work.jaw.{way}", "spindle.cut.{way}"], joint = {{ law = [{{ '
        f'kind = "linear", stiffness = {k} }}, {{ kind = "viscous", damping = {c} }}] }} }},\n'
        for way, k, c in (*((w, 2e8, 1500.0) for w in "xyz"), *((w, 2.5e5, 1.5) for w in ("rx", "ry", "rz")))
    )
    work = """[[component]]
name = "work"
kind = "beam"
start = [0, 1, 0.21]
axis = [0, 0, 1]
up_to = "5 kHz"
material = [{ name = "C45", young = "208 GPa", poisson = 0.29, density = "7830 kg/m^3", loss_factor = 0.003 }]
segment = [{ length = "430 mm", diameter = "0.3 mm" }]
station = [{ name = "jaw", at = "15 mm" }, { name = "cut", at = "250 mm" }, { name = "end", at = "end" }]

"""
    text = path.read_text("utf-8")
    text = text.replace(MOUNTS, f"{MOUNTS}\n{held}").replace("[[axis]]", f"{work}[[axis]]", 1)
    path.write_text(text, "utf-8")
    return path


@pytest.mark.thorough
def test_a_part_far_too_thin_sets_nothing_else_adrift(tmp_path: Path) -> None:
    path = with_a_wire(written(tmp_path, LATHE, "schema", "schema"))
    said = mistakes(read_machine(path))
    assert any("slender beyond reason" in sentence for sentence in said)
    assert not [sentence for sentence in said if "nothing holds it" in sentence]


@pytest.mark.thorough
def test_what_drifts_beside_a_part_far_too_thin_is_named_alone(tmp_path: Path) -> None:
    said = mistakes(read_machine(with_a_wire(without(tmp_path, "z_screw"))))
    loose = [sentence.partition(", it")[0] for sentence in said if "nothing holds it" in sentence]
    assert loose == [f"{part}: nothing holds it along (0, 0, 1)" for part in ("slide", "post")]
