"""From a study file to results: what identifies a study, and how its configurations are computed."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import os
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.atomic import sha256, write_npz
from jointlib.joint import Joint

from .asked import check_asked
from .engine import compute, process_pool, single_threaded
from .evaluation import Evaluation, Generation
from .search import generations, optimiser
from .store import Store, arrays
from .study import BASE, Study

_BLOCK = 16
"""Most configurations in a block."""
_BLOCKS = 256
"""Blocks a plan should at least have, so that many workers share a short one."""
_PATIENCE = 10
"""Seconds a scheduler has to answer."""
_PLAN = "plan"
_PACKAGES = ("jointlib", "machines")


def begin(study: Study, folder: Path) -> Store:
    """The results folder of a study: a new one, or that of the same study, inputs and program."""
    check_asked(study)
    together = study.population * study.repeats if study.searched else study.total
    block = max(1, min(_BLOCK, together // _BLOCKS))
    if study.searched:  # generations end where blocks do
        block = max(size for size in range(1, block + 1) if together % size == 0)
    return Store.begin(folder, identity(study), study.total, block)


def planned(study: Study, folder: Path) -> Study:
    """The study with the designs that its search has proposed so far; any other study as it is."""
    if not study.searched:
        return study
    rows = [_proposed(path) for path in sorted((folder / _PLAN).glob("*.npz"))]
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
    evaluation = Evaluation(study.source.resolve(), tuple(sorted(joints.items())), uuid.uuid4().hex)
    trial = Generation(evaluation, next(generations(study)), 0) if study.searched else evaluation
    trial(0, 1)  # what is wrong with the study is said before any worker starts
    with _workers(workers, scheduler) as (executor, count):
        if study.searched:
            search_all(study, store, evaluation, executor, count, progress)
        else:
            compute(store, evaluation, executor, count, part, progress)


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
def _workers(workers: int | None, scheduler: str | None) -> Iterator[tuple[Executor | None, int]]:
    """Who computes, and how many; None for this process."""
    count = workers or os.cpu_count() or 1
    if scheduler is not None:
        with _cluster(scheduler) as found:
            yield found
    elif count == 1 and single_threaded():
        yield None, 1
    else:
        with process_pool(count) as pool:
            yield pool, count


@contextlib.contextmanager
def _cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """The workers of a Dask scheduler, and how many threads they have."""
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError:
        raise InputError("--scheduler: Dask is not installed, expected pip install 'jointlib[cluster]'") from None
    try:
        client = distributed.Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"--scheduler: {address} does not answer ({str(error).splitlines()[0]})") from None
    with client:
        threads = sum(client.nthreads().values())
        if not threads:
            raise InputError(f"--scheduler: {address} has no workers, expected at least one")
        yield client.get_executor(pure=False), threads


def identity(study: Study) -> dict[str, Any]:
    """Hashes of the study, of every file it stands on and of the program, by which results are told apart."""
    together = hashlib.sha256("".join(sha256(file) for file in inputs(study)).encode()).hexdigest()
    program = f"{version('jointlib')} {_code()}" + (f", {optimiser()}" if study.searched else "")
    return {"study": sha256(study.source), "inputs": together, "program": program}


def inputs(study: Study) -> tuple[Path, ...]:
    """Every file that the configurations are made from."""
    bases = [study.base, *(study.source.parent / str(v) for f in study.factors if f.path == BASE for v in f.choices)]
    found = {file for base in bases for file in _files(base, frozenset())}
    words = {word for f in study.factors if f.path != BASE for word in _words(list(f.choices))}
    named = (folder / word for folder in {file.parent for file in found} for word in words if _may_name(word))
    found |= {file for path in named if path.is_file() for file in _files(path, frozenset())}
    return tuple(sorted(found))


def _may_name(word: str) -> bool:
    return len(word) < 200 and "\n" not in word


def _files(path: Path, above: frozenset[Path]) -> set[Path]:
    """A file and every file that its text names, in turn."""
    import tomllib

    if not path.is_file():
        raise InputError(f"{path}: no such file, expected a machine file")
    found = {path.resolve()}
    if path.suffix == ".toml" and path not in above:
        try:
            table = tomllib.loads(path.read_text("utf-8-sig"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: not valid TOML: {error}") from None
        for word in _words(table):
            named = path.parent / word
            if _may_name(word) and named.is_file():
                found |= _files(named, above | {path})
    return found


def _words(value: Any) -> set[str]:
    if isinstance(value, str):
        return {value}
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return {word for part in inside for word in _words(part)}


def _code() -> str:
    """Hash of the program's own text."""
    import jointlib

    root = Path(jointlib.__file__).parents[1]
    digest = hashlib.sha256()
    for package in _PACKAGES:
        for file in sorted((root / package).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
