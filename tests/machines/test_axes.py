"""Axes: a machine whose slides stand elsewhere is the machine drawn there, and gives way as its levers say."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from click.testing import CliRunner

from jointlib.errors import InputError
from machines import Beam, Machine, Rigid, frozen_receptance, read_machine, static_point
from machines.mistakes.axes import torn_apart
from machines.model.masses import part_masses
from machines.verbs.inspect import command as inspect

LIBRARY = Path("machines/library")
LINES = [0.5, 60.0, 400.0]

TABLE = """
schema = "jointlib/machine/1"

[[component]]
name = "table"
kind = "rigid"
mass = "200 kg"
inertia = [5, 12, 15]
centre = [0.0, 0.0, 0.1]
[[component.point]]
name = "cut"
at = [0.0, 0.0, "200 mm"]

[[component]]
name = "tip"
kind = "lumped"
dofs = ["x", "z"]
mass = [["1 kg", 0], [0, "1 kg"]]
stiffness = [["1 GN/m", 0], [0, "1 GN/m"]]

[[axis]]
name = "x"
direction = [2, 0, 0]
moves = ["table"]
travel = ["-300 mm", "300 mm"]

[tool]
x = "tip.x - table.cut.x"
y = "tip.z - table.cut.z"

[response]
drive = "tip.z - table.cut.z"
frequency = ["1 Hz", "500 Hz"]
"""


def springs(at: list[tuple[float, float]], k: float = 5e7) -> str:
    """A foot at each place (x, y): upright springs, and along x and y, on guides that the table carries."""
    return "".join(
        f'[[connection]]\nname = "foot_{i}.{axis}"\nbetween = ["table", "ground"]\nat = [{x}, {y}, 0.0]\n'
        f'direction = {direction}\njoint = {{ law = [{{ kind = "linear", stiffness = {k} }}] }}\n'
        for i, (x, y) in enumerate(at)
        for axis, direction in (("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1]))
    )


def written(folder: Path, text: str, name: str = "m.toml") -> Path:
    (folder / name).write_text(text)
    return folder / name


def receptance(machine: Machine) -> np.ndarray:
    return frozen_receptance(machine, LINES, 0.0).receptance


@pytest.mark.parametrize("d", [0.0, 0.12, -0.3])
def test_a_table_on_four_springs_gives_way_by_its_lever(tmp_path: Path, d: float) -> None:
    """1/Σk + d²/kθ with kθ = Σk·b², in z; the cut stands still, the carriages travel with the table."""
    file = written(tmp_path, TABLE + springs([(0.25, 0.2), (-0.25, 0.2), (0.25, -0.2), (-0.25, -0.2)]))
    machine = read_machine(file, {"axis.x.position": d})
    H = frozen_receptance(machine, 1e-3, 0.0).receptance[0]
    expected = 1 / 2e8 + d**2 / (2e8 * 0.25**2) + 1 / 1e9
    assert H[1, 1].real == pytest.approx(expected, rel=1e-6)


def test_symmetric_positions_of_a_symmetric_machine_are_mirror_images(tmp_path: Path) -> None:
    file = written(tmp_path, TABLE + springs([(0.25, 0.2), (-0.25, 0.2), (0.25, -0.2), (-0.25, -0.2)]))
    left, right = (receptance(read_machine(file, {"axis.x.position": d})) for d in ("-170 mm", "170 mm"))
    mirror = np.diag([-1.0, 1.0])
    assert mirror @ left @ mirror == pytest.approx(right, rel=1e-9, abs=1e-18)
    assert abs(left[0, 0, 1]) > 1e-3 * abs(left[0, 0, 0])


@pytest.mark.thorough
def test_a_column_mill_is_its_mirror_image_left_and_right() -> None:
    """It is symmetric but for the place of its nut; with that in the middle, so is what it does at ± 220 mm."""
    left, right = (
        receptance(
            read_machine(LIBRARY / "column_mill_a.toml", {"bundle.x_screw.position": 0.45, "axis.x.position": x})
        )
        for x in (-0.22, 0.22)
    )
    mirror = np.diag([-1.0, 1.0])
    assert mirror @ left @ mirror == pytest.approx(right, rel=1e-7, abs=1e-7 * np.max(np.abs(right)))


def redrawn(path: Path, folder: Path, shift: dict[str, Any], **keys: Any) -> Machine:
    """A column mill with its file and its parts written by hand at another place: shift by component or bundle."""
    text = path.read_text().replace("column_mill/", "")
    parts = (path.parent / "column_mill" / "modules.toml").read_text().replace("../", "")
    (folder / "mount.joint.toml").write_text((path.parent / "mount.joint.toml").read_text())
    for name, source in (("m.toml", text), ("modules.toml", parts)):
        tables = tomllib.loads(source)
        for kind in ("component", "bundle", "connection"):
            for table in tables.get(kind, []):
                by = shift.get(table["name"].partition(".")[0])
                if by is not None:
                    for key in ("at", "centre", "start"):
                        if key in table:
                            table[key] = (np.array(table[key]) + by).tolist()
                table |= keys.get(table["name"], {})
                for point in table.get("point", []):
                    point["at"] = (np.array(point["at"]) + shift.get(f"{table['name']}.{point['name']}", 0)).tolist()
        (folder / name).write_text(tomli_w.dumps(tables))
    return read_machine(folder / "m.toml")


X, Y, Z = np.eye(3)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("word", "position", "shift", "keys"),
    [
        ("a", {"x": "180 mm"}, {"table": 0.18 * X, "x_guide": 0.18 * X}, {"x_screw": {"position": 0.58}}),
        (
            "a",
            {"y": -0.2},
            dict.fromkeys(("saddle", "table", "x_guide", "x_screw", "y_guide"), -0.2 * Y),
            {"y_screw": {"position": 0.1}},
        ),
        (
            "b",
            {"y": 0.1, "z": 0.25},
            dict.fromkeys(("saddle", "column", "foot", "y_guide"), 0.1 * Y)
            | dict.fromkeys(("head", "spindle", "cutter", "front", "rear", "taper", "z_guide"), 0.1 * Y + 0.25 * Z)
            | {"z_screw": 0.1 * Y, "table.cut": 0.1 * Y + 0.25 * Z},
            {
                "y_screw": {"position": 0.4},
                "z_screw": {"position": 0.1},
                "column": {
                    "station": [
                        {"name": "foot", "at": 0.0},
                        {"name": "low", "at": 0.71},
                        {"name": "bearing", "at": 0.86},
                        {"name": "high", "at": 1.11},
                    ]
                },
            },
        ),
    ],
)
def test_a_moved_axis_is_the_machine_drawn_there(
    tmp_path: Path, word: str, position: dict[str, Any], shift: dict[str, Any], keys: dict[str, Any]
) -> None:
    path = LIBRARY / f"column_mill_{word}.toml"
    moved = read_machine(path, {f"axis.{axis}.position": at for axis, at in position.items()})
    by_hand = redrawn(path, tmp_path, shift, **keys)
    assert receptance(moved) == pytest.approx(receptance(by_hand), rel=1e-9)
    assert static_point(moved).displacement == pytest.approx(static_point(by_hand).displacement, rel=1e-6, abs=1e-13)


@pytest.mark.thorough
def test_a_lathe_cuts_the_bar_where_its_tool_stands() -> None:
    """The bar gives way less beside the chuck; the station of the cut follows the tool, post and slide carry it."""
    path, d = LIBRARY / "lathe.toml", -0.11
    moved = read_machine(path, {"axis.z.position": d})
    beam = next(c for c in moved.components if isinstance(c, Beam))
    assert beam.stations == {"rear": 0.1, "front": 0.4, "cut": pytest.approx(0.71 + d)}
    by_hand = read_machine(
        path,
        {
            "component.spindle.station[2].at": 0.71 + d,
            "component.slide.centre[2]": 0.25 + d,
            "component.post.centre[2]": 0.25 + d,
            "component.post.point[0].at[2]": 0.21 + d,
            "bundle.z_screw.position": 0.5 + d,
            "bundle.x_screw.at[2]": 0.25 + d,
            **{f"bundle.z_guide.at[{i}][2]": z + d for i, z in enumerate((0.1, 0.1, 0.4, 0.4))},
            **{f"bundle.x_guide.at[{i}][2]": z + d for i, z in enumerate((0.15, 0.35, 0.15, 0.35))},
        },
    )
    assert receptance(moved) == pytest.approx(receptance(by_hand), rel=1e-9)
    assert abs(receptance(moved)[0, 0, 0]) < 0.9 * abs(receptance(read_machine(path))[0, 0, 0])


@pytest.mark.thorough
def test_at_zero_nothing_is_touched(tmp_path: Path) -> None:
    """A file with its axes at 0 has the receptance of the file without them, to the last bit."""
    for word in "ab":
        path = LIBRARY / f"column_mill_{word}.toml"
        text = path.read_text()
        bare = text[: text.index("[[axis]]")] + text[text.index("[static]") :]
        (tmp_path / "column_mill").mkdir(exist_ok=True)
        parts = (LIBRARY / "column_mill/modules.toml").read_text()
        (tmp_path / "column_mill/modules.toml").write_text(parts[: parts.index("[[axis]]")])
        (tmp_path / "mount.joint.toml").write_text((LIBRARY / "mount.joint.toml").read_text())
        plain = read_machine(written(tmp_path, bare))
        machine = read_machine(path, {"axis.x.position": 0, "axis.z.position": "0 mm"})
        assert not plain.axes
        assert np.array_equal(receptance(machine), receptance(plain))


def test_what_rides_on_a_slide_travels_with_it() -> None:
    moves = {w: {a.name: a.moves for a in read_machine(LIBRARY / f"column_mill_{w}.toml").axes} for w in "ab"}
    assert moves["a"] == {"x": ("table",), "y": ("saddle", "table"), "z": ("head", "spindle", "cutter")}
    assert set(moves["b"]["y"]) == {"saddle", "column", "head", "spindle", "cutter"}


SPRING = 'joint = { law = [{ kind = "linear", stiffness = 1e8 }] }'


def test_a_tool_of_a_file_rides_on_what_its_spindle_rides_on(tmp_path: Path) -> None:
    """With everything on the slide a position moves the whole: the same masses further on, the same receptance."""
    sizes = 'schema = "jointlib/tool/1"\ndiameter = "12 mm"\nflute_length = "30 mm"\nstick_out = "60 mm"\n'
    (tmp_path / "a.tool.toml").write_text(f'{sizes}[[section]]\nlength = "40 mm"\ndiameter = "32 mm"\n')
    text = "".join(
        f'[[component]]\nname = "{n}"\nkind = "rigid"\nmass = 50\ninertia = [1, 1, 1]\ncentre = [0, 0, {z}]\n'
        for n, z in (("slide", 0.5), ("spindle", 0.15))
    )
    for word in ("x", "y", "z"):
        direction = [int(word == w) for w in "xyz"]
        for at in ([0.1, 0.1, 0.5], [-0.1, 0.1, 0.6], [0.1, -0.1, 0.6]):
            more = f"at = {at}\ndirection = {direction}\n"
            text += held(f"{word}_{at[0]}_{at[1]}".replace(".", ""), ["slide", "ground"], more, SPRING)
    text += '[[connection]]\nname = "flange"\nbetween = ["spindle", "slide"]\nat = [0, 0, 0.3]\nrigid = true\n'
    text += '[[axis]]\nname = "x"\ndirection = [1, 0, 0]\nmoves = ["slide"]\n[tool]\nfile = "a.tool.toml"\n'
    path = written(tmp_path, 'schema = "jointlib/machine/1"\n' + text)
    here, there = read_machine(path), read_machine(path, {"axis.x.position": 0.2})
    assert set(there.axes[0].moves) == {"slide", "spindle", "cutter"}
    centres = [np.array([p.centre for p in part_masses(m)]) for m in (here, there)]
    np.testing.assert_allclose(centres[1] - centres[0], np.tile([0.2, 0.0, 0.0], (3, 1)), atol=1e-12)


RAIL = """
schema = "jointlib/machine/1"

