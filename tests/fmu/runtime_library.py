"""The FMI wrapper compiled around two hand-written joints, and the C host that tests it."""

from __future__ import annotations

import functools
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import fmpy
from tools import require

HERE = Path(__file__).parent
RUNTIME = HERE.parents[1] / "fmu" / "runtime"
HEADERS = Path(fmpy.__file__).with_name("c-code")
STRICT = ("-std=c99", "-pedantic", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")
SANITIZED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-runtime-")


def compiled(name: str, arguments: Sequence[str | Path]) -> Path:
    """Output of the compiler."""
    out = Path(_FOLDER.name) / name
    subprocess.run([require("gcc"), *STRICT, *map(str, arguments), "-o", str(out)], check=True)
    return out


def inputs(joint: str) -> list[str | Path]:
    """Include folders and sources of a joint ("joint" or "spring") with the wrapper."""
    folder = HERE / f"runtime_{joint}"
    return [f"-I{folder}", f"-I{RUNTIME}", f"-I{HEADERS}", *sorted(RUNTIME.glob("*.c")), folder / "joint.c"]


@functools.cache
def library(joint: str, *, sanitized: bool = False) -> Path:
    """The shared library of a joint."""
    flags = ["-shared", "-fPIC", "-fvisibility=hidden", *(SANITIZED if sanitized else ())]
    return compiled(f"{joint}{sanitized:d}.so", [*flags, *inputs(joint), "-lm"])


@functools.cache
def host(*, sanitized: bool = False) -> Path:
    """The host, a program without Python."""
    flags = SANITIZED if sanitized else ()
    return compiled(f"host{sanitized:d}", [*flags, f"-I{HEADERS}", HERE / "runtime_host.c", "-ldl", "-lm"])


def hosted(check: str, version: int, kind: str, *, sanitized: bool = False) -> subprocess.CompletedProcess[str]:
    """One check of the host on both joints."""
    libraries = [str(library(joint, sanitized=sanitized)) for joint in ("joint", "spring")]
    command = [str(host(sanitized=sanitized)), check, str(version), kind, *libraries]
    return subprocess.run(command, capture_output=True, text=True, env={}, timeout=120)
