"""Machine files: what they say is what is built, and what is wrong in them is said in one sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_machine_coupling import lumped

import machines
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from machines import Connection, Identify, Lumped, Machine, Modal, Rigid, read_machine, response

LIBRARY = Path(machines.__file__).parent / "library"

GOOD = """
schema = "jointlib/machine/1"
name = "test"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [["942 g"]]
[[component]]
name = "base"
kind = "lumped"
dofs = ["x"]
mass = [[2.2]]
damping = [[200.0]]
stiffness = [["200 N/um"]]
[[component]]
name = "cutter"
kind = "modal"
dofs = ["x", "y"]
frequency = ["922 Hz", 1000]
damping_ratio = [0.011, 0.011]
modal_mass = [0.04, 0.04]
shapes = [[1.0, 0.0], [0.0, 1.0]]
[[component]]
name = "body"
kind = "rigid"
mass = 3.0
inertia = [[1e-3, 0.0, 0.0], [0.0, 2e-3, 0.0], [0.0, 0.0, 3e-3]]
centre = ["10 mm", 0.0, 0.0]
[[connection]]
name = "guide"
between = ["slide.x", "base.x"]
joint = { law = [ { kind = "linear", stiffness = "600 N/um" }, { kind = "viscous", damping = 500 } ] }
[[connection]]
name = "clamp"
between = ["cutter.x", "slide.x"]
rigid = true
[[connection]]
name = "mount"
between = ["body", "ground"]
at = [0.0, "20 mm", 0.0]
direction = [0, 0, 2]
joint = { law = [ { kind = "linear", stiffness = 1e8 } ] }
[tool]
x = "cutter.x"
y = "cutter.y"
[response]
force = ["10 N", 50]
frequency = ["0.2 kHz", 7000]
[cutting]
process = "milling"
teeth = 2
tangential = "600 N/mm^2"
normal = 2e8
mode = "down"
immersion = 0.5
feed = "0.1 mm"
speed = ["4000 rpm", 25000]
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "m.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_file_is_read_in_si(tmp_path: Path) -> None:
    machine = read_machine(write(tmp_path, GOOD))
    slide, base, cutter, body = machine.components
    assert isinstance(slide, Lumped)
    assert slide.mass[0, 0] == pytest.approx(0.942)
    assert isinstance(base, Lumped)
    assert base.stiffness is not None
    assert base.stiffness[0, 0] == pytest.approx(2e8)
    assert isinstance(cutter, Modal)
    assert cutter.frequency.tolist() == [922.0, 1000.0]
    assert isinstance(body, Rigid)
    assert machine.connections[1].rigid
    # The centre lies at 10 mm along x and the spring at 20 mm along y: ρ = (−10, 20, 0) mm, ρ × z = (20, 10, 0) mm.
    assert machine.rows([machine.connections[2]])[0, -6:] == pytest.approx([0, 0, 1, 0.02, 0.01, 0])
    assert machine.force == (10.0, 50.0)
    assert machine.frequency == (200.0, 7000.0)
    assert machine.cutting is not None
    assert machine.cutting["tangential"] == pytest.approx(6e8)
    assert machine.cutting["speed"] == (4000.0, 25000.0)
    assert machine.driven_dof() == "cutter.x"
    assert all(np.isfinite(f.receptance).all() for f in response(machine).frfs)


