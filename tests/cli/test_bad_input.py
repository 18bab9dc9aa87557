"""Bad input: one clear sentence for each fault on standard error, exit status 2, no traceback, nothing written."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from command_line import LIBRARY, Done, files, jointlib

GUIDE = "library/guide.joint.toml"
TWO_MASS = "library/two_mass.toml"
TOOL = "library/two_mode_tool.toml"
RIG = "library/guide_mill/rig.measurement.toml"
STATIC = "library/guide_mill/static.measurement.toml"
START = "library/guide_mill/start.joint.toml"
TIP = "library/three_joints/tip.measurement.toml"
AT = "--amplitude 1um --frequency 500"
TRACE = f"trace {RIG} --joint {START} -o out/traced"
FIT = f"identify {STATIC} --law hertz-guide -o out/joint.toml"
FRF = f"frf {TWO_MASS} -o out/frf.npz"


def refused(command: str, *said: str) -> Done:
    """Call in a folder that holds the library, and see that the misuse is named and leaves no trace."""
    before = files(Path())
    done = jointlib(command)
    assert done.status == 2, done
    assert done.out == ""
    first, *more = done.err.splitlines()
    assert first.startswith("jointlib: ")
    assert not more or first == f"jointlib: {len(more)} faults"
    sentence = done.err
    for words in ("Traceback", "Error:", "array(", "object at"):
        assert words not in sentence
    for words in said:
        assert words in sentence
    assert files(Path()) == before
    return done


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the library, and some files that are not what their names say."""
    folder = tmp_path_factory.mktemp("bench")
    shutil.copytree(LIBRARY, folder / "library")
    garbage = bytes(range(255, -1, -1)) * 10
    for suffix in ("toml", "csv", "npz", "mat", "uff", "unv", "fmu", "xyz"):
        (folder / f"garbage.{suffix}").write_bytes(garbage)
        (folder / f"nothing.{suffix}").write_bytes(b"")
    (folder / "cut.npz").write_bytes((LIBRARY / "guide_mill" / "rig_1.npz").read_bytes()[:5000])
    (folder / "zip.fmu").write_bytes(b"PK\x03\x04 no archive")
    np.save(folder / "array.npy", np.arange(5.0))
    (folder / "array.npy").rename(folder / "array.npz")
    (folder / "late.csv").write_bytes(b"a,b\n" + b"1,2\n" * 50000 + b"\xff,1\n")
    (folder / "plain").write_text("text")
    (folder / "folder.toml").mkdir()
    (folder / "folder.npz").mkdir()
    return folder


