"""A study of guide_mill beside the command for every configuration, blocks beside rows, and what the engine takes.

Run it as a script; ``--configurations 100000`` computes a plan of that size to the end. With ``--dask`` a plan of that
size alone, by two workers of a Dask scheduler, and with ``--mill`` beside it that of the library's column mill with as
many samples as make that size. Memory is that of the largest process. Processor time of this process and its
children, OPENBLAS_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import tomli_w

import machines
from jointlib import read_joint, write_joint
from machines import read_machine
from machines.road.open_joints import with_joints
from machines.study.engine import compute
from machines.study.evaluation import Evaluation
from machines.study.run import begin, evaluate_all
from machines.study.study import Study
from machines.study.study_file import read_study

LIBRARY = Path(machines.__file__).parent / "library"
COMMANDS = 12


def machine_file(folder: Path) -> None:
    """guide_mill with its guide identified once, so that no configuration has to."""
    machine, _ = with_joints(read_machine(LIBRARY / "guide_mill.toml"))
    joint = next(c.joint for c in machine.connections if c.name == "guide")
    assert joint is not None
    write_joint(folder / "guide.joint.toml", joint)
    document = tomllib.loads((LIBRARY / "guide_mill.toml").read_text())
    del document["connection"][0]["identify"]
    document["connection"][0]["joint"] = "guide.joint.toml"
    (folder / "guide_mill.toml").write_text(tomli_w.dumps(document))


def plan(folder: Path, count: int) -> Study:
    """Preload, damping and cutter stiffness of guide_mill over ``count`` points of a Latin hypercube."""
    path = folder / f"{count}.study.toml"
    path.write_text(
        f"""
