"""Several tools by name: one of them is in the machine, and what belongs to the others is not."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import machines
from jointlib.cli.main import cli
from jointlib.errors import InputError
from machines import frozen_receptance, lobes_at_amplitude, read_machine
from machines.explore.scene import Explorer
from machines.study.evaluation import Evaluation
from machines.study.study_file import read_study

HEAD = """
schema = "jointlib/machine/1"
[[component]]
name = "spindle"
kind = "lumped"
dofs = ["x", "y"]
mass = [[20.0, 0.0], [0.0, 20.0]]
damping = [["900 N s/m", 0.0], [0.0, "900 N s/m"]]
stiffness = [["80 N/um", 0.0], [0.0, "90 N/um"]]
"""
TOOL = """
[[component]]
name = "{name}"
kind = "lumped"
dofs = ["x", "y"]
mass = [[{mass}, 0.0], [0.0, {mass}]]
[[connection]]
name = "{name}_x"
between = ["{name}.x", "spindle.x"]
joint = {{ law = [{{ kind = "linear", stiffness = "20 N/um" }}, {{ kind = "viscous", damping = 60 }}] }}
[[connection]]
name = "{name}_y"
between = ["{name}.y", "spindle.y"]
joint = {{ law = [{{ kind = "linear", stiffness = "22 N/um" }}, {{ kind = "viscous", damping = 60 }}] }}
"""
LONG, SHORT = TOOL.format(name="long_cutter", mass=1.4), TOOL.format(name="short_cutter", mass=0.5)
CUT = """
[response]
frequency = [100, 4000]
force = [10]
[static]
force = {{ "short_cutter.x" = 100.0 }}
[cutting]
process = "milling"
teeth = {teeth}
tangential = 8e8
normal = 2e8
mode = "down"
immersion = 0.5
speed = [3000, 9000]
"""
NAMED = """
[tool.short]
x = "short_cutter.x"
y = "short_cutter.y"
components = ["short_cutter"]
[tool.long]
x = "long_cutter.x"
y = "long_cutter.y"
components = ["long_cutter"]
cutting = { teeth = 2 }
"""
BOTH = HEAD + LONG + SHORT + CUT.format(teeth=4) + NAMED


def written(folder: Path, text: str) -> Path:
    path = folder / "mill.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_first_tool_is_in_the_machine_and_another_one_by_its_name(tmp_path: Path) -> None:
    path = written(tmp_path, BOTH)
    short, long = read_machine(path), read_machine(path, {"tool.use": "long"})
    assert (short.tool_name, long.tool_name) == ("short", "long")
    assert [c.name for c in short.components] == ["spindle", "short_cutter"]
    assert [c.name for c in long.connections] == ["long_cutter_x", "long_cutter_y"]
    assert short.cutting is not None
    assert long.cutting is not None
    assert (short.cutting["teeth"], long.cutting["teeth"]) == (4, 2)
    assert "The tool is 'long'." in long.remarks()


def test_a_named_tool_makes_the_machine_of_a_file_that_has_no_other(tmp_path: Path) -> None:
    lines = np.linspace(200.0, 1500.0, 40)
    long = frozen_receptance(read_machine(written(tmp_path, BOTH), {"tool.use": "long"}), lines, 0.0).receptance
    alone = HEAD + LONG + CUT.format(teeth=2).replace("short_cutter", "long_cutter")
    alone = alone.replace('[static]\nforce = { "long_cutter.x" = 100.0 }\n', "")
    only = read_machine(written(tmp_path, alone + '[tool]\nx = "long_cutter.x"\ny = "long_cutter.y"\n'))
    np.testing.assert_allclose(long, frozen_receptance(only, lines, 0.0).receptance, rtol=1e-12)


def test_a_file_may_say_which_tool_it_has_and_the_verbs_another(tmp_path: Path) -> None:
    path = written(tmp_path, BOTH.replace("[tool.short]", '[tool]\nuse = "long"\n[tool.short]'))
    assert read_machine(path).tool_name == "long"
    for name in ("short", "long"):
        asked = ["lobes", str(path), "--tool", name, "--speed", "6000", "--method", "zero-order", "--json"]
        done = CliRunner().invoke(cli, asked, catch_exceptions=False)
        assert done.exit_code == 0, done.output
        tool = read_machine(path, {"tool.use": name})
        chart = lobes_at_amplitude(tool, np.array([6000.0]), 0.0, "zero-order")
        assert json.loads(done.stdout)["minimum_depth"] == chart.minimum_depth
        assert json.loads(done.stdout)["depth"] == chart.depth.tolist()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[tool.short]", '[tool]\nuse = "lang"\n[tool.short]', "did you mean 'long'"),
        ("[tool.short]", '[tool]\nx = "spindle.x"\n[tool.short]', "stands beside named tools"),
        ('components = ["long_cutter"]', 'components = ["cutter_long"]', "components names 'cutter_long'"),
        ("cutting = { teeth = 2 }", "cutting = 2", "expected a table with keys of [cutting]"),
        (NAMED, '[tool]\nuse = "long"\nx = "short_cutter.x"\n', "no tool has a name"),
    ],
)
def test_a_tool_that_cannot_be_chosen_is_refused_in_a_sentence(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in BOTH
    with pytest.raises(InputError) as refused:
        read_machine(written(tmp_path, BOTH.replace(old, new)))
    assert words in str(refused.value)


STUDY = """
schema = "jointlib/study/1"
base = "mill.toml"
[[factor]]
name = "immersion"
path = "cutting.immersion"
values = [0.3, 0.7]
[[objective]]
quantity = "minimum-depth"
goal = "max"
[conditions]
speeds = 20
"""
VARIED = """[[factor]]
name = "tool"
path = "tool.use"
values = ["short", "long"]
[[objective]]"""


def depths(folder: Path) -> dict[str, list[float]]:
    """Lowest stable depth in m of either tool at the two immersions, by `jointlib lobes`."""
    found: dict[str, list[float]] = {}
    for name in ("short", "long"):
        for immersion in (0.3, 0.7):
            path = folder / "one.toml"
            path.write_text(BOTH.replace("immersion = 0.5", f"immersion = {immersion}"), "utf-8")
            machine = read_machine(path, {"tool.use": name})
            found.setdefault(name, []).append(
                lobes_at_amplitude(machine, np.linspace(3000.0, 9000.0, 20), 0.0, "zero-order").minimum_depth
            )
    return found


@pytest.mark.parametrize(
    ("text", "tools", "wanted"),
    [
        (STUDY, (), ("short",)),
        (STUDY, ("long",), ("long",)),
        (STUDY + 'tool = "long"\n', (), ("long",)),
        (STUDY + 'tool = "long"\n', ("short",), ("short",)),
        (STUDY + 'tool = ["short", "long"]\n', (), ("short", "long")),
        (STUDY, ("long", "short"), ("long", "short")),
        (STUDY.replace("[[objective]]", VARIED), (), ("short", "long")),
    ],
)
def test_a_study_computes_every_tool_as_lobes_does(
    tmp_path: Path, text: str, tools: tuple[str, ...], wanted: tuple[str, ...]
) -> None:
    written(tmp_path, BOTH)
    (tmp_path / "a.study.toml").write_text(text, "utf-8")
    study, known = read_study(tmp_path / "a.study.toml", tools), depths(tmp_path)
    found = Evaluation(study.source, tools=tools)(0, study.total)["minimum-depth"]
    if "tool.use" in text:
        assert found.reshape(2, 2).T.ravel().tolist() == pytest.approx([*known["short"], *known["long"]], rel=1e-9)
    else:
        assert found.reshape(2, -1).T.tolist() == [pytest.approx(known[name], rel=1e-9) for name in wanted]
        assert [case.tool for case in study.cases] == ([""] if wanted == ("short",) and not tools else list(wanted))


def test_a_study_run_with_a_tool_writes_the_machine_with_it_and_belongs_to_it(tmp_path: Path) -> None:
    written(tmp_path, BOTH)
    (tmp_path / "a.study.toml").write_text(STUDY, "utf-8")
    (tmp_path / "b.study.toml").write_text(STUDY.replace("[[objective]]", VARIED), "utf-8")

    def study(words: str) -> Result:
        return CliRunner().invoke(cli, ["study", *words.format(f=tmp_path).split(), "--workers", "1"])

    done = study("run {f}/a.study.toml -o {f}/out --tool long --json")
    assert done.exit_code == 0, done.output
    best = read_machine(tmp_path / "out" / "best.toml")
    assert (best.tool_name, best.cutting["teeth"] if best.cutting else None) == ("long", 2)
    depth = json.loads(done.stdout)["best"]["results"]["minimum-depth"]
    assert depth == pytest.approx(
        lobes_at_amplitude(best, np.linspace(3000.0, 9000.0, 20), 0.0, "zero-order").minimum_depth
    )
    assert "--tool long" in (tmp_path / "out" / "report.html").read_text("utf-8")
    for words, said in (
        ("run {f}/a.study.toml -o {f}/out --tool short", "it differs in --tool"),
        ("run {f}/a.study.toml -o {f}/other --tool lang", "did you mean 'long'"),
        ("run {f}/b.study.toml -o {f}/other --tool long", "tool.use is a factor and is given by --tool"),
    ):
        assert said in str(study(words).exception)


@pytest.mark.slow
def test_the_explorer_shows_and_saves_the_tool_it_was_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path, BOTH)
    short, long = Explorer(path), Explorer(path, tool="long")
    assert (short.base.tool_name, long.base.tool_name) == ("short", "long")
    assert [c.value for c in long.controls if c.key == "cutting.teeth"] == [2.0]
    stiffer = {"cutting.immersion": 70.0}
    assert long.summary(stiffer).minimum_depth == pytest.approx(depths(tmp_path)["long"][1], rel=1e-3)
    saved, *_ = long.save(stiffer, tmp_path / "kept", "best")
    again = read_machine(saved)
    assert (again.tool_name, again.cutting["immersion"] if again.cutting else None) == ("long", 0.7)
    page = long.report(stiffer, tmp_path / "kept", "page").read_text("utf-8")
    assert "--tool long" in page
    assert "with the tool long as set" in page


def test_the_explorer_refuses_a_study_of_another_tool(tmp_path: Path) -> None:
    path = written(tmp_path, BOTH)
    (tmp_path / "a.study.toml").write_text(STUDY, "utf-8")
    asked = ["study", "run", f"{tmp_path}/a.study.toml", "-o", f"{tmp_path}/out", "--tool", "long", "--workers", "1"]
    assert CliRunner().invoke(cli, asked, catch_exceptions=False).exit_code == 0
    shown = Explorer(path, tmp_path / "a.study.toml", tmp_path / "out", tool="long").scatter()
    assert shown is not None
    assert len(shown.rows) == 2
    with pytest.raises(InputError, match=r"is a study of the tool long, expected one of 'short', or --tool"):
        Explorer(path, tmp_path / "a.study.toml", tmp_path / "out")


def test_every_verb_of_a_machine_takes_a_tool_and_refuses_one_that_is_not_there(tmp_path: Path) -> None:
    path = written(tmp_path, BOTH)
    said = CliRunner().invoke(cli, ["inspect", str(path), "--tool", "long"], catch_exceptions=False)
    assert "tool x: long_cutter.x" in said.stdout
    for verb in ("inspect", "modes", "frf", "lobes", "check", "run", "fmu", "ssp", "explore"):
        more = {"frf": "frf.npz", "run": "out", "fmu": "m.fmu", "ssp": "m.ssp"}.get(verb)
        words = [verb, str(path), "--tool", "lang", *(["-o", f"{tmp_path}/{more}"] if more else [])]
        done = CliRunner().invoke(cli, words)
        assert "[tool]: use is 'lang', did you mean 'long'?" in str(done.exception), verb
    joint = str(Path(machines.__file__).parent / "library" / "guide.joint.toml")
    for words in (["inspect", joint], ["fmu", joint, "-o", f"{tmp_path}/m.fmu"]):
        assert "is no machine" in str(CliRunner().invoke(cli, [*words, "--tool", "long"]).exception)


FAULTS = [
    # what stands there, what is written instead, words of the one sentence, the line that it shows
    (
        "mass = [[0.5, 0.0], [0.0, 0.5]]",
        "mas = [[0.5, 0.0], [0.0, 0.5]]",
        "[[component]] 3 (short_cutter): key 'mass'",
        0,
    ),
    ("frequency = [100, 4000]", "frequency = [4000, 100]", "frequency runs from 4000 to 100 Hz", 0),
    ("[tool.long]\n", '[tool.long]\nz = "long_cutter.x"\n', "[tool.long]: unknown key 'z'", 1),
    ('y = "long_cutter.y"', 'y = "lang_cutter.y"', "[tool.long]: y is 'lang_cutter.y', but there is no component", 0),
    ("cutting = { teeth = 2 }", "cutting = { teth = 2 }", "[tool.long]: [cutting]: unknown key 'teth'", 0),
    (
        'components = ["short_cutter"]',
        'components = ["short_cuter"]',
        "[tool.short]: components names 'short_cuter'",
        0,
    ),
    ('y = "short_cutter.y"', 'y = "short_cutter.q"', "[tool.short]: y: no degree of freedom 'short_cutter.q'", 0),
    ("[tool.short]\n", '[tool.short]\ncutting = { mode = "upp" }\n', "[tool.short]: [cutting]: mode is 'upp'", 1),
    ("teeth = 4", "teeth = 0", "[cutting]: teeth is 0", 0),
    ("[tool.short]\n", '[tool]\nuse = "lang"\n[tool.short]\n', "[tool]: use is 'lang', did you mean 'long'?", 1),
    ("[tool.short]\n", '[tool]\ny = "spindle.y"\n[tool.short]\n', "[tool]: y stands beside named tools", 1),
    ('components = ["long_cutter"]', "components = 3", "[tool.long]: components is 3", 0),
]


@pytest.mark.parametrize("seed", range(24))
def test_faults_of_named_tools_and_of_the_rest_are_told_together(seed: int, tmp_path: Path) -> None:
    heads = [i for i, (_, new, _, _) in enumerate(FAULTS) if new.startswith("[tool]")]
    most = np.random.default_rng(seed).permutation(len(FAULTS))
    three = [i for i in most if i not in heads[seed % 2 :: 2]][:3]  # a table stands there once
    text = BOTH
    for old, new, _, _ in (FAULTS[i] for i in three):
        assert old.splitlines()[0] in text
        text = text.replace(old, new, 1)
    with pytest.raises(InputError) as refused:
        read_machine(written(tmp_path, text))
    assert len(refused.value.sentences) == 3, refused.value
    for _, new, words, beside in (FAULTS[i] for i in three):
        (said,) = (said for said in refused.value.sentences if words in said)
        (shown,) = re.findall(r"\(line (\d+): (.*)\)$", said)
        assert text.splitlines()[int(shown[0]) - 1] == new.splitlines()[beside] == shown[1]


@pytest.mark.parametrize("key", ["component", "connection", "bundle", "static", "cutting", "tool"])
@pytest.mark.parametrize("value", ["3", '"x"', "[1]", "{}", '[{ name = "a" }]', "[]"])
def test_whatever_stands_for_a_table_beside_named_tools_is_refused_or_read(
    tmp_path: Path, key: str, value: str
) -> None:
    text = BOTH if key in ("bundle",) else re.sub(rf"(?ms)^\[+{key}[\].].*?(?=^\[(?!\[?{key})|\Z)", "", BOTH)
    path = written(tmp_path, f"{key} = {value}\n{text}")
    done = CliRunner().invoke(cli, ["inspect", str(path)])
    assert done.exit_code == 0 or isinstance(done.exception, InputError), done.exception


def test_a_change_of_the_cut_goes_over_that_of_the_tool_as_in_a_study(tmp_path: Path) -> None:
    long = read_machine(written(tmp_path, BOTH), {"tool.use": "long", "cutting.teeth": 3})
    assert long.cutting is not None
    assert long.cutting["teeth"] == 3
