"""The C text by which parameters of a system's joints follow its conditions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from jointlib.modulation import Modulation

from ..system.conditions import by_role, least_and_largest
from ..system.system import System
from ..system.variables import variables_of
from .native import joints_of, lags, native_parts

_NUDGE = 1e-5
"""Of the usual size of a condition, for a difference."""


@dataclass(frozen=True)
class Following:
    """What the functions of the joints do about conditions; all empty where there are none."""

    applied: Callable[[str], tuple[str, ...]]
    """Lines after which p are the parameters as they are with these states."""
    extremes: tuple[str, ...] = ()
    """Lines that check the parameters with their least and largest factors."""
    begun: tuple[str, ...] = ()
    """What lags begins at its condition,"""
    stepped: tuple[str, ...] = ()
    """moves towards it over a step,"""
    rates: tuple[str, ...] = ()
    """or at these rates."""


NOTHING = Following(lambda states: ())


def following(system: System) -> Following:
    """The lines of a system."""
    if not system.conditions:
        return NOTHING
    begun, stepped, rates = [], [], []
    for lag, (place, u) in zip(lags(system), _behind(system), strict=True):
        begun.append(f"s[{place}] = {u};")
        stepped.append(f"after[{place}] = s[{place}] - expm1(-h / {lag.seconds!r}) * ({u} - s[{place}]);")
        rates.append(f"rate[{place}] = ({u} - s[{place}]) / {lag.seconds!r};")
    return Following(
        lambda states: (
            "double q[JL_ROOM(JL_PARAMETERS)];",
            f"jl_modulated(p, {states}, motion, q);",
            "p = q;",
        ),
        (
            "for (i = 0; i < 2; i++) {",
            "    double q[JL_ROOM(JL_PARAMETERS)];",
            "    jl_extreme(p, i, q);",
            "    if (jl_sound(q, message, size)) return 1;",
            "}",
        ),
        tuple(begun),
        tuple(stepped),
        tuple(rates),
    )


def modulated(system: System, number: Callable[[float], str]) -> tuple[str, ...]:
    """Tables, and the functions that multiply the parameters by their factors: at a point, and at the extremes."""
    if not system.conditions:
        return ()
    tables: list[str] = []
    lines: list[str] = []
    ends: list[str] = []
    first = 0
    for i, joint in enumerate(joints_of(system)):
        own = [v for v in variables_of(joint) if v.kind == "parameter"]
        for role, of in by_role(joint).items():
            places = [first + k for k, v in enumerate(own) if v.declared is not None and v.declared.role is role]
            factors, (low, high) = [], least_and_largest(of)
            for m in of:
                name = f"jl_table{len(tables)}"
                rows = ", ".join(f"{{ {number(x)}, {number(y)} }}" for x, y in m.points)
                tables.append(f"static const double {name}[][2] = {{ {rows} }};")
                told = (str(len(m.points)), number(m.period or 0.0), number(m.reference), _followed(system, i, m))
                factors.append(f"jl_factor({name}, {', '.join(told)})")
            lines += [f"factor = {' * '.join(factors)};", *(f"q[{k}] *= factor;" for k in places)]
            ends += [f"factor = high ? {number(high)} : {number(low)};", *(f"q[{k}] *= factor;" for k in places)]
        first += len(own)
    nudges = [_NUDGE * c.size for c in (*system.conditions, *(lag.condition for lag in lags(system)))]
    begin = ["double factor;", "memcpy(q, p, JL_PARAMETERS * sizeof *q);"]
    return (
        '#include <string.h>\n#include "modulation.h"',
        "\n".join([*tables, f"const double jl_nudge[] = {{ {', '.join(map(number, nudges))} }};"]),
        _function("jl_modulated(const double *p, const double *s, const double *motion, double *q)", begin + lines),
        _function("jl_extreme(const double *p, int high, double *q)", begin + ends),
    )


def _function(head: str, lines: list[str]) -> str:
    unused = ["(void)s; (void)motion;"] if "motion" in head else []
    body = "".join(f"    {line}\n" for line in [*lines, *unused])
    return f"static void {head}\n{{\n{body}}}"


def _behind(system: System) -> list[tuple[int, str]]:
    """Place of each lagging state among those of the joints, and its condition."""
    of = lags(system)
    first = sum(len(part.states) for part in native_parts(system))
    return [(first + k, _input(system, lag.condition.kind)) for k, lag in enumerate(of)]


def _input(system: System, kind: str) -> str:
    (k,) = (k for k, c in enumerate(system.conditions) if c.kind == kind)
    return f"motion[{2 * len(system.joints) + k}]"


def _followed(system: System, joint: int, m: Modulation) -> str:
    """What a modulation reads: its condition, or what lags behind that."""
    for lag, (place, _) in zip(lags(system), _behind(system), strict=True):
        if (lag.joint, lag.condition.kind) == (joint, m.condition):
            return f"s[{place}]"
    return _input(system, m.condition)
