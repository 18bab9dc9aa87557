"""Compilation of a native FMU: which compilers are here, for which platforms, and the same bytes every time."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from jointlib.errors import InputError, nearest
from jointlib.io import atomic

FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-s")
"""No contraction into fused operations and no fast math: the same numbers from every compiler."""
_TIME_LIMIT = 600.0
OLD_GLIBC = "old_glibc.h"
_OLD_GLIBC = """#if defined(__linux__) && (defined(__x86_64__) || defined(__aarch64__))
#include <features.h>
#if defined(__GLIBC__)
#if defined(__x86_64__)
#define JL_FIRST "GLIBC_2.2.5"
#else
#define JL_FIRST "GLIBC_2.17"
#endif
"""
_OLD_GLIBC += "".join(
    f'__asm__(".symver {name},{name}@" JL_FIRST);\n' for name in ("exp", "expm1", "log", "log1p", "pow", "tanh")
)
_OLD_GLIBC += "#endif\n#endif\n"
"""Binds functions to the first of their versions in glibc. Later ones differ in how they report a range error, which
nobody asks for here, and a library that wants them is refused by every Linux
that is older than the compiler's."""


@dataclass(frozen=True)
class Platform:
    """A platform as FMI names it, and as zig does."""

    fmi3: str
    fmi2: str
    zig: str
    suffix: str

    def folder(self, fmi: int) -> str:
        """Name of its folder below ``binaries/``."""
        return self.fmi2 if fmi == 2 else self.fmi3


