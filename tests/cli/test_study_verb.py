"""``jointlib study``: run, resume, parts, other workers; whatever computes them, the results are the same bytes."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import files, jointlib, with_library
from conftest import Left

from jointlib import Joint, write_joint
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.viscous import Viscous
from machines.study import run

STUDY = """
schema = "jointlib/study/1"
base = "machines/library/two_mode_tool.toml"
[[factor]]
path = "component.cutter.modal_mass[0]"
range = [0.3, 0.5]
[[factor]]
path = "cutting.immersion"
range = [0.3, 0.7]
[[objective]]
quantity = "removal-rate"
goal = "max"
[conditions]
speeds = 100
[sampling]
method = "sobol"
count = 16
"""


@pytest.fixture
def study(here: Path) -> Path:
    Path("s.study.toml").write_text(STUDY)
    return Path("s.study.toml")


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """The study as one process computes it."""
    folder = with_library(tmp_path_factory.mktemp("study") / "here")
    command = "study run s.study.toml -o one --workers 1 --json"
    with contextlib.chdir(folder):
        Path("s.study.toml").write_text(STUDY)
        return Left(command, jointlib(command), folder / "one")


@pytest.mark.slow
def test_a_study_ends_with_its_best_configuration(one: Left) -> None:
    assert one.done.status == 0
    data = one.done.json
    assert (data["done"], data["total"]) == (64, 64)
    with np.load(one.folder / "results.npz") as held:
        assert data["best"]["results"]["removal-rate"] == held["removal-rate"].max()
        assert data["best"]["configuration"] == int(np.argmax(held["removal-rate"]))
    first, total = data["sensitivity"]["removal-rate"]["immersion"]
    assert 0 < first < total + 0.2
    with contextlib.chdir(one.folder.parent):
        again = jointlib("study report s.study.toml -o one --json")
    assert again.json == data


@pytest.mark.slow
def test_parts_processes_and_one_process_leave_the_same_bytes(study: Path, one: Left) -> None:
    halves = [jointlib(f"study run {study} -o parts --workers 1 --shard {k}/2 --json") for k in (2, 1)]
    assert [h.json["done"] for h in halves] == [32, 64]
    jointlib(f"study run {study} -o pool --workers 2")
    assert Path("parts/results.npz").read_bytes() == (one.folder / "results.npz").read_bytes()
    assert Path("pool/results.npz").read_bytes() == (one.folder / "results.npz").read_bytes()


@pytest.mark.slow
def test_workers_of_a_dask_scheduler_leave_the_same_bytes(
    study: Path, one: Left, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed (extra cluster)")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        done = jointlib(f"study run {study} -o dask --scheduler {cluster.scheduler_address} --json")
        monkeypatch.setattr("machines.study.run._code", lambda: "another release")
        other = jointlib(f"study run {study} -o other --scheduler {cluster.scheduler_address}")
    assert done.status == 0
    assert (other.status, len(other.err.splitlines())) == (2, 1)
    assert "does not see this study (program), expected the same files and the same release" in other.err
    assert Path("dask/results.npz").read_bytes() == (one.folder / "results.npz").read_bytes()


@pytest.mark.slow
def test_a_scheduler_that_ends_is_told_and_nothing_is_lost(study: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed (extra cluster)")
    study.write_text(STUDY.replace("count = 16", "count = 4096"))
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:

        def end() -> None:
            deadline = time.monotonic() + 60
            while not list(Path("out").glob("shards/*.npz")) and time.monotonic() < deadline:
                time.sleep(0.1)
            cluster.scheduler.loop.add_callback(cluster.scheduler.close)

        thread = threading.Thread(target=end)
        thread.start()
        done = jointlib(f"study run {study} -o out --scheduler {cluster.scheduler_address}")
        thread.join()
    assert done.status == 2
    assert "ended or lost its workers; what is done is kept, resume the study" in done.err
    assert list(Path("out").glob("shards/*.npz"))


@pytest.mark.slow
def test_resume_goes_on_where_results_are_missing(study: Path, one: Left) -> None:
    shutil.copytree(one.folder, "out")
    before = Path("out/results.npz").read_bytes()
    shards = sorted(Path("out/shards").iterdir())
    times = {shard.name: shard.stat().st_mtime_ns for shard in shards[1:]}
    shards[0].unlink()
    Path("out/results.npz").unlink()
    unfinished = jointlib(f"study report {study} -o out --json").json
    assert (unfinished["best"], unfinished["total"]) == (None, 64)
    assert 0 <= unfinished["done"] < 64
    done = jointlib(f"study resume {study} -o out --workers 1 --json")
    assert done.json["done"] == 64
    assert Path("out/results.npz").read_bytes() == before
    assert {s.name: s.stat().st_mtime_ns for s in Path("out/shards").iterdir() if s.name in times} == times


ABSORBER = """
schema = "jointlib/machine/1"
name = "absorber"
[[component]]
name = "bar"
kind = "lumped"
dofs = ["x"]
mass = [["10 kg"]]
stiffness = [["10 N/um"]]
[[component]]
name = "absorber"
kind = "lumped"
dofs = ["x"]
mass = [["1 kg"]]
[[connection]]
name = "rubber"
between = ["absorber.x", "bar.x"]
joint = { law = [ { kind = "linear", stiffness = "1 N/um" }, { kind = "viscous", damping = "300 N s/m" } ] }
[tool]
x = "bar.x"
[response]
force = ["1 N"]
frequency = ["20 Hz", "500 Hz"]
"""
SEARCH = """
schema = "jointlib/study/1"
base = "absorber.toml"
[[factor]]
name = "stiffness"
path = "connection.rubber.joint.linear.stiffness"
range = ["0.2 N/um", "2 N/um"]
scale = "log"
[[factor]]
path = "connection.rubber.joint.viscous.damping"
range = ["50 N s/m", "3000 N s/m"]
scale = "log"
[[objective]]
quantity = "peak-receptance"
goal = "min"
[sampling]
method = "pareto"
count = 240
population = 16
"""


@pytest.fixture
def search(here: Path) -> Path:
    pytest.importorskip("pymoo", reason="pymoo is not installed (extra optimise)")
    Path("absorber.toml").write_text(ABSORBER)
    Path("a.study.toml").write_text(SEARCH)
    return Path("a.study.toml")


@pytest.mark.slow
def test_a_search_finds_the_optimal_absorber(search: Path) -> None:
    """Den Hartog: an absorber of mass ratio μ lowers the peak to √(1 + 2/μ)/k, at a stiffness of μ k/(1 + μ)².

    The best damper is better by 1e-3 still (Nishihara and Asami).
    """
    done = jointlib(f"study run {search} -o out --workers 1 --json")
    assert (done.status, done.json["done"]) == (0, 240)
    assert all(line.startswith("computing") for line in done.err.splitlines()), "the optimiser is quiet"
    mu, best = 0.1, done.json["best"]
    assert 0.998 < best["results"]["peak-receptance"] * 10e6 / np.sqrt(1 + 2 / mu) < 1.02
    stiffness = float(best["factors"]["stiffness"].split()[0])
    assert stiffness == pytest.approx(10 * mu / (1 + mu) ** 2, rel=0.03)


@pytest.mark.slow
def test_a_search_by_other_workers_leaves_the_same_bytes(search: Path) -> None:
    search.write_text(SEARCH.replace("240", "48"))
    jointlib(f"study run {search} -o one --workers 1")
    jointlib(f"study run {search} -o pool --workers 2")
    before = Path("one/results.npz").read_bytes()
    assert Path("pool/results.npz").read_bytes() == before
    distributed = pytest.importorskip("distributed", reason="Dask is not installed (extra cluster)")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=":0") as cluster:
        jointlib(f"study run {search.resolve()} -o dask --scheduler {cluster.scheduler_address}")
    assert Path("dask/results.npz").read_bytes() == before
    refused = jointlib(f"study run {search} -o parts --shard 1/2")
    assert (refused.status, len(refused.err.splitlines())) == (2, 1)
    assert "--shard: a generation of a search follows from the one before" in refused.err


@pytest.mark.thorough
def test_results_go_into_a_table_for_other_programs(study: Path, one: Left) -> None:
    shutil.copytree(one.folder, "out")
    done = jointlib(f"study report {study} -o out --table out/all.csv")
    assert (done.status, "wrote out/all.csv" in done.out) == (0, True)
    lines = Path("out/all.csv").read_text().splitlines()
    with np.load("out/results.npz") as held:
        assert [float(line.split(",")[-1]) for line in lines[1:]] == held["removal-rate"].tolist()
    assert lines[0].startswith("design,case,sample,modal_mass[0],immersion,")
    refused = jointlib(f"study report {study} -o out --table all.xlsx")
    assert (refused.status, "expected .parquet, .csv" in refused.err) == (2, True)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("study run {s} -o out --shard 3/2", "--shard: '3/2', expected k/n such as 2/8"),
        ("study run {s} -o out --shard 1", "--shard: '1', expected k/n"),
        ("study run {s} -o out --shard ²/3", "--shard: '²/3', expected k/n"),
        ("study run {s} -o out --scheduler nowhere", "--scheduler: 'nowhere', expected an address such as tcp://"),
        ("study resume {s} -o out", "holds no study to resume"),
        ("study report {s} -o out", "holds no study"),
        ("study run {s} -o out --workers 0", "--workers"),
        ("study run {s} -o out --workers 99999", "--workers: 99999, expected at most"),
        ("study run nothing.toml -o out", "nothing.toml: no such file, expected a study file"),
        ("study run machines/library/two_mass.toml -o out", 'expected "jointlib/study/1"'),
        ("study run {s} -o out --scheduler tcp://127.0.0.1:1", "does not answer"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(
    study: Path, words: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "_PATIENCE", 1)
    before = files(Path())
    done = jointlib(words.format(s=study))
    assert done.status == 2
    assert said in done.err
    assert files(Path()) == before


@pytest.mark.thorough
def test_a_stranger_at_the_address_of_the_scheduler_is_told(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes the connection and says nothing."""
    monkeypatch.setattr(run, "_PATIENCE", 1)
    with socket.create_server(("127.0.0.1", 0)) as stranger:
        done = jointlib(f"study run {study} -o out --scheduler tcp://127.0.0.1:{stranger.getsockname()[1]}")
    assert (done.status, Path("out").exists()) == (2, False)
    assert "does not answer (nothing in 1 s), expected a Dask scheduler" in done.err


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="process groups are those of POSIX systems")
@pytest.mark.parametrize("after", [0.0, 1.0])
def test_ctrl_c_ends_command_and_workers_without_a_traceback(study: Path, after: float) -> None:
    """A terminal sends it to all of them, whether the workers have begun or are being started."""
    study.write_text(STUDY.replace("count = 16", "count = 4096"))
    # A shell starts what it puts in the background with SIGINT ignored, and that is inherited.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    words = f"sys.argv = ['jointlib', 'study', 'run', '{study}', '-o', 'out', '--workers', '2']"
    command = f"{heed}; import sys; {words}; from jointlib.cli.main import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", command], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 60
    while not Path("out/study.json").exists():
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(after)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    lines = [line for line in err.splitlines() if line]
    assert all(line.startswith("jointlib: ") for line in lines), err
    assert lines[-1] == "jointlib: stopped; nothing half-written is left"