@pytest.mark.parametrize(
    ("command", "said"),
    [
        # words that are no command
        ("frobnicate", "no verb 'frobnicate', expected one of "),
        ("lobe machine.toml", "did you mean 'lobes'?"),
        ("--bogus", "--bogus"),
        (f"df {GUIDE} {AT} --bogus", "--bogus"),
        (f"df {GUIDE} {AT} extra.toml", "extra.toml"),
        ("laws extra", "extra"),
        ("df", "JOINT"),
        (f"df {GUIDE} --amplitude 1um", "--frequency"),
        (f"df {GUIDE} --amplitude", "--amplitude"),
        ("identify --law hertz-guide -o out/joint.toml", "MEASUREMENTS"),
        (f"identify {STATIC} --law hertz-guide", "-o"),
        (f"trace {RIG} --joint {START}", "-o"),
        (f"run {TWO_MASS}", "-o"),
        (f"frf {TWO_MASS}", "-o"),
        # files that are absent or something else
        (f"df nowhere.toml {AT}", "nowhere.toml: no such file, expected a joint file"),
        ("check nowhere.toml", "nowhere.toml: no such file, expected a machine file"),
        ("lobes nowhere.toml", "nowhere.toml: no such file, expected a machine file"),
        ("run nowhere.toml -o out", "nowhere.toml: no such file, expected a machine file"),
        ("frf nowhere.toml -o out/frf.npz", "nowhere.toml: no such file"),
        (f"trace nowhere.toml --joint {START} -o out", "nowhere.toml: no such file, expected a measurement file"),
        (f"trace {RIG} --joint nowhere.toml -o out", "nowhere.toml: no such file, expected a joint file"),
        ("identify nowhere.toml --law viscous -o out/joint.toml", "nowhere.toml: no such file"),
        (f"identify {STATIC} --start nowhere.toml -o out/joint.toml", "nowhere.toml: no such file"),
        ("fmu nowhere.toml -o out/x.fmu", "nowhere.toml: no such file"),
        ("fmu --verify nowhere.fmu", "nowhere.fmu: no such file"),
        ("inspect nowhere.csv", "nowhere.csv: no such file"),
        (f"df folder.toml {AT}", "folder.toml: cannot be read"),
        ("inspect folder.toml", "folder.toml: a folder"),
        ("inspect folder.npz", "folder.npz: a folder"),
        ("fmu --verify folder.toml", "folder.toml: cannot be read"),
        (f"df {TWO_MASS} {AT}", "schema is 'jointlib/machine/1', expected \"jointlib/joint/1\""),
        (f"check {GUIDE}", "schema is 'jointlib/joint/1', expected \"jointlib/machine/1\""),
        (f"run {GUIDE} -o out", 'expected "jointlib/machine/1"'),
        (f"identify {GUIDE} --law viscous -o out/joint.toml", 'expected "jointlib/measurement/1"'),
        *((f"inspect garbage.{s}", f"garbage.{s}") for s in ("toml", "csv", "npz", "mat", "uff", "unv", "fmu", "xyz")),
        *((f"inspect nothing.{s}", f"nothing.{s}") for s in ("toml", "csv", "npz", "mat", "uff", "unv", "fmu")),
        ("inspect cut.npz", "cut.npz: cannot be read as npz"),
        ("inspect array.npz", "array.npz: cannot be read as npz"),
        ("inspect late.csv", "late.csv: line 50002 is 'ÿ,1', expected 2 numbers a row"),
        ("inspect plain", "no reader for '' files, expected one of asc, csv, dat"),
        (f"df garbage.toml {AT}", "garbage.toml: cannot be read"),
        (f"df nothing.toml {AT}", "schema is None"),
        ("fmu --verify garbage.fmu", "garbage.fmu: not an intact zip archive"),
        ("fmu --verify zip.fmu", "zip.fmu: not an intact zip archive"),
        # places that cannot be written
        (f"frf {TWO_MASS} -o plain/frf.npz", "plain is a file, expected a folder"),
        (f"frf {TWO_MASS} -o folder.npz", "folder.npz is a folder, expected the name of a file"),
        (f"frf {TWO_MASS} -o out/frf.txt", "ends in '.txt', expected .npz, .csv, .frf, .svg, .png"),
        (f"lobes {TOOL} -o out/lobes.txt", "ends in '.txt', expected .npz, .csv, .svg"),
        (f"lobes {TOOL} -o plain/lobes.npz", "plain is a file"),
        (f"identify {STATIC} --law hertz-guide -o folder.toml", "folder.toml is a folder"),
        (f"identify {STATIC} --law hertz-guide -o plain/joint.toml", "plain is a file"),
        (f"trace {RIG} --joint {START} -o plain", "plain is a file, expected a folder"),
        (f"trace {RIG} --joint {START} -o plain/deep/out", "plain is a file, expected a folder"),
        (f"fmu {GUIDE} -o out/guide.zip", "ends in '.zip', expected .fmu"),
        (f"fmu {GUIDE} -o plain/guide.fmu", "plain is a file"),
        (f"run {TWO_MASS} -o plain", "plain is a file, expected a folder"),
        (f"run {TWO_MASS} -o plain/out", "plain is a file, expected a folder"),
        (f"run {TOOL} -o out --amplitude -1um", "--amplitude"),
        (f"run {TWO_MASS} -o out --amplitude 1um", "no [cutting]"),
        (f"check {TWO_MASS} --amplitude 1mm", "the joint guide ends at 1.12"),
        # values without sense
        (f"df {GUIDE} --amplitude -1um --frequency 500", "--amplitude: -1um, expected at least 0 m"),
        (f"df {GUIDE} --amplitude 1N --frequency 500", "--amplitude: unit 'N' does not fit, expected one like 'm'"),
        (f"df {GUIDE} --amplitude nan --frequency 500", "--amplitude: 'nan', expected a number"),
        (f"df {GUIDE} --amplitude 1e999 --frequency 500", "expected a finite value in m"),
        (f"df {GUIDE} --amplitude '' --frequency 500", "expected a number"),
        (f"df {GUIDE} --amplitude 1um, --frequency 500", "expected a number"),
        (f"df {GUIDE} --amplitude 1um --frequency -5", "--frequency: -5, expected at least 0 Hz"),
        (f"df {GUIDE} --amplitude 1um --frequency 500rpm", "unit 'rpm', expected Hz or kHz"),
        (f"df {GUIDE} --amplitude 1um --frequency 5:1:10", "--frequency: unit ':1:10', expected Hz"),
        (f"df {GUIDE} {AT} --bias 1N", "--bias: unit 'N' does not fit"),
        (f"check {TWO_MASS} --amplitude -1um", "amplitude is -1e-06 m, expected more than 0"),
        (f"check {TWO_MASS} --amplitude 0", "expected more than 0, or none for the tangent at rest"),
        (f"{FRF} --frequency 5:1:10", "--frequency: runs from 5 to 1 Hz, expected 0 < low < high"),
        (f"{FRF} --frequency 100", "'100', expected lo:hi or lo:hi:n"),
        (f"{FRF} --frequency -5:10:4", "expected 0 < low < high"),
        (f"{FRF} --frequency 5:10:1", "1 lines, expected 2 to"),
        (f"{FRF} --frequency 5N:10", "unit 'N', expected Hz or kHz"),
        (f"{FRF} --force 0", "force is 0 N, expected more than 0"),
        (f"{FRF} --force -5", "force is -5 N, expected more than 0"),
        (f"{FRF} --force 5um", "--force: unit 'um' does not fit, expected one like 'N'"),
        (f"{FRF} --drive slide.y", "no degree of freedom 'slide.y', did you mean 'slide.x'?"),
        (f"{FRF} --drive spindle", "expected one of base.x, slide.x"),
        (f"{FRF} --harmonics 3,5", "ascending multiples that begin with 1"),
        (f"{FRF} --harmonics many", "--harmonics: 'many', expected 1, auto or multiples"),
        (f"lobes {TOOL} --speed 0", "a spindle speed of 0 rpm, expected finite ones above 0"),
        (f"lobes {TOOL} --speed -600", "a spindle speed of -600 rpm, expected finite ones above 0"),
        (f"lobes {TOOL} --speed 600N", "--speed: unit 'N', expected rpm"),
        (f"lobes {TOOL} --amplitude -1um", "--amplitude: -1um, expected at least 0 m"),
        (f"lobes {TOOL} --amplitude 1,2,5um", "numbers with a unit and without, expected a unit at each, such as 1um"),
        (f"lobes {TOOL} --speed 9000 --depth 1 2mm", "--depth: 1 2mm, numbers with a unit and without"),
        (f"lobes {TOOL} --speed 9000 --depth 1", "expected at most 0.5 m; a number without a unit is in m"),
        (f"lobes {TOOL} --speed 9000 --depth 2m", "--depth: 2m, expected at most 0.5 m\n"),
        (f"lobes {TOOL} --amplitude 5", "--amplitude: 5, expected at most 0.01 m; a number without a unit is in m"),
        (f"lobes {TOOL} --method zeroth", "no method 'zeroth'"),
        (f"lobes {TOOL} --method zero-ordr", "did you mean 'zero-order'?"),
        (f"lobes {TOOL} --method turning", "the process is milling"),
        (f"lobes {TOOL} --depth 1mm", "--depth: needs --speed"),
        (f"lobes {TOOL} --speed 9000 --depth 0", "depths must be finite and positive"),
        (f"lobes {TOOL} --speed 9000 --depth 1N", "--depth: unit 'N' does not fit, expected one like 'm'"),
        (f"lobes {TOOL} --witness", "--witness: simulates one point at a time, expected --speed and --depth"),
        (f"lobes {TWO_MASS}", "no [cutting], lobes need a cutting operation"),
        (f"fmu {GUIDE}", "expected a joint file and -o X.fmu"),
        (f"fmu {GUIDE} --verify x.fmu", "--verify: takes the FMU alone"),
        (f"fmu {GUIDE} -o out/x.fmu --fmi 3 --runtime python", "leave the runtime out or use 'c'"),
        (f"fmu {GUIDE} -o out/x.fmu --fmi 4", "'4' is not one of"),
        (f"fmu {GUIDE} -o out/x.fmu --runtime java", "'java' is not one of"),
        (f"fmu {GUIDE} -o out/x.fmu --platform win46", "platform 'win46' is not known, did you mean 'win64'"),
        (f"fmu {GUIDE} -o out/x.fmu --platform win64 --runtime python", "the Python runtime brings its own"),
        (f"identify {STATIC} -o out/joint.toml", "expected either --law or --start"),
        (f"identify {STATIC} --law hertz-guide --start {START} -o out/j.toml", "expected either --law or --start"),
        (
            f"identify {STATIC} --law herz-guide -o out/joint.toml",
            "unknown law 'herz-guide', did you mean 'hertz-guide'",
        ),
        (f"identify {STATIC} --law viscous -o out/joint.toml", "no record depends on it"),
        (f"{FIT} --order 3,3", "no surface among the laws"),
        (f"{FIT} --order 3", "--order: '3', expected two whole numbers i,j"),
        (f"trace {RIG} -o out", "neither --joint nor --machine is given, expected one of them"),
        (f"trace {RIG} --joint {START} --machine {TWO_MASS} -o out", "both --joint and --machine is given"),
        (f"trace {STATIC} --joint {START} -o out", "a trace needs records of motion"),
        (f"trace {RIG} --machine {TWO_MASS} -o out", "kind is 'rig', expected --joint with it"),
        (f"trace {TIP} --joint {START} -o out", "kind is 'frf', expected --machine with it"),
        (f"trace {TIP} --machine {TWO_MASS} -o out", "no degree of freedom 'spindle.x', "),
        (f"trace {TIP} --machine nowhere.toml -o out", "nowhere.toml: no such file, expected a machine file"),
        (f"identify {TIP} --law viscous -o out/joint.toml", "kind is 'frf', identify needs static, rig or path"),
        (f"{TRACE} --seed many", "'many' is not a valid integer"),
        (f"{TRACE} --seed -1", "-1 is not in the range"),
    ],
)
def test_a_wrong_command_gets_one_sentence(command: str, said: str, at_bench: Path) -> None:
    refused(command, said)


