"""The designs of a study on the page: brushed, listed, and set on the sliders."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from browser import Browser, Tab
from command_line import LIBRARY
from explorer_site import Opened, Site, curve, page, part, press, serving_study, until_drawn, until_status, value
from tools import package

from jointlib.errors import InputError

pytestmark = pytest.mark.thorough
STUDY = """
schema = "jointlib/study/1"
base = "lathe.toml"
[[factor]]
name = "guide"
path = "connection.guide.joint.linear.stiffness"
range = ["100 N/um", "900 N/um"]
levels = 5
[[factor]]
name = "material"
path = "cutting.specific"
values = ["1000 N/mm^2", "2000 N/mm^2"]
[[objective]]
quantity = "minimum-depth"
goal = "max"
[[objective]]
quantity = "static-compliance"
goal = "min"
[[constraint]]
quantity = "minimum-depth"
at_least = "1.2 mm"
"""
SHOWN = "document.querySelectorAll('#scatter .main-svg').length > 0"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with serving_study(tmp_path_factory.mktemp("designs"), STUDY) as site:
        yield site


@pytest.fixture(scope="module")
def opened(chromium: Browser, site: Site) -> Iterator[Opened]:
    with page(chromium, site) as tab:
        tab.until(SHOWN)
        yield Opened.now(tab)


@pytest.fixture
def tab(opened: Opened) -> Tab:
    return opened.anew()


def labels(tab: Tab) -> list[str]:
    found: list[str] = tab.evaluate("[...document.querySelectorAll('.control .label label')].map(e => e.textContent)")
    return found


def listed(tab: Tab) -> list[int]:
    found: list[int] = tab.evaluate("[...document.querySelectorAll('#chosen-list tbody th')].map(e => +e.textContent)")
    return found


def test_a_box_around_designs_highlights_and_lists_them(tab: Tab) -> None:
    x, y, width, height = tab.box("#scatter .nsewdrag")
    corners = ((0.01, 0.01), (0.3, 0.4), (0.7, 0.8), (0.99, 0.99))
    tab.drag(*((x + a * width, y + b * height) for a, b in corners))
    tab.until("document.querySelectorAll('#chosen-list tbody tr').length > 0")
    assert listed(tab) == list(range(10))
    press(tab, "#clear")
    tab.until("document.querySelector('#chosen-list').textContent.includes('No design')")


def test_a_click_on_a_design_sets_the_unlocked_sliders_to_it(tab: Tab) -> None:
    stiffness, specific = (labels(tab).index(name) for name in ("stiffness", "specific pressure"))
    press(tab, part("lock", specific))
    tab.until(f"document.querySelector(`{part('field', specific)}`).disabled")
    before, kept = curve(tab, "frf"), value(tab, specific)
    x, y, number = tab.evaluate(
        "(() => { const g = document.querySelector('#scatter .js-plotly-plot'), l = g._fullLayout;"
        "g.scrollIntoView(); const r = g.getBoundingClientRect(), t = g._fullData[0], i = t.x.length - 1;"
        "return [r.x + l._size.l + l.xaxis.c2p(t.x[i]), r.y + l._size.t + l.yaxis.c2p(t.y[i]), t.customdata[i]]; })()"
    )
    tab.click(x, y)
    until_status(tab, f"set to design {number}")
    until_drawn(tab, before)
    assert value(tab, stiffness) in {"100", "300", "500", "700", "900"}
    assert value(tab, specific) == kept


def test_designs_are_highlighted_and_used_by_the_keyboard(tab: Tab) -> None:
    stiffness, specific = (labels(tab).index(name) for name in ("stiffness", "specific pressure"))
    tab.type_into("#designs", "1, 8-9")
    tab.until("document.querySelectorAll('#chosen-list tbody tr').length === 3")
    assert listed(tab) == [1, 8, 9]
    press(tab, part("design", 9))
    until_status(tab, "set to design 9")
    assert (float(value(tab, stiffness)), float(value(tab, specific))) == (900.0, 2000.0)
    tab.type_into("#designs", "4-99")
    assert "expected numbers from 0 to 9" in until_status(tab, "designs:")


def test_a_report_is_written_into_the_folder_and_nowhere_else(tab: Tab, site: Site) -> None:
    before = set(site.folder.parent.rglob("*"))
    tab.type_into("#name", "a setting")
    press(tab, "#report")
    until_status(tab, f"Wrote {site.folder / 'a setting.html'}.")
    assert set(site.folder.parent.rglob("*")) - before == {site.folder, site.folder / "a setting.html"}
    assert "<svg" in (site.folder / "a setting.html").read_text()


def test_a_fault_of_the_program_is_told_in_words(
    chromium: Browser, site: Site, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    from machines.explore import Explorer

    def broken(*given: object) -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(Explorer, "at", broken)
    with page(chromium, site) as tab:
        tab.type_into("#read-at", "3000")
        said = until_status(tab, "fault of its own")
        assert "ZeroDivisionError" in said
        assert "secret" not in tab.evaluate("document.body.textContent")
    assert "secret" in caplog.text


def test_the_results_of_another_study_are_refused(site: Site) -> None:
    from machines.explore import Explorer

    folder = site.folder.parent
    with pytest.raises(InputError, match="its base is"):
        Explorer(LIBRARY / "lathe.toml", folder / "s.study.toml", folder / "results").scatter()


@pytest.mark.parametrize(("text", "found"), [("", []), ("3", [3]), ("0, 2-4", [0, 2, 3, 4]), (" 1 - 2,1", [1, 2])])
def test_numbers_and_ranges_of_designs(text: str, found: list[int]) -> None:
    package("dash")
    from machines.explore.designs import numbers_in

    assert numbers_in(text, 10) == found


@pytest.mark.parametrize("text", ["a", "3-1", "10", "1-", "-1", "1e3", "9999999999"])
def test_what_is_no_number_of_a_design_is_refused(text: str) -> None:
    package("dash")
    from machines.explore.designs import numbers_in

    with pytest.raises(InputError, match="designs:"):
        numbers_in(text, 10)
