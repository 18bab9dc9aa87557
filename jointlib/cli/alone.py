"""One command at a time writes into a folder: the second is refused in a sentence."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jointlib.errors import InputError


@contextmanager
def alone_in(folder: Path, where: str, shared: bool = False) -> Iterator[None]:
    """Within it no other command of this user on this computer gets the same folder, which need not be there yet.

    ``shared``: those that share it too, as parts of a study do, may have it at the same time, and no others. The lock
    lies among temporary files and goes with its process, however that ends; systems without such locks have none.

    Raises
    ------
    InputError
        Another command has the folder.
    """
    if os.name != "posix":
        yield
        return
    import fcntl

    handle = os.open(_locks() / hashlib.sha256(os.fsencode(folder.resolve())).hexdigest()[:32], _NEW, 0o600)
    try:
        try:
            fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except OSError:
            raise InputError(
                f"{where}: another command is writing into {folder}, expected another folder, or to wait for its end"
            ) from None
        yield
    finally:
        os.close(handle)


_NEW = os.O_CREAT | os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)


def _locks() -> Path:
    """A folder for locks that this user alone can write into."""
    found = Path(tempfile.gettempdir()) / f"jointlib-{os.getuid()}"
    found.mkdir(mode=0o700, exist_ok=True)
    about = found.lstat()
    if found.is_symlink() or about.st_uid != os.getuid() or about.st_mode & 0o022:
        return Path(tempfile.mkdtemp(prefix="jointlib-"))
    return found