BAD = [
    ('kind = "modal"', 'kind = "modall"', "did you mean 'modal'"),
    ('mass = [["942 g"]]', 'mass = [["942 N/mm"]]', "mass.*N/mm.*kg"),
    ('mass = [["942 g"]]', "mass = [[0.0]]", "mass is singular"),
    ('mass = [["942 g"]]', "mass = [[nan]]", "finite"),
    ('mass = [["942 g"]]', "mas = [[1.0]]", "'mass' is missing"),
    ('mass = [["942 g"]]', "mass = [[1.0, 0.0], [0.0, 1.0]]", "mass has shape"),
    ("damping = [[200.0]]", "damping = [[-200.0]]", "negative eigenvalue"),
    ("damping = [[200.0]]", "dampin = [[200.0]]", "unknown key 'dampin', did you mean 'damping'"),
    ('dofs = ["x", "y"]', 'dofs = ["x", "x"]', "named twice"),
    ("modal_mass = [0.04, 0.04]", "modal_mass = [0.04]", "one per mode"),
    ("shapes = [[1.0, 0.0], [0.0, 1.0]]", "shapes = [[1.0, 0.0]]", "shapes has shape"),
    ("mass = 3.0", 'mass = "-3 kg"', "expected more than 0"),
    ("inertia = [[1e-3, 0.0, 0.0]", "inertia = [[1e-3, 1e-4, 0.0]", "symmetric"),
    ('name = "base"', 'name = "slide"', "'slide' is declared twice"),
    ('name = "clamp"', 'name = "guide"', "'guide' is declared twice"),
    ('"slide.x", "base.x"', '"slide.x", "bse.x"', "no degree of freedom 'bse.x', did you mean 'base.x'"),
    ('"slide.x", "base.x"', '"slide.x", "slide.x"', "both sides"),
    ('"slide.x", "base.x"', '"slide.x"', "expected two"),
    ('"slide.x", "base.x"', '"slide.x", "base"', "needs a dof"),
    ('"body", "ground"', '"slide", "ground"', "no shape in space"),
    ('"body", "ground"', '"boddy", "ground"', "did you mean 'body'"),
    ("direction = [0, 0, 2]", "direction = [0, 0, 0]", "not zero"),
    ("direction = [0, 0, 2]", "", "at and direction together"),
    ("rigid = true", "", "neither a joint"),
    ("rigid = true", 'rigid = true\njoint = { law = [ { kind = "linear", stiffness = 1 } ] }', "both a joint"),
    ("rigid = true", 'rigid = "yes"', "true or false"),
    ("rigid = true", 'joint = "lost.joint.toml"', "lost.joint.toml, which does not exist"),
    ("rigid = true", "joint = 3", "a file name or a table"),
    ("rigid = true", "identify = { from = [] }", "at least one measurement"),
    ('kind = "linear", stiffness = 1e8', 'kind = "linar", stiffness = 1e8', "did you mean 'linear'"),
    ('frequency = ["0.2 kHz", 7000]', "frequency = [7000, 200]", "runs from 7000 to 200 Hz"),
    ('frequency = ["0.2 kHz", 7000]', 'frequency = ["1 mm", 7000]', "mm"),
    ('force = ["10 N", 50]', "force = [0.0]", "more than 0"),
    ('force = ["10 N", 50]', 'drive = "slide.y"', "did you mean 'slide.x'"),
    ('x = "cutter.x"', 'x = "cuter.x"', "did you mean 'cutter.x'"),
    ('x = "cutter.x"', 'z = "cutter.x"', "unknown key 'z'"),
    ("teeth = 2", "tooth = 2", "did you mean 'teeth'"),
    ("teeth = 2", "", "'teeth', which is missing"),
    ("immersion = 0.5", "immersion = 1.5", "at most 1"),
    ('process = "milling"', 'process = "miling"', "did you mean 'milling'"),
    ("[tool]", "[tol]", "unknown key 'tol', did you mean 'tool'"),
    ('schema = "jointlib/machine/1"', 'schema = "jointlib/machin/1"', "schema"),
]


@pytest.mark.parametrize(("old", "new", "words"), BAD)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    path = write(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=words) as caught:
        read_machine(path)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert text.count(str(path)) == 1
    assert "\n" not in text


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_machine(tmp_path / "nothing.toml")


def test_joint_that_is_still_to_be_identified_is_asked_for(tmp_path: Path) -> None:
    text = GOOD.replace("rigid = true", 'identify = { from = ["a.measurement.toml"], start = "s.joint.toml" }')
    machine = read_machine(write(tmp_path, text))
    found = machine.connections[1].identify
    assert found == Identify((tmp_path / "a.measurement.toml",), tmp_path / "s.joint.toml")
    with pytest.raises(InputError, match=r"'clamp' has no joint yet.*with_joint\('clamp', joint\)"):
        response(machine)
    joint = read_joint(LIBRARY / "two_mass.joint.toml")
    assert machine.with_joint("clamp", joint).joints()[1] is joint
    with pytest.raises(InputError, match="did you mean 'clamp'"):
        machine.with_joint("clmp", joint)


def test_rigid_connections_that_repeat_each_other_are_refused() -> None:
    parts = tuple(lumped(n, [[1.0]]) for n in "abc")
    ring = [("a.x", "b.x"), ("b.x", "c.x"), ("c.x", "a.x")]
    with pytest.raises(InputError, match="'w2' is rigid but repeats"):
        Machine(parts, tuple(Connection(f"w{i}", sides, rigid=True) for i, sides in enumerate(ring)))


def test_machine_needs_a_force_and_a_drive() -> None:
    bare = Machine((lumped("a", [[1.0]], None, [[1e6]]),))
    for arguments, words in [
        ((), "no drive"),
        ((None, (1, 2), "a.x"), "no force"),
    ]:
        with pytest.raises(InputError, match=words):
            response(bare, *arguments)  # type: ignore[arg-type]
