"""Results of a study on disk: shards that appear whole, so that a run killed at any moment goes on where it was.

A study of ``total`` configurations is cut into blocks of fixed size, the unit in which configurations are computed
together; results do not depend on who computes which block. A shard ``shards/000012-000015.npz`` holds the blocks in
its name. The index is the names themselves: a file that is there is whole.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, reason
from jointlib.io.atomic import write_npz, write_text

_SHARD = re.compile(r"(\d{6,})-(\d{6,})\.npz")
_LOCK = re.compile(r"\.(.+)\.lock")
_HEAD = "study.json"
_DIFFERS = {
    "study": "its study file",
    "inputs": "a file that it names",
    "program": "the release of jointlib",
    "tools": "--tool",
}


@dataclass(frozen=True)
class Store:
    """A results folder; `begin` makes one or opens one of the same study."""

    folder: Path
    total: int
    """Configurations."""
    block: int
    """Configurations in a block; the last may be shorter."""
    head: Mapping[str, object] = field(default_factory=dict)
    """What tells it from every other study, written as soon as a part of it is being computed."""

    @classmethod
    def begin(cls, folder: Path, identity: Mapping[str, object], total: int, block: int) -> Store:
        """The folder for the results of a study; ``identity`` (hashes, version) tells it from every other study.

        A folder that was begun for another study and holds nothing yet is as good as empty. Nothing is written before
        a part is locked.
        """
        store = cls(folder, total, block, {**identity, "total": total, "block": block})
        store._refuse_others()
        return store

    def _refuse_others(self, word: str = "") -> bool:
        """Whether the folder holds this study; refuse one that holds something else. ``word``: the own lock."""
        path = self.folder / _HEAD
        if path.is_file():
            found = _read(path)
            different = sorted(key for key in {*found, *self.head} if found.get(key) != self.head.get(key))
            if different and self._used(word):
                what = ", ".join([words for key, words in _DIFFERS.items() if key in different] or different)
                raise InputError(
                    f"{self.folder}: holds results of another study (it differs in {what}), expected an empty folder "
                    "or the study that was begun there"
                )
            return not different
        if self._used(word):
            raise InputError(f"{self.folder}: is not empty and holds no study, expected an empty folder")
        return False

    def _used(self, word: str) -> bool:
        """Whether the folder holds anything but a head and locks that nobody else holds."""
        try:
            for path in self.folder.iterdir() if self.folder.is_dir() else ():
                lock = _LOCK.fullmatch(path.name)
                if lock is None and path.name != _HEAD:
                    return True
                if lock is not None and lock[1] not in (word, "study"):
                    with path.open("w") as file:
                        if not _locked(file.fileno()):
                            return True
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be opened ({error.strerror})") from None
        return False

    @classmethod
    def opened(cls, folder: Path) -> tuple[Store, dict[str, object]]:
        """The store of a folder and the identity it was begun with."""
        path = folder / _HEAD
        if not path.is_file():
            raise InputError(f"{folder}: holds no study, expected a folder that 'jointlib study run' has written")
        head = _read(path)
        try:
            total, block = int(str(head["total"])), int(str(head["block"]))
        except (KeyError, ValueError):
            raise InputError(f"{path}: total or block is missing, expected the head of a study") from None
        return cls(folder, total, block), head

    @property
    def blocks(self) -> int:
        """How many blocks there are."""
        return -(-self.total // self.block)

    def rows(self, first: int, last: int) -> slice:
        """Configurations of the blocks ``first`` to ``last``, both included."""
        return slice(first * self.block, min((last + 1) * self.block, self.total))

    def held(self) -> list[tuple[int, int]]:
        """Ranges of blocks that are done, ascending."""
        shards = self.folder / "shards"
        try:
            names = [_SHARD.fullmatch(path.name) for path in shards.iterdir()]
        except FileNotFoundError:
            return []
        except OSError as error:
            raise InputError(f"{shards}: cannot be opened ({error.strerror}), expected a folder of results") from None
        return sorted((int(m[1]), int(m[2])) for m in names if m)

    def missing(self) -> list[int]:
        """Blocks that are still to do, ascending."""
        done = np.zeros(self.blocks, dtype=bool)
        for first, last in self.held():
            done[first : last + 1] = True
        return [int(i) for i in np.flatnonzero(~done)]

    def keep(self, first: int, last: int, results: Mapping[str, Array]) -> None:
        """Write the results of some blocks, whole or not at all."""
        rows = self.rows(first, last)
        for name, values in results.items():
            if len(values) != rows.stop - rows.start:
                raise ValueError(f"{name}: {len(values)} results for {rows.stop - rows.start} configurations")
        write_npz(self.folder / "shards" / f"{first:06d}-{last:06d}.npz", results)

    def shards(self, blocks: range | None = None) -> Iterator[tuple[slice, dict[str, Array]]]:
        """Results and their rows, a shard at a time in ascending order and none twice, of all blocks or of some."""
        at, stop = (0, self.blocks) if blocks is None else (blocks.start, blocks.stop)
        for first, last in self.held():
            begin, end = max(first, at), min(last + 1, stop)
            if begin < end:
                rows, own = self.rows(begin, end - 1), self.rows(first, last).start
                found = arrays(self.folder / "shards" / f"{first:06d}-{last:06d}.npz")
                yield rows, {name: values[rows.start - own : rows.stop - own] for name, values in found.items()}
                at = end

    def checked(self, blocks: range | None = None) -> None:
        """Refuse a study of which some blocks are still to do."""
        missing = [i for i in self.missing() if blocks is None or i in blocks]
        if missing:
            raise InputError(
                f"{self.folder}: lacks {len(missing)} of {self.blocks} blocks, expected all; resume the study"
            )

    def results(self, blocks: range | None = None) -> dict[str, Array]:
        """Every result of every configuration, in order, or of those in some blocks; they must be done."""
        self.checked(blocks)
        parts = [found for _, found in self.shards(blocks)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    @contextlib.contextmanager
    def lock(self, word: str) -> Iterator[None]:
        """Hold a part of the study for this process; the operating system lets go of it if the process dies."""
        with self._locking(word) as file:
            if not _locked(file.fileno()):
                raise InputError(f"{self.folder}: {word} is being computed by another process, expected it to end")
            with self._locking("study") as head:
                _locked(head.fileno(), wait=True)
                if self.head and not self._refuse_others(word):
                    text = json.dumps(dict(self.head), indent=1, sort_keys=True) + "\n"
                    write_text(self.folder / _HEAD, text)
            yield

    def _locking(self, word: str) -> IO[str]:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            return (self.folder / f".{word}.lock").open("w")
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be written ({error.strerror})") from None


def _read(path: Path) -> dict[str, object]:
    try:
        head = json.loads(bytes_of(path, "the head of a study"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read ({reason(error)})") from None
    if not isinstance(head, dict):
        raise InputError(f"{path}: holds no table, expected the head of a study")
    return head


def arrays(path: Path) -> dict[str, Array]:
    """The arrays of a file of the folder."""
    try:
        with np.load(path, allow_pickle=False) as held:
            return {name: held[name] for name in held.files}
    except ValueError:
        raise InputError(f"{path}: is no file of arrays; remove it and resume the study") from None
    except (OSError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(f"{path}: cannot be read ({error}); remove it and resume the study") from None


def _locked(descriptor: int, wait: bool = False) -> bool:
    """Whether an exclusive lock was got; on systems without such locks it is taken for granted."""
    if os.name != "posix":
        return True
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        return False
    return True
