"""Work on several processors: pools of processes, and long loops whose items they share.

Which process computes what makes no difference to a result: every item is computed from what is known before the loop,
and linear algebra has one thread.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, TypeVar

from jointlib.shown.progress import each
from jointlib.system.memory import divide

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_WORTH = 0.5
"""Seconds that are left of a loop from which on it is shared; to begin takes a fifth of that at most."""
_MOST = 8
"""Processes of a loop: each comes to hold memory of its own."""
_AHEAD = 2
"""Items handed out per process, so that none is idle while a result is waited for in its order."""

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_work: Callable[[Any], Any]
"""What this process was begun for."""


def on_every_core(work: Callable[[_Item], _Result], items: Iterable[_Item], count: int) -> Iterator[_Result]:
    """``work`` of each item, in their order; what is long is shared among the processors.

    Items, of which there are about ``count``, are drawn as they are handed out, a few before their results are there.
    The first are worked on here, until they tell that more than half a second is left. Other processes see what this
    one knows at that moment, and only results come back, which have to be picklable. Each has its part of the memory
    that this one may take. Where that is too little, a process is killed or the system gives none, this one goes on
    alone.

    On Linux, where a process can be divided; not in a process or thread that is itself one of several, nor where
    linear algebra may have several threads.
    """
    left, spent, done, cores = iter(items), 0.0, 0, _free_cores()
    for item in left:
        begun = time.perf_counter()
        yield work(item)
        spent, done = spent + time.perf_counter() - begun, done + 1
        if cores > 1 and count - done > 1 and spent / done * (count - done) > _WORTH:
            break
    else:
        return
    yield from _shared(work, left, min(cores, count - done))


def each_on_every_core(what: str, work: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """`on_every_core` of all items; how many of ``what`` are handed out is told, see `each`."""
    return list(on_every_core(work, each(what, items, len(items)), len(items)))


def _free_cores() -> int:
    from multiprocessing.process import parent_process

    alone = parent_process() is None and threading.current_thread() is threading.main_thread()
    if sys.platform != "linux" or not alone or not single_threaded():
        return 1
    return min(len(os.sched_getaffinity(0)), _MOST)


def _shared(work: Callable[[_Item], _Result], items: Iterator[_Item], processes: int) -> Iterator[_Result]:
    from concurrent.futures import BrokenExecutor

    handed, found = deque[_Item](), deque["Future[_Result]"]()

    def hand_out(most: int) -> None:
        for item in islice(items, most):
            handed.append(item)
            found.append(pool.submit(_worked, item))

    try:
        with _pool(processes, "fork", partial(_begin_part, work, processes)) as pool:
            with _undisturbed():
                hand_out(_AHEAD * processes)
            while found:
                result = found[0].result()
                handed.popleft()
                found.popleft()
                yield result
                hand_out(1)
    except (BrokenExecutor, MemoryError, OSError):  # what the work itself raised it raises here again
        yield from map(work, chain(handed, items))


def _begin_part(work: Callable[[Any], Any], processes: int) -> None:
    global _work
    _work = work
    divide(processes)
    _begin()


def _worked(item: Any) -> Any:
    return _work(item)


def single_threaded() -> bool:
    """Whether linear algebra has one thread in this process; with more its last digits may be others."""
    return os.cpu_count() == 1 or any(os.environ.get(name) == "1" for name in _THREADS)


@contextlib.contextmanager
def process_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes with one thread each for linear algebra, which end when this process does."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read when a worker imports numpy
    try:
        with _pool(workers, "spawn", _begin) as pool:
            with _undisturbed():
                for _ in range(workers):  # each starts a worker
                    pool.submit(os.getpid)
            yield pool
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _pool(workers: int, start: str, begin: Callable[[], None]) -> Iterator[ProcessPoolExecutor]:
    """A pool whose processes are ended at once where the work is broken off."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    context, others = multiprocessing.get_context(start), multiprocessing.active_children()
    with ProcessPoolExecutor(workers, mp_context=context, initializer=begin) as pool:
        try:
            yield pool
        except BaseException:
            for worker in set(multiprocessing.active_children()).difference(others):
                worker.terminate()
            pool.shutdown(cancel_futures=True)
            raise


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


def _begin() -> None:
    """Watch the parent from a thread and leave with it, even where it was killed; signals end without a word."""
    from multiprocessing.process import parent_process

    for number in (signal.SIGINT, signal.SIGTERM):
        if callable(signal.getsignal(number)):
            signal.signal(number, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
