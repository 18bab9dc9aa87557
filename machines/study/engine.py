"""Computing the blocks of a study: in this process, in a pool of processes, or wherever an executor runs them.

A task is a run of blocks; its length follows from what the first ones cost, so that handing it over takes no
noticeable share of the time. Results go to the store as they come; who computed what makes no difference to them.
"""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing.process import parent_process

from jointlib.arrays import Array
from jointlib.errors import InputError

from .store import Store

Evaluate = Callable[[int, int], Mapping[str, Array]]
"""Results of the configurations from the first to before the second row, one array per result; picklable."""

_TASK = 2.0
"""Seconds a task should take."""
_AHEAD = 2
"""Tasks waiting per worker, so that none is idle while results are written."""
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Task:
    """A run of neighbouring blocks, computed one by one."""

    evaluate: Evaluate
    rows: tuple[tuple[int, int], ...]
    """First row and end of every block."""

    def __call__(self) -> tuple[dict[str, Array], float]:
        """The results, joined, and the seconds they took."""
        import numpy as np

        start = time.perf_counter()
        found = [self.evaluate(first, end) for first, end in self.rows]
        joined = {name: np.concatenate([part[name] for part in found]) for name in found[0]}
        return joined, time.perf_counter() - start


def compute(
    store: Store,
    evaluate: Evaluate,
    executor: Executor | None = None,
    workers: int = 1,
    part: tuple[int, int] = (1, 1),
    progress: Callable[[int], None] = lambda done: None,
    blocks: range | None = None,
) -> None:
    """Compute the blocks that are missing, of all or of some; with ``part`` (k, n) the k-th of n equal runs of them.

    Without an executor this process computes. Where a worker is killed, what is in the store stays, and the study is
    to be resumed.
    """
    k, n = part
    blocks = range(store.blocks) if blocks is None else blocks
    mine = blocks[(len(blocks) * (k - 1)) // n : (len(blocks) * k) // n]
    with store.lock(f"part-{k}-of-{n}"):
        todo = [i for i in store.missing() if i in mine]
        if executor is None:
            executor, workers = _Here(), 1
        try:
            _dispatch(store, evaluate, executor, workers, todo, progress)
        except BrokenExecutor:
            raise InputError(
                f"{store.folder}: a worker was killed or ran out of memory; what is done is kept, resume the study"
            ) from None
        except (OSError, EOFError) as error:
            raise InputError(f"{store.folder}: the computation stopped ({error}); resume the study") from None
        if lost := len(set(todo) & set(store.missing())):
            raise InputError(f"{store.folder}: {lost} blocks that were computed are gone from it; resume the study")


def _dispatch(
    store: Store,
    evaluate: Evaluate,
    executor: Executor,
    workers: int,
    todo: Sequence[int],
    progress: Callable[[int], None],
) -> None:
    left, cost, done = list(todo), math.inf, 0
    running: dict[Future[tuple[dict[str, Array], float]], tuple[int, int]] = {}
    while left or running:
        while left and len(running) < _AHEAD * workers:
            size = 1 if math.isinf(cost) else max(1, min(int(_TASK / cost), len(left) // (2 * workers) or 1))
            run = _neighbours(left, size)
            rows = tuple((store.rows(i, i).start, store.rows(i, i).stop) for i in run)
            running[executor.submit(Task(evaluate, rows))] = (run[0], run[-1])
            del left[: len(run)]
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in finished:
            lowest, highest = running.pop(future)
            results, seconds = future.result()
            store.keep(lowest, highest, results)
            done += highest - lowest + 1
            cost = max(seconds / (highest - lowest + 1), 1e-6)
            progress(done)


def _neighbours(blocks: Sequence[int], size: int) -> list[int]:
    """Up to ``size`` blocks from the start that follow each other without a hole."""
    run = [blocks[0]]
    for i in blocks[1:size]:
        if i != run[-1] + 1:
            break
        run.append(i)
    return run


class _Here(Executor):
    """Computes at once, in this process."""

    def submit(self, fn, /, *args, **kwargs):  # type: ignore[no-untyped-def]
        future: Future[object] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def single_threaded() -> bool:
    """Whether linear algebra has one thread in this process; with more its last digits may be others."""
    return os.cpu_count() == 1 or any(os.environ.get(name) == "1" for name in _THREADS)


@contextlib.contextmanager
def process_pool(workers: int) -> Iterator[Executor]:
    """Processes with one thread each for linear algebra, which end when this process does."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read when a worker imports numpy
    try:
        context, others = multiprocessing.get_context("spawn"), multiprocessing.active_children()
        with ProcessPoolExecutor(workers, mp_context=context, initializer=_end_with_parent) as pool:
            try:
                with _undisturbed():
                    for _ in range(workers):  # each starts a worker
                        pool.submit(os.getpid)
                yield pool
            except BaseException:
                for worker in set(multiprocessing.active_children()).difference(others):
                    worker.terminate()
                pool.shutdown(cancel_futures=True)
                raise
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Keeps Ctrl-C from the processes that are started meanwhile until they can end without a word."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent() -> None:
    """Watch the parent from a thread and leave with it, even where it was killed; Ctrl-C ends without a word."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