schema = "jointlib/study/1"
name = "{count} configurations"
base = "guide_mill.toml"
factor = [
    {{ name = "preload", path = "connection.guide.joint.hertz_guide.preload", range = ["300 N", "900 N"] }},
    {{ name = "damping", path = "connection.guide.joint.viscous.damping", range = ["500 N s/m", "1000 N s/m"] }},
    {{ path = "cutting.immersion", range = [0.3, 0.9] }},
]
conditions = {{ speed = [3000, 12000], speeds = 200 }}
objective = [{{ quantity = "minimum-depth", goal = "max" }}]
sampling = {{ method = "latin-hypercube", count = {count} }}
"""
    )
    return read_study(path)


@contextlib.contextmanager
def measured(label: str, said: dict[str, float]) -> Iterator[None]:
    """Processor time of this process and of those that ended inside."""
    start = _seconds()
    yield
    said[label] = _seconds() - start


def _seconds() -> float:
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--configurations", type=int, default=2048)
    parser.add_argument("--dask", action="store_true")
    parser.add_argument("--mill", action="store_true")
    given = parser.parse_args()
    count = given.configurations
    if given.dask:
        by_dask(count, given.mill)
        return
    seconds: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        machine_file(folder)
        study = plan(folder, count)
        with measured("study", seconds):
            wall = time.perf_counter()
            store = begin(study, folder / "results")
            evaluate_all(study, store, {})
            wall = time.perf_counter() - wall
        depth = store.results()["minimum-depth"]
        largest = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        each = seconds["study"] / count
        print(
            f"{count} configurations: {wall:.1f} s, {1e3 * each:.2f} ms of processor time each, start of the "
            f"workers counted; largest process {largest / 1024:.0f} MB"
        )
        overhead(folder)
        together(folder)
        with measured("commands", seconds):
            found = [command(study, row) for row in range(COMMANDS)]
        print(f"largest difference from the command: {np.max(np.abs(np.array(found) / depth[:COMMANDS] - 1)):.0e}")
        slow = seconds["commands"] / COMMANDS
        print(f"jointlib lobes, configuration by configuration: {slow:.2f} s each, {slow / each:.0f}x")


def by_dask(count: int, mill: bool) -> None:
    """A plan by two workers of a Dask scheduler: what each configuration costs, what the engine takes beside it."""
    from distributed import LocalCluster

    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # read when a worker imports numpy
    workers = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with tempfile.TemporaryDirectory() as name, workers as cluster:
        folder = Path(name)
        if mill:
            text = (LIBRARY / "column_mill.study.toml").read_text("utf-8")
            path = LIBRARY / "column_mill.study.toml"
            study = read_study(path)
            samples = -(-count // (study.total // study.samples))
            path = folder / "mill.study.toml"
            for key in ("column_mill_a.toml", "column_mill_b.toml"):
                text = text.replace(f'"{key}"', f'"{LIBRARY / key}"')
            path.write_text(text.replace("samples = 16", f"samples = {samples}"), "utf-8")
            study = read_study(path)
        else:
            machine_file(folder)
            study = plan(folder, count)
        store = begin(study, folder / "results")
        wall, here = time.perf_counter(), time.process_time()
        evaluate_all(study, store, {}, scheduler=cluster.scheduler_address)
        wall, here = time.perf_counter() - wall, time.process_time() - here
        largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        begun = time.perf_counter()
        found = store.results()
        read = time.perf_counter() - begun
        print(
            f"{study.total} configurations by two workers of Dask: {wall:.0f} s, {2e3 * wall / study.total:.2f} ms of "
            f"a worker each; engine, store and scheduler {here:.1f} s, {100 * here / (2 * wall):.2f} % of the "
            f"work; largest {largest:.0f} MB; results read in {read:.1f} s"
        )
        assert len(found["minimum-depth"]) == study.total


def overhead(folder: Path) -> None:
    """One process: the engine with its store beside the bare evaluation of the same rows."""
    study = plan(folder, 1024)
    evaluation = Evaluation(study.source)
    evaluation(0, 16)
    spent = [0.0]

    def timed(first: int, end: int) -> dict[str, np.ndarray]:
        start = time.process_time()
        found = evaluation(first, end)
        spent[0] += time.process_time() - start
        return found

    store = begin(study, folder / "overhead")
    start = time.process_time()
    compute(store, timed)
    whole = time.process_time() - start
    print(f"engine and store: {100 * (whole / spent[0] - 1):.2f} % of the work")


def together(folder: Path) -> None:
    """The configurations of a block computed together beside one after the other, in one process."""
    source = plan(folder, 1024).source
    for quantity in ("minimum-depth", "removal-rate"):
        path = folder / f"{quantity}.study.toml"
        path.write_text(source.read_text().replace("minimum-depth", quantity))
        evaluation = Evaluation(path)
        evaluation(0, 32)
        spent, found = [], []
        for size in (1, 32):
            start = time.process_time()
            found.append([evaluation(first, first + size)[quantity] for first in range(0, 512, size)])
            spent.append((time.process_time() - start) / 512)
        same = np.array_equal(np.concatenate(found[0]), np.concatenate(found[1]))
        print(
            f"{quantity}: {1e3 * spent[0]:.2f} ms one by one, {1e3 * spent[1]:.2f} ms in blocks of 32, "
            f"{spent[0] / spent[1]:.1f}x, {'the same bytes' if same else 'NOT the same bytes'}"
        )


def command(study: Study, row: int) -> float:
    """The lowest depth of one configuration by ``jointlib lobes``, from a machine file and a joint file of its own."""
    preload, damping, immersion = study.numbers()[row]
    folder = study.source.parent
    joint = read_joint(folder / "guide.joint.toml")
    changed = joint.with_parameters({"hertz_guide.preload": float(preload), "viscous.damping": float(damping)})
    write_joint(folder / "changed.joint.toml", changed)
    document = tomllib.loads(study.base.read_text())
    document["connection"][0]["joint"] = "changed.joint.toml"
    document["cutting"]["immersion"] = float(immersion)
    (folder / "changed.toml").write_text(tomli_w.dumps(document))
    words = ["lobes", str(folder / "changed.toml"), "--method", "zero-order", "--json"]
    done = subprocess.run([Path(sys.executable).with_name("jointlib"), *words], capture_output=True, check=True)
    return float(json.loads(done.stdout)["minimum_depth"])


if __name__ == "__main__":
    main()
