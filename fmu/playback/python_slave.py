"""A joint as the source of a Python slave that imports the standard library and pythonfmu only."""

from __future__ import annotations

import ast
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.modulation import lags_of

from ..members.archive import read_archive
from ..system.conditions import by_role, conditions_of, least_and_largest
from ..system.variables import Part, parts_of, variables_of

NAMELESS = "JointSlave"
"""Name of module and class before the fingerprint of the content gives them their own."""
_FRAME = Path(__file__).with_name("python_frame.py")
_FACTOR = Path(__file__).with_name("python_factor.py")
_EVERY_INPUT = (
    ("self.inputs[0], self.inputs[1], h)", "*self.inputs, h)"),
    ("joint_initial(self.parameters, self.inputs[0])", "joint_initial(self.parameters, *self.inputs)"),
    ("math.isfinite(self.inputs[0]) and math.isfinite(self.inputs[1])", "all(map(math.isfinite, self.inputs))"),
    ("displacement and velocity are", "the inputs are"),
)
_HEAD = '''"""Restoring force of a machine joint: generated, do not edit."""

from __future__ import annotations

import json
import math
from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

'''


def slave_source(joint: Joint, identifier: str = NAMELESS) -> str:
    """Text of the slave module, whose class is called ``identifier``."""
    parts, variables, following = parts_of(joint), variables_of(joint), _following(joint)
    for part, law in zip(parts, joint.laws, strict=True):
        if not part.kernel.functions:
            raise InputError(
                f"{law.kind}: no FMU kernel in Python for this law, expected {part.kernel.word}_kernel.py beside the "
                "module of the law, or runtime 'c'"
            )
    table = "".join(f"    ({v.name!r}, {v.causality!r}, {v.start or 0.0!r}),\n" for v in variables)
    declared = [v.declared for v in variables if v.declared is not None]
    bounds = "".join(f"    ({_number(d.lower)}, {_number(d.upper)}, {_number(d.above)}),\n" for d in declared)
    kernels = {part.kernel.word: part.kernel.source for part in parts}
    blocks = [
        f"VARIABLES = (\n{table})",
        f"# lower, upper and excluded lower bound of each parameter\nBOUNDS = (\n{bounds})",
        *kernels.values(),
        *following.functions,
        _checks(parts, following),
        _initial(parts, following),
        _step(parts, following),
        _frame_class(bool(joint.modulations)).replace(NAMELESS, identifier),
    ]
    return _HEAD + "\n\n\n".join(blocks) + "\n"


def _number(value: float) -> str:
    return repr(float(value)) if abs(value) < float("inf") else ("math.inf" if value > 0 else "-math.inf")


def _arguments(part: Part) -> str:
    """``stiffness=p[3], coefficients=[[p[4], p[5]]]``: the law's fields out of the list of parameters."""

    def place(where: int | list[int] | list[list[int]]) -> str:
        if isinstance(where, int):
            return f"p[{where}]"
        return "[" + ", ".join(place(entry) for entry in where) + "]"

    return ", ".join(f"{name}={place(where)}" for name, where in part.fields.items())


def _checks(parts: tuple[Part, ...], following: _Following) -> str:
    lines = [f"    {part.kernel.word}_check({_arguments(part)})" for part in parts if part.kernel.has("check")]
    lines += following.extremes
    return "\n".join(["def joint_check(p):", '    """Refuse parameters that do not go together."""', *lines])


def _initial(parts: tuple[Part, ...], following: _Following) -> str:
    head = f"def joint_initial(p, {following.arguments or 'z'}):"
    lines = [head, '    """Virgin states at a displacement of z metres."""', *following.begun, "    s = []"]
    lines += [f"    s += {part.kernel.word}_initial(z, {_arguments(part)})" for part in parts if _remembers(part)]
    return "\n".join([*lines, f"    return s{following.behind}"])


def _step(parts: tuple[Part, ...], following: _Following) -> str:
    head = f"def joint_step(p, s, {following.arguments or 'z, v'}, h):"
    lines = [head, '    """Force in N after h seconds at z and v, and the states then."""', *following.stepped]
    lines += ["    force, after = 0.0, []"]
    for part in parts:
        lines.append(f"    # {part.name}")
        if _remembers(part):
            first, end = part.states
            call = f"{part.kernel.word}_step(z, v, h, s[{first}:{end}], {_arguments(part)})"
            lines += [f"    f, states = {call}", "    force, after = force + f, after + states"]
        else:
            lines.append(f"    force += {part.kernel.word}_force(z, v, {_arguments(part)})")
    return "\n".join([*lines, f"    return force, after{following.behind}"])