def changed(name: str, old: str, new: str) -> None:
    path = Path(name)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Path]:
    """A copy of the library to spoil."""
    shutil.copytree(LIBRARY, tmp_path / "library")
    with contextlib.chdir(tmp_path):
        yield tmp_path


RECORD = 'file = "rig_1.npz"'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rig_1.npz", "rig_9.npz", "rig_9.npz: no such file, expected a record"),
        ('name = "a2"', 'name = "b2"', "channel 'a2' is missing, a rig needs accelerations a1 and a2"),
        ('name = "P"', 'name = "force"', "rig_1.npz: no column 'force', expected one of P, a1, a2, a3"),
        (
            "{ mass = 0.942, u = 1e-4 }",
            '"0.942 N/mm"',
            "runner_block: unit 'N/mm' does not fit, expected one like 'kg'",
        ),
        ("mass = 0.942", "mass = -1", "runner_block is -1 kg, expected a positive mass"),
        ("mass = 0.942", "mass = nan", "expected a finite value in kg"),
        ("u = 1e-4", "u = -1e-4", "expected a standard uncertainty"),
        ("settle", "setle", "unknown key 'setle', did you mean 'settle'?"),
        (
            RECORD,
            f'{RECORD}\nsample_rate = "51200 Hz"',
            "different sample rates (51200 Hz and 102400 Hz), expected one",
        ),
        ('["2 kHz", "20 kHz"]', '["20 kHz", "2 kHz"]', "band runs from 20000 to 2000 Hz, expected low before high"),
        ('["2 kHz", "20 kHz"]', '["2 kHz", "60 kHz"]', "expected at most half the sample_rate"),
        ('"102400 Hz"', '"102400 rpm"', "sample_rate: unit 'rpm', expected Hz"),
        ('"102400 Hz"', "0", "sample_rate is 0 Hz, expected a positive one"),
        ("period = 5120", "", "rig_1.npz has no period"),
        ("period = 5120", "period = 1.5", "period is 1.5, expected a whole number"),
        ("period = 5120", "period = 999999", "0 whole periods"),
        ("period = 5120", "period = 5119", "the period of 5119 samples is not whole; the signals shift by 1 samples"),
        ("period = 5120", "period = 4000", "rig_1.npz: the period of 4000 samples is not whole"),
        ("settle = 0", "settle = 99", "4 whole periods, settle = 99 drops them"),
        ('driven = "runner_block"', 'driven = "runer"', "driven is 'runer', did you mean 'runner_block'?"),
        ('body = "rail"', 'body = "rial"', "channel a2: body is 'rial', did you mean 'rail'?"),
        ('role = "quiet"', 'role = "silent"', "role is 'silent', did you mean 'quiet'?"),
        ('role = "fit"', 'role = "sealed"', 'no record has role = "fit"'),
        ('kind = "rig"', 'kind = "rigg"', "kind is 'rigg', did you mean 'rig'?"),
        (RECORD, f"{RECORD}\nrows = [9, 2]", "rows is [9, 2], expected [first, end)"),
        (RECORD, f"{RECORD}\nrows = [0, 9999999]", "rows [0, 9999999], the file has 20480"),
        ('unit = "m/s^2"', 'unit = "N"', "unit 'N' does not fit, expected one like 'm/s^2'"),
        ('unit = "m/s^2"', 'unit = "qqq"', "unit 'qqq' is not known, expected one like 'm/s^2'"),
        ("gain = 0.125 ", "gain = 0 ", "gain is 0"),
        ("range = 4096.0", "range = -1", "range is -1, expected a positive full scale"),
        ('"acceleration"', '"accel"', "quantity is 'accel', did you mean 'acceleration'?"),
        ('name = "a3"', 'name = "a2"', "a channel name stands twice"),
        ("measurement/1", "measurement/2", "schema is 'jointlib/measurement/2'"),
        ("[bodies]", "[bodies", "not valid TOML"),
        ("[bodies]", '[[correction]]\nfamily = "gian"\n[bodies]', "family is 'gian', did you mean 'gain'?"),
        (
            "[bodies]",
            '[[correction]]\nfamily = "gain"\nchannel = "a2"\ngain = "2 mm"\n[bodies]',
            "gain: unit 'mm' does not fit",
        ),
        (
            "[bodies]",
            '[[correction]]\nfamily = "offset"\nchannel = "a2"\noffset = 1\nrecord = "rig_9.npz"\n[bodies]',
            "names record 'rig_9.npz', did you mean 'rig_",
        ),
    ],
)
def test_a_wrong_measurement_file_gets_one_sentence(old: str, new: str, said: str, own: Path) -> None:
    changed(RIG, old, new)
    refused(TRACE, said)


