"""``jointlib inspect MACHINE -o``: the picture as a file."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from browser import Browser, Tab
from command_line import LIBRARY, files, jointlib

GUIDE_MILL = LIBRARY / "guide_mill.toml"


def test_a_mode_is_drawn_where_one_is_asked_for(tmp_path: Path) -> None:
    target = tmp_path / "carriage.svg"
    assert jointlib(f"inspect {LIBRARY / 'carriage.toml'} -o {target} --mode 5").status == 0
    assert "5: 635.6 Hz, damping 0.16 %" in target.read_text("utf-8")


def test_a_machine_is_drawn_into_a_file(tmp_path: Path) -> None:
    for name in ("mill.svg", "mill.html"):
        done = jointlib(f"inspect {GUIDE_MILL} -o {tmp_path / name} --json")
        assert (done.status, done.complaints) == (0, [])
        assert done.json["picture"] == str(tmp_path / name)
        assert (
            "normal (modal) has no place in space and none of its connections has one: it is not drawn."
            in (done.json["lines"])
        )
    assert ElementTree.parse(tmp_path / "mill.svg").getroot().tag.endswith("svg")
    assert files(tmp_path) == {Path("mill.svg"), Path("mill.html")}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (f"{GUIDE_MILL} -o mill.png", "-o: mill.png ends in '.png', expected .svg, .html"),
        (f"{LIBRARY / 'guide.joint.toml'} -o joint.svg", "schema is 'jointlib/joint/1'"),
        (f"{LIBRARY / 'two_mass.toml'} -o two.svg", "two_mass.toml: no part has a place in space"),
        (f"{LIBRARY / 'carriage.toml'} --mode 1", "--mode: expected -o FILE.svg or FILE.html as well"),
        (f"{LIBRARY / 'carriage.toml'} -o c.svg --mode 7", "carriage.toml: mode 7, expected 1 to 6"),
    ],
)
def test_what_cannot_be_drawn_is_said(here: Path, words: str, said: str) -> None:
    before = files(here)
    done = jointlib(f"inspect {words}")
    assert done.status == 2
    assert said in done.err
    assert "Traceback" not in done.err
    assert files(here) == before


@pytest.fixture(scope="module")
def tab(chromium: Browser, tmp_path_factory: pytest.TempPathFactory) -> Tab:
    path = tmp_path_factory.mktemp("picture") / "mill.html"
    assert jointlib(f"inspect {GUIDE_MILL} -o {path}").status == 0
    tab = chromium.tab()
    tab.open(path.as_uri())
    tab.until("!!document.querySelector('canvas')?.width")
    return tab


# The canvas as text: what is drawn elsewhere is another text.
SHOWN = "document.querySelector('canvas').toDataURL()"


def changed(tab: Tab, before: str) -> str:
    tab.wait(lambda: tab.evaluate(SHOWN) != before, "the picture is drawn anew")
    return str(tab.evaluate(SHOWN))


@pytest.mark.thorough
def test_the_page_turns_with_the_mouse_and_the_keyboard(tab: Tab) -> None:
    blank = "data:image/png"
    first = changed(tab, blank)
    x, y, width, height = tab.box("canvas")
    tab.drag((x + width / 2, y + height / 2), (x + width / 2 + 80, y + height / 2 + 20))
    second = changed(tab, first)
    tab.focus("canvas")
    tab.press("ArrowLeft")
    third = changed(tab, second)
    tab.click_on("[data-view=aside]")
    assert changed(tab, third)
    assert tab.complaints == []
    assert [address for address in tab.requested if not address.startswith("file:")] == []


def test_the_page_names_what_the_mouse_points_at(tab: Tab) -> None:
    tab.click_on("[data-view=front]")
    x, y, width, height = tab.box("canvas")
    tab.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + width / 2, y=y + height / 2 - 40)
    tab.until("document.querySelector('.jv-said').textContent.includes('head')")


def test_a_mode_moves_until_it_is_stopped(tab: Tab) -> None:
    tab.click_on("[data-view=aside]")
    still = str(tab.evaluate(SHOWN))
    tab.evaluate(
        "(() => { const pick = document.querySelector('select'); pick.value = '1';"
        "pick.dispatchEvent(new Event('change')); })()"
    )
    moving = changed(tab, still)
    changed(tab, moving)
    assert "the tool" in tab.text(".jv-said")
    tab.click_on(".jv-bar button")
    assert tab.text(".jv-bar button") == "Play"
    tab.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    held = tab.evaluate(SHOWN)
    tab.evaluate("new Promise(done => setTimeout(done, 300))")
    assert tab.evaluate(SHOWN) == held
