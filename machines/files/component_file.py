"""Component files: ``schema = "jointlib/component/1"``, the keys of a ``[[component]]`` in a file of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.io.mistakes import Lost
from jointlib.io.toml import Section
from jointlib.io.toml_file import read_toml
from jointlib.registry import names, plugin

from ..components.component import Component
from ..model.by_speed import BySpeed

_SUFFIX = ".toml"


def names_a_file(section: Section) -> bool:
    """Whether a ``[[component]]`` names a component file."""
    file = section.raw().get("file")
    return isinstance(file, str) and file.endswith(_SUFFIX)


def names_files(section: Section) -> bool:
    """Whether a ``[[component]]`` names several component files, each at a spindle speed."""
    return isinstance(section.raw().get("file"), list)


def of_files(section: Section, read: Callable[[Section], Component]) -> BySpeed:
    """The component of several files by spindle speed, each of which ``read`` reads from its table."""
    name, files, speeds = section.text("name"), section.words("file"), section.numbers("speed", "rpm")
    section.done()
    parts = tuple(
        read(of_file(Section({"name": name, "file": file}, section.where, section.folder, section.mistakes)))
        for file in files
    )
    try:
        return BySpeed(name, tuple(speeds), parts)
    except InputError as error:
        raise InputError(f"{section.where}: {str(error).partition(': ')[2]}") from None


def read_component(path: Path, name: str) -> Component:
    """The component in a file, under a name."""
    table = read_toml(path, "component")
    section = _named(table, name)
    cls: type[Component] = section.kind(
        lambda word, where: plugin("jointlib.components", word, where), names("jointlib.components")
    )
    component = cls.from_section(section)
    section.done()
    return component


def of_file(section: Section) -> Section:
    """The table of the component file that a ``[[component]]`` names, under the name that the machine gives it.

    Beside ``name`` and ``file`` no key may stand there: what the component is, its file says.
    """
    name, path = section.text("name"), section.path("file")
    if section.has("kind"):
        section.fault("kind stands beside the file of a component, expected it in that file alone")
        section.take("kind")
    section.done()
    if not path.is_file():
        raise InputError(f"{section.where}: file refers to {path}, which does not exist")
    mistakes = section.mistakes
    if mistakes is None:
        inner = read_toml(path, "component")
    else:
        found = mistakes.attempt(lambda: read_toml(path, "component", mistakes))
        if found is None:
            raise Lost
        inner = found
    return _named(inner, name)


def _named(section: Section, name: str) -> Section:
    """The table with a name of its own, and without what only programs read."""
    table: dict[str, Any] = {k: value for k, value in section.raw().items() if k not in ("name", "provenance")}
    return Section({"name": name, **table}, section.where, section.folder, section.mistakes)