def test_one_period_without_a_quiet_record_asks_for_what_tells_the_noise(own: Path) -> None:
    changed(RIG, "settle = 0", "settle = 3")
    changed(RIG, 'file = "rig_quiet.npz"\nrole = "quiet"', 'file = "rig_1.npz"\nrole = "fit"')
    refused(TRACE, 'expected at least 2 periods or a record with role = "quiet": nothing else tells the noise')


def spoil(change: Callable[[dict[str, np.ndarray]], object]) -> None:
    path = Path("library/guide_mill/rig_1.npz")
    with np.load(path) as archive:
        data = {name: archive[name].astype(float) for name in archive.files}
    change(data)
    np.savez(path, **data)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["a2"].__setitem__(7, np.nan), "column 'a2' row 7 is nan, expected a number"),
        (lambda d: d["a2"].__setitem__(0, -np.inf), "column 'a2' row 0 is -inf, expected a number"),
        (lambda d: d.pop("a2"), "no column 'a2'"),
        (lambda d: d.update(a2=d["a2"][:-5]), "channels of different length (a1 20480, a2 20475"),
        (lambda d: d.update(a2=d["a2"].reshape(2, -1)), "no column 'a2'"),
        (lambda d: d.update({k: v[:0] for k, v in d.items()}), "holds no samples"),
        (lambda d: d.update({k: v[:99] for k, v in d.items()}), "0 whole periods"),
        (lambda d: d["a2"].fill(3), "channel a2 is constant while others move; it is dead"),
        (
            lambda d: d.update({k: np.random.default_rng(1).normal(size=len(v)) for k, v in d.items()}),
            "nothing repeats",
        ),
    ],
)
def test_a_wrong_record_gets_one_sentence(
    change: Callable[[dict[str, np.ndarray]], object], said: str, own: Path
) -> None:
    spoil(change)
    refused(TRACE, "rig_1.npz", said)


