"""The C source of a native FMU: tables and joints generated around the laws' kernels, the wrapper as it stands."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from jointlib.joint import Joint

from ..system.system import System, prefixed
from .closed_source import ClosedTables, closed_sizes, closed_tables, closed_text
from .joint_source import joint_functions, listed, text
from .modulation_source import following, modulated
from .native import continuous_states, exchangeable, joints_of, lags, native_parts, native_variables

TRANSLATION_UNIT = "all.c"
"""The one file to compile; it includes the others."""
RUNTIME = Path(__file__).parents[1] / "runtime"
_GUARDED = re.compile(r"#ifdef JL_CONDITIONS\n(.*?)(?:#else\n(.*?))?#endif\n", re.DOTALL)
"""What models with conditions have beside, or in place of what the others have."""
_FOR_CONDITIONS = {"conditions.h", "modulation.h"}
_KINDS = {
    "input": "JL_INPUT",
    "output": "JL_OUTPUT",
    "parameter": "JL_PARAMETER",
    "state": "JL_STATE",
    "rate": "JL_RATE",
    "indicator": "JL_INDICATOR",
    "time": "JL_TIME",
}


def source_files(system: System, identifier: str, token: str) -> dict[str, str]:
    """Every file that :data:`TRANSLATION_UNIT` needs beside the FMI headers, by its name."""
    files = {file.name: file.read_text(encoding="utf-8") for file in sorted(RUNTIME.glob("*.[ch]"))}
    if not system.conditions:
        files = {n: _GUARDED.sub(lambda m: m[2] or "", t) for n, t in files.items() if n not in _FOR_CONDITIONS}
    units = ["joint.c", *(name for name in sorted(files) if name.endswith(".c"))]
    everything = "".join(f'#include "{name}"\n' for name in units)
    return files | {
        TRANSLATION_UNIT: f"/* The whole FMU in one translation unit: generated, do not edit. */\n{everything}",
        "joint_sizes.h": _sizes(system, tables := closed_tables(system)),
        "joint.c": _model(system, identifier, token, tables),
    }


def number(value: float) -> str:
    """A C constant that reads back as the same double."""
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))


def _sizes(system: System, tables: ClosedTables | None) -> str:
    parts, behind = native_parts(system), len(lags(system))
    memory = sum(len(part.states) for part in parts) + behind
    sizes = {
        "JL_VARIABLES": len(native_variables(system)),
        "JL_INPUTS": len(system.inputs),
        "JL_OUTPUTS": len(system.outputs),
        "JL_PARAMETERS": parts[-1].parameters[1] if parts else 0,
        "JL_STRUCTURE": len(system.states),
        "JL_JOINTS": len(system.joints),
        "JL_STATES": len(system.states) + memory,
        "JL_CONTINUOUS": len(continuous_states(system)),
        "JL_MODES": parts[-1].modes[1] if parts else 0,
        "JL_INDICATORS": parts[-1].indicators[1] if parts else 0,
        "JL_EXCHANGE": int(exchangeable(system)),
        "JL_LOADED": int(system.load is not None),
        **closed_sizes(tables),
    }
    lines = "".join(f"    {name} = {size},\n" for name, size in sizes.items())[:-2]
    seen = f"#define JL_CONDITIONS {len(system.conditions)}\n#define JL_LAGS {behind}\n\n" if system.conditions else ""
    return (
        "/* Sizes of one model: generated, do not edit. */\n"
        f"#ifndef JOINT_SIZES_H\n#define JOINT_SIZES_H\n\n{seen}enum {{\n{lines}\n}};\n\n#endif\n"
    )


def _model(system: System, identifier: str, token: str, tables: ClosedTables | None) -> str:
    parts = native_parts(system)
    kernels = {part.kernel.word: part.kernel.text.strip() for part in parts}
    what = "Restoring force of a machine joint" if system.lone else "Machine structure with joints"
    blocks = [
        f"/* {what}: generated, do not edit. */\n"
        '#include <math.h>\n#include <stddef.h>\n#include <stdio.h>\n#include "joint.h"',
        f'const char jl_token[] = "{token}";\nconst char jl_identifier[] = "{identifier}";',
        _variables(system),
        _places(system),
        _matrix(system.matrix()),
        _load(system),
        closed_text(tables, lambda values: _lines(map(number, values)), lambda values: _lines(map(str, values))),
        *kernels.values(),
        *(f"static const int jl_n{i}[] = {{ {listed(part.lengths)} }};" for i, part in enumerate(parts)),
        *modulated(system, number),
        *joint_functions(parts, exchangeable(system), following(system)),
    ]
    return "\n\n".join(blocks) + "\n"


def _variables(system: System) -> str:
    rows = []
    for v in native_variables(system):
        lower, upper, above = (
            (v.declared.lower, v.declared.upper, v.declared.above) if v.declared else (-math.inf, math.inf, -math.inf)
        )
        start = v.nominal or 0.0 if v.kind == "state" else v.start or 0.0
        bounds = ", ".join(number(x) for x in (start, lower, upper, above))
        rows.append(f"    {{ {text(system.shown(v.name))}, {_KINDS[v.kind]}, {bounds} }}")
    return (
        "/* name, kind, start (of a state: its usual size), lower, upper and excluded lower bound */\n"
        "const jl_variable jl_variables[JL_VARIABLES] = {\n" + ",\n".join(rows) + "\n};"
    )


def _places(system: System) -> str:
    """What belongs to which state and joint."""
    names = [text(prefixed(prefix, what)) for prefix, _ in system.joints for what in ("displacement", "velocity")]
    names += [text(c.name) for c in system.conditions]
    owners = [part.joint for part in native_parts(system) for _ in part.states] + [lag.joint for lag in lags(system)]
    validity = [number(x) for joint in joints_of(system) for x in _validity(joint)]
    validity += [number(x) for c in system.conditions for x in (c.low, c.high)]
    return (
        f"const int jl_continuous[] = {{ {listed(continuous_states(system))} }};\n"
        f"const double jl_validity[] = {{ {listed(validity)} }};\n"
        f"const char *const jl_motion_names[] = {{ {', '.join(names or [text('')] * 2)} }};\n"
        f"const int jl_owner[] = {{ {listed(owners)} }};"
    )


def _matrix(matrix: np.ndarray) -> str:
    """The rows without their zeros."""
    rows = [np.flatnonzero(row) for row in matrix]
    first = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(int)
    entries = [number(matrix[i, j]) for i, row in enumerate(rows) for j in row]
    columns = [str(j) for row in rows for j in row]
    return (
        f"const int jl_first[] = {{\n{_lines(map(str, first))}\n}};\n"
        f"const int jl_column[] = {{\n{_lines(columns)}\n}};\n"
        f"const double jl_entry[] = {{\n{_lines(entries)}\n}};"
    )


def _load(system: System) -> str:
    """What a static load adds to every row, and where the structure stands under it."""
    pushed, moved, shown = system.constants
    load = map(number, np.concatenate([pushed, moved, np.zeros(len(system.conditions)), shown]))
    rest = map(number, system.start)
    return f"const double jl_load[] = {{\n{_lines(load)}\n}};\nconst double jl_rest[] = {{\n{_lines(rest)}\n}};"


def _lines(numbers: Iterable[str]) -> str:
    """Entries of an array in lines that every compiler takes."""
    return textwrap.fill(listed(numbers), 110, initial_indent="    ", subsequent_indent="    ")


def _validity(joint: Joint) -> tuple[float, float, float, float]:
    """Lowest and highest displacement (m) and velocity (m/s) for which the joint was identified."""
    z, v = (
        max(abs(x) for x in joint.validity[name]) if name in joint.validity else math.inf
        for name in ("amplitude", "velocity")
    )
    return -z, z, -v, v
