"""The C functions of a system's joints: what each law's kernel says, summed joint by joint."""

from __future__ import annotations

from collections.abc import Iterable

from .modulation_source import Following
from .native import NativePart

_POINT = "const double *p, const double *s, const int *m, const double *motion"
_EVENT = "const double *p, double *s, int *m, const double *motion"
Parts = tuple[NativePart, ...]


def joint_functions(parts: Parts, exchange: bool, following: Following) -> list[str]:
    """Every function that ``joint.h`` asks of the joints; without ``exchange`` they exist in steps only."""
    return [
        *_check(parts, following),
        _initial(parts, following),
        _step(parts, following),
        *(_exchange(parts, following) if exchange else _without_exchange(parts)),
        _step_partials(parts, following),
    ]


def listed(values: Iterable[object]) -> str:
    """What stands between the braces of an array, which C does not allow to be empty."""
    return ", ".join(str(value) for value in values) or "0"


def text(name: str) -> str:
    """A C string, bytes outside ASCII in octal."""
    plain = (chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in name.encode("utf-8"))
    return '"' + "".join(plain) + '"'


def _function(head: str, arguments: str, lines: Iterable[str], end: str = "") -> str:
    """A definition that uses every argument, so that no compiler warns."""
    names = [argument.split()[-1].lstrip("*") for argument in arguments.split(",")]
    unused = " ".join(f"(void){name};" for name in names)
    body = "".join(f"    {line}\n" for line in (*lines, unused, *([end] if end else [])))
    return f"{head}({arguments})\n{{\n{body}}}"


def _places(i: int, part: NativePart, *, modes: bool = False) -> str:
    """``p + 3, jl_n1, s + 2, m + 1``: what the kernel of the part is given."""
    places = [f"p + {part.parameters[0]}", f"jl_n{i}", f"s + {part.remembered[0]}"]
    return ", ".join([*places, f"m + {part.modes[0]}"] if modes else places)


def _check(parts: Parts, following: Following) -> list[str]:
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
            where = f"{part.prefix}: " if part.prefix else ""
            lines += [
                f"said = {part.kernel.word}_check(p + {part.parameters[0]}, jl_n{i});",
                f'if (said) {{ snprintf(message, size, "%s%s", {text(where)}, said); return 1; }}',
            ]
    arguments, lines = "const double *p, char *message, size_t size", [*lines, "(void)said;"]
    if not following.extremes:
        return [_function("int jl_check", arguments, lines, "return 0;")]
    whole = ["int i;", "if (jl_sound(p, message, size)) return 1;", *following.extremes]
    return [
        _function("static int jl_sound", arguments, lines, "return 0;"),
        _function("int jl_check", arguments, whole, "return 0;"),
    ]


def _initial(parts: Parts, following: Following) -> str:
    lines = [*following.begun, *following.applied("s")] + [
        f"{part.kernel.word}_initial(p + {part.parameters[0]}, jl_n{i}, motion[{2 * part.joint}], "
        f"s + {part.remembered[0]}, m + {part.modes[0]});"
        for i, part in enumerate(parts)
        if part.kernel.has("initial")
    ]
    return _function("void jl_initial", "const double *p, const double *motion, double *s, int *m", lines)


def _step(parts: Parts, following: Following) -> str:
    lines = [*following.stepped, *following.applied("after"), "int i;", _no_force()]
    for i, part in enumerate(parts):
        word, force = part.kernel.word, f"f[{part.joint}] +="
        if part.states:
            lines.append(f"{force} {word}_step({_places(i, part)}, {_zv(part)}, h, after + {part.remembered[0]});")
        else:
            lines.append(f"{force} {word}_force({_places(i, part)}, NULL, {_zv(part)});")
    arguments = "const double *p, const double *s, const double *motion, double h, double *after, double *f"
    return _function("void jl_step", arguments, lines)


def _no_force() -> str:
    return "for (i = 0; i < JL_JOINTS; i++) f[i] = 0.0;"


def _zv(part: NativePart) -> str:
    """Displacement and velocity of the part's joint."""
    return f"motion[{2 * part.joint}], motion[{2 * part.joint + 1}]"


