"""The documentation: what its pages show runs, and what their tables say is what the code knows."""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import importlib
import inspect
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import pytest
from repeats import repeats

from jointlib.cli.main import cli
from jointlib.effect import JointEffect
from jointlib.fault import Fault
from jointlib.parameter import parameters_of
from jointlib.path_fault import PathFault
from jointlib.registry import law

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path.name for path in DOCS.glob("*.md"))
LANGUAGES = {"console", "python", "toml", "text"}
"""``text`` is what must not run; a ``toml`` or ``python`` block that begins with ``# file: NAME`` is written there."""
ELSEWHERE = re.compile(r"jointlib (run|explore|trace .*guide_mill|.*\bmills\b|.*bed_mill)")
"""What takes long and is run by other tests; here only the arguments are read."""
LONG = ("fmu.md", "lobes.md", "loop.md", "machines.md", "plan.md", "studies.md", "tools.md", "view.md")
"""Pages that compute for many seconds."""
VERY_LONG = ("lobes.md", "plan.md", "studies.md", "tools.md")
_FENCE = re.compile(r"^```(\{?[\w-]+\}?)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_SPAN = re.compile(r"`([^`]+)`")


@dataclass(frozen=True)
class Block:
    """One fenced block of a page."""

    language: str
    text: str
    line: int

    @property
    def file(self) -> str | None:
        """Name of the file that the block is, if it is one."""
        match = re.match(r"# file: (\S+)\n", self.text)
        return match[1] if match else None


def blocks(page: str) -> list[Block]:
    text = (DOCS / page).read_text("utf-8")
    found = [Block(m[1], m[2], text[: m.start()].count("\n") + 1) for m in _FENCE.finditer(text)]
    return [b for b in found if not b.language.startswith("{")]


def section(page: str, heading: str) -> str:
    """Text of one ``##`` section."""
    match = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", (DOCS / page).read_text("utf-8"), re.M | re.S)
    assert match, f"{page} has no section {heading!r}"
    return match[1]


def rows(text: str) -> list[list[str]]:
    """Cells of every table row, the heads left out."""
    lines = [line.strip().strip("|") for line in text.splitlines() if line.strip().startswith("|")]
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)] for line in lines]
    heads = {i - 1 for i, row in enumerate(cells) if set("".join(row)) <= set("-: ")}
    return [row for i, row in enumerate(cells) if i not in heads and i - 1 not in heads]


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the shipped files, so that nothing a page does reaches the repository."""
    folder = tmp_path_factory.mktemp("library") / "library"
    shutil.copytree(ROOT / "machines" / "library", folder)
    return folder


@pytest.fixture
def desk(tmp_path: Path, library: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder in which the shipped files lie where they do in the repository."""
    (tmp_path / "machines").mkdir()
    (tmp_path / "machines" / "library").symlink_to(library, target_is_directory=True)
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "bed_mill.toml").symlink_to(DOCS / "bed_mill.toml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read(command: str) -> None:
    """Parse the arguments of a command without running it."""
    verb, *arguments = shlex.split(command)[1:]
    found = cli.get_command(click.Context(cli), verb)
    assert found is not None, f"{command}: no such verb"
    found.make_context(verb, arguments)


def output_of(command: str) -> str:
    """What a command prints on standard output; it must end with status 0."""
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(io.StringIO()):
        try:
            status = cli.main(shlex.split(command)[1:], prog_name="jointlib", standalone_mode=False)
        except click.exceptions.Exit as stop:
            status = stop.exit_code
    assert not status, f"{command}: exit status {status}"
    return stream.getvalue()


def words(line: str) -> str:
    return " ".join(line.split())


def run_console(block: Block, where: str) -> None:
    """Run the ``$`` lines; the lines shown below one must stand in what it prints, in this order."""
    for part in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
        command, _, shown = part.replace("\\\n", " ").partition("\n")
        assert command.startswith("jointlib "), f"{where}: {command!r}, expected a command of jointlib"
        if ELSEWHERE.match(command):
            read(command)
            continue
        printed = iter([words(line) for line in output_of(command).splitlines()])
        for line in filter(None, map(words, shown.splitlines())):
            assert line == "…" or line in printed, f"{where}: `{command}` does not print {line!r}, or not there"


def run_python(block: Block, where: str, names: dict[str, Any]) -> None:
    """Run a block; what it prints must be its lines that begin with ``#> ``."""
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream):
        exec(compile("\n" * block.line + block.text, where, "exec"), names)
    said = re.findall(r"^ *#> (.*)$", block.text, flags=re.MULTILINE)
    assert stream.getvalue().splitlines() == said, where


@pytest.mark.parametrize("page", repeats(PAGES, lambda page: page not in LONG, lambda page: page not in VERY_LONG))
def test_what_a_page_shows_runs(page: str, desk: Path) -> None:
    names: dict[str, Any] = {"__name__": "docs"}
    for block in blocks(page):
        where = f"docs/{page}:{block.line}"
        assert block.language in LANGUAGES, f"{where}: a block of {block.language!r}, expected one of {LANGUAGES}"
        if block.file:
            target = desk / block.file
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
        elif block.language == "toml":
            tomllib.loads(block.text)
        elif block.language == "console":
            run_console(block, where)
        elif block.language == "python":
            run_python(block, where, names)


def test_the_index_names_every_page() -> None:
    text = (DOCS / "index.md").read_text("utf-8")
    trees = re.findall(r"```\{toctree\}\n(.*?)```", text, re.S)
    listed = [line for tree in trees for line in tree.split("\n") if line and not line.startswith(":")]
    listed.remove("gallery/index")  # made while the pages are built, of docs/examples
    assert sorted(f"{name}.md" for name in listed) == [p for p in PAGES if p != "index.md"]


def our_laws() -> list[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return sorted(project["entry-points"]["jointlib.laws"])


def test_the_table_of_laws_is_the_registry() -> None:
    table = {row[0].strip("`"): row for row in rows(section("laws.md", "The laws"))}
    assert sorted(table) == our_laws()
    for kind, row in table.items():
        cls = law(kind, "docs")
        fields = [f"{p.name} [{p.unit}]" for p in parameters_of(cls)]
        assert _SPAN.findall(row[1]) == fields, kind
        assert row[3] == ("yes" if cls.passive else "no"), kind
        assert row[4] == (", ".join(f"`{s}`" for s in cls.states) or "–"), kind


