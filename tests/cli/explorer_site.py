"""A running explorer and the parts of its page."""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from browser import Browser, Tab
from lathe_file import lathe_file
from tools import package

if TYPE_CHECKING:
    from machines.explore import Explorer

DRAWN = "document.querySelectorAll('#gain .main-svg').length > 0 && !!document.querySelector('#headline')?.textContent"


@dataclass(frozen=True)
class Site:
    """Where an explorer is, where it writes, and the machine files of which FMUs were asked for."""

    address: str
    port: int
    folder: Path
    exported: list[tuple[str, Path]] = field(default_factory=list)


@contextlib.contextmanager
def serving(explorer: Explorer, folder: Path) -> Iterator[Site]:
    """The page of an explorer, served by this process; its FMUs are empty."""
    from machines.explore.server import bound, explorer_app, listening

    exported: list[tuple[str, Path]] = []

    def export(source: Path, target: Path) -> list[str]:
        exported.append((source.read_text(), target))
        target.write_bytes(b"")
        return ["It computes in Python."]

    with bound(port=0) as place:
        app, _ = explorer_app(explorer, explorer.machine.stem, folder, export)
        server = listening(app, place)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield Site(f"http://127.0.0.1:{server.port}/", server.port, folder, exported)
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@contextlib.contextmanager
def serving_study(folder: Path, text: str) -> Iterator[Site]:
    """The page of the lathe with the designs of a study of it, whose file has this text."""
    package("dash")
    from machines.explore import Explorer
    from machines.study.run import begin, evaluate_all
    from machines.study.study_file import read_study

    lathe_file(folder)
    (folder / "s.study.toml").write_text(text)
    study = read_study(folder / "s.study.toml")
    evaluate_all(study, begin(study, folder / "results"), {}, workers=1)
    with serving(Explorer(folder / "lathe.toml", folder / "s.study.toml", folder / "results"), folder / "out") as site:
        yield site


@contextlib.contextmanager
def page(browser: Browser, site: Site) -> Iterator[Tab]:
    """The page, newly opened in a context of its own; it must end without an error in its console."""
    tab = browser.tab()
    tab.open(site.address)
    tab.until(DRAWN)
    yield tab
    assert tab.complaints == []
    browser.close(tab)


def part(name: str, control: int) -> str:
    """Selector of a part of a control."""
    return f'[id=\'{{"control":{control},"part":"{name}"}}\']'


def value(tab: Tab, control: int) -> str:
    """What the number field of a control shows."""
    return str(tab.evaluate(f"document.querySelector({json.dumps(part('field', control))}).value"))


def curve(tab: Tab, graph: str, which: str = "y") -> list[list[float]]:
    """The numbers of every trace that a graph shows."""
    found: list[list[float]] = tab.evaluate(
        f"document.querySelector('#{graph} .js-plotly-plot')._fullData.map(t => Array.from(t.{which}))"
    )
    return found


def until_status(tab: Tab, words: str) -> str:
    """The status line once it holds these words."""
    tab.until(f"document.querySelector('#status').textContent.includes({json.dumps(words)})")
    return tab.text("#status")


def until_drawn(tab: Tab, before: list[list[float]], graph: str = "frf") -> None:
    """Wait until a graph shows something else than before."""
    tab.wait(lambda: curve(tab, graph) != before, f"{graph} is drawn anew")


def press(tab: Tab, name: str) -> None:
    """A button, pressed by the keyboard."""
    tab.focus(name)
    tab.press("Enter")


GRAPHS = ("frf", "gain", "lobes")


@dataclass(frozen=True)
class Opened:
    """A page that several tests use one after the other: opening one takes seconds of processor time."""

    tab: Tab
    curves: dict[str, list[list[float]]]

    @classmethod
    def now(cls, tab: Tab) -> Opened:
        return cls(tab, {graph: curve(tab, graph) for graph in GRAPHS})

    def anew(self) -> Tab:
        """Everything as when it was opened, done by the buttons of the page."""
        tab = self.tab
        if tab.evaluate("innerWidth") != 1280:
            tab.size(1280, 800)
        tab.evaluate(
            "document.querySelectorAll('button[aria-pressed=true], #forget').forEach(e => e.click());"
            "dash_clientside.set_props('speed', {data: null}); dash_clientside.set_props('status', {children: ''});"
            "document.querySelector('#reset-all').click()"
        )
        until_status(tab, "as in the file")
        tab.wait(lambda: {graph: curve(tab, graph) for graph in GRAPHS} == self.curves, "all is as at first")
        tab.evaluate("dash_clientside.set_props('status', {children: ''})")
        return tab
