"""The example in every verb's help is run as it stands."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from command_line import examples, jointlib, wrote
from repeats import repeats

from jointlib.cli.main import verbs

LONG = {"run", "trace", "explore", "plan"}
"""Their examples are run once, by the tests that look at what they leave."""


def test_help_names_every_verb_and_the_exit_statuses() -> None:
    done = jointlib("--help")
    assert done.status == 0
    assert all(f"  {verb} " in done.out for verb in verbs())
    assert "0 done, 1 a check failed, 2 bad input" in " ".join(done.out.split())
    assert jointlib("").out == done.out
    assert jointlib("").status == 0


SECONDS, MANY = {"fmu", "ssp", "modes"}, {"study", "stickout"}
"""Examples that compute for more than a second, and for ten."""


@pytest.mark.parametrize(
    "verb",
    repeats(sorted(verbs().keys() - LONG), lambda verb: verb not in SECONDS | MANY, lambda verb: verb not in MANY),
)
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


def test_the_module_answers_as_the_command(here: Path) -> None:
    said = subprocess.run([sys.executable, "-m", "jointlib", "--version"], capture_output=True, text=True)
    assert (said.returncode, said.stdout) == (0, jointlib("--version").out)