[[component]]
name = "rail"
kind = "beam"
axis = [1, 0, 0]
tolerance = "100 mm"
[[component.material]]
name = "steel"
young = "210 GPa"
poisson = 0.3
density = "7850 kg/m^3"
[[component.segment]]
length = "1 m"
diameter = "60 mm"
[[component.station]]
name = "root"
at = 0.0
[[component.station]]
name = "here"
at = "400 mm"

[[component]]
name = "slide"
kind = "rigid"
mass = "3 kg"
inertia = [0.01, 0.01, 0.01]
centre = [0.4, 0.0, 0.05]

[[axis]]
name = "x"
direction = [1, 0, 0]
moves = ["slide"]

[tool]
x = "slide.uz"

[response]
frequency = ["1 Hz", "2 kHz"]
"""


def held(name: str, between: list[str], at: str = "", joint: str = "rigid = true") -> str:
    return f'[[connection]]\nname = "{name}"\nbetween = {between}\n{at}{joint}\n'.replace("'", '"')


def rail(folder: Path, guide: str = "") -> Path:
    root = "".join(held(f"root.{d}", [f"rail.root.{d}", "ground"]) for d in ("x", "y", "z", "rx", "ry", "rz"))
    stiff = 'joint = { law = [{ kind = "linear", stiffness = 1e12 }] }'
    for i, (dy, direction) in enumerate(((0.0, [0, 0, 1]), (0.0, [0, 1, 0]), (0.0, [1, 0, 0]))):
        root += held(f"c{i}", ["slide", "rail"], f"at = [0.4, {dy}, 0.05]\ndirection = {direction}\n", stiff)
    return written(folder, RAIL + guide + root)


@pytest.mark.parametrize("d", [-0.3, 0.0, 0.25, 0.6])
def test_a_carriage_further_out_on_a_cantilever_is_softer_as_its_length_cubed(tmp_path: Path, d: float) -> None:
    """The station of the rail follows the carriage: l³/3EI + l/κGA at the place where it stands."""
    machine = read_machine(rail(tmp_path), {"axis.x.position": d})
    beam = next(c for c in machine.components if isinstance(c, Beam))
    assert beam.stations["here"] == pytest.approx(0.4 + d)
    kappa = 6 * 1.3 / (7 + 6 * 0.3)
    area, inertia, l = np.pi * 0.06**2 / 4, np.pi * 0.06**4 / 64, 0.4 + d
    expected = l**3 / (3 * 210e9 * inertia) + l / (kappa * 210e9 / 2.6 * area) + 1e-12
    assert frozen_receptance(machine, 1e-2, 0.0).receptance[0, 0, 0].real == pytest.approx(expected, rel=1e-5)


def test_a_station_that_something_else_holds_stays_and_another_follows(tmp_path: Path) -> None:
    stop = held("stop", ["rail.here.z", "ground"], "", 'joint = { law = [{ kind = "linear", stiffness = 1e6 }] }')
    for d, names in ((0.2, ["root", "here", "here_2"]), (1e-5, ["root", "here"])):
        machine = read_machine(rail(tmp_path, stop), {"axis.x.position": d})
        beam = next(c for c in machine.components if isinstance(c, Beam))
        assert list(beam.stations) == names
        assert beam.stations["here"] == 0.4
        assert beam.stations[names[-1]] == pytest.approx(0.4 + d, abs=2e-5)


def test_weight_follows_the_axis(tmp_path: Path) -> None:
    """Feet under a table that has travelled 0.3 m by carriages that stay on the base share its weight by levers."""
    base = '[[component]]\nname = "base"\nkind = "rigid"\nmass = "10 kg"\ninertia = [1, 1, 1]\n'
    fixed = "".join(held(f"base.{d}", [f"base.{d}", "ground"]) for d in ("ux", "uy", "uz", "rx", "ry", "rz"))
    feet = springs([(0.25, 0.2), (-0.25, 0.2), (0.25, -0.2), (-0.25, -0.2)]).replace(
        '["table", "ground"]', '["base", "table"]'
    )
    file = written(tmp_path, TABLE + base + fixed + feet + "[static]\ngravity = true\n")
    d = 0.2
    point = static_point(read_machine(file, {"axis.x.position": d}))
    total = 200 * 9.80665
    for i, side in ((0, 1), (1, -1)):
        assert abs(point.of(f"foot_{i}.z")[1]) == pytest.approx(total / 4 * (1 + side * d / 0.25), rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("direction = [2, 0, 0]", "direction = [0, 0, 0]", "direction is [0.0, 0.0, 0.0], expected a vector"),
        ('moves = ["table"]', 'moves = ["tabel"]', "moves 'tabel', which is no component, did you mean 'table'?"),
        ('moves = ["table"]', "moves = []", "moves is empty"),
        ('["-300 mm", "300 mm"]', '["300 mm", "-300 mm"]', "travel is [0.3, -0.3], expected [low, high]"),
        (
            'travel = ["-300 mm", "300 mm"]',
            'travel = ["-300 mm", "300 mm"]\nposition = "0.4 m"',
            "[[axis]] 1 (x): position is 400 mm, expected -300 to 300 mm, its travel",
        ),
        ("moves = ", "mvoes = ", "key 'moves' is missing, did you mean it by 'mvoes'?"),
        (
            '[[axis]]\nname = "x"',
            '[[axis]]\nname = "x"\ndirection = [1, 0, 0]\nmoves = ["table"]\n[[axis]]\nname = "x"',
            "twice",
        ),
    ],
)
def test_axes_without_sense_are_refused_in_a_sentence(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = TABLE + springs([(0.25, 0.2), (-0.25, 0.2), (0.0, -0.2)])
    assert old in text
    with pytest.raises(InputError, match=re.escape(said)):
        read_machine(written(tmp_path, text.replace(old, new)))


def test_paths_to_axes_are_checked(tmp_path: Path) -> None:
    for changes, said in (
        ({"axis.u.position": 0.1}, "path 'axis.u.position': no axis 'u', expected one of x, y, z"),
        ({"axis.x.position": "0.5 m"}, "position is 500 mm, expected -300 to 300 mm"),
    ):
        with pytest.raises(InputError, match=re.escape(said)):
            read_machine(LIBRARY / "column_mill_a.toml", changes)
    with pytest.raises(InputError, match="no axis 'x', there is none"):
        read_machine(LIBRARY / "two_mass.toml", {"axis.x.position": 0.1})


def test_an_element_that_does_not_slide_is_not_torn_apart(tmp_path: Path) -> None:
    text = (LIBRARY / "column_mill_a.toml").read_text().replace('moves = ["table"]', 'moves = ["cutter"]')
    text = text.replace("column_mill/", f"{LIBRARY.resolve()}/column_mill/")
    with pytest.raises(
        InputError, match=r"\(taper\): an axis moves 'cutter' against 'spindle', which a taper does not"
    ):
        read_machine(written(tmp_path, text), {"axis.x.position": 0.1})
    text = text.replace('moves = ["cutter"]', 'moves = ["saddle"]')
    with pytest.raises(InputError, match=r"\(y_guide\): its axis is \(0, 1, 0\), but an axis of the machine moves"):
        read_machine(written(tmp_path, text), {"axis.x.position": 0.1})


def test_a_hanging_machine_moves_what_is_named(tmp_path: Path) -> None:
    """Nothing stands on the ground, so nothing can be said to ride on the slide but what the file says."""
    text = "".join(
        f'[[component]]\nname = "{n}"\nkind = "rigid"\nmass = 1\ninertia = [1, 1, 1]\n' for n in ("a", "b", "c")
    )
    text += '[[axis]]\nname = "x"\ndirection = [1, 0, 0]\nmoves = ["b"]\nposition = 0.1\n'
    for first, second in (("a", "b"), ("b", "c")):
        text += held(first + second, [first, second], "at = [0, 0, 0]\ndirection = [0, 0, 1]\n")
    machine = read_machine(written(tmp_path, 'schema = "jointlib/machine/1"\n' + text))
    assert machine.axes[0].moves == ("b",)
    centres = [c.centre.tolist() for c in machine.components if isinstance(c, Rigid) and c.centre is not None]
    assert centres == [[0, 0, 0], [0.1, 0, 0], [0, 0, 0]]


@pytest.mark.thorough
def test_inspect_tells_where_the_axes_stand() -> None:
    said = CliRunner().invoke(inspect, [str(LIBRARY / "column_mill_a.toml")]).output.splitlines()
    assert "axis y: moves saddle, table along (0, 1, 0), at 0 mm of -225 to 225 mm" in said


def test_what_does_not_ride_because_something_known_by_matrices_hangs_on_it_is_told_with_that(tmp_path: Path) -> None:
    text = 'schema = "jointlib/machine/1"\n' + "".join(
        f'[[component]]\nname = "{n}"\nkind = "rigid"\nmass = 20\ninertia = [1, 1, 1]\n' for n in ("slide", "turret")
    )
    text += '[[component]]\nname = "live"\nkind = "lumped"\ndofs = ["z"]\nmass = [[2]]\n'
    text += held("way", ["slide", "ground"], "at = [0, 0, 0]\ndirection = [0, 0, 1]\n")
    text += held("foot", ["live.z", "turret.uz"])
    text += '[[bundle]]\nname = "face"\nkind = "bolted-face"\nbetween = ["turret", "slide"]\n'
    text += "axes = [[0, 0, 1], [1, 0, 0]]\n"
    text += 'length = 0.2\nwidth = 0.2\nbolts = 4\nbolt_force = "20 kN"\nnormal_stiffness = 1e12\ndamping = 1e4\n'
    text += '[[axis]]\nname = "x"\ndirection = [1, 0, 0]\nmoves = ["slide"]\n'
    (said,) = torn_apart(read_machine(written(tmp_path, text)))
    assert said.endswith("expected both in moves, or neither; live, of kind lumped, is not known to ride on turret")
    held_elsewhere = text + held("stay", ["turret", "ground"], "at = [0, 0, 0]\ndirection = [0, 0, 1]\n")
    (said,) = torn_apart(read_machine(written(tmp_path, held_elsewhere)))
    assert said.endswith("expected both in moves, or neither")
