"""Functions that have the name of a verb: they find what the verb prints, and the verb goes through them."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
import urllib.request
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from command_line import jointlib as called
from tools import package

import jointlib
import machines
from fmu.export import export_fmu
from fmu.ssp import export_ssp
from jointlib.cli.main import verbs
from jointlib.errors import InputError
from jointlib.shown.json_values import plain
from jointlib.shown.result import Shown

LIBRARY = Path("machines/library")
TWO_MASS = LIBRARY / "two_mass.toml"
TOOL = LIBRARY / "two_mode_tool.toml"
GUIDE = LIBRARY / "guide.joint.toml"
STATIC = LIBRARY / "guide_mill" / "static.measurement.toml"
RIG = LIBRARY / "guide_mill" / "rig.measurement.toml"
START = LIBRARY / "guide_mill" / "start.joint.toml"
TIP = LIBRARY / "three_joints" / "tip.measurement.toml"
HITS = LIBRARY / "tap_test" / "hits.measurement.toml"

FUNCTIONS: Mapping[str, Any] = {
    "run": machines.run,
    "new": machines.new,
    "plan": machines.plan,
    "import": jointlib.import_,
    "inspect": machines.inspect,
    "estimate": jointlib.estimate,
    "identify": jointlib.identify,
    "trace": machines.trace,
    "df": jointlib.df,
    "frf": machines.frf,
    "modes": machines.modes,
    "uncouple": machines.uncouple,
    "stickout": machines.stickout,
    "compare": machines.compare,
    "check": machines.check,
    "lobes": machines.lobes,
    "fmu": export_fmu,
    "ssp": export_ssp,
    "study": machines.study,
    "explore": machines.explore,
}
NAMED_ELSE = {"amplitude": "amplitudes", "changes": "tool", "settings": "set", "tools": "tool"}
"""Words of an option inside the verb, and of the argument that it is."""


def same(found: Any, words: str) -> None:
    """What a function has for JSON is what its verb prints."""
    done = called(f"{words} --json")
    assert done.status == 0, done.err
    assert json.loads(json.dumps(plain(found))) == done.json


@pytest.mark.parametrize("verb", sorted(FUNCTIONS))
def test_a_function_has_the_options_of_its_verb(verb: str) -> None:
    command = verbs()[verb].load()
    command = command.commands["run"] if isinstance(command, click.Group) else command
    parameters = inspect.signature(FUNCTIONS[verb]).parameters
    left = {"as_json", "verify", "limit"}
    given = [o.name for o in command.params if isinstance(o, click.Option) and o.name not in left]
    path = {"output": "path" if verb in ("fmu", "ssp") else "folder"}
    missing = [name for name in given if not {name, NAMED_ELSE.get(str(name)), path.get(str(name))} & parameters.keys()]
    assert not missing
    for parameter in list(parameters.values())[2:]:
        keyword = parameter.kind is not inspect.Parameter.POSITIONAL_OR_KEYWORD
        assert keyword or verb == "run", f"{verb}: {parameter.name} can be given by its place"


def test_df_is_what_the_verb_prints(here: Path) -> None:
    found = jointlib.df(GUIDE, amplitude=[1e-6, "3 um"], frequency="500 Hz", bias="0.2 um")
    data = called(f"df {GUIDE} --amplitude 1um 3um --frequency 500 --bias 0.2um --json").json
    assert found.amplitude.tolist() == data["amplitude"]
    assert found.gain.real.tolist() == data["gain_real"]
    assert found.gain.imag.tolist() == data["gain_imag"]
    np.testing.assert_allclose(found.damping, found.gain.imag / (1000 * np.pi), rtol=1e-15)
    assert "1 µm" in repr(found)
    axes = found.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("amplitude [µm]", "stiffness [N/µm]")
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), found.gain[:, 0].real / 1e6)


def test_identify_takes_files_and_writes_the_joint(here: Path) -> None:
    found = jointlib.identify([STATIC, RIG], start=START, output="by_function.joint.toml")
    data = called(f"identify {STATIC} {RIG} --start {START} -o by_verb.joint.toml --json").json
    assert {name: p.value for name, p in found.parameters.items()} == {
        name: p["value"] for name, p in data["parameters"].items()
    }
    assert Path("by_function.joint.toml").read_bytes() == Path("by_verb.joint.toml").read_bytes()
    again = jointlib.identify([jointlib.read_measurement(STATIC)], laws=["hertz-guide"])
    assert again.joint.parameters == jointlib.identify(STATIC, laws="hertz-guide").joint.parameters


@pytest.mark.slow
def test_trace_takes_files_or_what_was_read_of_them(here: Path) -> None:
    found = machines.trace(STATIC.with_name("rig.measurement.toml"), joint=START, output="by_function")
    same(found.as_json(), f"trace {RIG} --joint {START} -o by_verb")
    names = [path.name for path in found.files]
    assert names[-1] == "report.html"
    for name in names[:-1]:
        assert Path("by_function", name).read_bytes() == Path("by_verb", name).read_bytes(), name
    report = jointlib.trace(jointlib.read_measurement(RIG), jointlib.read_joint(START))
    assert report.as_json() == found.as_json()
    assert repr(found) == f"Trace: {report.finding()}"


def test_a_trace_asks_for_one_model(here: Path) -> None:
    with pytest.raises(InputError, match="expected --joint with it"):
        machines.trace(RIG, machine=TWO_MASS)
    with pytest.raises(InputError, match="neither --joint nor --machine"):
        machines.trace(RIG)


def test_import_writes_the_measurement_and_reads_it(here: Path) -> None:
    Path("push.csv").write_text((LIBRARY / "guide_mill" / "static.csv").read_text())
    found = jointlib.import_("push.csv", "by_function.measurement.toml")
    data = called("import push.csv -o by_verb.measurement.toml --json").json
    assert list(found.guesses) == data["guesses"]
    assert found.measurement.kind == data["kind"]
    assert [c.name for c in found.measurement.channels] == [c["name"] for c in data["channels"]]
    assert Path("by_function.measurement.toml").read_bytes() == Path("by_verb.measurement.toml").read_bytes()
    assert f"{len(found.guesses)} guess" in repr(found)
    assert found.plot().get_xlabel().endswith("[µm]")
    other = jointlib.import_("push.csv", "set.measurement.toml", set={"channel.load.unit": "kN"})
    assert next(c.unit for c in other.measurement.channels if c.quantity == "force") == "kN"


@pytest.mark.thorough
def test_estimate_writes_what_the_verb_writes(here: Path) -> None:
    found = jointlib.estimate(HITS, output="f.measurement.toml", plot="f.svg")
    data = called(f"estimate {HITS} -o v.measurement.toml --plot v.svg --json").json
    assert found.finding() == data["sentence"]
    assert [f.averages for f in found.frfs] == [f["averages"] for f in data["frfs"]]
    written = sorted(Path(p).name for p in data["files"])
    assert written == sorted(p.name for p in here.glob("v*") if p.suffix != ".svg")
    for name in written:
        assert Path(f"f{name[1:]}").exists()
    assert Path("f.svg").read_bytes() == Path("v.svg").read_bytes()
    with pytest.raises(InputError, match="is the measurement itself"):
        jointlib.estimate(HITS, output=HITS)


def test_frf_is_what_the_verb_prints_and_writes(here: Path) -> None:
    found = machines.frf(TWO_MASS, force=["10 N", 50.0], frequency=("1 kHz", 2000.0, 50), output="f.csv")
    verb = called(f"frf {TWO_MASS} --force 10 50 --frequency 1kHz:2kHz:50 -o v.csv --json").json
    named = {"file", "files"}
    assert json.loads(json.dumps(plain({k: v for k, v in found.data.items() if k not in named}))) == {
        k: v for k, v in verb.items() if k not in named
    }
    for ours, theirs in zip(found.files, verb["files"], strict=True):
        assert ours.read_bytes() == Path(theirs).read_bytes()
    assert "µm/N" in repr(found)
    axes = found.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("frequency [Hz]", "|x/F| [µm/N]")
    unwritten = machines.frf(machines.read_machine(TWO_MASS), force=10, frequency="1kHz:2kHz:50", harmonics=1)
    assert (unwritten.files, unwritten.data["file"]) == ((), None)
    assert unwritten.responses[0].force == (10.0,)


def test_lobes_are_what_the_verb_prints(here: Path) -> None:
    found = machines.lobes(TOOL, speed=["6000 rpm", 9000], depth="1 mm", amplitude=(0.0, "2 um"))
    same(found.data, f"lobes {TOOL} --speed 6000 9000 --depth 1mm --amplitude 0 2um")
    assert found.charts[0].speed.tolist() == [6000.0, 9000.0]
    assert found.columns()["amplitude"][0].tolist() == [0.0, 0.0, 2e-6, 2e-6]
    assert [line.get_label() for line in found.plot().get_lines()] == ["onset of chatter", "limit at 2 µm"]
    assert "stable at these speeds below" in repr(found)
    printed = called(f"lobes {TOOL} --speed 6000 9000 --depth 1mm --amplitude 0 2um").out
    assert printed.splitlines() == found.lines


@pytest.mark.slow
def test_modes_are_what_the_verb_prints(here: Path) -> None:
    found = machines.modes(LIBRARY / "lathe.toml", all=True)
    same(found.as_json(), f"modes {LIBRARY / 'lathe.toml'} --all")
    assert repr(found) == f"MachineModes: {found.as_json()['sentence']}"
    shares = [values for name, (values, _) in found.columns().items() if name.startswith("share of ")]
    assert np.all(np.sum(shares, axis=0) < 1 + 1e-9)
    measured = machines.modes(TIP, condition="8 N", output="f/tip.component.toml")
    data = called(f"modes {TIP} --condition '8 N' -o v/tip.component.toml --json").json
    assert plain(measured.as_json() | {"file": ""}) == data | {"file": ""}
    assert Path("f/tip.component.toml").read_bytes() == Path("v/tip.component.toml").read_bytes()
    with pytest.raises(InputError, match="--band: given with"):
        machines.modes(TWO_MASS, band=(100.0, 200.0))


def test_check_is_what_the_verb_prints(here: Path) -> None:
    found = machines.check(TWO_MASS, amplitude="2 um")
    data = called(f"check {TWO_MASS} --amplitude 2um --json").json
    assert (found.max_relative_difference, found.passed) == (data["max_relative_difference"], data["passed"])
    assert list(found.remarks) == data["warnings"]


@pytest.mark.slow
def test_compare_takes_files_or_what_was_read_of_them(here: Path) -> None:
    first, other = LIBRARY / "paper_sdof.toml", LIBRARY / "paper_sdof_hertz.toml"
    found = machines.compare(first, other, output="f.svg")
    data = called(f"compare {first} {other} -o v.svg --json").json
    assert found.finding() == data["sentence"]
    assert plain([vars(d) for d in found.differences]) == data["differences"]
    assert Path("f.svg").read_bytes() == Path("v.svg").read_bytes()
    read = machines.compare(*map(machines.read_machine, (first, other)))
    assert [d.other for d in read.differences] == [d.other for d in found.differences]
    joint = jointlib.read_joint(GUIDE)
    name = next(iter(joint.parameters))
    stiffer = joint.with_parameters({name: 1.1 * joint.parameters[name]})
    (difference,) = machines.compare(joint, stiffer).differences
    assert difference.what == name
    assert machines.compare(joint, stiffer).plot().get_xlabel() == "other against the first [%]"


def test_inspect_gives_what_a_file_holds(here: Path) -> None:
    for path, kind in ((TWO_MASS, machines.Machine), (GUIDE, jointlib.Joint), (RIG, jointlib.Measurement)):
        found = machines.inspect(path)
        same(found.as_json(), f"inspect {path}")
        assert isinstance(found.holds, kind)
        assert found.columns().keys() == found.holds.columns().keys()
        assert found.plot().get_xlabel()
    Path("two_mass.joint.toml").write_text((LIBRARY / "two_mass.joint.toml").read_text())
    Path("heavy.toml").write_text(TWO_MASS.read_text().replace("mass = [[0.942]]", "mass = [[942e6]]"))
    assert "looks wrong: " in repr(machines.inspect("heavy.toml"))
    assert "looks wrong" not in repr(machines.inspect(TWO_MASS))
    record = machines.inspect(LIBRARY / "guide_mill" / "static.csv")
    assert set(record.holds) == set(record.columns()["column"][0])
    assert record.plot().get_xlabel() == "sample"


def test_new_writes_what_the_verb_writes(here: Path) -> None:
    written = machines.new("study", "f.study.toml", machine=None)
    assert [p.name for p in written] == ["f.study.toml", "f.toml"]
    data = called("new study -o v.study.toml --json").json
    assert [data["file"], *data["beside"]] == ["v.study.toml", "v.toml"]
    assert Path("f.toml").read_bytes() == Path("v.toml").read_bytes()
    with pytest.raises(InputError, match="exists already"):
        machines.new("study", "f.study.toml")
    with pytest.raises(InputError, match="machin"):
        machines.new("machin", "m.toml")


STUDY = """
schema = "jointlib/study/1"
name = "mass"
base = "machines/library/two_mass.toml"
[[factor]]
name = "mass"
path = "component.slide.mass"
values = [[[0.9]], [[1.0]], [[1.1]]]
[[objective]]
quantity = "static-compliance"
goal = "min"
"""


@pytest.mark.thorough
def test_a_study_gives_its_verdict(here: Path) -> None:
    Path("mass.study.toml").write_text(STUDY)
    found = machines.study("mass.study.toml", "f", workers=1)
    data = called("study run mass.study.toml -o v --workers 1 --json").json
    ours = json.loads(json.dumps(plain(found.as_json())))
    assert {k: v for k, v in ours.items() if k not in ("report", "machine")} == {
        k: v for k, v in data.items() if k not in ("report", "machine")
    }
    assert (found.done, found.total) == (3, 3)
    assert found.verdict is not None
    assert (
        len(found.columns()["configuration"][0] if "configuration" in found.columns() else found.verdict.leading) >= 1
    )
    again = machines.study("mass.study.toml", "f", part="report", table="all.csv")
    assert again.as_json()["best"] == found.as_json()["best"]
    assert again.files[-1] == Path("all.csv")
    with pytest.raises(InputError, match="holds no study to resume"):
        machines.study("mass.study.toml", "empty", part="resume")
    with pytest.raises(InputError, match="--shard"):
        machines.study("mass.study.toml", "f", shard="3/2")


def test_the_page_answers_beside_the_program_until_it_is_closed(here: Path) -> None:
    package("dash")
    with machines.explore(TWO_MASS, port=0) as page:
        with urllib.request.urlopen(page.address, timeout=30) as answer:
            assert b"jointlib" in answer.read()
        assert page.alone
        assert page.address in repr(page)
        assert page.explorer.curves({}).frequency.size
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(page.address, timeout=5)


@pytest.mark.thorough
def test_exports_take_files(here: Path) -> None:
    done = export_fmu(GUIDE, "f.fmu", runtime="python")
    called(f"fmu {GUIDE} -o v.fmu --runtime python --json")
    assert Path("f.fmu").read_bytes() == Path("v.fmu").read_bytes()
    assert done.file == Path("f.fmu")
    with pytest.raises(InputError, match="is no machine"):
        export_fmu(GUIDE, "g.fmu", tool="long")


def test_a_machine_that_is_read_has_its_tool(here: Path) -> None:
    machine = machines.read_machine(TWO_MASS)
    with pytest.raises(InputError, match="this machine has one"):
        machines.check(machine, tool="long")
    assert machines.check(machine).max_relative_difference == machines.check(str(TWO_MASS)).max_relative_difference


def test_quantities_are_si_or_carry_their_unit(here: Path) -> None:
    with pytest.raises(InputError, match="--amplitude: -1 um, expected at least 0 m"):
        machines.lobes(TOOL, amplitude="-1 um")
    with pytest.raises(InputError, match=r"--frequency: runs from 3000 to 1000 Hz"):
        machines.frf(TWO_MASS, frequency=(3000, 1000))
    with pytest.raises(InputError, match=r"output: a\.toml ends in '.toml'"):
        machines.lobes(TOOL, speed=6000, output="a.toml")


@pytest.mark.parametrize("verb", ["compare", "explore", "lobes", "modes", "study"])
def test_a_room_that_has_the_name_of_a_verb_is_called_and_keeps_its_names(verb: str) -> None:
    room = getattr(machines, verb)
    assert room is import_module(f"machines.{verb}")
    function = getattr(import_module(f"machines.answers.{verb}"), verb)
    assert inspect.signature(room) == inspect.signature(function)
    assert callable(room)
    assert verb in dir(machines)


@pytest.mark.slow
def test_names_of_rooms_are_there_before_and_after_a_call_without_a_warning() -> None:
    code = """
import warnings
warnings.simplefilter("error")
import machines
found = machines.lobes("machines/library/two_mode_tool.toml", speed=6000)
from machines.lobes import amplitude_limits
from machines.explore import Explorer
from machines.study.findings.verdict import Verdict
from machines.compare.comparison import compared
from machines.modes.natural_modes import natural_modes
from machines import lobes, modes
assert lobes.amplitude_limits is amplitude_limits and machines.natural_modes is natural_modes
assert lobes("machines/library/two_mode_tool.toml", speed=6000).charts[0].depth == found.charts[0].depth
assert modes("machines/library/two_mass.toml").modes.frequency.size == 2
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parents[2])


def test_every_result_has_a_face(here: Path) -> None:
    found = [
        jointlib.df(GUIDE, amplitude=1e-6, frequency=500),
        machines.inspect(GUIDE),
        machines.check(TWO_MASS),
        machines.modes(TWO_MASS),
        machines.lobes(TOOL, speed=6000),
    ]
    for each in found:
        assert isinstance(each, Shown)
        assert repr(each) == f"{type(each).__name__}: {each.finding()}"
        assert type(each).__name__ in each._repr_html_()
