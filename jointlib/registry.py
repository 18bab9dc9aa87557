"""What is installed: laws, effects, components and readers, ours and third parties', by entry point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
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
    found: dict[str, Any] = {}
    failed: dict[str, str] = {}
    for point in sorted(entry_points(group=group), key=lambda p: p.name):
        try:
            found[point.name] = point.load()
        except Exception as error:
            failed[point.name] = f"{type(error).__name__}: {error}"
    return Installed(found, failed)


def plugin(group: str, name: str, where: str) -> Any:
    """One plugin by name, or one sentence that names the nearest."""
    have = installed(group)
    if name in have.found:
        return have.found[name]
    what = group.removeprefix("jointlib.").rstrip("s")
    if name in have.failed:
        raise InputError(f"{where}: {what} {name!r} failed to load ({have.failed[name]})")
    raise InputError(f"{where}: unknown {what} {name!r}, {nearest(name, have.found)}")


def laws() -> dict[str, type[JointLaw]]:
    """Every law that loads, by its word in files."""
    return dict(installed("jointlib.laws").found)


def law(kind: str, where: str) -> type[JointLaw]:
    """The law of that kind."""
    found: type[JointLaw] = plugin("jointlib.laws", kind, where)
    return found
