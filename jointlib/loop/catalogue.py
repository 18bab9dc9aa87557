"""The effects that a trace tries: whatever is installed under the entry points ``jointlib.effects``."""

from __future__ import annotations

from jointlib.effect import JointEffect
from jointlib.registry import installed


def catalogue() -> tuple[tuple[JointEffect, ...], tuple[str, ...]]:
    """The installed effects, and a sentence for each that did not load."""
    plugins = installed("jointlib.effects")
    failed = tuple(f"Effect {name} did not load: {why}." for name, why in plugins.failed.items())
    return tuple(effect() for effect in plugins.found.values()), failed
