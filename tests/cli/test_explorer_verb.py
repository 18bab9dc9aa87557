"""``jointlib explore`` as a command: its example, its port, what it asks for, how it ends."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from command_line import ROOT, examples, jointlib
from tools import package

MACHINE = "machines/library/two_mass.toml"


@pytest.mark.slow
def test_the_example_runs_until_ctrl_c_and_ends_without_a_word_of_failure(here: Path) -> None:
    package("dash")
    (shown,) = examples("explore")
    # A shell starts what it puts in the background with SIGINT ignored, and that is inherited.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [sys.executable, "-c", f"{heed}; from jointlib.cli.main import main; main()", *shlex.split(shown)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        command, cwd=here, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        said = []
        while not (said and said[-1].startswith("http")):
            line = process.stdout.readline()
            assert line, process.stderr.read()
            said.append(line)
        address = said[-1].split()[0]
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+", address)
        with urllib.request.urlopen(address, timeout=30) as answer:
            assert b"jointlib" in answer.read()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 0
    assert out == "ended\n"
    assert "Traceback" not in err
    assert sorted(p.name for p in here.iterdir()) == ["machines"]


def test_a_port_that_is_taken_is_told_in_one_sentence(here: Path) -> None:
    package("dash")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = jointlib(f"explore {MACHINE} --port {port}")
    assert done.status == 2
    assert done.err == (
        f"jointlib: --port {port} on 127.0.0.1: Address already in use, "
        "expected a free port (leave --port out for any)\n"
    )


def test_without_a_port_another_is_found_where_the_usual_one_is_taken() -> None:
    package("dash")
    from machines.explore.server import PORT, bound

    with bound() as first, bound() as second:
        numbers = {first.getsockname()[1], second.getsockname()[1]}
        assert len(numbers) == 2
        assert {first.getsockname()[0], second.getsockname()[0]} == {"127.0.0.1"}
        assert first.getsockname()[1] == PORT or PORT not in numbers


def test_missing_dash_is_told_with_the_command_that_brings_it(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec

    def absent(name: str, *more: Any) -> Any:
        return None if name == "dash" else found(name, *more)

    monkeypatch.setattr(importlib.util, "find_spec", absent)
    done = jointlib(f"explore {MACHINE}")
    assert done.status == 2
    assert done.err == ("jointlib: explore: needs the package dash, install it with pip install 'jointlib[explore]'\n")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (f"explore {MACHINE} --study a.toml", "--study and --results: expected both"),
        (f"explore {MACHINE} --results out", "--study and --results: expected both"),
        ("explore nothing.toml", "nothing.toml"),
        (f"explore {MACHINE} --host no.such.host.invalid", "is no address of this computer"),
        (f"explore {MACHINE} --port 70000", "--port"),
        (f"explore {MACHINE} -o {MACHINE}", "is a file, expected a folder"),
    ],
)
def test_bad_input_is_one_sentence(here: Path, words: str, sentence: str) -> None:
    package("dash")
    done = jointlib(words)
    assert done.status == 2
    assert sentence in done.err
    assert done.err.count("\n") == 1
    assert done.out == ""


@pytest.mark.parametrize(
    ("host", "alone"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False), ("192.168.1.2", False), ("a", False)],
)
def test_what_counts_as_this_computer(host: str, alone: bool) -> None:
    package("dash")
    from machines.explore.server import is_this_computer

    assert is_this_computer(host) is alone
