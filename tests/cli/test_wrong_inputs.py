"""Three things that a new user gets wrong with each verb: one clear sentence, exit status 2, nothing written."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from command_line import LIBRARY, files, jointlib

MILL = "library/two_mode_tool.toml"
TWO_MASS = "library/two_mass.toml"
GUIDE = "library/guide.joint.toml"
STATIC = "library/guide_mill/static.measurement.toml"
RIG = "library/guide_mill/rig.measurement.toml"
START = "library/guide_mill/start.joint.toml"
DATA = "library/guide_mill/rig_1.npz"
CSV = "library/guide_mill/static.csv"

WRONG = {
    "run": [
        ("run library -o out", "library: cannot be read, it is a folder, expected a machine file"),
        (f"run {CSV} -o out", "static.csv: cannot be read as TOML, expected a machine file"),
        (f"run {TWO_MASS} -o out --tool drill", "use is 'drill', but no tool has a name"),
    ],
    "new": [
        ("new mill -o x.toml", "'mill' is not one of 'machine', 'joint', 'measurement', 'study'"),
        ("new machine -o mill", "-o: mill ends in '', expected .toml"),
        (f"new study --machine {GUIDE} -o x.study.toml", 'expected "jointlib/machine/1"'),
    ],
    "import": [
        ("import none.csv -o x.toml", "none.csv: no such file, expected a record"),
        (f"import {CSV} --set channel.load.unti=kN -o x.toml", "unknown key 'unti', did you mean 'unit'?"),
        (f"import {CSV} --kind ring -o x.toml", "--kind: 'ring', did you mean 'rig'?"),
    ],
    "inspect": [
        ("inspect library", "library: a folder, expected a file"),
        (f"inspect {TWO_MASS} -o two_mass.pdf", "-o: two_mass.pdf ends in '.pdf', expected .svg"),
        ("inspect notes.docx", "no reader for '.docx' files, expected one of asc, csv"),
    ],
    "identify": [
        (f"identify {CSV} --law viscous -o j.toml", "static.csv: cannot be read as TOML, expected a measurement file"),
        (f"identify {STATIC} --law hertz -o j.toml", "unknown law 'hertz', did you mean 'hertz-guide'?"),
        (f"identify {STATIC} -o j.toml", "expected either --law or --start"),
    ],
    "trace": [
        (f"trace {RIG} --joint {TWO_MASS} -o out", 'expected "jointlib/joint/1"'),
        (f"trace {START} --joint {RIG} -o out", 'expected "jointlib/measurement/1"'),
        (f"trace {DATA} --joint {START} -o out", "rig_1.npz: cannot be read as text, expected a measurement file"),
    ],
    "df": [
        (
            f"df {GUIDE} --amplitude 1,5um --frequency 500",
            "--amplitude: '1,5um', a number with a comma",
            "1.5um or 1um",
        ),
        (f"df {GUIDE} --amplitude 5% --frequency 500", "--amplitude: unit '%' does not fit, expected one like 'm'"),
        (f"df {GUIDE} --amplitude small --frequency 500", "--amplitude: 'small', expected a number"),
    ],
    "frf": [
        (f"frf {TWO_MASS} --force 10kg -o f.npz", "--force: unit 'kg' does not fit, expected one like 'N'"),
        (f"frf {TWO_MASS} --frequency 1000-7000 -o f.npz", "--frequency: '1000-7000', expected lo:hi or lo:hi:n"),
        (f"frf {TWO_MASS} --samples 10 -o f.npz", "--samples", "x>=40"),
    ],
    "modes": [
        (f"modes {TWO_MASS} --amplitude 1N", "--amplitude: unit 'N' does not fit, expected one like 'm'"),
        (f"modes {TWO_MASS} --force 50", "--force"),
        (f"modes {DATA}", "rig_1.npz: cannot be read as text, expected a machine file"),
    ],
    "compare": [
        (f"compare {TWO_MASS}", "expected two files or folders, or a study file with --results"),
        (f"compare {TWO_MASS} {GUIDE}", "guide.joint.toml is a joint", "expected two of a kind"),
        (f"compare {TWO_MASS} {MILL} --designs 0 3", "--designs: expected --results as well"),
    ],
    "check": [
        (f"check {TWO_MASS} {MILL}", "two_mode_tool.toml"),
        (f"check {TWO_MASS} --frequency 100", "--frequency"),
        (f"check {RIG}", "schema is 'jointlib/measurement/1', expected \"jointlib/machine/1\""),
    ],
    "lobes": [
        (f"lobes {MILL} --speed 3000:6000", "--speed: unit ':6000', expected rpm or krpm or Hz"),
        (f"lobes {MILL} --speed 6,000rpm", "--speed: '6,000rpm', a number with a comma", "expected 6000rpm or"),
        (f"lobes {TWO_MASS} --speed 3000", "two_mass.toml: no [cutting], lobes need a cutting operation"),
    ],
    "fmu": [
        (f"fmu {GUIDE}", "expected a joint file and -o X.fmu, a machine file and -o X.fmu, or --verify X.fmu"),
        (f"fmu {GUIDE} --fmi 4 -o x.fmu", "'4' is not one of '2', '3'"),
        (f"fmu --verify {GUIDE}", "guide.joint.toml: not an intact zip archive", "expected an FMU"),
    ],
    "ssp": [
        (f"ssp {GUIDE} -o x.ssp", 'expected "jointlib/machine/1"'),
        (f"ssp {TWO_MASS} -o x.fmu", "-o: x.fmu ends in '.fmu', expected .ssp"),
        (f"ssp {TWO_MASS}", "-o"),
    ],
    "study": [
        ("study library/guide_mill.study.toml", "expected one of run, resume, report before the file"),
        (f"study run {MILL} -o out", 'expected "jointlib/study/1"'),
        ("study show out", "study: 'show', expected one of run, resume, report"),
    ],
    "explore": [
        (f"explore {GUIDE}", 'expected "jointlib/machine/1"'),
        (f"explore {TWO_MASS} --port 99999", "--port", "99999"),
        (f"explore {TWO_MASS} --port http", "--port", "'http'"),
    ],
}


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the library, and a letter."""
    folder = tmp_path_factory.mktemp("bench")
    shutil.copytree(LIBRARY, folder / "library")
    (folder / "notes.docx").write_bytes(b"PK\x03\x04 a letter")
    return folder


@pytest.mark.parametrize(
    ("command", "said"),
    [pytest.param(command, said, id=command) for cases in WRONG.values() for command, *said in cases],
)
def test_what_a_new_user_gets_wrong_is_answered_in_a_sentence(command: str, said: list[str], at_bench: Path) -> None:
    before = files(Path())
    done = jointlib(command)
    assert (done.status, done.out) == (2, ""), done
    sentence = done.err.splitlines()[-1]
    assert sentence.startswith("jointlib: ")
    for words in ("Traceback", "Error:", "Errno", "codec", "array(", "object at"):
        assert words not in done.err
    for words in said:
        assert words in sentence
    assert files(Path()) == before


def test_values_with_commas_keep_their_one_reading(at_bench: Path) -> None:
    """A list in SI, one with a unit on each, and one whose last value is in SI are no decimal commas."""
    for amplitude in ("1e-6,3e-6", "1um,3um", "1um,3e-6"):
        done = jointlib(f"df {GUIDE} --amplitude {amplitude} --frequency 500 --json")
        assert (done.status, done.json["amplitude"]) == (0, pytest.approx([1e-6, 3e-6])), done
