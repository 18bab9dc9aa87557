"""The example in every verb's help is run as it stands."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Done, examples, jointlib
from conftest import Left

from jointlib.cli.main import VERBS

LONG = {"run", "trace", "explore"}


def wrote(done: Done) -> list[Path]:
    return [Path(line.removeprefix("wrote ")) for line in done.out.splitlines() if line.startswith("wrote ")]


def test_help_names_every_verb_and_the_exit_statuses() -> None:
    done = jointlib("--help")
    assert done.status == 0
    assert all(f"  {verb} " in done.out for verb in VERBS)
    assert "0 done, 1 a check failed, 2 bad input" in " ".join(done.out.split())
    assert jointlib("").out == done.out
    assert jointlib("").status == 0


@pytest.mark.parametrize("verb", sorted(VERBS.keys() - LONG))
def test_the_example_of_a_verb_works_and_names_what_it_wrote(verb: str, here: Path) -> None:
    shown = examples(verb)
    assert shown
    for command in shown:
        assert command.split()[0] == verb
        done = jointlib(command)
        assert done.status == 0, done.err
        assert done.out.strip()
        named = wrote(done)
        assert all(path.is_file() for path in named)
        assert bool(named) == (" -o " in command)


def test_the_example_of_run_works_and_names_what_it_wrote(guide_mill_run: Left) -> None:
    assert guide_mill_run.command == "run machines/library/guide_mill.toml -o out"
    done, folder = guide_mill_run.done, guide_mill_run.folder
    assert done.status == 0, done.err
    named = {folder.parent / path for path in wrote(done)}
    assert named == {path for path in folder.rglob("*") if path.is_file()}


def test_the_example_of_trace_works(guide_trace: Left) -> None:
    assert guide_trace.done.status == 0, guide_trace.done.err
    assert {path.name for path in guide_trace.folder.iterdir()} == {
        "trace.json",
        "trace.npz",
        "joint.toml",
        "report.html",
    }
