"""The effects that a trace tries: whatever is installed under the entry points ``jointlib.effects``."""

from __future__ import annotations

from dataclasses import dataclass

from jointlib.effect import JointEffect
from jointlib.fault import Fault
from jointlib.path_fault import PathFault
from jointlib.registry import installed


@dataclass(frozen=True)
class Catalogue:
    """What competes: effects of the joint, faults of a rig, faults of a force along a path."""

    joint: tuple[JointEffect, ...]
    rig: tuple[Fault, ...]
    path: tuple[PathFault, ...]
    failed: tuple[str, ...]
    """A sentence for each plugin that did not load."""


def catalogue() -> Catalogue:
    """The installed effects, in the order of their entry points."""
    plugins = installed("jointlib.effects")
    effects = [effect() for effect in plugins.found.values()]
    return Catalogue(
        tuple(e for e in effects if isinstance(e, JointEffect)),
        tuple(e for e in effects if isinstance(e, Fault)),
        tuple(e for e in effects if isinstance(e, PathFault)),
        tuple(f"Effect {name} did not load: {why}." for name, why in plugins.failed.items()),
    )
