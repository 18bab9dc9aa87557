"""Files with several faults: all of them in one answer, each with its line, and nothing that only follows from them."""

from __future__ import annotations

import contextlib
import random
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import LIBRARY, Done, jointlib

Fault = tuple[str, str, str]
"""What stands there, what is put in its place, and words that the answer must hold."""

MACHINE: dict[str, list[Fault]] = {
    "two_mass.toml": [
        ('kind = "lumped"\ndofs = ["x"]\nmass = [[0.942]]', 'kind = "lump"\ndofs = ["x"]\nmass = [[0.942]]', "'lump'"),
        ("[[0.942]]", '[["0.942 N"]]', "mass[0][0]: unit 'N'"),
        ("mass = [[2.2]]", "mas = [[2.2]]", "'mas'"),
        ('[["200 N s/m"]]', '"much"', "damping is 'much'"),
        ("stiffness =", "k =", "did you mean 'stiffness'?"),
        ('"base.x"]', '"bse.x"]', "no degree of freedom 'bse.x'"),
        ('joint = "two_mass.joint.toml"', 'joint = "none.joint.toml"', "none.joint.toml, which does not exist"),
        ('[tool]\nx = "slide.x"', '[tool]\nx = "slide.q"', "no degree of freedom 'slide.q'"),
        ('["1 kHz", "7 kHz"]', '["7 kHz", "1 kHz"]', "frequency runs from 7000 to 1000 Hz"),
        ('force = ["10 N", ', 'force = ["0 N", ', "force is 0 N"),
    ],
    "two_mode_tool.toml": [
        ("damping_ratio = ", "zeta = ", "did you mean it by 'zeta'?"),
        ("modal_mass = ", "effective_mass = ", "did you mean 'modal_mass'?"),
        ("teeth = 3", "flutes = 3", "unknown key 'flutes', did you mean 'teeth'?"),
        ("normal = ", "radial = ", "unknown key 'radial', did you mean 'normal'?"),
        ("immersion = 0.5", "immersion = 1.5", "immersion is 1.5"),
        ('mode = "up"', 'mode = "upp"', "mode is 'upp'"),
        ("speed = [4000, 25000]", "speed = [25000, 4000]", "speed is [25000, 4000] rpm"),
        ("[cutting]\n", "[cutting]\nnose_radius = 0.1\n", "nose_radius is not covered"),
        ('y = "cutter.y"', 'y = "cuter.y"', "no degree of freedom 'cuter.y'"),
        ('frequency = ["100 Hz", "3 kHz"]', 'freq = ["100 Hz", "3 kHz"]', "'freq', did you mean 'frequency'?"),
    ],
    "carriage.toml": [
        ("inertia = [0.25, 0.35, 0.4]", "inertia = [0.25, 0.35]", "inertia is [0.25, 0.35]"),
        ('"40 kg"', '"-40 kg"', "mass is -40"),
        ('kind = "linear-guide"', 'kind = "linear-giude"', "unknown bundle 'linear-giude'"),
        ('width = "25 mm"', 'widht = "25 mm"', "did you mean it by 'widht'?"),
        ('height = "12 mm"', 'height = "12 N"', "height: unit 'N'"),
        ('mounting = "fixed-free"', 'mounting = "loose"', "mounting is 'loose'"),
        ('nut_stiffness = "450 N/um"', 'nut_stiffness = "450 N"', "nut_stiffness: unit 'N'"),
        ("gravity = true", 'gravity = "down"', "gravity is 'down'"),
        ('"slide.rx" = "4 N m"', '"slide.qx" = "4 N"', "force names 'slide.qx'"),
        ('x = "slide.uz"', 'x = "slide.zz"', "no degree of freedom 'slide.zz'"),
    ],
    "column_mill_a.toml": [
        ('process = "milling"', 'process = "milling"\nhelix = 30', "helix needs 'diameter'"),
        ("teeth = ", "teeth = 0 #", "teeth is 0, expected a whole number"),
        ('name = "x"\ndirection', 'name = "x"\nspeed = 3\ndirection', "unknown key 'speed'"),
        ("[response]\n", "[response]\nfrequencies = 3\n", "unknown key 'frequencies', did you mean 'frequency'?"),
        ("[[bundle]]\n", "[[bundle]]\nkappas = 3\n", "unknown key 'kappas'"),
        ('kind = "rigid"', 'kind = "body"', "unknown component 'body', did you mean 'rigid'?"),
        ("inertia = [9, 18, 25]", "I = [9, 18, 25]", "key 'inertia' is missing, did you mean it by 'I'?"),
    ],
}
MEASUREMENT: dict[str, list[Fault]] = {
    "guide_mill/rig.measurement.toml": [
        ("settle = 0", "setle = 0", "did you mean 'settle'?"),
        ('["2 kHz", "20 kHz"]', '["20 kHz", "2 kHz"]', "band runs from 20000 to 2000 Hz"),
        ("mass = 0.942", "mass = -1", "runner_block is -1 kg"),
        ('driven = "runner_block"', 'driven = "runer"', "driven is 'runer'"),
        ('role = "quiet"', 'role = "silent"', "role is 'silent'"),
        ('file = "rig_2.npz"', 'fil = "rig_2.npz"', "did you mean it by 'fil'?"),
        ('file = "rig_3.npz"', 'file = "rig_3.npz"\nrows = [9, 2]', "rows is [9, 2]"),
        ('name = "a2"\nquantity = "acceleration"', 'name = "a2"\nquantity = "accel"', "quantity is 'accel'"),
        ("gain = 0.125 ", "gain = 0 ", "gain is 0"),
        ('body = "rail"', 'body = "rial"', "body is 'rial'"),
    ],
    "three_joints/tip.measurement.toml": [
        ('kind = "frf"', 'kind = "fre"', "kind is 'fre', did you mean 'frf'?"),
        ('force = "1 N"', 'force = "-1 N"', "force is -1 N"),
        ('force = "3 N"', 'force = "3 um"', "force: unit 'um'"),
        ('quantity = "receptance"\nforce = "8 N"', 'quantity = "acceleration"\nforce = "8 N"', "is 'acceleration'"),
        ('file = "tip_15N.csv"', "file = 15", "file is 15, expected a string"),
        ('role = "sealed"', 'role = "closed"', "role is 'closed'"),
    ],
}
JOINT: dict[str, list[Fault]] = {
    "guide.joint.toml": [
        ("3.931408125e-8", "-1", "kappa is -1.0"),
        ('"630 N"', '"630 kg"', "preload: unit 'kg'"),
        ('["contact_angle"]', '["angle"]', "fixed names 'angle'"),
        ("damping = ", "c = ", "did you mean it by 'c'?"),
        ('kind = "viscous"', 'kind = "viscos"', "unknown law 'viscos'"),
        ('schema = "jointlib/joint/1"', 'schema = "jointlib/joint/9"', "schema is 'jointlib/joint/9'"),
        ('name = "guide"', 'name = "guide"\nlabel = "x"', "unknown key 'label'"),
    ],
}
STUDY: dict[str, list[Fault]] = {
    "guide_mill.study.toml": [
        ('goal = "max"', 'goal = "most"', "goal is 'most'"),
        ("[sampling]\n", "[sampling]\nseeds = 3\n", "unknown key 'seeds', did you mean 'seed'?"),
        ('["3000 rpm", "12000 rpm"]', '["3000 rpm", "1200 rpm"]', "speed is not ascending"),
        ("base = ", "machine = ", "did you mean it by 'machine'?"),
        ('["300 N", "900 N"]', '["900 N", "300 N"]', "range from 900 to 300 is empty"),
        ("deviation = 0.2", 'deviation = "0.2 N"', "deviation has the unit 'N'"),
        ('words = ["short", "medium", "long"]', 'words = ["short", "long"]', "2 words for 3 values"),
        ('quantity = "removal-rate"', 'quantity = "removal"', "quantity is 'removal', did you mean 'removal-rate'?"),
        ("at_least = ", "at_leest = ", "unknown key 'at_leest', did you mean 'at_least'?"),
        ("samples = 8", "samples = 0", "samples is 0, expected a whole number"),
    ],
    "column_mill.study.toml": [
        (
            'role = "uncertain"\ndistribution = { kind = "log-normal", median = 8e11',
            'role = "unsure"\ndistribution = { kind = "log-normal", median = 8e11',
            "role is 'unsure'",
        ),
        ('name = "x guide" ', 'title = "x guide" ', "unknown key 'title', did you mean 'name'?"),
        ('method = "factorial"', 'method = "grid"', "method is 'grid', did you mean 'factorial'?"),
        ('x = ["0 mm", "300 mm"]', 'x = ["0 mm", "0 mm"]', "x names a position twice"),
        ('goal = "min"', 'goal = "least"', "goal is 'least'"),
        (
            'deviation = 0.3 }\n\n[[factor]]\nname = "guide damping"',
            'deviation = -1 }\n\n[[factor]]\nname = "guide damping"',
            "deviation is -1",
        ),
    ],
}
FILES = {name: faults for of in (MACHINE, MEASUREMENT, JOINT, STUDY) for name, faults in of.items()}
EACH = {"two_mass.toml": 9, "guide.joint.toml": 7, "two_mode_tool.toml": 8, "carriage.toml": 8, "column_mill_a.toml": 4}
"""How many files of a kind; 6 of the others."""