def test_every_law_has_a_paragraph_on_when_to_take_it() -> None:
    text = section("laws.md", "When to take which")
    assert sorted(re.findall(r"^\*\*`([\w-]+)`\*\*", text, re.M)) == our_laws()


def our_effects() -> list[JointEffect | Fault | PathFault]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    targets = [t.split(":") for t in project["entry-points"]["jointlib.effects"].values()]
    return [getattr(importlib.import_module(module), name)() for module, name in targets]


def tried_on(effect: JointEffect | Fault | PathFault) -> str:
    """The routes on which an effect competes."""
    if isinstance(effect, JointEffect):
        return "rig, path" if law(effect.member, "docs").in_time else "rig"
    return "rig" if isinstance(effect, Fault) else "path"


def place_of(effect: JointEffect | Fault | PathFault) -> str:
    if isinstance(effect, JointEffect):
        return "joint"
    return effect.on if isinstance(effect, Fault) else "force"


def test_the_table_of_effects_is_the_registry() -> None:
    """Joint effects, faults of a rig and faults along a path: one row a family and route, with what it looks like."""
    declared: dict[tuple[str, str, str], tuple[set[str], set[str]]] = {}
    for effect in our_effects():
        laws, alike = declared.setdefault((effect.family, place_of(effect), tried_on(effect)), (set(), set()))
        laws |= {effect.member} if isinstance(effect, JointEffect) else set()
        alike |= set(effect.look_alikes)
    listed = {}
    for family, laws_, place, route, signature, alike_ in rows(section("loop.md", "The catalogue")):
        assert signature, family
        listed[family.strip("`"), place, route] = set(_SPAN.findall(laws_)), set(_SPAN.findall(alike_))
    assert listed == declared


def test_the_table_of_look_alikes_is_what_the_effects_declare() -> None:
    pairs = {frozenset((e.family, other)) for e in our_effects() for other in e.declared_pairs}
    declared = {
        (e.family, other, words, "yes" if frozenset((e.family, other)) in pairs else "–")
        for e in our_effects()
        for other, words in e.look_alikes.items()
    }
    table = rows(section("loop.md", "What separates look-alikes"))
    assert {(row[0].strip("`"), row[1].strip("`"), row[2], row[3]) for row in table} == declared


def test_the_sentences_of_the_import_checks_are_those_of_the_code() -> None:
    source = "".join(path.read_text("utf-8") for path in (ROOT / "jointlib").rglob("*.py"))
    table = rows(section("loop.md", "What is checked on import"))
    sentences = [sentence for row in table for sentence in _SPAN.findall(row[1])]
    assert len(sentences) == len(table) > 20
    assert [s for s in sentences if s not in source] == []


