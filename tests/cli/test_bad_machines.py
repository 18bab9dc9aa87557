"""Machines that cannot be: one sentence that says where, what was found and what was expected; exit status 2."""

from __future__ import annotations

import contextlib
import shutil
import tomllib
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from command_line import LIBRARY, jointlib
from machine_mutations import library, mutated
from repeats import repeats
from test_bad_input import refused

LINES = np.linspace(50.0, 1500.0, 291)
LARGE = ("column_mill", "lathe")
"""Machines whose check and response take seconds; a mutation of them is only read and balanced."""


def receptance() -> np.ndarray:
    """Two dofs, three modes, m/N."""
    f, shapes = np.array([310.0, 700.0, 1150.0]), np.array([[0.3, -0.2, 0.25], [0.1, 0.3, 0.2]])
    w, w0 = 2 * np.pi * LINES[:, None], 2 * np.pi * f
    return np.asarray(np.einsum("ir,jr,fr->fij", shapes, shapes, 1 / (w0**2 - w**2 + 2j * 0.02 * w * w0)))


def write(name: str, H: np.ndarray, keep: np.ndarray | None = None) -> None:
    keep = np.ones(len(LINES), dtype=bool) if keep is None else keep
    np.savez(name, frequency=LINES[keep], receptance=H[keep])


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Path]:
    """A folder with measured records, good and bad."""
    with contextlib.chdir(tmp_path):
        H = receptance()
        write("good.npz", H)
        write("conjugate.npz", H.conj())
        write("signed.npz", H * np.array([[1, -1], [1, 1]]))
        write("upside.npz", H * np.array([[1, 1], [1, -1]]))
        write("gap.npz", H, (LINES < 400) | (LINES > 500))
        yield tmp_path


MEASURED = """
schema = "jointlib/machine/1"
[[component]]
name = "column"
kind = "frf"
dofs = ["x", "y"]
interpolation = "rational"
[[component.record]]
file = "good.npz"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[20.0]]
[[connection]]
name = "guide"
between = ["column.x", "slide.x"]
joint = { law = [{ kind = "linear", stiffness = 3e7 }, { kind = "cubic", stiffness3 = 3e17 }] }
[tool]
x = "slide.x"
[response]
force = [10]
frequency = [60, 1400]
"""
LUMPED = """
schema = "jointlib/machine/1"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[20.0]]
[[component]]
name = "body"
kind = "rigid"
mass = 5.0
inertia = [0.1, 0.1, 0.1]
[[connection]]
name = "guide"
between = ["slide.x", "body.ux"]
joint = { law = [{ kind = "linear", stiffness = 3e7 }, { kind = "viscous", damping = 300 }] }
[[connection]]
name = "foot"
between = ["body", "ground"]
at = [0, 0, 0.1]
direction = [1, 0, 0]
joint = { law = [{ kind = "linear", stiffness = 3e7 }, { kind = "viscous", damping = 300 }] }
[tool]
x = "slide.x"
[response]
force = [10]
frequency = [60, 400]
"""
FRF = "frf m.toml -o out.npz --frequency 60:400:20"
GUIDE = LUMPED[LUMPED.index("[[connection]]") : LUMPED.index('[[connection]]\nname = "foot"')]
FOOT = LUMPED[LUMPED.index('[[connection]]\nname = "foot"') : LUMPED.index("[tool]")]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("good.npz", "conjugate.npz", ("(column): the driving point x yields energy", "expected a passive record")),
        ("good.npz", "upside.npz", ("the driving point y yields energy over the band", "carry the wrong sign")),
        ("good.npz", "signed.npz", ("(column): y from x and back differ by 2 of their norm", "expected reciprocal")),
        (
            "good.npz",
            "gap.npz",
            ("'column': asked for ", "no line lies between 395 and 505 Hz", "measure there or leave that range out"),
        ),
        ("[60, 1400]", "[20, 1400]", ("asked for 20 to", "measured from 50 to 1500 Hz; nothing is extrapolated")),
        ("[60, 1400]", "[60, 1700]", ("to 1700 Hz, measured from 50 to 1500 Hz; nothing is extrapolated",)),
        ('interpolation = "rational"', "", ("which is no measured line", 'say interpolation = "rational"')),
        ('"column.x"', '"column.X"', ("no degree of freedom 'column.X', did you mean 'column.x'?",)),
        ('"column.x"', '"colum.x"', ("no degree of freedom 'colum.x', did you mean 'column.x'?",)),
        ('x = "slide.x"', 'x = "slide_x"', ("[tool]: x: no degree of freedom 'slide_x', did you mean 'slide.x'?",)),
    ],
)
def test_measured_parts(old: str, new: str, said: tuple[str, ...], own: Path) -> None:
    Path("m.toml").write_text(MEASURED.replace(old, new, 1))
    refused("frf m.toml -o out.npz", *said)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            GUIDE + FOOT,
            "",
            ("m.toml: component 'body' is joined neither directly nor through others to slide.x or the ground",),
        ),
        (GUIDE, GUIDE + GUIDE, ("m.toml: connection 'guide' is declared twice, expected different names",)),
        (
            GUIDE,
            GUIDE + GUIDE.replace('"guide"', '"again"'),
            ("connections 'guide' and 'again' hold the same motion by the same joint, expected it once",),
        ),
        (
            GUIDE,
            GUIDE + GUIDE.replace('"guide"', '"again"').replace('"slide.x", "body.ux"', '"body.ux", "slide.x"'),
            ("connections 'guide' and 'again' hold the same motion by the same joint",),
        ),
        ('"body.ux"', '"body.x"', ("connection 'guide': no degree of freedom 'body.x', did you mean 'body.",)),
        ('"body.ux"', '"body"', ("side 'body' needs a dof (body.ux, body.uy", "or at and direction")),
        (
            "[tool]",
            '[[connection]]\nname = "l"\nbetween = ["slide.x", "ground"]\nrigid = true\n'
            '[[connection]]\nname = "r"\nbetween = ["ground", "slide.x"]\nrigid = true\n[tool]',
            ("connection 'r' is rigid but repeats what rigid ones before it hold",),
        ),
        ("mass = 5.0", "mass = -5.0", ("(body): mass is -5", "expected")),
        ("mass = 5.0", "mass = 1e-90", ("mass: 1e-90, expected 0 or a size between 1e-75 and 1e+75 kg",)),
        ("[[20.0]]", "[[-20.0]]", ("(slide): mass has a negative eigenvalue, expected one that yields no energy",)),
        (
            "[tool]",
            "[static]\ngravity = true\n[tool]",
            ("static: nothing holds body.uz against the static load",),
        ),
        (
            "[tool]",
            '[static]\nforce = { "body.uy" = 5 }\n[tool]',
            ("static: nothing holds body.uy against the static load; add a connection or a stiffness",),
        ),
    ],
)
def test_connections_and_parts(old: str, new: str, said: tuple[str, ...], own: Path) -> None:
    assert old in LUMPED
    Path("m.toml").write_text(LUMPED.replace(old, new, 1))
    refused(FRF, *said)


