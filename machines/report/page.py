"""A page: a first sentence, sections with pictures and tables, what it stands on, and how to make it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from jointlib.io.atomic import write_text


@dataclass(frozen=True)
class Figure:
    """A picture as SVG text with its caption."""

    svg: str
    caption: str
    png: bytes = b""
    """The same in pixels, where that was asked for."""


@dataclass(frozen=True)
class Table:
    """Rows of text under a header."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    fold: str = ""
    """Words to open it by, where it is there for those who look for it; else it is open."""


@dataclass(frozen=True)
class Section:
    """A heading, a few sentences, and what shows it."""

    title: str
    text: Sequence[str] = ()
    figures: Sequence[Figure] = ()
    tables: Sequence[Table] = ()
    parts: Sequence[Section] = ()
    """Sections within, each under a smaller heading."""
    kind: str = ""
    """What several of one sort are gathered under."""


_MANY = 3


def gathered(sections: Sequence[Section]) -> list[Section]:
    """The sections with more than three of a kind as the parts of one, where the first of them stands."""
    kinds = [section.kind for section in sections]
    found: list[Section] = []
    for section in sections:
        if not section.kind or kinds.count(section.kind) <= _MANY:
            found.append(section)
        elif all(one.title != section.kind for one in found):
            found.append(Section(section.kind, parts=[one for one in sections if one.kind == section.kind]))
    return found


@dataclass(frozen=True)
class Page:
    """The whole report; :meth:`write` renders it into one file that needs no network."""

    title: str
    finding: str
    """First sentence: what was found and what to do."""
    numbers: Sequence[tuple[str, str]]
    """The few figures a reader looks for first."""
    sections: Sequence[Section]
    inputs: Sequence[tuple[str, str]]
    """Files read with their SHA-256."""
    assumptions: Sequence[str]
    warnings: Sequence[str]
    command: str
    """The command line that makes this report again."""
    version: str
    answers: Sequence[str] = ()
    """What else a reader wants to know first, a sentence or two each, in the order of weight."""
    lost: Sequence[str] = ()
    """What was asked for and failed, with the reason."""
    doubts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Sentences that stand beside a number, by its name."""

    def html(self) -> str:
        """The page as HTML text."""
        from jinja2 import Environment, FileSystemLoader, StrictUndefined

        folder = Path(__file__).parent
        environment = Environment(
            loader=FileSystemLoader(folder),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        return environment.get_template("page.html").render(page=self)

    def write(self, path: Path) -> None:
        """Write the page whole or not at all."""
        write_text(path, self.html())