@pytest.mark.thorough
def test_a_value_that_a_machine_cannot_take_is_said_first_and_nothing_is_left(study: Path) -> None:
    """The last of all values; once it is put right, the same folder takes the study."""
    whole = STUDY.replace("range = [0.3, 0.7]", 'values = [0.3, 0.5, "half"]').replace("sobol", "latin-hypercube")
    study.write_text(whole)
    before = files(Path())
    refused = jointlib(f"study run {study} -o out --workers 1")
    assert (refused.status, len(refused.err.splitlines()), files(Path())) == (2, 1, before)
    assert re.search(
        r"s.study.toml: with .*, immersion half: machines/\S+: \[cutting\]: immersion: 'half'", refused.err
    )
    study.write_text(whole.replace('"half"', "0.6"))
    assert jointlib(f"study run {study} -o out --workers 1").status == 0


def test_a_machine_that_cannot_be_has_no_results_and_stops_no_study(here: Path) -> None:
    """Pulled with 700 N, a contact of less preload gives way; the designs that hold are compared all the same."""
    write_joint("contact.joint.toml", Joint((HertzContact(900.0, 3.931408125e-8), Viscous(400.0))))
    Path("hung.toml").write_text(
        """
schema = "jointlib/machine/1"
tool = { x = "slide.x" }
response = { frequency = [20, 2000] }
static = { force = { "slide.x" = "-700 N" } }
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[60.0]]
[[connection]]
name = "guide"
between = ["slide.x", "ground"]
joint = "contact.joint.toml"
"""
    )
    study = """
schema = "jointlib/study/1"
base = "hung.toml"
factor = [{ name = "preload", path = "connection.guide.joint.hertz_contact.preload", values = [VALUES] }]
objective = [{ quantity = "static-compliance", goal = "min" }]
"""
    Path("s.study.toml").write_text(study.replace("VALUES", '"600 N", "650 N", "900 N", "1200 N"'))
    done = jointlib("study run s.study.toml -o out --workers 1 --json")
    assert done.status == 0
    assert done.json["best"]["factors"] == {"preload": "1200 N"}
    with np.load("out/results.npz") as held:
        assert np.isnan(held["static-compliance"]).tolist() == [True, True, False, False]
    said = jointlib("study report s.study.toml -o out")
    assert re.search(r"2 of them have no results; the first: \S*hung.toml: static: no equilibrium", said.out)
    assert "2 of 4 designs meet the constraints" in said.out
    assert "2 of them have no results" in Path("out/report.html").read_text()
    Path("s.study.toml").write_text(study.replace("VALUES", '"600 N", "650 N"'))
    none = jointlib("study run s.study.toml -o none --workers 1")
    assert (none.status, "no equilibrium" in none.err, Path("none/study.json").exists()) == (2, True, False)
