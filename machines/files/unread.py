"""Parts of a machine file that could not be read: what refers to them is no fault of its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..components.static_load import StaticLoad


class Unread:
    """Components, and connections or bundles, whose tables something is wrong with."""

    def __init__(self, components: Sequence[Mapping[str, Any]], joins: Sequence[Mapping[str, Any]]) -> None:
        self._components = [table.get("name") for table in components]
        self._joins = [table.get("name") for table in joins]

    def __bool__(self) -> bool:
        return bool(self._components or self._joins)

    def among(self, sides: Iterable[str]) -> bool:
        """Whether one of some dofs, differences of dofs or names of components is theirs, or may be."""
        if self._nameless(self._components):
            return True
        named = {term.strip().partition(".")[0] for side in sides for term in str(side).split(" - ")}
        return not named.isdisjoint(map(str, self._components))

    def without(self, load: StaticLoad) -> StaticLoad:
        """A static load without what acts on them."""
        force = {dof: value for dof, value in load.force.items() if not self.among([dof])}
        if self._nameless(self._joins) or self._nameless(self._components):
            return replace(load, force=force, offset={})
        ends = tuple(f"{name}{mark}" for name in self._joins for mark in "._")
        kept = {k: v for k, v in load.offset.items() if k not in self._joins and not k.startswith(ends)}
        return replace(load, force=force, offset=kept)

    def _nameless(self, names: Sequence[Any]) -> bool:
        return any(not isinstance(name, str) for name in names)
