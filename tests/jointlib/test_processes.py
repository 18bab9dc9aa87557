"""Long loops are shared among processors: the same results in the same order, whatever becomes of the processes."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread

import pytest

from jointlib import CheckFailed
from jointlib.system import memory, processes
from jointlib.system.processes import on_every_core

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="a process is divided on Linux alone")
SLOW = 0.12
"""s an item takes, of which a dozen are worth a second process."""


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1})
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")


def slowly(item: int) -> tuple[int, int]:
    time.sleep(SLOW)
    return item, os.getpid()


def test_a_long_loop_is_shared_and_its_results_keep_their_order() -> None:
    found = list(on_every_core(slowly, range(12), 12))
    assert [item for item, _ in found] == list(range(12))
    assert found[0][1] == os.getpid()
    assert len({process for _, process in found}) == 3


def test_a_short_loop_stays_where_it_is() -> None:
    found = list(on_every_core(lambda item: (item, os.getpid()), range(100), 100))
    assert found == [(item, os.getpid()) for item in range(100)]


def test_linear_algebra_of_several_threads_stays_in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in processes._THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    assert {process for _, process in on_every_core(slowly, range(6), 6)} == {os.getpid()}


def test_a_thread_and_a_process_of_several_share_nothing_further() -> None:
    def inner(item: int) -> tuple[int, set[int]]:
        return os.getpid(), {process for _, process in on_every_core(slowly, range(6), 6)}

    (here, shared), *others = on_every_core(inner, range(3), 3)
    assert (here, len(shared)) == (os.getpid(), 3)
    assert all(seen == {other} != {here} for other, seen in others)
    seen = set[int]()
    thread = Thread(target=lambda: seen.update(process for _, process in on_every_core(slowly, range(6), 6)))
    thread.start()
    thread.join()
    assert seen == {os.getpid()}


def test_items_are_drawn_as_they_are_handed_out() -> None:
    drawn = list[int]()

    def items() -> Iterator[int]:
        for item in range(40):
            drawn.append(item)
            yield item

    for item, _ in on_every_core(slowly, items(), 40):
        assert len(drawn) <= item + 2 + processes._AHEAD * 2
        if item == 7:
            break
    assert len(drawn) < 40


def test_what_one_item_raises_ends_the_loop() -> None:
    def fails(item: int) -> tuple[int, int]:
        if item == 5:
            raise CheckFailed("the fifth does not settle")
        return slowly(item)

    found = list[int]()

    def gather() -> None:
        for item, _ in on_every_core(fails, range(12), 12):
            found.append(item)

    with pytest.raises(CheckFailed, match="the fifth does not settle"):
        gather()
    assert found == list(range(5))


def test_where_a_process_is_killed_this_one_goes_on() -> None:
    here = os.getpid()

    def deadly(item: int) -> int:
        time.sleep(SLOW)
        if item == 4 and os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    assert list(on_every_core(deadly, range(10), 10)) == list(range(10))


def test_where_the_system_gives_no_process_this_one_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> int:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(os, "fork", none)
    found = list(on_every_core(slowly, range(8), 8))
    assert found == [(item, os.getpid()) for item in range(8)]


def test_a_file_that_the_work_cannot_read_is_told_as_ever() -> None:
    def reads(item: int) -> int:
        time.sleep(SLOW)
        if item == 5:
            raise FileNotFoundError(2, "No such file or directory", "gone.csv")
        return item

    with pytest.raises(FileNotFoundError, match="gone"):
        list(on_every_core(reads, range(12), 12))


def test_processes_part_the_memory_and_where_that_is_too_little_one_goes_on_alone() -> None:
    here = os.getpid()

    def filled(item: int) -> tuple[int, int]:
        time.sleep(SLOW)
        soft, _ = resource.getrlimit(resource.RLIMIT_DATA)
        if item == 5:
            assert bytearray(600_000_000)
        return os.getpid(), soft

    before = resource.getrlimit(resource.RLIMIT_DATA)
    held = memory._held()
    resource.setrlimit(resource.RLIMIT_DATA, (held + 800_000_000, before[1]))
    try:
        found = list(on_every_core(filled, range(8), 8))
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)
    parts = {soft - held for process, soft in found if process != here}
    assert len(parts) == 1
    assert parts.pop() == pytest.approx(400e6, rel=0.1)
    assert [process for process, _ in found[5:]] == [here] * 3


LOOP = """
import os, signal, time
from jointlib.system.processes import on_every_core

signal.signal(signal.SIGINT, signal.default_int_handler)  # what a shell begins beside itself ignores Ctrl-C

def slowly(item):
    time.sleep(0.1)
    return os.getpid()

os.sched_getaffinity = lambda process: {0, 1}
for process in on_every_core(slowly, range(200), 200):
    print(process, flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_nothing_is_left_of_a_loop_that_is_stopped(number: int, tmp_path: Path) -> None:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    with subprocess.Popen(
        [sys.executable, "-c", LOOP],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    ) as running:
        assert running.stdout is not None
        seen = {int(running.stdout.readline()) for _ in range(8)}
        assert len(seen) == 3
        if number == signal.SIGINT:
            os.killpg(running.pid, number)  # as Ctrl-C does: every process hears it
        else:
            os.kill(running.pid, number)
        running.wait(10)
        said = running.communicate()[1] if number == signal.SIGINT else ""
    assert said.count("Traceback") == (1 if number == signal.SIGINT else 0)
    until = time.monotonic() + 10
    while any(Path(f"/proc/{process}").exists() for process in seen) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(Path(f"/proc/{process}").exists() for process in seen)