def test_what_cannot_be_decided_is_what_the_faults_declare_to_need() -> None:
    needing: dict[tuple[str, str], set[str]] = {}
    for effect in our_effects():
        if isinstance(effect, Fault) and effect.needs:
            assert effect.needs == {"P"}, f"{effect.family} needs more than the table tells"
            needing.setdefault(("rig", "no force P"), set()).add(effect.family)
        elif isinstance(effect, PathFault) and effect.requires:
            word = {"clock": "no clock", "position": "no channel of the feed position"}[effect.requires]
            needing.setdefault(("path", word), set()).add(effect.family)
    table = [r for r in rows(section("loop.md", "Verdicts")) if r[0] in ("rig", "path")]
    for (route, word), families in needing.items():
        (row,) = [r for r in table if r[0] == route and word in r[-1]]
        assert set(_SPAN.findall(row[1])) == families


_TAKERS = {
    "text",
    "number",
    "numbers",
    "matrix",
    "words",
    "flag",
    "integer",
    "take",
    "path",
    "section",
    "sections",
    "each",
}
_READERS = {
    "Measurement": [
        f"jointlib/io/{name}.py"
        for name in (
            "measurement_file",
            "channel_table",
            "text_dialect",
            "estimate_table",
            "tables/cut_table",
            "tables/correction_table",
            "tables/cuts_table",
        )
    ],
    "Joint": ["jointlib/io/joint_file.py"],
    "Machine": [
        *(
            f"machines/{name}.py"
            for name in (
                "files/machine_file",
                "files/component_file",
                "files/cutting_table",
                "model/axes",
                "components/lumped",
                "components/modal",
                "components/rigid",
                "components/riding",
                "files/named_tools",
                "components/static_load",
                "components/beam",
                "components/cutters/cutting_tool",
                "shapes/segment",
                "components/matrices",
                "components/matrix_rows",
                "components/measured",
                "components/record_files",
                "shapes/outline",
                "components/state_space",
            )
        ),
    ],
    "Tool file": ["machines/files/tool_file.py"],
    "Studies": ["machines/study/study_file.py", "machines/study/conditions.py", "machines/study/factors.py"],
    "Cutting file": ["jointlib/cutting_force/cutting_file.py"],
    "Bundles": sorted(str(path.relative_to(ROOT)) for path in (ROOT / "machines" / "bundles").glob("*.py")),
}


