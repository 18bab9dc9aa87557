"""The C source of a native FMU: the joint generated around its laws' kernels, and the wrapper as it stands."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

from jointlib.joint import Joint

from .native import NativePart, continuous_states, native_parts, native_variables, only_in_steps

TRANSLATION_UNIT = "all.c"
"""The one file to compile; it includes the others."""
RUNTIME = Path(__file__).with_name("runtime")
_KINDS = {
    "input": "JL_INPUT",
    "output": "JL_OUTPUT",
    "parameter": "JL_PARAMETER",
    "state": "JL_STATE",
    "rate": "JL_RATE",
    "indicator": "JL_INDICATOR",
    "time": "JL_TIME",
}
_POINT = "const double *p, const double *s, const int *m, double z, double v"


def source_files(joint: Joint, identifier: str, token: str) -> dict[str, str]:
    """Every file that :data:`TRANSLATION_UNIT` needs beside the FMI headers, by its name."""
    files = {file.name: file.read_text(encoding="utf-8") for file in sorted(RUNTIME.glob("*.[ch]"))}
    units = ["joint.c", *(name for name in sorted(files) if name.endswith(".c"))]
    everything = "".join(f'#include "{name}"\n' for name in units)
    return files | {
        TRANSLATION_UNIT: f"/* The whole FMU in one translation unit: generated, do not edit. */\n{everything}",
        "joint_sizes.h": _sizes(joint),
        "joint.c": _joint(joint, identifier, token),
    }


def number(value: float) -> str:
    """A C constant that reads back as the same double."""
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))


def _sizes(joint: Joint) -> str:
    parts, variables = native_parts(joint), native_variables(joint)
    sizes = {
        "JL_VARIABLES": len(variables),
        "JL_PARAMETERS": parts[-1].parameters[1],
        "JL_STATES": sum(len(part.states) for part in parts),
        "JL_CONTINUOUS": len(continuous_states(joint)),
        "JL_MODES": parts[-1].modes[1],
        "JL_INDICATORS": parts[-1].indicators[1],
        "JL_EXCHANGE": int(not only_in_steps(joint)),
    }
    lines = "".join(f"    {name} = {size},\n" for name, size in sizes.items())[:-2]
    return (
        "/* Sizes of one joint: generated, do not edit. */\n"
        f"#ifndef JOINT_SIZES_H\n#define JOINT_SIZES_H\n\nenum {{\n{lines}\n}};\n\n#endif\n"
    )


def _joint(joint: Joint, identifier: str, token: str) -> str:
    parts = native_parts(joint)
    kernels = {part.kernel.word: part.kernel.text.strip() for part in parts}
    blocks = [
        "/* Restoring force of a machine joint: generated, do not edit. */\n"
        '#include <math.h>\n#include <stddef.h>\n#include <stdio.h>\n#include "joint.h"',
        f'const char jl_token[] = "{token}";\nconst char jl_identifier[] = "{identifier}";',
        _tables(joint),
        *kernels.values(),
        *(f"static const int jl_n{i}[] = {{ {_list(part.part.lengths)} }};" for i, part in enumerate(parts)),
        _check(parts),
        _initial(parts),
        _step(parts),
        *(_exchange(parts) if not only_in_steps(joint) else _without_exchange(parts)),
        _step_partials(parts),
    ]
    return "\n\n".join(blocks) + "\n"


def _list(values: Iterable[object]) -> str:
    return ", ".join(str(value) for value in values) or "0"


def _tables(joint: Joint) -> str:
    rows = []
    for v in native_variables(joint):
        lower, upper, above = (
            (v.declared.lower, v.declared.upper, v.declared.above) if v.declared else (-math.inf, math.inf, -math.inf)
        )
        start = v.start if v.start is not None else v.nominal or 0.0
        bounds = ", ".join(number(x) for x in (start, lower, upper, above))
        rows.append(f'    {{ "{v.name}", {_KINDS[v.kind]}, {bounds} }}')
    validity = ", ".join(number(x) for x in _validity(joint))
    return (
        "/* name, kind, start (of a state: its usual size), lower, upper and excluded lower bound */\n"
        "const jl_variable jl_variables[JL_VARIABLES] = {\n" + ",\n".join(rows) + "\n};\n"
        f"const int jl_continuous[] = {{ {_list(continuous_states(joint))} }};\n"
        f"const double jl_validity[4] = {{ {validity} }};"
    )


def _validity(joint: Joint) -> tuple[float, float, float, float]:
    """Lowest and highest displacement (m) and velocity (m/s) for which the joint was identified."""
    z, v = (
        max(abs(x) for x in joint.validity[name]) if name in joint.validity else math.inf
        for name in ("amplitude", "velocity")
    )
    return -z, z, -v, v


def _function(head: str, arguments: str, lines: Iterable[str], end: str = "") -> str:
    """A definition that uses every argument, so that no compiler warns."""
    names = [argument.split()[-1].lstrip("*") for argument in arguments.split(",")]
    unused = " ".join(f"(void){name};" for name in names)
    body = "".join(f"    {line}\n" for line in (*lines, unused, *([end] if end else [])))
    return f"{head}({arguments})\n{{\n{body}}}"


def _places(i: int, part: NativePart, *, modes: bool = False) -> str:
    """``p + 3, jl_n1, s + 2, m + 1``: what the kernel of the part is given."""
    places = [f"p + {part.parameters[0]}", f"jl_n{i}", f"s + {part.part.states[0]}"]
    return ", ".join([*places, f"m + {part.modes[0]}"] if modes else places)


def _check(parts: tuple[NativePart, ...]) -> str:
    lines = [
        "const char *said;",
        "int i;",
        "for (i = 0; i < JL_PARAMETERS; i++) {",
        "    const jl_variable *d = &jl_variables[JL_FIRST_PARAMETER + i];",
        "    if (!isfinite(p[i])) {",
        '        snprintf(message, size, "%s is %.15g, expected a finite number", d->name, p[i]);',
        "        return 1;",
        "    }",
        "    if (p[i] <= d->above) {",
        '        snprintf(message, size, "%s is %.15g, expected a value above %.15g", d->name, p[i], d->above);',
        "        return 1;",
        "    }",
        "    if (!(p[i] >= d->lower && p[i] <= d->upper)) {",
        '        snprintf(message, size, "%s is %.15g, expected a value between %.15g and %.15g",',
        "            d->name, p[i], d->lower, d->upper);",
        "        return 1;",
        "    }",
        "}",
        "said = NULL;",
    ]
    for i, part in enumerate(parts):
        if part.kernel.has("check"):
            lines += [
                f"said = {part.kernel.word}_check(p + {part.parameters[0]}, jl_n{i});",
                'if (said) { snprintf(message, size, "%s", said); return 1; }',
            ]
    return _function(
        "int jl_check", "const double *p, char *message, size_t size", [*lines, "(void)said;"], "return 0;"
    )


def _initial(parts: tuple[NativePart, ...]) -> str:
    lines = [
        f"{part.kernel.word}_initial(p + {part.parameters[0]}, jl_n{i}, z, "
        f"s + {part.part.states[0]}, m + {part.modes[0]});"
        for i, part in enumerate(parts)
        if part.kernel.has("initial")
    ]
    return _function("void jl_initial", "const double *p, double z, double *s, int *m", lines)


def _step(parts: tuple[NativePart, ...]) -> str:
    lines = ["double force = 0.0;"]
    for i, part in enumerate(parts):
        word = part.kernel.word
        if part.states:
            lines.append(f"force += {word}_step({_places(i, part)}, z, v, h, after + {part.part.states[0]});")
        else:
            lines.append(f"force += {word}_force({_places(i, part)}, NULL, z, v);")
    arguments = "const double *p, const double *s, double z, double v, double h, double *after"
    return _function("double jl_step", arguments, lines, "return force;")


def _exchange(parts: tuple[NativePart, ...]) -> list[str]:
    force = [f"force += {q.kernel.word}_force({_places(i, q, modes=True)}, z, v);" for i, q in enumerate(parts)]
    rates = [
        f"{q.kernel.word}_rates({_places(i, q, modes=True)}, z, v, rate + {q.part.states[0]});"
        for i, q in enumerate(parts)
        if q.kernel.has("rates")
    ]
    zero = "for (i = 0; i < JL_STATES; i++) rate[i] = 0.0;"
    indicators = [
        f"{q.kernel.word}_indicators({_places(i, q, modes=True)}, z, v, g + {q.indicators[0]});"
        for i, q in enumerate(parts)
        if q.kernel.has("indicators")
    ]
    events = [
        f"jumped |= {q.kernel.word}_event({_places(i, q, modes=True)}, z, v);"
        for i, q in enumerate(parts)
        if q.kernel.has("event")
    ]
    return [
        _function("double jl_force", _POINT, ["double force = 0.0;", *force], "return force;"),
        _function("void jl_rates", f"{_POINT}, double *rate", ["int i;", zero, *rates]),
        _function("void jl_indicators", f"{_POINT}, double *g", indicators),
        _function(
            "int jl_event",
            _POINT.replace("const double *s, const int *m", "double *s, int *m"),
            ["int jumped = 0;", *events],
            "return jumped;",
        ),
        _partials(parts),
    ]


def _without_exchange(parts: tuple[NativePart, ...]) -> list[str]:
    """Co-simulation only: the force follows the inputs, and nothing is integrated outside."""
    words = dict.fromkeys(part.kernel.word for part in parts)
    idle = [
        f"(void){word}_{purpose};"
        for word, kernel in ((word, next(q.kernel for q in parts if q.kernel.word == word)) for word in words)
        for purpose in ("force", "rates", "indicators", "event", "partials")
        if kernel.has(purpose)
    ]
    return [
        _function(
            "double jl_force", _POINT, ["double after[JL_STATES + 1];"], "return jl_step(p, s, z, v, 0.0, after);"
        ),
        _function(
            "void jl_rates", f"{_POINT}, double *rate", ["int i;", "for (i = 0; i < JL_STATES; i++) rate[i] = 0.0;"]
        ),
        _function("void jl_indicators", f"{_POINT}, double *g", idle),
        _function(
            "int jl_event", _POINT.replace("const double *s, const int *m", "double *s, int *m"), [], "return 0;"
        ),
        _function(
            "void jl_partials",
            f"{_POINT}, double *dF, double *dR",
            [
                "int i;",
                "for (i = 0; i < 2 + JL_STATES; i++) dF[i] = 0.0;",
                "for (i = 0; i < JL_STATES * (2 + JL_STATES); i++) dR[i] = 0.0;",
                "jl_step_partials(p, s, z, v, dF);",
            ],
        ),
    ]


def _partials(parts: tuple[NativePart, ...]) -> str:
    """Partials of the force add up; those of a rate concern the states of its own part."""
    largest = max(len(part.states) for part in parts)
    lines = [
        "const int width = 2 + JL_STATES;",
        f"double f[{2 + largest}], r[{max(largest * (2 + largest), 1)}];",
        "int i, j;",
        "for (i = 0; i < width; i++) dF[i] = 0.0;",
        "for (i = 0; i < JL_STATES * width; i++) dR[i] = 0.0;",
    ]
    for i, part in enumerate(parts):
        size, first = len(part.states), part.part.states[0]
        lines += [
            f"{part.kernel.word}_partials({_places(i, part, modes=True)}, z, v, f, r);",
            "dF[0] += f[0];",
            "dF[1] += f[1];",
        ]
        if size:
            lines += [
                f"for (j = 0; j < {size}; j++) dF[2 + {first} + j] = f[2 + j];",
                f"for (i = 0; i < {size}; i++) {{",
                f"    double *row = dR + ({first} + i) * width;",
                f"    row[0] = r[i * {2 + size}];",
                f"    row[1] = r[i * {2 + size} + 1];",
                f"    for (j = 0; j < {size}; j++) row[2 + {first} + j] = r[i * {2 + size} + 2 + j];",
                "}",
            ]
    return _function("void jl_partials", f"{_POINT}, double *dF, double *dR", [*lines, "(void)j;"])


def _step_partials(parts: tuple[NativePart, ...]) -> str:
    largest = max(len(part.states) for part in parts)
    lines = [f"double f[{2 + largest}], r[{max(largest * (2 + largest), 1)}];", "dF[0] = dF[1] = 0.0;"]
    for i, part in enumerate(parts):
        if part.kernel.has("step_partials"):
            lines.append(f"{part.kernel.word}_step_partials({_places(i, part)}, z, v, f);")
        else:
            lines.append(f"{part.kernel.word}_partials({_places(i, part)}, NULL, z, v, f, r);")
        lines += ["dF[0] += f[0];", "dF[1] += f[1];"]
    arguments = "const double *p, const double *s, double z, double v, double *dF"
    return _function("void jl_step_partials", arguments, [*lines, "(void)r;"])