def _remembers(part: Part) -> bool:
    return part.states[0] < part.states[1]


@dataclass(frozen=True)
class _Following:
    """What the functions do about conditions; all empty where the joint depends on none."""

    arguments: str = ""
    """Inputs by name."""
    functions: tuple[str, ...] = ()
    extremes: tuple[str, ...] = ()
    """Lines that check the parameters with their least and largest factors."""
    begun: tuple[str, ...] = ()
    """Lines after which p are the parameters as they are at the start,"""
    stepped: tuple[str, ...] = ()
    """or at the end of a step."""
    behind: str = ""
    """The states that lag, behind those of the laws."""


def _following(joint: Joint) -> _Following:
    conditions = conditions_of(f"joint {joint.name!r}", (joint,))
    if not conditions:
        return _Following()
    lags = lags_of(joint.modulations)
    first = sum(len(law.states) for law in joint.laws)
    late = [c for c in conditions if c.kind in lags]
    begun = [f"    {c.name}_behind = {c.name}" for c in late]
    stepped = [
        f"    {c.name}_behind = s[{first + k}] - math.expm1(-h / {lags[c.kind]!r}) * ({c.name} - s[{first + k}])"
        for k, c in enumerate(late)
    ]
    read = {c.kind: f"{c.name}_behind" if c in late else c.name for c in conditions}
    applied = f"    p = joint_modulated(p, {', '.join(read.values())})"
    return _Following(
        ", ".join(["z", "v", *(c.name for c in conditions)]),
        (_FACTOR.read_text(encoding="utf-8").split("\n\n\n", 1)[1].strip(), _modulated(joint, read)),
        _extremes(joint),
        (*begun, applied),
        (*stepped, applied),
        f" + [{', '.join(read[c.kind] for c in late)}]" if late else "",
    )


def _extremes(joint: Joint) -> tuple[str, ...]:
    factors = {role: least_and_largest(of) for role, of in by_role(joint).items()}
    rows = [factors.get(v.declared.role, (1.0, 1.0)) for v in variables_of(joint) if v.declared is not None]
    return (
        f"    for x, (lower, upper, above), factors in zip(p, BOUNDS, {rows!r}):",
        "        for factor in factors:",
        "            if not (lower <= x * factor <= upper and x * factor > above):",
        '                raise ValueError(f"{x} is out of bounds times the factor {factor} of its conditions")',
    )


def _modulated(joint: Joint, read: Mapping[str, str]) -> str:
    """The function that multiplies the parameters by their factors."""
    own = [v for v in variables_of(joint) if v.kind == "parameter"]
    lines = [f"def joint_modulated(p, {', '.join(read.values())}):", '    """Parameters under conditions."""']
    lines.append("    q = list(p)")
    for role, of in by_role(joint).items():
        factors = [f"factor({m.points!r}, {m.period or 0.0!r}, {m.reference!r}, {read[m.condition]})" for m in of]
        places = [i for i, v in enumerate(own) if v.declared is not None and v.declared.role is role]
        lines.append(f"    f = {' * '.join(factors)}")
        lines += [f"    q[{i}] *= f" for i in places]
    return "\n".join([*lines, "    return q"])


def _frame_class(conditions: bool) -> str:
    """The class of the frame; what only the type checker needs is left out. With ``conditions`` it hands on all inputs,
    not displacement and velocity alone."""
    text = _FRAME.read_text(encoding="utf-8")
    (node,) = (n for n in ast.parse(text).body if isinstance(n, ast.ClassDef))
    found = (ast.get_source_segment(text, node) or "").replace("  # type: ignore[misc]", "")
    for two, every in _EVERY_INPUT if conditions else ():
        found = found.replace(two, every)
    return found


def built_members(source: str, identifier: str) -> dict[str, bytes]:
    """Every file of the FMU that pythonfmu builds from a slave, by its name in the archive."""
    from pythonfmu import FmuBuilder

    path = list(sys.path)
    try:
        with tempfile.TemporaryDirectory(prefix="jointlib-") as folder:
            script = Path(folder) / f"{identifier}.py"
            script.write_bytes(source.encode("utf-8"))
            built = FmuBuilder.build_FMU(script, dest=Path(folder) / f"{identifier}.fmu")
            return read_archive(Path(built))
    finally:
        # The builder imports the slave from the folder that is gone now.
        sys.path[:] = path
        sys.modules.pop(identifier, None)