def _exchange(parts: Parts, following: Following) -> list[str]:
    applied = following.applied("s")

    def calls(purpose: str, left: str, result: str) -> list[str]:
        return [
            f"{left.format(q=q)}{q.kernel.word}_{purpose}({_places(i, q, modes=True)}, {_zv(q)}{result.format(q=q)});"
            for i, q in enumerate(parts)
            if q.kernel.has(purpose)
        ]

    zero = "for (i = 0; i < JL_MEMORY; i++) rate[i] = 0.0;"
    return [
        _function(
            "void jl_force",
            f"{_POINT}, double *f",
            [*applied, "int i;", _no_force(), *calls("force", "f[{q.joint}] += ", "")],
        ),
        _function(
            "void jl_rates",
            f"{_POINT}, double *rate",
            [*applied, "int i;", zero, *calls("rates", "", ", rate + {q.remembered[0]}"), *following.rates],
        ),
        _function(
            "void jl_indicators",
            f"{_POINT}, double *g",
            [*applied, *calls("indicators", "", ", g + {q.indicators[0]}")],
        ),
        _function(
            "int jl_event",
            _EVENT,
            [*applied, "int jumped = 0;", *calls("event", "jumped |= ", "")],
            "return jumped;",
        ),
        _partials(parts, following),
    ]


def _without_exchange(parts: Parts) -> list[str]:
    """Co-simulation only: the force follows the inputs, and nothing is integrated outside."""
    kernels = {part.kernel.word: part.kernel for part in parts}
    idle = [
        f"(void){word}_{purpose};"
        for word, kernel in kernels.items()
        for purpose in ("force", "rates", "indicators", "event", "partials")
        if kernel.has(purpose)
    ]
    no_rate = ["int i;", "for (i = 0; i < JL_MEMORY; i++) rate[i] = 0.0;"]
    partials = [
        "double held[2 * JL_JOINTS];",
        "int i;",
        "for (i = 0; i < JL_JOINTS * JL_WIDTH; i++) dF[i] = 0.0;",
        "for (i = 0; i < JL_MEMORY * JL_WIDTH; i++) dR[i] = 0.0;",
        "jl_step_partials(p, s, motion, held);",
        "for (i = 0; i < 2 * JL_JOINTS; i++) dF[i / 2 * JL_WIDTH + i % 2] = held[i];",
    ]
    step = ["double after[JL_MEMORY + 1];", "jl_step(p, s, motion, 0.0, after, f);"]
    return [
        _function("void jl_force", f"{_POINT}, double *f", step),
        _function("void jl_rates", f"{_POINT}, double *rate", no_rate),
        _function("void jl_indicators", f"{_POINT}, double *g", idle),
        _function("int jl_event", _EVENT, [], "return 0;"),
        _function("void jl_partials", f"{_POINT}, double *dF, double *dR", partials),
    ]


def _partials(parts: Parts, following: Following) -> str:
    """Partials of a joint's force add up; those of a rate concern the states of its own part."""
    lines = [
        *following.applied("s"),
        *_scratch(parts),
        "int i, j;",
        "for (i = 0; i < JL_JOINTS * JL_WIDTH; i++) dF[i] = 0.0;",
        "for (i = 0; i < JL_MEMORY * JL_WIDTH; i++) dR[i] = 0.0;",
    ]
    for i, part in enumerate(parts):
        size, first = len(part.states), part.remembered[0]
        row = f"dF[{part.joint} * JL_WIDTH"
        lines += [
            f"{part.kernel.word}_partials({_places(i, part, modes=True)}, {_zv(part)}, one, r);",
            f"{row}] += one[0];",
            f"{row} + 1] += one[1];",
        ]
        if size:
            lines += [
                f"for (j = 0; j < {size}; j++) {row} + 2 + {first} + j] = one[2 + j];",
                f"for (i = 0; i < {size}; i++) {{",
                f"    double *row = dR + ({first} + i) * JL_WIDTH;",
                f"    row[0] = r[i * {2 + size}];",
                f"    row[1] = r[i * {2 + size} + 1];",
                f"    for (j = 0; j < {size}; j++) row[2 + {first} + j] = r[i * {2 + size} + 2 + j];",
                "}",
            ]
    return _function("void jl_partials", f"{_POINT}, double *dF, double *dR", [*lines, "(void)j; (void)one; (void)r;"])


def _scratch(parts: Parts) -> list[str]:
    """Partials of one part's force and rates."""
    largest = max((len(part.states) for part in parts), default=0)
    return [f"double one[{2 + largest}], r[{max(largest * (2 + largest), 1)}];"]


def _step_partials(parts: Parts, following: Following) -> str:
    lines = [*following.applied("s"), *_scratch(parts), "int i;", "for (i = 0; i < 2 * JL_JOINTS; i++) dF[i] = 0.0;"]
    for i, part in enumerate(parts):
        if part.kernel.has("step_partials"):
            lines.append(f"{part.kernel.word}_step_partials({_places(i, part)}, {_zv(part)}, one);")
        else:
            lines.append(f"{part.kernel.word}_partials({_places(i, part)}, NULL, {_zv(part)}, one, r);")
        lines += [f"dF[{2 * part.joint + k}] += one[{k}];" for k in (0, 1)]
    arguments = "const double *p, const double *s, const double *motion, double *dF"
    return _function("void jl_step_partials", arguments, [*lines, "(void)one; (void)r;"])