def keys_of(path: Path) -> Iterator[str]:
    """Keys that a reader asks a section for, by the text of its calls."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr in _TAKERS | {"has"}
            and node.args
            and isinstance(node.args[0], ast.Constant)
            and isinstance(node.args[0].value, str)
        ):
            yield node.args[0].value
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "assumed_value":
            key = node.args[2]
            assert isinstance(key, ast.Constant)
            yield str(key.value)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "_each":
            key = node.args[1]
            assert isinstance(key, ast.Constant)
            yield str(key.value)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "kind":
            yield "kind"


@pytest.mark.parametrize("kind", _READERS)
def test_every_key_that_a_reader_knows_is_documented(kind: str) -> None:
    from jointlib.cutting_force.tooth_force import COEFFICIENTS
    from jointlib.io import joint_file
    from machines.files import cutting_table as operation

    known = {key for name in _READERS[kind] for key in keys_of(ROOT / name)}
    known |= {
        "Measurement": {"schema"},
        "Joint": set(joint_file._VALIDITY) | {"schema"},
        "Machine": set(operation.CUTTING_UNITS) | {"x", "y", "at", "direction", "law", "schema", "outline"},
        "Bundles": set(),
        "Cutting file": set(COEFFICIENTS) | {"schema"},
        "Tool file": {"file"},
        "Studies": {"schema", "values", "range", "distribution"},
    }[kind]
    documented = {key for row in rows(section("files.md", kind)) for key in _SPAN.findall(row[0])}
    assert documented == known


def test_the_tables_of_corrections_are_the_registry() -> None:
    from jointlib.corrections import faults
    from jointlib.fault import Fault

    along_path = {name: f for name, f in faults("path").items() if not isinstance(f, Fault)}
    declared = {
        (name, getattr(f, "on", "channel"), *(f"{key} [{unit}]" for key, unit in f.parameters.items()))
        for name, f in [*faults("rig").items(), *along_path.items()]
    }
    table = rows(section("files.md", "Corrections"))
    listed = {(row[0].strip("`"), row[1].strip("`").replace("–", "rig"), *_SPAN.findall(row[2])) for row in table}
    assert listed == declared


def test_shipped_files_and_those_of_the_pages_are_read(desk: Path) -> None:
    from jointlib.cutting_force.cutting_file import read_cutting_file
    from jointlib.io.joint_file import read_joint
    from jointlib.io.measurement_file import read_measurement
    from machines.files.machine_file import read_machine

    for page in PAGES:
        for block in blocks(page):
            if block.file:
                target = desk / block.file
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_text(block.text, encoding="utf-8")
    from machines.study.study_file import read_study

    readers = {"joint": read_joint, "measurement": read_measurement, "machine": read_machine, "study": read_study}
    readers |= {"cutting": read_cutting_file}
    by_machines = ("parts", "component", "tool", "holder")
    count = 0
    for path in [*(desk / "machines" / "library").rglob("*.toml"), *desk.glob("*.toml")]:
        schema = tomllib.loads(path.read_text("utf-8")).get("schema", "")
        if schema and schema.split("/")[1] not in by_machines:  # read with the machines that name them
            readers[schema.split("/")[1]](path)
            count += 1
    assert count >= 5


@pytest.mark.parametrize(
    "command",
    [
        "df machines/library/guide.joint.toml --amplitude 1um --frequency 500",
        "frf machines/library/two_mass.toml --force 10 --frequency 1000:7000:50 -o frf.npz",
        "check machines/library/two_mass.toml",
        "lobes machines/library/two_mode_tool.toml --speed 6000",
        "inspect machines/library/guide.joint.toml",
    ],
)
def test_a_verb_prints_the_keys_that_are_promised(command: str, desk: Path) -> None:
    verb = command.split()[0]
    cells = {row[0].strip("`"): row[1] for row in rows(section("files.md", "JSON on standard output"))}
    promised = set(_SPAN.findall(re.sub(r"\(.*?\)|; with.*", "", cells[verb])))
    assert promised <= set(json.loads(output_of(f"jointlib {command} --json")))


def test_the_files_of_a_run_are_those_that_the_program_names() -> None:
    steps = (*(ROOT / "machines" / "road").glob("*.py"), ROOT / "fmu" / "machine_step.py")
    program = "".join(path.read_text("utf-8") for path in steps)
    table = re.search(r"^\| in `out/`.*?\n\n", (DOCS / "start.md").read_text("utf-8"), re.M | re.S)
    assert table
    for row in rows(table[0]):
        for name in _SPAN.findall(row[0]):
            assert name.removeprefix("guide") in program, name


@pytest.mark.slow
def test_the_example_of_a_third_party_package_is_found_and_holds(tmp_path: Path) -> None:
    """The package of docs/extend.md, installed as pip would leave it, in a process of its own."""
    for block in blocks("extend.md"):
        if block.file:
            target = tmp_path / "site" / block.file
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
    declared = tomllib.loads((tmp_path / "site" / "pyproject.toml").read_text("utf-8"))["project"]
    info = tmp_path / "site" / f"{declared['name'].replace('-', '_')}-{declared['version']}.dist-info"
    info.mkdir()
    head = f"Metadata-Version: 2.1\nName: {declared['name']}\nVersion: {declared['version']}\n"
    (info / "METADATA").write_text(head, encoding="utf-8")
    points = [
        f"[{group}]\n" + "".join(f"{name} = {target}\n" for name, target in members.items())
        for group, members in declared["entry-points"].items()
    ]
    (info / "entry_points.txt").write_text("\n".join(points), encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path / "site"), str(ROOT)])}

    code = """
import runpy
from jointlib.cli.main import cli
from jointlib.effect import JointEffect
from jointlib.fault import Fault
pages = [runpy.run_path(f"site/tests/{page}.py") for page in ("test_rubber_mount", "test_faults")]
tests = [f for page in pages for name, f in page.items() if name.startswith("test_")]
for test in tests:
    test()
assert len(tests) >= 5
cli.main(["laws", "--json"])
"""
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert "rubber-mount" in {row["kind"] for row in found["laws"]}
    assert {"rubber-mount", "crosstalk", "warm-up"} <= set(found["effects"])
    assert "tsv" in found["readers"]
    assert not found["failed"]


def test_the_listed_python_api_is_the_one_there_is() -> None:
    """Each table row of docs/api.md is ``module`` or ``module.name(signature)``; names and parameters must agree."""
    listed = [_SPAN.findall(row[0])[0] for row in rows((DOCS / "api.md").read_text("utf-8"))]
    assert len(listed) > 25
    for entry in listed:
        name, _, arguments = entry.partition("(")
        module, _, attribute = name.rpartition(".")
        target: Any
        try:
            target = getattr(importlib.import_module(module), attribute)
        except ModuleNotFoundError:
            module, _, owner = module.rpartition(".")
            target = getattr(getattr(importlib.import_module(module), owner), attribute)
        if not arguments:
            continue
        given = [a.strip() for a in arguments.rstrip(")").split(",") if a.strip()]
        if dataclasses.is_dataclass(target) and isinstance(target, type):
            parameters = [f.name for f in dataclasses.fields(target) if f.init]
        else:
            signature = inspect.signature(target).parameters.values()
            parameters = [p.name for p in signature if p.name != "self"]
        assert [g.split("=")[0].strip("*… ") for g in given if g not in ("*", "…")] == parameters[: len(given)], entry
        if "…" not in given:
            assert len([g for g in given if g != "*"]) == len(parameters), entry
