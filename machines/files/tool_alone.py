"""A tool or holder file by itself, looked at without a machine."""

from __future__ import annotations

from pathlib import Path

from jointlib.io.mistakes import Lost, Mistakes, all_at_once

from ..components.component import Component
from ..components.connection import Connection
from .machine_file import component_of, connection_of
from .tool_file import alone


def read_tool(path: Path, kind: str = "tool") -> tuple[tuple[Component, ...], tuple[Connection, ...]]:
    """Components that a file of ``kind`` tool or holder puts into a machine, and what joins them."""

    def read(mistakes: Mistakes) -> tuple[tuple[Component, ...], tuple[Connection, ...]]:
        tables = alone(path, kind, mistakes)
        components, _ = tables.each("component", component_of)
        joins, _ = tables.each("connection", connection_of)
        if mistakes.sentences:
            raise Lost
        inner = (one for join in joins for one in join if not any(side == "spindle" for side in one.between))
        return tuple(components), tuple(inner)

    return all_at_once(read)