def test_a_rigid_connection_that_its_parts_cannot_obey(own: Path) -> None:
    """A modal part without a mode in y cannot be held there."""
    Path("m.toml").write_text(
        LUMPED.replace(
            "[tool]",
            '[[component]]\nname = "arm"\nkind = "modal"\ndofs = ["x", "y"]\nfrequency = [100]\ndamping_ratio = [0.1]\n'
            "shapes = [[1.0], [0.0]]\n"
            '[[connection]]\nname = "pin"\nbetween = ["arm.y", "ground"]\nrigid = true\n[tool]',
        )
    )
    refused(FRF, "'pin'", "motions that the components cannot make; give the modal ones more modes, or hold less")


def test_a_universal_file_without_the_function_that_is_asked_for(own: Path) -> None:
    from test_measured import files

    files(own)
    record = 'file = "all.uff"\nresponse = "x"\ndrive = "x"\nresponse_at = "8X"\ndrive_at = "12X"'
    Path("m.toml").write_text(MEASURED.replace('file = "good.npz"', record))
    refused(
        "frf m.toml -o out.npz",
        "all.uff: holds no responses at 8X to a force at 12X, expected one; it has 12+X from 12+X, 7-Z from 12+X",
    )
    record = record.replace("8X", "12X")
    Path("m.toml").write_text(MEASURED.replace('file = "good.npz"', record))
    refused("frf m.toml -o out.npz", "(column): no record of x from y, nor back")


@pytest.mark.parametrize("soft", ["", ', { kind = "cubic", stiffness3 = -1e17 }'])
@pytest.mark.parametrize("joints", [1, 2])
def test_a_tool_that_moves_no_joint_is_told(soft: str, joints: int, own: Path) -> None:
    """The body turns freely about x; a moment about it leaves both joints alone, curved or not."""
    text = LUMPED.replace('x = "slide.x"', 'x = "body.rx"').replace(
        "damping = 300 }", f"damping = 300 }}{soft}", joints
    )
    Path("m.toml").write_text(text)
    done = jointlib(f"{FRF} --json")
    assert done.status == 0
    said = "the force on body.rx moves no joint (guide, foot), so none of them bears on the answer"
    assert said in done.json["warnings"]
    with np.load("out.npz") as found:
        w = 2 * np.pi * found["frequency_0"]
        assert found["receptance_0"][:, 0] == pytest.approx(-1 / (0.1 * w**2), rel=1e-9)


@pytest.mark.parametrize("start", repeats(range(0, 600, 60), lambda _: False, lambda at: at == 180))
def test_files_mutated_at_random_are_computed_or_refused_in_plain_sentences(start: int, tmp_path: Path) -> None:
    """Keys deleted, doubled, swapped and misspelt, values of every wrong kind and size, in all machine files."""
    shutil.copytree(LIBRARY, tmp_path / "library")
    names, refusals = [p.name for p in library(LIBRARY)], 0
    with contextlib.chdir(tmp_path / "library"), warnings.catch_warnings():
        for seed in range(start, start + 60):
            document, said = mutated(Path(names[seed % len(names)]).read_text("utf-8"), seed)
            Path("m.toml").write_text(tomli_w.dumps(document), "utf-8")
            verb = ("inspect m.toml", "check m.toml", "frf m.toml -o o.npz --frequency 100:2000:5")[seed % 3]
            if names[seed % len(names)].startswith(LARGE):
                verb = "inspect m.toml"
            done = jointlib(verb)
            assert done.status in (0, 1, 2), (seed, said)
            if done.status:
                lines = done.err.strip().splitlines()
                first = next(i for i, line in enumerate(lines) if line.startswith("jointlib: "))
                assert all(line.endswith("…") for line in lines[:first]), (seed, said)
                more = len(lines) - first - 1
                assert not more or lines[first] == f"jointlib: {more} faults", (seed, said)
                assert all(line.startswith("m.toml: ") for line in lines[first + 1 :]), (seed, said)
                assert not any(word in done.err for word in ("Traceback", "array(", "object at")), (seed, said)
            refusals += done.status == 2
    assert 20 < refusals < 60


def test_the_machines_that_ship_are_not_refused() -> None:
    for path in library(LIBRARY):
        assert tomllib.loads(path.read_text("utf-8"))["name"]
        assert jointlib(f"inspect {path}").status == 0
