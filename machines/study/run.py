"""From a study file to results: what identifies a study, and how its configurations are computed."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import importlib
import json
import os
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.atomic import sha256, write_npz
from jointlib.joint import Joint
from jointlib.system.processes import process_pool, single_threaded

from .asked import check_asked
from .engine import compute
from .evaluation import Evaluation, Generation
from .inputs import inputs_hash
from .search import generations, optimiser
from .store import Store, arrays
from .study import Study
from .study_file import read_study

_BLOCK = 32
"""Most configurations in a block."""
_BLOCKS = 128
"""Blocks a plan should at least have, so that many workers share a short one."""
_PATIENCE = 10
"""Seconds a scheduler has to answer."""
_TRIED = 8
_PLAN = "plan"
_PACKAGES = ("jointlib", "machines")
_SHOWING = ("explore", "report")


def begin(study: Study, folder: Path) -> Store:
    """The results folder of a study: a new one, or that of the same study, inputs and program."""
    check_asked(study)
    together = study.population * study.repeats if study.searched else study.total
    whole = study.together
    block = max(whole, min(_BLOCK, together // _BLOCKS) // whole * whole)
    if study.searched:  # generations end where blocks do
        block = max(size for size in range(whole, block + 1, whole) if together % size == 0)
    known = identity(study) | ({"optimiser": optimiser()} if study.searched else {})
    return Store.begin(folder, known, study.total, block)


def planned(study: Study, folder: Path) -> Study:
    """The study with the designs that its search has proposed so far; any other study as it is."""
    if not study.searched:
        return study
    rows = [_proposed(path) for path in sorted((folder / _PLAN).glob("*.npz"), key=lambda p: int(p.stem))]
    return replace(study, found=np.concatenate(rows)) if rows else study


def evaluate_all(
    study: Study,
    store: Store,
    joints: dict[str, Joint],
    workers: int | None = None,
    part: tuple[int, int] = (1, 1),
    scheduler: str | None = None,
    progress: Callable[[int], None] = lambda done: None,
) -> None:
    """Compute what is missing, with so many processes (default: one per processor).

    Each has one thread for linear algebra; where that holds for this process, a single one is this.

    ``scheduler`` is the address of a Dask scheduler, whose workers compute instead.
    """
    if study.searched and part != (1, 1):
        raise InputError("--shard: a generation of a search follows from the one before, expected no parts of it")
    known, word = tuple(sorted(joints.items())), uuid.uuid4().hex
    evaluation = Evaluation(study.source.resolve(), known, word, inputs_hash(study), study.asked_tools)
    _try(study, evaluation)
    with _workers(study, workers, scheduler) as (executor, count):
        if study.searched:
            search_all(study, store, evaluation, executor, count, progress)
        else:
            compute(store, evaluation, executor, count, part, progress)


def _try(study: Study, evaluation: Evaluation) -> None:
    """Say what is wrong with the study before any worker starts: where the first few designs are all refused."""
    numbers = evaluation.numbers(next(generations(study))) if study.searched else study.numbers()
    tried = range(0, len(numbers), study.repeats)[:_TRIED]
    said = ""
    for row in tried:
        sentence = evaluation.refused(numbers[row], study.case(row))
        if not sentence:
            return
        said = said or sentence
    raise InputError(said)


def search_all(
    study: Study,
    store: Store,
    evaluation: Evaluation,
    executor: Executor | None,
    workers: int,
    progress: Callable[[int], None] = lambda done: None,
) -> None:
    """Compute generation after generation; those that are in the store are only told to the optimiser."""
    proposals, first = generations(study), 0
    designs = next(proposals)
    with store.lock("search"), contextlib.suppress(StopIteration):
        while True:
            path = store.folder / _PLAN / f"{first // study.repeats:06d}.npz"
            if path.exists():
                designs = _proposed(path)
            else:
                write_npz(path, {"designs": designs})
            end = first + len(designs) * study.repeats
            blocks = range(first // store.block, -(-end // store.block))
            rows = Generation(evaluation, designs, first)
            compute(store, rows, executor, workers, progress=progress, blocks=blocks)
            designs, first = proposals.send((designs, store.results(blocks))), end


def _proposed(path: Path) -> Array:
    return arrays(path)["designs"]


@contextlib.contextmanager
def _workers(study: Study, workers: int | None, scheduler: str | None) -> Iterator[tuple[Executor | None, int]]:
    """Who computes, and how many; None for this process."""
    count = workers or os.cpu_count() or 1
    if scheduler is not None:
        with _cluster(scheduler, study) as found:
            yield found
    elif count == 1 and single_threaded():
        yield None, 1
    else:
        with process_pool(count) as pool:
            yield pool, count


@contextlib.contextmanager
def _cluster(address: str, study: Study) -> Iterator[tuple[Executor, int]]:
    """The workers of a Dask scheduler, which have to see the same study, and how many threads they have."""
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError:
        raise InputError("--scheduler: Dask is not installed, expected pip install 'jointlib[cluster]'") from None
    try:
        kind = asyncio.run(asyncio.wait_for(_kind(distributed, address), _PATIENCE))
    except Exception as error:  # whatever program it is that listens there
        said = str(error).partition("\n")[0] or f"nothing in {_PATIENCE} s"
        raise InputError(f"--scheduler: {address} does not answer ({said}), expected a Dask scheduler") from None
    if kind != "Scheduler":
        raise InputError(f"--scheduler: {address} is a {kind.lower()} of Dask, expected its scheduler")
    with distributed.Client(address, timeout=_PATIENCE, set_as_default=False) as client:
        threads = sum(client.nthreads().values())
        if not threads:
            raise InputError(f"--scheduler: {address} has no workers, expected at least one")
        here, source = identity(study), study.source.resolve()
        for worker, there in client.run(_seen, source, study.asked_tools, on_error="return").items():
            if there != here:
                known = isinstance(there, dict)
                what = ", ".join(k for k in here if there[k] != here[k]) if known else str(there).partition("\n")[0]
                raise InputError(
                    f"--scheduler: worker {worker} does not see this study ({what}), expected the same files and the "
                    "same release of jointlib"
                )
        try:
            yield client.get_executor(pure=False), threads
        except (CancelledError, distributed.scheduler.KilledWorker):
            raise InputError(
                f"--scheduler: {address} ended or lost its workers; what is done is kept, resume the study"
            ) from None


async def _kind(distributed: Any, address: str) -> str:
    """What of Dask answers; a client would wait for a stranger without end."""
    async with distributed.rpc(address) as other:
        return str((await other.identity())["type"])


def _seen(source: Path, tools: tuple[str, ...]) -> dict[str, Any]:
    """What a worker has of a study."""
    return identity(read_study(source, tools))


def identity(study: Study) -> dict[str, Any]:
    """Hashes of the study, of every file it stands on and of the program, by which results are told apart."""
    known = {"study": sha256(study.source), "inputs": inputs_hash(study), "program": f"{version('jointlib')} {_code()}"}
    return known | ({"tools": list(study.asked_tools)} if study.asked_tools else {})


def tools_asked(folder: Path) -> tuple[str, ...]:
    """The tools that a study was run with, in the place of those that its file names; none where it was not."""
    with contextlib.suppress(OSError, ValueError):
        return tuple(json.loads((folder / "study.json").read_text("utf-8")).get("tools", ()))
    return ()


def _code() -> str:
    """Hash of the text of what computes; what only tells of results or shows them leaves them valid."""
    import jointlib

    root = Path(jointlib.__file__).parents[1]
    digest = hashlib.sha256()
    for package in _PACKAGES:
        for file in sorted((root / package).rglob("*.py")):
            if file.relative_to(root / package).parts[0] not in _SHOWING:
                digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
