"""Nothing half written, nothing lost: kills, two commands at once, folders not to be written into, full disks."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest
from command_line import files, jointlib
from repeats import repeats
from test_interrupt import load

from jointlib.cli.alone import alone_in
from jointlib.errors import InputError

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals, locks and limits are those of POSIX")
MAIN = "from jointlib.cli.main import main; main()"
LIBRARY = "machines/library"
WRITING = {
    "run": f"run {LIBRARY}/two_mode_tool.toml -o out",
    "frf": f"frf {LIBRARY}/two_mass.toml --force 10 --frequency 1kHz:2kHz:40 -o out/x.npz",
    "lobes": f"lobes {LIBRARY}/two_mode_tool.toml --speed 6000 9000 -o out/x.csv",
    "inspect": f"inspect {LIBRARY}/carriage.toml -o out/x.html",
    "identify": f"identify {LIBRARY}/guide_mill/static.measurement.toml --law hertz-guide -o out/x.joint.toml",
    "estimate": f"estimate {LIBRARY}/tap_test/hits.measurement.toml -o out/x.measurement.toml",
    "fmu": f"fmu {LIBRARY}/guide.joint.toml -o out/x.fmu",
    "new": "new machine -o out/x.toml",
}
TRACED = f"trace {LIBRARY}/guide_mill/rig.measurement.toml --joint {LIBRARY}/guide_mill/start.joint.toml -o out"
OTHERS = {
    "import": f"import {LIBRARY}/guide_mill/static.csv -o out/x.measurement.toml",
    "plan": f"plan {LIBRARY}/guide.joint.toml --rig {LIBRARY}/guide_mill/rig.measurement.toml "
    "--effects quadratic-damping -o out",
    "trace": TRACED,
    "modes": f"modes {LIBRARY}/three_joints/tip.measurement.toml --condition 8_N -o out/x.component.toml",
    "uncouple": f"uncouple {LIBRARY}/bar.measurement.toml --remove {LIBRARY}/bar.component.toml -o out/x.toml",
    "stickout": f"stickout {LIBRARY}/end_mill.toml --between 66mm 76mm --speed 15000 --method zero-order -o out/x.csv",
    "compare": f"compare {LIBRARY}/paper_sdof.toml {LIBRARY}/paper_sdof_hertz.toml -o out/x.svg",
    "ssp": f"ssp {LIBRARY}/two_mass.toml -o out/x.ssp",
}
"""The other verbs that write; `study` has tests of its own, `explore` writes when it is asked to."""


def started(words: str, heed: bool = False, **how: object) -> subprocess.Popen[str]:
    """``heed``: Ctrl-C is heeded, which what a shell starts in the background does not."""
    ears = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); " if heed else ""
    command = [sys.executable, "-c", ears + MAIN, *(word.replace("_N", " N") for word in words.split())]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how)  # type: ignore[call-overload]


def whole(folder: Path) -> None:
    """Every file loads as what its name says; the name of what was only begun starts with a point."""
    for path in folder.rglob("*"):
        if not path.is_file() or path.name.startswith("."):
            continue
        if path.suffix == ".toml" and not path.name.endswith("joint.toml"):
            assert "schema" in tomllib.loads(path.read_text("utf-8"))
        elif path.suffix in (".csv", ".svg"):
            assert path.read_bytes().endswith(b"\n") or path.suffix == ".svg"
        else:
            load(path)


@pytest.mark.parametrize(
    "verb", repeats([*WRITING, *OTHERS], lambda _: False, lambda verb: verb in ("frf", "lobes", "identify"))
)
def test_a_kill_at_any_moment_leaves_whole_files_or_none(verb: str, here: Path) -> None:
    words, begun = {**WRITING, **OTHERS}[verb], time.perf_counter()
    with started(words) as process:
        _, err = process.communicate()
    assert process.returncode == 0, err
    length, expected = time.perf_counter() - begun, files(here / "out")
    rng = random.Random(verb)
    for _ in range(2):
        shutil.rmtree(here / "out", ignore_errors=True)
        with started(words) as process:
            time.sleep(rng.uniform(0.5, 1.0) * length)
            process.send_signal(signal.SIGKILL)
            process.communicate()
        whole(here)
        left = (
            {path for path in files(here / "out") if not path.name.startswith(".")}
            if (here / "out").exists()
            else set()
        )
        assert left <= expected
    if verb in ("new", "plan"):  # these overwrite nothing, and the kill may have come after the file was whole
        shutil.rmtree(here / "out", ignore_errors=True)
    with started(words) as process:
        process.communicate()
    assert process.returncode == 0
    assert {path for path in files(here / "out") if not path.name.startswith(".")} >= expected


@pytest.mark.parametrize(
    "verb", repeats([*WRITING, *OTHERS], lambda _: False, lambda verb: verb in ("lobes", "fmu", "modes"))
)
def test_ctrl_c_at_any_moment_leaves_whole_files_alone(verb: str, here: Path) -> None:
    words, begun = {**WRITING, **OTHERS}[verb], time.perf_counter()
    with started(words, heed=True) as process:
        process.communicate()
    length, rng = time.perf_counter() - begun, random.Random(verb)
    for _ in range(3):
        shutil.rmtree(here / "out", ignore_errors=True)
        with started(words, heed=True) as process:
            time.sleep(rng.uniform(0.3, 0.9) * length)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate()
        assert "Traceback" not in err
        if process.returncode != 0:  # it may have been done
            assert process.returncode == 130, err
            assert err.splitlines()[-1] == "jointlib: stopped; nothing half-written is left"
        whole(here)
        assert not [path for path in files(here) if path.name.startswith(".")]


@pytest.mark.parametrize(
    "words",
    [
        "run {}/two_mass.toml -o out",
        "trace {}/guide_mill/rig.measurement.toml -o out",
        "plan {}/guide.joint.toml -o out",
    ],
)
def test_a_second_command_into_the_same_folder_is_refused(words: str, here: Path) -> None:
    before = files(here)
    with alone_in(Path("out"), "-o"):
        done = jointlib(words.format(LIBRARY))
        assert done.status == 2
        assert "-o: another command is writing into out, expected another folder" in done.err
    assert files(here) == before
    with alone_in(Path("out"), "-o"), alone_in(Path("elsewhere"), "-o"):
        pass


def test_parts_of_a_study_share_their_folder_with_no_other_command(here: Path) -> None:
    study = f"study run {LIBRARY}/guide_mill.study.toml -o out"
    with alone_in(Path("out"), "-o", shared=True):
        with alone_in(Path("out"), "-o", shared=True):
            pass
        done = jointlib(f"run {LIBRARY}/two_mass.toml -o out")
        assert (done.status, "-o: another command is writing into out" in done.err) == (2, True), done
    with alone_in(Path("out"), "-o"):
        done = jointlib(study)
        assert (done.status, "-o: another command is writing into out" in done.err) == (2, True), done
    assert not Path("out").exists()


def test_the_folder_of_a_command_that_was_killed_is_free_again(here: Path) -> None:
    hold = "import time; from pathlib import Path; from jointlib.cli.alone import alone_in\n"
    hold += "with alone_in(Path('out'), '-o'):\n    print('held', flush=True)\n    time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", hold], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        with pytest.raises(InputError, match="another command"), alone_in(Path("out"), "-o"):
            pass
        process.send_signal(signal.SIGKILL)
        process.wait()
    with alone_in(here / "." / "out", "-o"):
        pass


@pytest.mark.parametrize("verb", ["frf", "identify", "inspect", "new"])
@pytest.mark.parametrize("folder", ["/proc/none", "/dev/null/none"])
def test_a_folder_that_cannot_be_written_into_gets_a_sentence(verb: str, folder: str, here: Path) -> None:
    before = files(here)
    done = jointlib(WRITING[verb].replace("-o out", f"-o {folder}"))
    assert done.status == 2
    said = done.err.splitlines()[-1]
    assert said.startswith("jointlib: ")
    assert folder.split("/")[1] in said
    assert "[Errno" not in done.err
    assert files(here) == before


@pytest.mark.parametrize(
    "verb",
    repeats([*WRITING, *OTHERS], lambda _: False, lambda verb: verb in WRITING and verb != "run"),
)
def test_a_disk_that_fills_up_ends_in_a_sentence_and_leaves_nothing_half_written(verb: str, here: Path) -> None:
    """A limit on the size of files stands for it: writing fails in the middle, as on a full disk."""
    import resource

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))

    with started(
        {**WRITING, **OTHERS}[verb], preexec_fn=small, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    ) as process:
        _, err = process.communicate()
    assert process.returncode == 2, err
    assert "Traceback" not in err
    assert "File too large" in err.splitlines()[-1]
    assert "[Errno" not in err
    whole(here)


@pytest.mark.slow
def test_a_disk_that_fills_up_in_the_middle_of_a_plan_leaves_none_of_it(here: Path) -> None:
    """The first of its files fit, the records to play do not."""
    import resource

    with started(OTHERS["plan"], preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))) as one:
        _, err = one.communicate()
    assert (one.returncode, "File too large" in err) == (2, True), err
    assert files(here / "out") == set()
    Path("out").mkdir(exist_ok=True)
    Path("out/.measurement.toml.x").touch()  # what a kill may leave
    with started(OTHERS["plan"]) as again:
        assert again.communicate()[1].count("jointlib:") == 0
    assert again.returncode == 0


@pytest.mark.thorough
def test_what_vanishes_while_a_command_writes_more_is_not_said_to_be_there(here: Path) -> None:
    with started(WRITING["run"]) as process:
        while process.poll() is None and not any(path.is_file() for path in Path("out").rglob("*")):
            time.sleep(0.01)
        assert process.poll() is None
        shutil.rmtree("out", ignore_errors=True)
        said, err = process.communicate()
    assert (process.returncode, "wrote" in said) == (2, False), err
    assert re.fullmatch(r"jointlib: out/\S+: is gone since it was written, expected .*", err.splitlines()[-1])
    whole(here)


@pytest.mark.slow
def test_a_working_folder_that_is_gone_gets_a_sentence(tmp_path: Path) -> None:
    code = "import os, sys; os.mkdir('gone'); os.chdir('gone'); os.rmdir('../gone'); " + MAIN
    for words in (["inspect", "a.toml"], ["new", "machine", "-o", "a.toml"], ["run", "a.toml", "-o", "out"]):
        command = [sys.executable, "-c", code, *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 2, done.stderr
        assert "Traceback" not in done.stderr
        assert len(done.stderr.splitlines()) == 1