PLATFORMS = (
    Platform("x86_64-linux", "linux64", "x86_64-linux-gnu.2.17", ".so"),
    Platform("x86_64-windows", "win64", "x86_64-windows-gnu", ".dll"),
    Platform("x86_64-darwin", "darwin64", "x86_64-macos.10.9", ".dylib"),
    Platform("aarch64-darwin", "aarch64-darwin", "aarch64-macos.11.0", ".dylib"),
    Platform("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
)


@dataclass(frozen=True)
class Compiler:
    """A command that makes shared libraries for one platform."""

    platform: Platform
    command: tuple[str, ...]
    flags: tuple[str, ...] = ()


def compilers() -> tuple[Compiler, ...]:
    """A compiler for each platform that can be reached from here.

    With ziglang (``pip install 'jointlib[native]'``) that is every one; without it the computer's own, by the system's
    compiler, and 64-bit Windows where mingw-w64 is installed.
    """
    if importlib.util.find_spec("ziglang") is not None:
        return tuple(Compiler(p, (sys.executable, "-m", "ziglang", "cc", "-target", p.zig)) for p in PLATFORMS)
    known = {here(): _system_compiler()}
    mingw = shutil.which("x86_64-w64-mingw32-gcc")
    if mingw:
        known.setdefault("x86_64-windows", (mingw,))
    # Without the last flag mingw's linker writes the time into the library.
    special = {".dll": ("-static-libgcc", "-Wl,--no-insert-timestamp"), ".so": ("-include", OLD_GLIBC)}
    return tuple(Compiler(p, known[p.fmi3], special.get(p.suffix, ())) for p in PLATFORMS if known.get(p.fmi3))


def compilers_for(platforms: Sequence[str]) -> tuple[Compiler, ...]:
    """Compilers for these platforms, by their names in FMI 2.0 or 3.0, and for this computer, which verifies.

    A platform that is asked for by name and cannot be had is refused; without names it is every one that can be had.
    """
    known = compilers()
    if not platforms:
        return known
    names = {name: p for p in PLATFORMS for name in (p.fmi2, p.fmi3)}
    for name in platforms:
        if name not in names:
            raise InputError(f"platform {name!r} is not known, {nearest(name, dict.fromkeys(names))}")
        if names[name] not in {c.platform for c in known}:
            raise InputError(f"no compiler for platform {name!r} here, expected pip install 'jointlib[native]'")
    wanted = {names[name].fmi3 for name in platforms} | {here()}
    return tuple(c for c in known if c.platform.fmi3 in wanted)


def here() -> str:
    """FMI 3.0 name of this computer's platform."""
    from fmpy import platform_tuple

    return str(platform_tuple)


def absent(fmi: int, present: Iterable[str]) -> list[str]:
    """FMI's names of the platforms that are not among ``present``."""
    known = set(present)
    return [platform.folder(fmi) for platform in PLATFORMS if platform.folder(fmi) not in known]


def _system_compiler() -> tuple[str, ...]:
    """``$CC`` where it is set, else the first of cc, gcc and clang."""
    named = shlex.split(os.environ.get("CC", ""))
    if named:
        path = shutil.which(named[0])
        return (path, *named[1:]) if path else ()
    return next(((path,) for path in map(shutil.which, ("cc", "gcc", "clang")) if path), ())


def can_compile() -> bool:
    """True if a native FMU that runs on this computer can be made here."""
    return any(compiler.platform.fmi3 == here() for compiler in compilers())


def library(compiler: Compiler, files: Mapping[str, str], unit: str, identifier: str) -> bytes:
    """The shared library ``identifier`` compiled from the one file ``unit``; ``files`` has all that it includes.

    Compiled once and kept: the same files, flags and compiler give the library of the last time.
    """
    name = identifier + compiler.platform.suffix
    position = () if compiler.platform.suffix == ".dll" else ("-fPIC",)
    libraries = () if compiler.platform.suffix == ".dll" else ("-lm",)
    if OLD_GLIBC in compiler.flags:
        files = {**files, OLD_GLIBC: _OLD_GLIBC}
    arguments = (*FLAGS, *position, "-I.", unit, "-o", name, *compiler.flags, *libraries)
    digest = hashlib.sha256()
    for text in (
        *compiler.command,
        _version(compiler.command),
        *arguments,
        *(x for f in sorted(files.items()) for x in f),
    ):
        data = text.encode("utf-8")
        digest.update(len(data).to_bytes(8, "big") + data)
    kept = _cache() / f"{digest.hexdigest()}{compiler.platform.suffix}"
    if kept.is_file():
        return kept.read_bytes()
    data = _compiled(compiler, files, arguments, name)
    with suppress(InputError):  # a cache that cannot be written costs time only
        atomic.write(kept, lambda file: file.write(data))
    return data


def _cache() -> Path:
    """Folder of the compiled libraries; what it holds may be deleted at any time."""
    if sys.platform == "win32":
        root = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    else:
        root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(root) / "jointlib" / "fmu"


@cache
def _version(command: tuple[str, ...]) -> str:
    """What the compiler says of itself."""
    asked = [*command, "--version"]
    # Zig leaves an empty object file behind where it is asked.
    with tempfile.TemporaryDirectory(prefix="jointlib-") as folder:
        try:
            done = subprocess.run(asked, cwd=folder, capture_output=True, text=True, errors="replace", timeout=60)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise InputError(f"{command[0]}: does not start ({error}), expected a C compiler") from None
    return done.stdout


def _compiled(compiler: Compiler, files: Mapping[str, str], arguments: tuple[str, ...], name: str) -> bytes:
    with tempfile.TemporaryDirectory(prefix="jointlib-") as folder:
        for file, text in files.items():
            (Path(folder) / file).write_bytes(text.encode("utf-8"))
        try:
            done = subprocess.run(
                [*compiler.command, *arguments],
                cwd=folder,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=_TIME_LIMIT,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise InputError(f"{compiler.command[0]}: does not finish ({error}), expected a C compiler") from None
        made = Path(folder) / name
        if done.returncode or not made.is_file():
            lines = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()]
            first = next((line for line in lines if "error" in line), lines[0] if lines else "no message")
            raise InputError(
                f"{' '.join(compiler.command)}: cannot compile the FMU for {compiler.platform.fmi3} ({first.strip()}), "
                "expected a C99 compiler"
            )
        return made.read_bytes()
