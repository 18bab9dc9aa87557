"""A reader that never comes back, or takes its process with it, is found out in a child."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from jointlib.errors import InputError
from jointlib.foreign import tried as module
from jointlib.foreign.tried import tried

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="readers are tried where a process can be forked")


def _for_ever() -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, signal.SIGTERM, signal.SIGALRM])
    while True:
        pass


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (_for_ever, "its reader does not come to an end"),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "its reader is ended by the system"),
    ],
)
def test_a_reader_that_would_take_the_program_with_it_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read: object, said: str
) -> None:
    monkeypatch.setattr(module, "_PATIENCE", 0.3)
    file = tmp_path / "a.h5"
    file.write_bytes(b"0")
    with pytest.raises(InputError, match=rf"a\.h5: cannot be read as an HDF5 file \({said}\)"):
        tried(file, "an HDF5 file", read)  # type: ignore[arg-type]


def test_a_reader_that_raises_or_returns_is_left_to_the_parent(tmp_path: Path) -> None:
    file = tmp_path / "a.h5"
    file.write_bytes(b"0")
    tried(file, "an HDF5 file", lambda: None)
    tried(file, "an HDF5 file", lambda: 1 / 0)
    tried(tmp_path / "none.h5", "an HDF5 file", lambda: None)