@pytest.mark.parametrize("damage", ["half", "flipped"])
def test_a_damaged_archive_gets_one_sentence(damage: str, own: Path) -> None:
    path = Path("library/guide_mill/rig_1.npz")
    data = bytearray(path.read_bytes())
    middle = len(data) // 3
    data[middle : middle + 2] = bytes(255 - b for b in data[middle : middle + 2])
    path.write_bytes(data if damage == "flipped" else data[:middle])
    refused(TRACE, "rig_1.npz: cannot be read as npz")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "empty, expected a header row"),
        ("deflection,load\n", "has a header but no samples"),
        ("1.5,2\n2.5,3\n", "the first row holds numbers, expected a header row"),
        ("deflection;load\n1,234;5,678\n", "line 2, '1,234;5,678', can be read in two ways: as 1.234, 5.678 ("),
        ("# a\ndeflection,load\n1,2\n\n2,x\n", "line 5 is '2,x', expected 2 numbers a row"),
        ("deflection,load\n1,2\n2,\n", "column 'load' row 1 is nan, expected a number"),
        ("deflection,load\n1,2\n2\n", "line 3 is '2', expected 2 numbers a row"),
        ("deflection,load\n1,2\n1_0,2\n", "line 3 is '1_0,2', expected 2 numbers a row"),
        ("deflection,load\n1,2\n2,nan\n", "column 'load' row 1 is nan, expected a number"),
        ("deflection,deflection\n1,2\n", "a column name stands twice"),
        ("deflection,laod\n1,2\n", "no column 'load', did you mean 'laod'?"),
        ("deflection,load\n1,2\n2,3\n", "2 points, expected at least 8 on a loading curve"),
        ("deflection,load\n" + "0,0\n" * 9, "'deflection' is zero throughout"),
    ],
)
def test_a_wrong_table_gets_one_sentence(text: str, said: str, own: Path) -> None:
    Path("library/guide_mill/static.csv").write_text(text)
    refused(FIT, "static.csv", said)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("3.931408125e-8", "nan", "[[law]] 1 (hertz-guide): kappa: nan, expected a finite value in m/N^(2/3)"),
        ("3.931408125e-8", "-1", "kappa is -1.0 m/N^(2/3), expected above 0"),
        ("3.931408125e-8", '"much"', "kappa: 'much', expected a number with a unit"),
        ('"630 N"', '"630 kg"', "preload: unit 'kg' does not fit, expected one like 'N'"),
        ('"630 N"', "[630]", "preload: [630], expected a number or a string with a unit"),
        ('"630 N"', "true", "preload: True, expected a number"),
        ("preload", "prelaod", "key 'preload' is missing, did you mean it by 'prelaod'?"),
        ("damping =", "mass = 1\ndamping =", "unknown key 'mass', expected one of damping"),
        ("damping =", "dampin = 1\ndamping =", "unknown key 'dampin', did you mean 'damping'?"),
        ('"hertz-guide"', '"herz-guide"', "unknown law 'herz-guide', did you mean 'hertz-guide'?"),
        ('"hertz-guide"', '"magic"', "or 17 others"),
        ('["contact_angle"]', '["angle"]', "fixed names 'angle', did you mean 'contact_angle'?"),
        ("joint/1", "joint/9", "schema is 'jointlib/joint/9'"),
        ("schema =", "shema =", "schema is None"),
        ("[[law]]", "[[laws]]", "no [[law]], expected at least one"),
        (
            'damping = "503 N s/m"',
            'damping = 1\n[[modulation]]\nrole = "stifness"',
            "role is 'stifness', did you mean 'stiffness'?",
        ),
        ("[[law]]", "[[law", "not valid TOML"),
        ("503 N s/m", "503 N/m", "damping: unit 'N/m' does not fit"),
        ('damping = "503 N s/m"', "damping = 1\n[validity]\namplitude = [2, 1]", "amplitude runs from 2 to 1"),
        (
            'damping = "503 N s/m"',
            'damping = 1\n[covariance]\nnames = ["viscous.damping"]\nmatrix = [[-1]]',
            "the variance of viscous.damping is negative",
        ),
    ],
)
def test_a_wrong_joint_file_gets_one_sentence(old: str, new: str, said: str, own: Path) -> None:
    changed(GUIDE, old, new)
    refused(f"df {GUIDE} {AT}", "guide.joint.toml", said)
    refused(f"fmu {GUIDE} -o out/guide.fmu", "guide.joint.toml", said)


