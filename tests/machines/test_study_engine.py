"""The engine of studies: whoever computes the blocks, and however often it is killed, the results are the same."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pytest
import study_kills
from study_kills import BLOCK, TOTAL

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.system import processes
from jointlib.system.processes import process_pool
from machines.study import engine
from machines.study.engine import compute
from machines.study.store import Store

SCRIPT = Path(study_kills.__file__)
IDENTITY = {"study": "killed"}


def quick(first: int, end: int) -> dict[str, Array]:
    x = np.arange(first, end, dtype=float)
    return {"sine": np.sin(x), "root": np.sqrt(x)}


def begun(folder: Path) -> Store:
    return Store.begin(folder, IDENTITY, TOTAL, BLOCK)


def same(found: Mapping[str, Array]) -> bool:
    wanted = quick(0, TOTAL)
    return found.keys() == wanted.keys() and all(np.array_equal(found[k], wanted[k]) for k in wanted)


def test_every_configuration_is_computed_once_and_in_order(tmp_path: Path) -> None:
    asked: list[tuple[int, int]] = []

    def noted(first: int, end: int) -> dict[str, Array]:
        asked.append((first, end))
        return quick(first, end)

    store = begun(tmp_path / "r")
    compute(store, noted)
    assert same(store.results())
    assert asked == [(i, min(i + BLOCK, TOTAL)) for i in range(0, TOTAL, BLOCK)]
    compute(store, noted)
    assert len(asked) == store.blocks


@pytest.mark.thorough
def test_a_pool_and_two_parts_leave_the_same_results(tmp_path: Path) -> None:
    pooled, parts = begun(tmp_path / "pool"), begun(tmp_path / "parts")
    with process_pool(2) as pool:
        compute(pooled, study_kills.evaluate, pool, 2)
    for k in (2, 1):
        compute(parts, quick, part=(k, 2))
        if k == 2:
            with pytest.raises(InputError, match="blocks, expected all; resume"):
                parts.results()
    assert same(pooled.results())
    assert same(parts.results())


@pytest.mark.slow
def test_killed_at_random_moments_it_goes_on_where_it_was(tmp_path: Path) -> None:
    """SIGKILL leaves no half-written shard, and what was computed is not computed again."""
    folder, rng = tmp_path / "r", np.random.default_rng(5)
    killed, blocks = 0, 0
    for _ in range(40):
        process = subprocess.Popen([sys.executable, str(SCRIPT), str(folder)])
        time.sleep(rng.uniform(0.25, 0.75))
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
        held = Store.opened(folder)[0].held() if (folder / "study.json").exists() else []
        done = sum(last - first + 1 for first, last in held)
        assert done >= blocks
        blocks = done
        if killed >= 6:
            break
    subprocess.run([sys.executable, str(SCRIPT), str(folder)], check=True)
    store = begun(folder)
    assert same(store.results())
    ranges = store.held()
    assert all(before[1] < after[0] for before, after in itertools.pairwise(ranges))


@pytest.mark.thorough
def test_workers_leave_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, str(SCRIPT), str(tmp_path / "r"), "2"], start_new_session=True)
    deadline = time.monotonic() + 30
    while not list((tmp_path / "r" / "shards").glob("*.npz")):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    while _alive(process.pid):
        assert time.monotonic() < deadline, "a worker lives on"
        time.sleep(0.05)


def _alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_worker_that_is_killed_is_told_and_nothing_is_lost(tmp_path: Path) -> None:
    store = begun(tmp_path / "r")
    with pytest.raises(InputError, match="a worker was killed"), process_pool(1) as pool:
        compute(store, dies_late, pool, 1)
    done = store.blocks - len(store.missing())
    assert done > 0
    compute(store, quick)
    assert same(store.results())


def test_blocks_that_vanish_while_others_are_computed_are_told(tmp_path: Path) -> None:
    store = begun(tmp_path / "r")

    def loses(done: int) -> None:
        if done == 2:
            next((tmp_path / "r" / "shards").glob("*.npz")).unlink()

    with pytest.raises(InputError, match="blocks that were computed are gone from it; resume the study"):
        compute(store, quick, progress=loses)
    compute(store, quick)
    assert same(store.results())


def test_a_pool_that_breaks_between_two_tasks_is_told_as_well(tmp_path: Path) -> None:
    class Breaks(Executor):
        given = 0

        def submit(self, fn, /, *args, **kwargs):  # type: ignore[no-untyped-def]
            self.given += 1
            if self.given > 2:
                raise BrokenProcessPool("a child process terminated")
            future: Future[object] = Future()
            future.set_result(fn(*args, **kwargs))
            return future

    with pytest.raises(InputError, match="a worker was killed"):
        compute(begun(tmp_path / "r"), quick, Breaks(), 1)


def dies_late(first: int, end: int) -> dict[str, Array]:
    if first >= TOTAL // 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(first, end)


def test_results_of_another_study_are_not_mixed_in(tmp_path: Path) -> None:
    compute(begun(tmp_path / "r"), quick, part=(1, 10))
    with pytest.raises(InputError, match=r"another study \(it differs in its study file\)"):
        Store.begin(tmp_path / "r", {"study": "other"}, TOTAL, BLOCK)
    with pytest.raises(InputError, match=r"another study \(it differs in block, total\)"):
        Store.begin(tmp_path / "r", IDENTITY, TOTAL + 1, BLOCK + 1)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").touch()
    with pytest.raises(InputError, match="not empty"):
        begun(tmp_path / "full")
    with pytest.raises(InputError, match="holds no study"):
        Store.opened(tmp_path / "full")


def test_a_folder_that_holds_no_result_yet_is_as_good_as_empty(tmp_path: Path) -> None:
    """A study that was refused or stopped at once, put right and begun again; but not while a process is at work."""
    other = Store.begin(tmp_path / "r", {"study": "with an error"}, TOTAL, BLOCK)
    assert not (tmp_path / "r").exists()
    with other.lock("part-1-of-2"):
        with pytest.raises(InputError, match="another study"):
            begun(tmp_path / "r")
        late = Store(tmp_path / "r", TOTAL, BLOCK, {"study": "killed"})
        with pytest.raises(InputError, match="another study"), late.lock("part-2-of-2"):
            pass
    store = begun(tmp_path / "r")
    with pytest.raises(InputError, match="another study"), store.lock("part-1-of-2"), other.lock("part-2-of-2"):
        pass
    assert Store.opened(tmp_path / "r")[1]["study"] == "killed"


def test_shards_that_cannot_be_listed_are_not_taken_for_none(tmp_path: Path) -> None:
    store = begun(tmp_path / "r")
    assert store.held() == []
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "shards").write_text("no folder")
    with pytest.raises(InputError, match=r"shards: cannot be opened \(Not a directory\)"):
        store.held()


def test_two_processes_do_not_compute_one_part(tmp_path: Path) -> None:
    store = begun(tmp_path / "r")
    with store.lock("part-1-of-1"), pytest.raises(InputError, match="another process"):
        compute(store, quick)


def test_a_full_disk_stops_the_study_and_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store, written = begun(tmp_path / "r"), []

    def full(*arguments: object, **arrays: object) -> None:
        written.append(arguments)
        if len(written) > 3:
            raise OSError(28, "No space left on device")
        saved(*arguments, **arrays)

    saved = np.savez_compressed
    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(InputError, match="No space left"):
        compute(store, quick)
    monkeypatch.undo()
    assert 0 < len(store.missing()) < store.blocks
    assert {path.suffix for path in (tmp_path / "r" / "shards").iterdir()} == {".npz"}
    compute(store, quick)
    assert same(store.results())


class Clock:
    """Time that passes only while something is computed."""

    def __init__(self, seconds: float) -> None:
        self.now, self.seconds = 0.0, seconds

    def evaluate(self, first: int, end: int) -> dict[str, Array]:
        self.now += self.seconds * (end - first)
        return quick(first, end)


@pytest.mark.parametrize(("seconds", "longest"), [(1e-6, 24), (0.019, 10), (0.5, 1)])
def test_tasks_are_as_long_as_the_measured_cost_allows(
    seconds: float, longest: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two seconds, or one block where that takes longer; never more than a fair share of what is left."""
    clock, store = Clock(seconds), begun(tmp_path / "r")
    monkeypatch.setattr(engine.time, "perf_counter", lambda: clock.now)
    compute(store, clock.evaluate, engine._Here(), 2)
    sizes = [last - first + 1 for first, last in store.held()]
    assert sizes[0] == 1, "nothing is known before the first block"
    assert max(sizes) == longest
    left = store.blocks - np.append(0, np.cumsum(sizes)[:-1])
    assert all(size <= max(1, rest // 4) for size, rest in zip(sizes, left, strict=True))
    assert len(sizes) < 25 or longest == 1
    assert same(store.results())


def test_workers_have_one_thread_for_linear_algebra(monkeypatch: pytest.MonkeyPatch) -> None:
    """With more threads the last digits of a product may be others, and processes would fight for the processors."""
    for name in processes._THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    assert not processes.single_threaded()
    with process_pool(1) as pool:
        assert [pool.submit(os.getenv, name).result() for name in processes._THREADS] == ["1", "1", "1"]
    assert os.getenv("OPENBLAS_NUM_THREADS") is None
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert processes.single_threaded()
