"""What is installed: laws, effects, components and readers, ours and third parties', by entry point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from jointlib.errors import InputError, nearest
from jointlib.law import JointLaw

GROUPS = (
    "jointlib.laws",
    "jointlib.effects",
    "jointlib.components",
    "jointlib.bundles",
    "jointlib.readers",
    "jointlib.steps",
    "jointlib.exports",
)


@dataclass(frozen=True)
class Installed:
    """The plugins of one group by name, and those that failed to load with the error each gave."""

    found: dict[str, Any]
    failed: dict[str, str]


@cache
def installed(group: str) -> Installed:
    """Load every entry point of a group; one that fails is recorded and stops nothing."""
    loaded = {name: _loaded(group, name) for name in names(group)}
    found = {name: what for name, (what, why) in loaded.items() if not why}
    return Installed(found, {name: why for name, (_, why) in loaded.items() if why})


def names(group: str) -> list[str]:
    """Names of the entry points of a group, none of which is loaded for that."""
    return list(_points(group))


def plugin(group: str, name: str, where: str) -> Any:
    """One plugin by name, which alone is loaded, or one sentence that names the nearest."""
    what = group.removeprefix("jointlib.").rstrip("s")
    if name not in _points(group):
        raise InputError(f"{where}: unknown {what} {name!r}, {nearest(name, names(group))}")
    found, why = _loaded(group, name)
    if why:
        raise InputError(f"{where}: {what} {name!r} failed to load ({why})")
    return found


@cache
def _points(group: str) -> dict[str, EntryPoint]:
    return {point.name: point for point in sorted(entry_points(group=group), key=lambda p: p.name)}


@cache
def _loaded(group: str, name: str) -> tuple[Any, str]:
    """An entry point, or the error that it gave."""
    try:
        return _points(group)[name].load(), ""
    except Exception as error:
        return None, f"{type(error).__name__}: {error}"


def laws() -> dict[str, type[JointLaw]]:
    """Every law that loads, by its word in files."""
    return dict(installed("jointlib.laws").found)


def law(kind: str, where: str) -> type[JointLaw]:
    """The law of that kind."""
    found: type[JointLaw] = plugin("jointlib.laws", kind, where)
    return found