def cases() -> Iterator[tuple[str, tuple[Fault, ...]]]:
    """Three faults each, drawn so that every fault of a file is met."""
    for name, faults in FILES.items():
        rng = random.Random(name)
        drawn: list[Fault] = []
        for _ in range(EACH.get(name, 6)):
            three = [drawn.pop() for _ in range(min(3, len(drawn)))]
            if len(three) < 3:
                drawn = [fault for fault in rng.sample(faults, len(faults)) if fault not in three]
                three += [drawn.pop() for _ in range(3 - len(three))]
            yield name, tuple(three)


CASES = list(cases())


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("faults") / "library"
    shutil.copytree(LIBRARY, folder)
    with contextlib.chdir(folder):
        yield folder


def told(done: Done) -> list[str]:
    """The sentences of an answer, without their number."""
    first, *more = done.err.splitlines()
    assert done.status == 2, done
    assert done.out == ""
    assert "Traceback" not in done.err
    assert first == f"jointlib: {len(more)} faults" if more else first.startswith("jointlib: ")
    return more or [first.removeprefix("jointlib: ")]


def verb_of(name: str) -> str:
    if ".joint." in name:
        return f"df {name} --amplitude 1um --frequency 500"
    return f"study run {name} -o out" if ".study." in name else f"inspect {name}"


