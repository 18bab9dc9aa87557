"""The one door for files that others wrote: whole bytes or one sentence, and no number that is none.

What a reader may do behind it: raise whatever it likes, ask for more memory than there is, warn. Nothing of that comes
out but an `InputError` with the name of the file in front.
"""

from __future__ import annotations

import stat
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, told
from jointlib.system.memory import refuse_beyond

T = TypeVar("T")
_TEXT_GROWS = 12
"""Bytes that are held at most for one of a file while its numbers are read."""
LARGEST = 1e75
"""As of every quantity: beyond it, products of a few are no floats any more."""


def bytes_of(path: Path, what: str) -> bytes:
    """All bytes of a regular file that is not too large; ``what`` it is expected to be, as ``a matrix``."""
    path = Path(path)
    try:
        found = path.stat()
        if stat.S_ISDIR(found.st_mode):
            raise InputError(f"{path}: cannot be read, it is a folder, expected {what}")
        if not stat.S_ISREG(found.st_mode):
            raise InputError(f"{path}: is a device or pipe, expected {what} in a file")
        refuse_beyond(_TEXT_GROWS * found.st_size, f"{path}: a file of {found.st_size} bytes")
        return path.read_bytes()
    except InputError:  # which is a `ValueError` too
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, expected {what}") from None
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise InputError(f"{path}: cannot be read ({reason(error)}), expected {what}") from None
    except MemoryError:
        raise InputError(f"{path}: is larger than the memory that is free, expected {what}") from None


def foreign(path: Path, what: str, read: Callable[[], T]) -> T:
    """What ``read`` makes of a file; however it fails, the sentence is that ``path`` cannot be read as ``what``.

    Warnings of a reader are failures: it met something that it did not understand. What overflows is none here: it is
    refused by `usable`, which says where.
    """
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("error")
            for kind in (DeprecationWarning, PendingDeprecationWarning, FutureWarning, ResourceWarning):
                warnings.simplefilter("ignore", kind)
            return read()
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"{path}: cannot be read as {what} (it asks for more memory than is free)") from None
    except Exception as error:  # readers raise plain exceptions of every kind on damaged files
        raise InputError(f"{path}: cannot be read as {what} ({reason(error)})") from None


def reason(error: BaseException) -> str:
    """Why something failed, as part of a sentence: without number of error, line ends and what cannot be printed."""
    words = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return told(next((line.strip() for line in words.splitlines() if line.strip()), type(error).__name__), 120)


def usable(path: Path, name: str, values: Array | ComplexArray) -> Array | ComplexArray:
    """Numbers that are finite and of a size that can be computed with; else a sentence on the first that is not."""
    with np.errstate(invalid="ignore", over="ignore"):
        good = np.abs(values) <= LARGEST
    if not np.all(good):
        at = np.unravel_index(int(np.argmin(good)), good.shape)
        place = ", ".join(str(int(k) + 1) for k in at)
        spot = f" at {place}" if at else ""
        raise InputError(f"{path}: {name}{spot} is {values[at]:g}, expected finite numbers up to {LARGEST:g}")
    return values
