"""Computing the blocks of a study: in this process, in a pool of processes, or wherever an executor runs them.

A task is a run of blocks; its length follows from what the first ones cost, so that handing it over takes no
noticeable share of the time. Results go to the store as they come; who computed what makes no difference to them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass

from jointlib.arrays import Array
from jointlib.errors import InputError

from .store import Store

Evaluate = Callable[[int, int], Mapping[str, Array]]
"""Results of the configurations from the first to before the second row, one array per result; picklable."""

_TASK = 2.0
"""Seconds a task should take."""
_AHEAD = 2
"""Tasks waiting per worker, so that none is idle while results are written."""


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
