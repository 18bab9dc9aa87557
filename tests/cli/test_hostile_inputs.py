"""Inputs that once broke the program or slipped through it: a sentence each, exit status 2, nothing written."""

from __future__ import annotations

import json
import os
import re
import shutil
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from command_line import LIBRARY, files, jointlib
from repeats import repeats

_COPIED = ("two_mass.toml", "two_mass.joint.toml", "guide.joint.toml", "guide_mill.toml")
FRF = "frf two_mass.toml --force 10 -o out.npz"
BEAM = """
schema = "jointlib/machine/1"
[[component]]
name = "bar"
kind = "beam"
material = [{ name = "steel", young = 2.1e11, poisson = 0.3, density = 7850 }]
segment = [{ length = "LENGTH", material = "steel", diameter = "DIAMETER" }]
station = [{ name = "a", at = 0 }, { name = "b", at = "end" }]
[[connection]]
name = "foot"
between = ["bar.a.y", "ground"]
joint = { law = [{ kind = "linear", stiffness = 1e7 }] }
[tool]
y = "bar.b.y"
"""
FACE = """
schema = "jointlib/machine/1"
[[component]]
name = "block"
kind = "rigid"
mass = 10
inertia = [1.0, 1.0, 1.0]
[[bundle]]
name = "face"
kind = "bolted-face"
between = ["block", "ground"]
at = [0, 0, 0]
length = 0.2
width = 0.2
bolts = BOLTS
bolt_force = 1e4
normal_stiffness = 1e13
reference_pressure = 1e6
pressure_exponent = EXPONENT
"""
MEASURED = """
schema = "jointlib/machine/1"
[[component]]
name = "bed"
kind = "frf"
dofs = ["x"]
[[component.record]]
file = "h.csv"
response = "x"
drive = "x"
quantity = "receptance"
[tool]
x = "bed.x"
"""


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    for name in (
        "two_mass.toml",
        "two_mass.joint.toml",
        "guide.joint.toml",
        "guide_mill.study.toml",
        "guide_mill.toml",
    ):
        shutil.copy(LIBRARY / name, tmp_path / name)
    for name in ("static.measurement.toml", "static.csv", "rig.measurement.toml"):
        shutil.copy(LIBRARY / "guide_mill" / name, tmp_path / name)
    os.mkfifo(tmp_path / "a_pipe.toml")
    return tmp_path


