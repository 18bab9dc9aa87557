"""The library inside an exported FMU, in a host without Python."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from exported_library import GUIDE, RUBBING, exported
from runtime_library import HEADERS, HERE, compiled
from test_runtime import standard_functions, symbols
from tools import require

from fmu.verify import TOLERANCE

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads Linux libraries")
both_versions = pytest.mark.parametrize("fmi", [2, 3])


@both_versions
def test_host_without_python_repeats_the_reference_runs_of_two_joints_at_once_twice(fmi: int) -> None:
    source = HERE / "exported_host.c"
    host = compiled("exported", ["-Wno-unused-function", f"-I{HEADERS}", source, "-ldl", "-lm"])
    two = [exported(joint, fmi) for joint in (GUIDE, RUBBING)]
    for one in two:
        assert [one.references[name] for name in ("displacement", "velocity", "force")] == [1, 2, 3]
    command = [str(host), str(fmi), *(x for one in two for x in (str(one.library), one.token))]
    done = subprocess.run(
        command, input="".join(one.table() for one in two), capture_output=True, text=True, env={}, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert all(float(x) <= TOLERANCE for x in done.stdout.split()), done.stdout


@both_versions
def test_library_shows_the_functions_of_both_standards_and_needs_nothing_but_an_old_libc(fmi: int) -> None:
    library = exported(RUBBING, fmi).library
    shown = [name for _, name in symbols(library, "-D", "--defined-only")]
    assert len(shown) == 119
    assert set(shown) == standard_functions()
    needed = [name for kind, name in symbols(library, "-D", "--undefined-only") if kind == "U"]
    assert needed
    assert all("@GLIBC_" in name for name in needed)
    newest = max(tuple(map(int, name.split("@GLIBC_")[1].split("."))) for name in needed)
    # zig builds against glibc 2.17. With the system's compiler exp, log and pow are those of 2.29.
    assert newest <= ((2, 17) if find_spec("ziglang") else (2, 29))
    told = subprocess.run(
        [require("readelf"), "-dW", str(library)], capture_output=True, text=True, check=True, env={"LC_ALL": "C"}
    ).stdout
    assert set(re.findall(r"\(NEEDED\).*\[(.*)\]", told)) <= {"libc.so.6", "libm.so.6"}
    assert not re.search(r"\((RPATH|RUNPATH|TEXTREL)\)", told)


def test_windows_library_needs_what_every_windows_has(tmp_path: Path) -> None:
    found = list((exported(RUBBING, 2).folder / "binaries").glob("win64/*.dll"))
    if not found:
        pytest.skip("no compiler for Windows (ziglang or mingw-w64)")
    told = subprocess.run([require("objdump"), "-p", str(found[0])], capture_output=True, text=True, check=True).stdout
    needed = {name.lower() for name in re.findall(r"DLL Name: (\S+)", told)}
    assert needed
    assert all(re.fullmatch(r"kernel32\.dll|msvcrt\.dll|ucrtbase\.dll|api-ms-win-crt-.*\.dll", name) for name in needed)
    assert len(re.findall(r"^\s*\[\s*\d+\].*\bfmi[23]\w+$", told, re.MULTILINE)) >= 119
