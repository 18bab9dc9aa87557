"""A joint as the source of a Python slave that imports the standard library and pythonfmu only."""

from __future__ import annotations

import ast
import sys
import tempfile
from pathlib import Path

from jointlib.errors import InputError
from jointlib.joint import Joint

from ..members.archive import read_archive
from ..system.variables import Part, parts_of, variables_of

NAMELESS = "JointSlave"
"""Name of module and class before the fingerprint of the content gives them their own."""
_FRAME = Path(__file__).with_name("python_frame.py")
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
    parts, variables = parts_of(joint), variables_of(joint)
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
        _checks(parts),
        _initial(parts),
        _step(parts),
        _frame_class().replace(NAMELESS, identifier),
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


def _checks(parts: tuple[Part, ...]) -> str:
    lines = [f"    {part.kernel.word}_check({_arguments(part)})" for part in parts if part.kernel.has("check")]
    return "\n".join(["def joint_check(p):", '    """Refuse parameters that do not go together."""', *lines])


def _initial(parts: tuple[Part, ...]) -> str:
    lines = ["def joint_initial(p, z):", '    """Virgin states at a displacement of z metres."""', "    s = []"]
    lines += [f"    s += {part.kernel.word}_initial(z, {_arguments(part)})" for part in parts if _remembers(part)]
    return "\n".join([*lines, "    return s"])


def _step(parts: tuple[Part, ...]) -> str:
    lines = ["def joint_step(p, s, z, v, h):", '    """Force in N after h seconds at z and v, and the states then."""']
    lines += ["    force, after = 0.0, []"]
    for part in parts:
        lines.append(f"    # {part.name}")
        if _remembers(part):
            first, end = part.states
            call = f"{part.kernel.word}_step(z, v, h, s[{first}:{end}], {_arguments(part)})"
            lines += [f"    f, states = {call}", "    force, after = force + f, after + states"]
        else:
            lines.append(f"    force += {part.kernel.word}_force(z, v, {_arguments(part)})")
    return "\n".join([*lines, "    return force, after"])


def _remembers(part: Part) -> bool:
    return part.states[0] < part.states[1]


def _frame_class() -> str:
    """The class of the frame; what only the type checker needs is left out."""
    text = _FRAME.read_text(encoding="utf-8")
    (node,) = (n for n in ast.parse(text).body if isinstance(n, ast.ClassDef))
    return (ast.get_source_segment(text, node) or "").replace("  # type: ignore[misc]", "")


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