def refused(words: str | list[str], *said: str) -> None:
    before = files(Path())
    done = jointlib(words)
    assert (done.status, done.out) == (2, ""), done
    lines = [line for line in done.err.splitlines() if not line.endswith("…")]
    assert len(lines) == 1, lines
    assert lines[0].startswith("jointlib: ")
    assert len(lines[0]) <= 300
    assert lines[0].isprintable()
    assert "[Errno" not in lines[0]
    for word in said:
        assert word in lines[0]
    assert files(Path()) == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["df", "guide.joint.toml", "--amplitude", "1 m)", "--frequency", "500"], "unit 'm)' is not known"),
        (["df", "guide.joint.toml", "--amplitude", "1 m/0", "--frequency", "500"], "unit 'm/0' is not known"),
        (["df", "guide.joint.toml", "--amplitude", "1" + "(" * 500, "--frequency", "500"], "is not known"),
        (["df", "guide.joint.toml", "--amplitude", "1 m^9999", "--frequency", "500"], "--amplitude: unit 'm^9999'"),
        (["df", "guide.joint.toml", "--amplitude", "²", "--frequency", "500"], "'²', expected a number"),
        (f"{FRF} --frequency 1:2:²", "'1:2:²', expected lo:hi or lo:hi:n"),
        (f"{FRF} --frequency 1:2:999999999999", "999999999999 lines, expected 2 to"),
        (f"{FRF} --frequency 1:2:{'9' * 5000}", "expected lo:hi or lo:hi:n"),
        (f"{FRF} --frequency 1kHz:2kHz:900000 --limit 100MB", "900000 lines of 2 joints and tool axes would take"),
        (
            ["df", "guide.joint.toml", "--limit", "50MB"]
            + [x for i in range(300) for x in ("--amplitude", f"{i + 1} um")]
            + [x for i in range(300) for x in ("--frequency", f"{i + 1}")],
            "300 amplitudes at 300 frequencies would take 72 MB of memory, expected at most 50 MB",
        ),
        (f"{FRF} --harmonics ²", "--harmonics: '²'"),
        (f"{FRF} --harmonics 0", "--harmonics: '0', expected 1, auto or multiples"),
        (f"{FRF} --harmonics 1,3,99999", "99999, expected multiples up to 1000"),
        (f"{FRF} --limit much", "--limit: 'much', expected a size"),
        ("study run guide_mill.study.toml -o out --limit much", "--limit: 'much', expected a size"),
        ("identify static.measurement.toml --law polynomial --order 2,² -o j.toml", "--order: '2,²'"),
        (["frf", "two_mass.toml", "-o", "x" * 4000 + ".npz"], "-o: is a name of 4004 letters"),
        (["trace", "rig.measurement.toml", "--joint", "x" * 4000, "-o", "out"], "--joint: is a name of 4000 letters"),
        (["inspect", "x" * 4000], "is a name of 4000 letters"),
        (["inspect", "a\nb.csv"], "a\\nb.csv: no such file"),
        (["trace", "rig.measurement.toml", "--joint", "a\nb", "-o", "out"], "a\\nb: no such file"),
        (["new", "machine\n" * 3000, "-o", "x.toml"], "is not one of 'machine'"),
        ("inspect /dev/zero", "/dev/zero"),
        ("new machine -o a_pipe.toml", "-o: a_pipe.toml is a device or pipe, expected the name of a file to write"),
        ("identify static.measurement.toml static.measurement.toml --law hertz-guide -o j.toml", "is given twice"),
        ("df /dev/zero --amplitude 1um --frequency 500", "/dev/zero: is a device or pipe"),
    ],
)
def test_hostile_words_get_a_sentence(words: str | list[str], said: str, at_bench: Path) -> None:
    refused(words, said)


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("two_mass.toml", '"two_mass.joint.toml"', '"a\\nb"', "joint refers to a\\nb, which does not exist"),
        ("two_mass.toml", '"two_mass.joint.toml"', f'"{"x" * 4000}"', "name"),
        ("static.measurement.toml", '"static.csv"', f'"{"x" * 4000}"', "file is a name of 4000 letters"),
        ("static.measurement.toml", '"static.csv"', '""', "file is empty"),
        (
            "guide.joint.toml",
            'name = "guide"',
            'name = "guide"\nprovenance = "me"',
            "provenance is 'me', expected a table",
        ),
        ("guide.joint.toml", '"503 N s/m"', '"1 m)"', "unit 'm)' is not known"),
        ("guide.joint.toml", '"503 N s/m"', "[" * 9000, "nested too deeply"),
        ("guide.joint.toml", '"503 N s/m"', "9" * 5000, "not valid TOML"),
        ("guide.joint.toml", '"503 N s/m"', '"' + "x" * 100_000 + '"', "expected a number"),
        ("guide_mill.study.toml", "samples = 8", "samples = 9223372036854775808", "at most 1000000"),
        ("guide_mill.study.toml", "samples = 8", "samples = 999999999", "at most 1000000"),
    ],
)
def test_hostile_values_get_a_sentence(name: str, old: str, new: str, said: str, at_bench: Path) -> None:
    text = Path(name).read_text("utf-8")
    assert old in text
    Path(name).write_text(text.replace(old, new, 1), "utf-8")
    refused(f"inspect {name}", said)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FACE.replace("BOLTS", "1e40").replace("EXPONENT", "0.5"), "bolts is 1e+40, expected a whole number"),
        (FACE.replace("BOLTS", "4").replace("EXPONENT", "1e6"), "pressure_exponent is 1e+06, expected 0 to 3"),
        (BEAM.replace("LENGTH", "1 m").replace("DIAMETER", "5e-5 mm"), "half waves long"),
    ],
)
def test_sizes_that_no_machine_has_are_refused(text: str, said: str, at_bench: Path) -> None:
    Path("m.toml").write_text(text)
    done = jointlib("modes m.toml")
    assert done.status == 2, done
    assert said in done.err


def test_infinite_responses_are_told_with_their_line(at_bench: Path) -> None:
    Path("m.toml").write_text(MEASURED)
    rows = [f"{50 + i},{1e-7},{-1e-8}" for i in range(9)]
    for bad in ("inf", "-inf", "nan", "1e300"):
        rows[4] = f"54,{bad},0"
        Path("h.csv").write_text("\n".join(["frequency [Hz],real [m/N],imag [m/N]", *rows]))
        refused("inspect m.toml", "54 Hz")