@pytest.mark.parametrize(("name", "faults"), CASES, ids=[f"{i}-{name}" for i, (name, _) in enumerate(CASES)])
def test_three_faults_get_three_sentences(name: str, faults: tuple[Fault, ...], library: Path) -> None:
    text = (LIBRARY / name).read_text("utf-8")
    for old, new, _ in faults:
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    file = library / Path(name).parent / f"wrong_{Path(name).name}"
    file.write_text(text, "utf-8")
    sentences = told(jointlib(verb_of(str(file.relative_to(library)))))
    assert len(sentences) == 3, sentences
    for _, _, words in faults:
        assert sum(words in said for said in sentences) == 1, (words, sentences)
    for said in sentences:
        line = re.search(r" \(line (\d+): (.*)\)$", said)
        assert line, said
        assert text.splitlines()[int(line[1]) - 1].strip().startswith(line[2].removesuffix("…")), said


def test_there_are_sixty_of_them() -> None:
    assert len(CASES) >= 60
    assert {(name, fault) for name, three in CASES for fault in three} >= {
        (name, fault) for name, faults in FILES.items() for fault in faults
    }


def test_no_fault_is_found_in_what_ships() -> None:
    for file in sorted(LIBRARY.rglob("*.toml")):
        if 'schema = "jointlib/parts/1"' not in file.read_text("utf-8") and ".study." not in file.name:
            assert jointlib(f"inspect {file}").status == 0, file
    from machines.study.study_file import read_study

    for file in LIBRARY.glob("*.study.toml"):
        assert read_study(file).factors


def test_a_fault_in_a_file_that_another_names_is_told_with_its_own_line(library: Path) -> None:
    (library / "bad.joint.toml").write_text('schema = "jointlib/joint/1"\n\n[[law]]\nkind = "viscous"\nc = 1\nx = 2\n')
    text = (LIBRARY / "two_mass.toml").read_text("utf-8").replace("two_mass.joint.toml", "bad.joint.toml")
    (library / "names_bad.toml").write_text(text.replace("mass = [[2.2]]", "mass = [[-2.2]]"))
    sentences = told(jointlib("inspect names_bad.toml"))
    assert [said.partition(":")[0] for said in sentences] == ["names_bad.toml", "bad.joint.toml", "bad.joint.toml"]
    assert sentences[1].endswith("key 'damping' is missing, did you mean it by 'c'? (line 5: c = 1)")
    assert sentences[2].endswith("(line 6: x = 2)")


def test_what_only_follows_from_a_fault_is_not_told(library: Path) -> None:
    """A component that cannot be read has no degrees of freedom that others could miss."""
    text = (LIBRARY / "two_mass.toml").read_text("utf-8")
    for old, new in (('dofs = ["x"]\nmass = [[2.2]]', "dofs = 5\nmass = [[2.2]]"), ('name = "slide"', "name = 5")):
        (library / "follows.toml").write_text(text.replace(old, new))
        (sentence,) = told(jointlib("inspect follows.toml"))
        assert "is 5, expected a" in sentence


