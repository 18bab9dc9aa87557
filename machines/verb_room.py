"""Rooms that bear the name of a verb: called, they do what the verb does.

An import of a room puts its module where a function of the same name would stand, so the module itself is called.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any


class VerbRoom(ModuleType):
    """``machines.lobes(…)`` is the function, ``machines.lobes.amplitude_limits`` one of the names in the module."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        """What the function of the same name in `machines.answers` returns."""
        return _function(self)(*given, **named)

    @property
    def __signature__(self) -> inspect.Signature:
        """That of the function, for those who ask how it is called."""
        return inspect.signature(_function(self))


def called_as_verb(name: str) -> None:
    """Make the module of this name one that can be called."""
    sys.modules[name].__class__ = VerbRoom


def _function(room: ModuleType) -> Callable[..., Any]:
    package, _, verb = room.__name__.rpartition(".")
    found: Callable[..., Any] = getattr(import_module(f"{package}.answers.{verb}"), verb)
    return found
