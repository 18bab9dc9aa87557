"""The FMI wrapper in C: what a host without Python sees of it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from repeats import repeats
from runtime_library import HEADERS, HERE, RUNTIME, compiled, hosted, inputs, library
from runtime_order import allowed
from tools import require

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads Linux libraries")
CHECKS = ("life", "two", "saved", "derivatives", "feedthrough", "arguments", "parameters", "events", "log")
NAMES = {
    "I": "instantiated",
    "N": "initialization mode",
    "E": "event mode",
    "C": "continuous-time mode",
    "S": "step mode",
    "T": "terminated",
    "X": "error",
}
both_versions = pytest.mark.parametrize("version", [2, 3])
both_kinds = pytest.mark.parametrize("kind", ["cs", "me"])


def symbols(path: Path, *options: str) -> list[tuple[str, str]]:
    """Kind and name of each symbol."""
    done = subprocess.run([require("nm"), *options, str(path)], capture_output=True, text=True, check=True)
    return [(line.split()[-2], line.split()[-1]) for line in done.stdout.splitlines() if len(line.split()) > 1]


def standard_functions() -> set[str]:
    """The names that the standard's headers declare for export."""
    text = "".join((HEADERS / f"fmi{version}Functions.h").read_text(encoding="utf-8") for version in (2, 3))
    return set(re.findall(r"^\s*FMI[23]_Export fmi[23]\w+TYPE\s+(fmi[23]\w+);", text, re.MULTILINE))


@pytest.mark.thorough
@both_kinds
@both_versions
@pytest.mark.parametrize("check", repeats(CHECKS, lambda check: check != "life"))
def test_joint_keeps_its_contract_in_a_host_without_python(check: str, version: int, kind: str) -> None:
    done = hosted(check, version, kind)
    assert (done.stdout, done.stderr, done.returncode) == ("", "", 0)


@pytest.mark.thorough
@both_kinds
@both_versions
@pytest.mark.parametrize("check", [*CHECKS, "order"])
def test_memory_and_arithmetic_are_sound(check: str, version: int, kind: str) -> None:
    done = hosted(check, version, kind, sanitized=True)
    assert (done.stderr, done.returncode) == ("", 0)


@both_kinds
@both_versions
def test_every_function_answers_in_every_state_as_the_standard_says(version: int, kind: str) -> None:
    done = hosted("order", version, kind)
    assert (done.stderr, done.returncode) == ("", 0), done.stdout
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    without_instance = {"GetTypesPlatform", "GetVersion", "FreeInstance"}
    instance_functions = {
        name
        for name in standard_functions()
        if name.startswith(f"fmi{version}") and name[4:] not in without_instance and "Instantiate" not in name
    }
    states = "INECTX" if kind == "me" else "INSTX"
    assert {(name, state) for name, state, *_ in rows} == {(n, s) for n in instance_functions for s in states}
    for name, state, status, message in rows:
        if name in allowed(version, kind, state):
            # Discard: a status that a synchronous FMU cannot tell.
            discarded = name in ("fmi2GetStatus", "fmi2GetIntegerStatus", "fmi2GetStringStatus")
            assert (status, message) == ("2" if discarded else "0", ""), (name, state)
        else:
            told = "model exchange" if kind == "me" else "co-simulation"
            expected = f'{name}: not allowed in state "{NAMES[state]}" of {told}'
            assert (status, message) == ("3", expected)


@pytest.mark.thorough
@pytest.mark.parametrize("joint", ["joint", "spring"])
def test_library_shows_the_119_functions_of_both_standards_and_needs_libc_and_libm_only(joint: str) -> None:
    shown = [name for _, name in symbols(library(joint), "-D", "--defined-only")]
    assert len(shown) == 119
    assert set(shown) == standard_functions()
    needed = {name for kind, name in symbols(library(joint), "-D", "--undefined-only") if kind == "U"}
    assert needed
    assert all("@GLIBC_" in name for name in needed)
    done = subprocess.run(
        [require("readelf"), "-d", str(library(joint))], capture_output=True, text=True, check=True, env={"LC_ALL": "C"}
    )
    assert set(re.findall(r"\(NEEDED\).*\[(.*)\]", done.stdout)) <= {"libc.so.6", "libm.so.6"}


@pytest.mark.slow
def test_wrapper_keeps_nothing_between_calls_but_in_instances(tmp_path: Path) -> None:
    *folders, joint = (x for x in inputs("joint") if x not in sorted(RUNTIME.glob("*.c")))
    for source in [*sorted(RUNTIME.glob("*.c")), joint]:
        # Without -fPIC also constants that hold addresses are read-only for the compiler.
        data = compiled("one.o", ["-c", "-fno-pic", *folders, source])
        assert [name for kind, name in symbols(data) if kind in "dDbBcCsSgG"] == []


@pytest.mark.slow
def test_two_joints_can_be_linked_into_one_program(tmp_path: Path) -> None:
    units = "".join(f'#include "{name}"\n' for name in ["joint.c", *sorted(p.name for p in RUNTIME.glob("*.c"))])
    (tmp_path / "all.c").write_text(units)
    objects = []
    for joint in ("joint", "spring"):
        folders = [f"-I{HERE / f'runtime_{joint}'}", f"-I{RUNTIME}", f"-I{HEADERS}"]
        objects.append(compiled(f"{joint}.o", ["-c", f"-DFMI2_FUNCTION_PREFIX={joint}_", *folders, tmp_path / "all.c"]))
        shared = {name for kind, name in symbols(objects[-1], "-g", "--defined-only")}
        assert f"{joint}_fmi2DoStep" in shared
        assert all(name.startswith(f"{joint}_") for name in shared)
    (tmp_path / "main.c").write_text(
        '#include "fmi2FunctionTypes.h"\n'
        "extern fmi2InstantiateTYPE joint_fmi2Instantiate, spring_fmi2Instantiate;\n"
        "extern fmi2FreeInstanceTYPE joint_fmi2FreeInstance, spring_fmi2FreeInstance;\n"
        "int main(void)\n{\n"
        '    void *a = joint_fmi2Instantiate("a", fmi2CoSimulation, "{runtime-joint-1}", 0, 0, 0, 0);\n'
        '    void *b = spring_fmi2Instantiate("b", fmi2CoSimulation, "{runtime-spring-1}", 0, 0, 0, 0);\n'
        '    void *wrong = spring_fmi2Instantiate("b", fmi2CoSimulation, "{runtime-joint-1}", 0, 0, 0, 0);\n'
        "    joint_fmi2FreeInstance(a);\n    spring_fmi2FreeInstance(b);\n"
        "    return a && b && !wrong ? 0 : 1;\n}\n"
    )
    program = compiled("program", [f"-I{HEADERS}", tmp_path / "main.c", *objects, "-lm"])
    assert subprocess.run([str(program)], env={}, check=False).returncode == 0
