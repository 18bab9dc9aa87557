"""Changes to a machine file before it is read: values at named places, so that one file serves many configurations."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section

from ..model.named_files import read, renamed

_NAMED = ("component", "connection", "bundle", "axis")
_ONE_OF = ("joint", "identify", "rigid")
"""Keys of a connection that exclude each other."""
_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


def change(documents: Sequence[Section], changes: Mapping[str, Any], where: str) -> None:
    """Put values at paths into documents that were opened but not read: a machine file and the parts it shares.

    ``component.cutter.stiffness[0][0]``, ``bundle.x_guide.preload``, ``connection.foot.joint.law[0].damping``,
    ``axis.x.position``, ``cutting.immersion``: components, connections, bundles and axes by name, entries of lists by
    number from 0; a law of a joint that stands in the file by its name as well, ``connection.foot.joint.viscous``. A
    key that the file leaves out may be set; what no file has is refused when the file is read. Where the value is a
    table and a table stands at the path, ``bundle.x_guide``, its keys take the place of those there. A joint given to a
    connection takes the place of records to identify one from, or of a rigid connection. A component that stands in a
    file of its own is changed in the machine alone: the keys of that file stand for it then.
    """
    for path, value in changes.items():
        _put(documents, path, value, where)


def named(path: str, names: Sequence[str]) -> tuple[str, str] | None:
    """Which of the names a path begins with, and the rest; names may hold dots."""
    fit = [name for name in names if path == name or path.startswith((f"{name}.", f"{name}["))]
    best = max(fit, key=len, default=None)
    return None if best is None else (best, path[len(best) :].removeprefix("."))


def _put(documents: Sequence[Section], path: str, value: Any, where: str) -> None:
    kind, _, rest = path.partition(".")
    if kind in _NAMED:
        tables = {t["name"]: t for d in documents for t in d.raw().get(kind, []) if isinstance(t.get("name"), str)}
        found = named(rest, list(tables))
        if found is None:
            word = rest.partition(".")[0]
            raise InputError(f"{where}: path {path!r}: no {kind} {word!r}, {nearest(word, tables)}")
        target, rest = tables[found[0]], found[1]
        if kind == "component" and rest and _STEP.findall(rest)[:1] not in ([("file", "")], [("speed", "")]):
            document = next(d for d in documents if any(t is target for t in d.raw()[kind]))
            _stand_for_itself(target, document.folder)
    else:
        target, rest = documents[-1].raw(), path
        known = [*_NAMED, *(key for key in target if key not in _NAMED)]
        if kind.partition("[")[0] not in target:
            raise InputError(f"{where}: path {path!r}: no {kind.partition('[')[0]!r}, {nearest(kind, known)}")
    steps = [int(index) if index else key for key, index in _STEP.findall(rest)]
    if not rest and isinstance(value, Mapping) and isinstance(target, dict):
        target |= value
        return
    if not steps or "".join(_words(steps)) != rest:
        raise InputError(f"{where}: path {path!r}, expected it to end in a key like 'mass' or 'stiffness[0][0]'")
    for step in steps[:-1]:
        target = _inside(target, step, path, where)
    last = steps[-1]
    if isinstance(last, int):
        _inside(target, last, path, where)
    elif not isinstance(target, dict):
        raise InputError(f"{where}: path {path!r}: {last!r} is a key, but there stands {target!r}")
    held = target.get(last) if isinstance(target, dict) else target[last]
    target[last] = {**held, **value} if isinstance(held, dict) and isinstance(value, Mapping) else value
    if kind == "connection" and len(steps) == 1 and last in _ONE_OF and value is not False:
        for other in _ONE_OF:
            if other != last:
                target.pop(other, None)


def _stand_for_itself(component: dict[str, Any], folder: Path) -> None:
    """Put the keys of the component file that a table names in its place; files are seen from ``folder``."""
    file = component.get("file")
    if not isinstance(file, str) or not file.endswith(".toml") or not (folder / file).is_file():
        return  # What is wrong with a file is told when the machine is read.
    home = (folder / file).parent
    held = renamed(read(folder / file), home, lambda path: Path(os.path.relpath(path, folder)).as_posix())
    del component["file"]
    component |= {key: value for key, value in held.items() if key not in ("schema", "name", "provenance")}


def _words(steps: Sequence[str | int]) -> list[str]:
    return [f"[{s}]" if isinstance(s, int) else f"{'.' if i else ''}{s}" for i, s in enumerate(steps)]


def _inside(target: Any, step: str | int, path: str, where: str) -> Any:
    if isinstance(step, int):
        if not isinstance(target, list) or step >= len(target):
            held = f"a list of {len(target)}" if isinstance(target, list) else repr(target)
            raise InputError(f"{where}: path {path!r}: no entry [{step}], there stands {held}")
        return target[step]
    law = _law(target, step)
    if law is not None:
        return law
    if not isinstance(target, dict) or step not in target:
        held = nearest(step, target) if isinstance(target, dict) else f"there stands {target!r}"
        raise InputError(f"{where}: path {path!r}: no key {step!r}, {held}")
    return target[step]


def _law(joint: Any, name: str) -> dict[str, Any] | None:
    """The law of a joint by the name that its parameters have: its kind, a second one with ``_2``."""
    laws = joint.get("law") if isinstance(joint, dict) and name not in joint else None
    count: dict[str, int] = {}
    for law in laws if isinstance(laws, list) else ():
        if isinstance(law, dict):
            kind = str(law.get("kind")).replace("-", "_")
            count[kind] = count.get(kind, 0) + 1
            if name == (kind if count[kind] == 1 else f"{kind}_{count[kind]}"):
                return law
    return None
