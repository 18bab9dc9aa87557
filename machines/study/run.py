"""From a study file to results: what identifies a study, and how its configurations are computed."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.io.atomic import sha256
from jointlib.joint import Joint

from .engine import compute, process_pool
from .evaluation import Evaluation
from .store import Store
from .study import BASE, Study

_BLOCK = 16
_PATIENCE = 10
"""Seconds a scheduler has to answer."""
_PACKAGES = ("jointlib", "machines")


def begin(study: Study, folder: Path) -> Store:
    """The results folder of a study: a new one, or that of the same study, inputs and program."""
    total = len(study.numbers())
    return Store.begin(folder, identity(study), total, _BLOCK)


def evaluate_all(
    study: Study,
    store: Store,
    joints: dict[str, Joint],
    workers: int | None = None,
    part: tuple[int, int] = (1, 1),
    scheduler: str | None = None,
    progress: Callable[[int], None] = lambda done: None,
) -> None:
    """Compute what is missing, with so many processes (default: one per processor; 1 computes in this process).

    ``scheduler`` is the address of a Dask scheduler, whose workers compute instead.
    """
    evaluation = Evaluation(study.source.resolve(), tuple(sorted(joints.items())))
    evaluation(0, 1)  # what is wrong with the study is said before any worker starts
    count = workers or os.cpu_count() or 1
    if scheduler is not None:
        with _cluster(scheduler) as (pool, count):
            compute(store, evaluation, pool, count, part, progress)
    elif count == 1:
        compute(store, evaluation, part=part, progress=progress)
    else:
        with process_pool(count) as pool:
            compute(store, evaluation, pool, count, part, progress)


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
    return {"study": sha256(study.source), "inputs": together, "program": f"{version('jointlib')} {_code()}"}


def inputs(study: Study) -> tuple[Path, ...]:
    """Every file that the configurations are made from."""
    bases = [study.base, *(study.source.parent / str(v) for f in study.factors if f.path == BASE for v in f.choices)]
    return tuple(sorted({file for base in bases for file in _files(base, frozenset())}))


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
            if len(word) < 200 and "\n" not in word and named.is_file():
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
