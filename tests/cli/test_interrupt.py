"""Ctrl-C: exit status 130, and nothing half-written is left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import files, jointlib

from jointlib import read_joint


def load(path: Path) -> None:
    """Read a file as what its name says; a half-written one raises."""
    if path.suffix == ".json":
        json.loads(path.read_text())
    elif path.name.endswith("joint.toml"):
        read_joint(path)
    elif path.suffix == ".npz":
        with np.load(path) as archive:
            assert all(archive[name].size >= 0 for name in archive.files)
    elif path.suffix in (".fmu", ".ssp"):
        assert zipfile.ZipFile(path).testzip() is None
    else:
        assert path.read_text().rstrip().endswith("</html>"), path


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals are sent as on POSIX")
@pytest.mark.parametrize(
    ("machine", "moment"), [("guide_mill", "tracing"), ("two_mode_tool", "forced response"), ("guide_mill", "")]
)
def test_ctrl_c_leaves_whole_files_only(machine: str, moment: str, here: Path) -> None:
    # A shell starts what it puts in the background with SIGINT ignored, and that is inherited.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [sys.executable, "-c", f"{heed}; from jointlib.cli.main import main; main()"]
    command += ["run", f"machines/library/{machine}.toml", "-o", "out"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        seen = ""
        while moment not in seen or not seen:
            seen = process.stderr.readline()
            assert seen, "the run ended before the signal"
        time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "jointlib: stopped; nothing half-written is left"
    assert "Traceback" not in err
    assert "wrote" not in out
    left = [path for path in here.joinpath("out").rglob("*") if path.is_file()]
    assert not [path for path in left if path.name.startswith(".")]
    assert not [path for path in left if path.name in ("report.html", "run.json")]
    for path in left:
        load(path)


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as on POSIX")
def test_ctrl_c_after_the_work_is_done_does_not_deny_it(here: Path) -> None:
    code = "import atexit, signal, time; signal.signal(signal.SIGINT, signal.default_int_handler); "
    code += "atexit.register(time.sleep, 1); atexit.register(print, 'shutting down', flush=True); "
    command = [sys.executable, "-c", code + "from jointlib.cli.main import main; main()"]
    command += ["new", "machine", "-o", "x.toml"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        while "shutting down" not in (line := process.stdout.readline()):
            assert line, "it ended before the signal"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert Path("x.toml").is_file()


@pytest.mark.parametrize("step", ["os.replace", "os.chmod"])
def test_ctrl_c_while_a_file_is_being_written_leaves_the_old_one(
    step: str, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    Path("curves.npz").write_bytes(b"old")
    before = files(here)
    monkeypatch.setattr(f"jointlib.io.atomic.{step}", stop)
    done = jointlib("frf machines/library/two_mass.toml --force 10 --frequency 1kHz:2kHz:20 -o curves.npz")
    assert (done.status, done.out) == (130, "")
    assert done.err.strip() == "jointlib: stopped; nothing half-written is left"
    assert files(here) == before
    assert Path("curves.npz").read_bytes() == b"old"


@pytest.mark.thorough
@pytest.mark.skipif(os.name != "posix", reason="pipes end as on POSIX")
def test_a_reader_that_has_read_enough_meets_no_traceback(here: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-c", "from jointlib.cli.main import main; main()", "laws", "--json"]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(writing)
    assert done.stderr == ""