JOINT = 'joint = "two_mass.joint.toml"'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("two_mass.joint", "none.joint", "(guide): joint refers to library/none.joint.toml, which does not exist"),
        (JOINT, "", "expected one of joint, identify or rigid"),
        (JOINT, f"{JOINT}\nrigid = true", "expected one of joint, identify or rigid"),
        (JOINT, 'identify = { from = ["none.toml"] }', "none.toml: no such file, expected a measurement file"),
        (JOINT, "identify = { from = [] }", "from is empty, expected at least one measurement file"),
        (JOINT, 'joint = { law = [{ kind = "linear" }] }', "key 'stiffness' is missing"),
        ("two_mass.joint", "two_mode_tool", "schema is 'jointlib/machine/1', expected \"jointlib/joint/1\""),
        ('["1 kHz", "7 kHz"]', '["7 kHz", "1 kHz"]', "frequency runs from 7000 to 1000 Hz, expected 0 < low < high"),
        ('"10 N"', '"0 N"', "force is 0 N, expected more than 0"),
        ("[[0.942]]", '[["0.942 N/mm"]]', "mass[0][0]: unit 'N/mm' does not fit, expected one like 'kg'"),
        ("[[0.942]]", "[[nan]]", "mass[0][0]: nan, expected a finite value in kg"),
        ("[[0.942]]", "[[0]]", "mass is singular"),
        ("[[0.942]]", "[[1, 2]]", "mass has shape (1, 2), expected (1, 1)"),
        ("stiffness", "stifness", "unknown key 'stifness', did you mean 'stiffness'?"),
        ('"base.x"]', '"bse.x"]', "no degree of freedom 'bse.x', did you mean 'base.x'?"),
        ('"base.x"]', '"base.x", "ground"]', "between names 3 sides, expected two"),
        ('name = "base"', 'name = "slide"', "component 'slide' is declared twice"),
        ('kind = "lumped"', 'kind = "lump"', "unknown component 'lump', did you mean 'lumped'?"),
        ('[tool]\nx = "slide.x"', '[tool]\nz = "slide.x"', "unknown key 'z'"),
        ('[tool]\nx = "slide.x"', '[tool]\nx = "slide.y"', "no degree of freedom 'slide.y', did you mean 'slide.x'?"),
        ("machine/1", "machine/2", "schema is 'jointlib/machine/2'"),
    ],
)
def test_a_wrong_machine_file_gets_one_sentence(old: str, new: str, said: str, own: Path) -> None:
    changed(TWO_MASS, old, new)
    for command in (f"check {TWO_MASS}", FRF):
        refused(command, said)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("teeth = 3", "teeth = 0", "teeth is 0, expected a whole number of at least 1"),
        ('"milling"', '"mill"', "process is 'mill', did you mean 'milling'?"),
        ('mode = "up"', 'mode = "upp"', "mode is 'upp', did you mean 'up'?"),
        ("immersion = 0.5", "immersion = 1.5", "immersion is 1.5, expected a/D of at most 1"),
        ("[4000, 25000]", "[25000, 4000]", "speed"),
        ("speed = [4000, 25000]", "", "[cutting] has no speed, expected one or --speed"),
        ('"600 N/mm^2"', '"600 N/mm"', "tangential: unit 'N/mm' does not fit"),
        ('"600 N/mm^2"', "600", "if it is meant in N/mm², write 6e+08"),
        ("teeth = 3", "teeth = 3\nhelix = '95 deg'", "helix is 95 degrees, expected from 0 to below 90"),
        ("teeth = 3", "teeth = 0", "teeth"),
    ],
)
def test_a_wrong_cutting_operation_gets_one_sentence(old: str, new: str, said: str, own: Path) -> None:
    changed(TOOL, old, new)
    refused(f"lobes {TOOL} --amplitude 1um", said)


def test_a_force_that_nobody_gives_is_asked_for(own: Path) -> None:
    changed(TWO_MASS, "force = ", "# ")
    refused(FRF, "no force is given")


def test_a_key_known_elsewhere_is_unknown_here(own: Path) -> None:
    changed(GUIDE, 'name = "guide"', "sample_rate = 5")
    refused(f"df {GUIDE} {AT}", "unknown key 'sample_rate', expected one of covariance, law, modulation, name")


def test_a_folder_without_permission_is_named_before_any_work(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # The superuser may write anywhere, so the answer of the system is put in place of a folder's mode.
    monkeypatch.setattr("jointlib.io.atomic.os.access", lambda path, mode: not mode & os.W_OK)
    for command in (TRACE, FIT, FRF, f"fmu {GUIDE} -o guide.fmu", f"lobes {TOOL} -o lobes.npz"):
        refused(command, "no permission to write into .")


def test_a_disk_that_is_full_leaves_nothing(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("jointlib.io.atomic.os.replace", full)
    refused("frf library/two_mass.toml --force 10 -o frf.npz", "frf.npz: cannot be written (No space left on device)")