def test_inspect_tells_which_samples_are_no_numbers(at_bench: Path) -> None:
    np.savez(
        "a.npz", force=np.array([1.0, np.inf, 3.0, np.nan]), gap=np.full(4, np.nan), big=np.array([1e300, -1e300, 0, 1])
    )
    done = jointlib("inspect a.npz")
    assert done.status == 0
    assert "force: 2 of 4 samples are no finite numbers, the first in row 2" in done.out
    assert "gap: 4 of 4 samples are no finite numbers, the first in row 1" in done.out
    row = next(line for line in done.out.splitlines() if line.startswith("big"))
    assert float(row.split()[-1]) == pytest.approx(np.std([1.0, -1.0, 0.0, 1e-300]) * 1e300, rel=1e-3)
    assert not {"nan", "inf"} & set(done.out.split())


def test_a_description_that_unfolds_without_end_is_refused(at_bench: Path) -> None:
    lots = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 12))
    bomb = f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a0 "ha">{lots}]><x>&a11;</x>'
    for data in (bomb.encode(), bomb.encode("utf-16"), b" " * 60_000_000):
        with zipfile.ZipFile("a.fmu", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", data)
        refused("inspect a.fmu", "a.fmu: cannot be read as an FMU", "too long, or defines a document type")


HOSTILE = (
    "*/ #error in C",
    '"; system("true"); //',
    "</script><script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "${jndi:ldap}{{7*7}}{% raw %}",
    "a\nb\t\\",
    "../../../../tmp/x",
    "\u202egnp.exe",
    "]]>&lt;&#x0;",
    "%s%n%x",
)
AN_FMU = ("</script><script>alert(1)</script>", "a\nb\t\\")
"""Names for which an FMU is made by default; it takes a second for each."""


@pytest.mark.parametrize("name", repeats(HOSTILE, lambda name: name in AN_FMU))
def test_no_name_becomes_markup_code_or_a_path(name: str, at_bench: Path) -> None:
    """In the C source, the XML and the page of an FMU, in a drawing and in the page of a machine."""
    joint = Path("guide.joint.toml").read_text("utf-8").replace('name = "guide"', f"name = {json.dumps(name)}")
    Path("guide.joint.toml").write_text(joint, "utf-8")
    machine = Path("two_mass.toml").read_text("utf-8").replace('name = "two-mass"', f"name = {json.dumps(name)}")
    Path("two_mass.toml").write_text(machine, "utf-8")
    before = files(Path().resolve().parent)
    done = jointlib("fmu guide.joint.toml -o out.fmu")
    if not json.loads(json.dumps(name)).isprintable():
        assert (done.status, "expected printable characters" in done.err) == (2, True), done
        return
    assert done.status == 0, done
    with zipfile.ZipFile("out.fmu") as archive:
        for member in archive.namelist():
            assert ".." not in Path(member).parts
            data = archive.read(member)
            if member.endswith(".xml"):
                ElementTree.fromstring(data)
            if member.endswith(".html"):
                assert not re.search(rb"<(script|img)\b", data), member
    assert files(Path().resolve().parent) - before == {Path(Path().resolve().name, "out.fmu")}


@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_becomes_markup_in_pictures_and_pages(name: str, at_bench: Path) -> None:
    text = (LIBRARY / "carriage.toml").read_text("utf-8")
    assert 'name = "carriage"' in text
    Path("m.toml").write_text(text.replace('name = "carriage"', f"name = {json.dumps(name)}", 1), "utf-8")
    for out in ("m.svg", "m.html"):
        done = jointlib(f"inspect m.toml -o {out}")
        assert done.status == 0, done
        page = Path(out).read_text("utf-8")
        # Inside the one script that belongs to the page, names stand as data.
        body = re.sub(r"<script\b[^>]*>.*?</script>", "", page, flags=re.DOTALL)
        assert "<script" not in body
        assert "<img" not in body
        assert page.count("</script") == page.count("<script") - page.count("<script>alert")
        if out == "m.svg":
            ElementTree.fromstring(page)


@pytest.mark.skipif(os.name != "posix", reason="memory is limited as on Linux")
def test_memory_that_is_not_there_ends_in_a_sentence(at_bench: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A computation whose need nobody foresaw."""

    def greedy(*_: object, **__: object) -> None:
        np.ones(2**40)

    monkeypatch.setattr("jointlib.io.joint_file.joint_from", greedy)
    refused("df guide.joint.toml --amplitude 1um --frequency 500", "of memory", "--limit")