def test_a_line_that_is_no_toml_is_shown(library: Path) -> None:
    (library / "broken.toml").write_text('schema = "jointlib/machine/1"\n\n[[component]\nname = "a"\n')
    (sentence,) = told(jointlib("inspect broken.toml"))
    assert sentence.startswith("broken.toml: not valid TOML: ")
    assert sentence.endswith("(line 3: [[component])")


def test_what_many_places_refer_to_and_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    text = (LIBRARY / "lathe.toml").read_text()
    machine = tmp_path / "lathe.toml"
    machine.write_text(text.replace('name = "bed"', 'name = "bbed"').replace("[tool]", "[tol]"))
    for joint in LIBRARY.glob("*.joint.toml"):
        shutil.copy(joint, tmp_path)
    done = jointlib(f"inspect {machine}")
    said = done.err.splitlines()
    assert (done.status, said[0]) == (2, "jointlib: 2 faults")
    assert sum("'bed'" in line for line in said) == 1
    begin = "connection 'mount_1.x' and 10 more: no component 'bed', did you mean 'bbed'? (line 8: "
    assert any(begin in line for line in said)
    every = [fault["fault"] for fault in jointlib(f"inspect {machine} --json").json["faults"]]
    assert sum("no component 'bed'" in fault for fault in every) == 11


OWN = """
[[connection]]
name = "near"
between = ["slide.uy", "ground"]
joint = { law = [{ kind = "linear", stiffness = 1e8 }] }
"""
"""A connection that is none of a bundle's."""


@pytest.mark.parametrize("at", ["[0.0, 0.0, 0.0]", "[[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]]"])
def test_a_fault_in_a_bundle_is_told_with_the_line_of_the_bundle(at: str, library: Path) -> None:
    """Its connections are named after it, and after each of its places."""
    text = (LIBRARY / "carriage.toml").read_text("utf-8").replace("at = [0.0, 0.0, 0.0]", f"at = {at}", 1)
    (library / "apart.toml").write_text(text.replace('between = ["slide", ', 'between = ["slid", ', 1) + OWN)
    sentences = told(jointlib("inspect apart.toml"))
    number = text.splitlines().index('between = ["slide", "ground"]') + 1
    assert all("no component 'slid'" in said for said in sentences)
    assert all(said.endswith(f'(line {number}: between = ["slid", "ground"])') for said in sentences), sentences


def test_a_bundle_declared_twice_is_told_with_a_line_of_its_own(library: Path) -> None:
    text = (LIBRARY / "carriage.toml").read_text("utf-8") + OWN
    start = text.index('[[bundle]]\nname = "screw"')
    bundle = text[start : text.index("\n[", start + 2) + 1]
    (library / "twice.toml").write_text(text + bundle)
    (sentence,) = told(jointlib("inspect twice.toml"))
    assert "connection 'screw.axial' is declared twice" in sentence
    assert sentence.endswith(f"(line {len(text.splitlines()) + 1}: [[bundle]])")


def test_a_connection_that_another_file_holds_is_told_without_a_line_of_this_one(library: Path) -> None:
    text = (LIBRARY / "column_mill" / "modules.toml").read_text("utf-8")
    (library / "column_mill" / "apart.toml").write_text(text.replace('between = ["bed", ', 'between = ["bedd", ', 1))
    own = '[[component]]\nname = "stone"\nkind = "lumped"\ndofs = ["x"]\nmass = [[1]]\nstiffness = [[1e6]]\n'
    parts = 'schema = "jointlib/machine/1"\nparts = ["column_mill/apart.toml"]\n'
    (library / "parted.toml").write_text(parts + own)
    (sentence,) = [said for said in told(jointlib("inspect parted.toml")) if "'bedd'" in said]
    assert sentence.endswith("no component 'bedd', did you mean 'bed'?")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("connection = [\n  { a = 1 },\n]\n[[connection]]\na = 2\n", "a list, connection = [...] in line 1"),
        ("x = 1\ntool = { x = 1 }\n[tool]\ny = 2\n", "a table in a line, tool = {...} in line 2"),
    ],
)
def test_two_styles_of_one_table_are_told_with_both_lines(here: Path, text: str, said: str) -> None:
    Path("m.toml").write_text(f"{text}")
    done = jointlib("inspect m.toml")
    assert done.status == 2
    name = said.split("=")[0].split()[-1]
    assert f"not valid TOML: {name} stands as {said} and again as a table in line" in done.err
    assert "immutable" not in done.err
    assert "expected one of the two throughout" in done.err
