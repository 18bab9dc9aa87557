"""The page of ``jointlib explore`` in a real browser, used as a designer uses it."""

from __future__ import annotations

import json
import re
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Browser, Tab
from command_line import LIBRARY, jointlib
from explorer_site import DRAWN, Opened, Site, curve, page, part, press, serving, until_drawn, until_status, value
from tools import package

from machines.answers.explore import identified

pytestmark = pytest.mark.thorough
AMPLITUDE, PRELOAD, CONTACT, DAMPING, TEETH = 0, 1, 3, 4, 5


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    package("dash")
    from machines.explore import Explorer

    machine = LIBRARY / "guide_mill.toml"
    with serving(Explorer(machine, joints=identified(machine)[0]), tmp_path_factory.mktemp("explorer") / "out") as site:
        yield site


@pytest.fixture(scope="module")
def opened(chromium: Browser, site: Site) -> Iterator[Opened]:
    with page(chromium, site) as tab:
        yield Opened.now(tab)


@pytest.fixture
def tab(opened: Opened) -> Tab:
    return opened.anew()


def test_dragging_a_slider_moves_every_curve(tab: Tab) -> None:
    before = {graph: curve(tab, graph) for graph in ("frf", "gain", "lobes")}
    x, y, width, height = tab.box(part("slider", PRELOAD))
    assert value(tab, PRELOAD) == "592.44"
    tab.drag((x + width / 2, y + height / 2), (x + 0.6 * width, y + height / 2), (x + 0.8 * width, y + height / 2))
    for graph, old in before.items():
        until_drawn(tab, old, graph)
    # The curves of the first place on the way may be drawn before the slider tells of the last.
    tab.wait(lambda: 1200 < float(value(tab, PRELOAD)) < 1700, "the slider tells where it was let go")
    # A guide under more preload is stiffer, its describing function at rest is larger.
    tab.wait(lambda: curve(tab, "gain")[0][0] > 1.2 * before["gain"][0][0], "the gain is that of the last preload")


def test_pictures_of_sliders_are_not_lost_to_others_that_are_asked_for_at_the_same_time(tab: Tab) -> None:
    """A second wish for pictures takes the place of the first, and the sliders may not have been answered by then."""
    before = curve(tab, "lobes")
    tab.evaluate(
        "(() => { const fetched = window.fetch; let wishes = 0; window.fetch = (...given) => {"
        "const answer = fetched(...given); wishes += String(given[1]?.body).includes('two teeth');"
        "if (wishes === 2) { window.fetch = fetched; dash_clientside.set_props('exact', {data: null}); }"
        "return answer; }; })();"
        "dash_clientside.set_props('wish', {data: {values: {'cutting.teeth': 2}, words: 'two teeth'}})"
    )
    # Half the teeth cut half as much at a time: more depth at every place where the chatter is worst.
    tab.wait(lambda: np.min(curve(tab, "lobes")[1]) > 1.2 * np.min(before[1]), "the lobes are those of two teeth")
    assert value(tab, TEETH) == "2"


def test_a_vibration_is_marked_on_the_describing_function(tab: Tab) -> None:
    marks = "document.querySelector('#gain .js-plotly-plot')._fullLayout.shapes.length"
    assert tab.evaluate(marks) == 0
    before = curve(tab, "frf")
    tab.type_into(part("field", AMPLITUDE), "20")
    until_drawn(tab, before)
    assert tab.evaluate(marks) == 2
    assert len(curve(tab, "frf")) > len(before)


def test_a_click_reads_what_jointlib_lobes_says_of_the_saved_machine(tab: Tab, site: Site) -> None:
    before = curve(tab, "frf")
    tab.focus(part("slider", PRELOAD))
    tab.press("ArrowRight", 20)
    until_drawn(tab, before)
    tab.type_into(part("field", TEETH), "3")
    tab.until(f"document.querySelector({json.dumps(part('field', TEETH))}).value === '3'")
    x, y, width, height = tab.box("#lobes .nsewdrag")
    tab.click(x + 0.45 * width, y + 0.5 * height)
    tab.until("document.querySelector('#reading').textContent.startsWith('At ')")
    tab.type_into("#name", "clicked")
    press(tab, "#save")
    until_status(tab, "Wrote")
    # Reading follows the sliders a moment after they come to rest.
    read = tab.text("#reading")
    found = re.fullmatch(r"At (\S+) rpm: stable below (\S+) mm, chatter (\S+) Hz \((\w+), lobe (\d+), .*\)", read)
    assert found, read
    speed = tab.evaluate("document.querySelector('#lobes .js-plotly-plot')._fullData.at(-2).x[0]")
    assert float(found[1]) == pytest.approx(speed, rel=1e-5)
    done = jointlib(["lobes", str(site.folder / "clicked.toml"), "--speed", repr(speed), "--amplitude", "0", "--json"])
    assert done.status == 0, done.err
    ((depth,),), ((chatter,),) = done.json["depth"], done.json["chatter_frequency"]
    assert (float(found[2]), float(found[3])) == pytest.approx((depth * 1e3, chatter), rel=1e-5)
    assert (found[4], int(found[5])) == (done.json["kind"][0][0], done.json["lobe"][0][0])


def test_locked_sliders_stay(tab: Tab) -> None:
    start = value(tab, DAMPING)
    for control, text in ((PRELOAD, "700"), (DAMPING, "900")):
        tab.type_into(part("field", control), text)
    press(tab, part("lock", PRELOAD))
    tab.until(f"document.querySelector({json.dumps(part('field', PRELOAD))}).disabled")
    assert tab.evaluate(f"document.querySelector({json.dumps(part('slider', PRELOAD))}).disabled")
    press(tab, "#reset-all")
    until_status(tab, "as in the file")
    assert (value(tab, PRELOAD), value(tab, DAMPING)) == ("700", start)
    press(tab, part("lock", PRELOAD))
    tab.until(f"!document.querySelector({json.dumps(part('field', PRELOAD))}).disabled")
    press(tab, part("reset", PRELOAD))
    tab.until(f"document.querySelector({json.dumps(part('field', PRELOAD))}).value === '592.44'")


@pytest.mark.parametrize("text", ["much", "-5", "1e9", ""])
def test_a_bad_value_is_refused_in_words_beside_its_field(tab: Tab, text: str) -> None:
    before = curve(tab, "frf")
    tab.type_into(part("field", PRELOAD), text)
    tab.until(f"document.querySelector({json.dumps(part('said', PRELOAD))}).textContent")
    said = tab.text(part("said", PRELOAD))
    assert "preload" in said
    assert "expected a number from 148 to 2370 N" in said
    assert curve(tab, "frf") == before
    tab.type_into(part("field", PRELOAD), "600 N")
    tab.until(f"!document.querySelector({json.dumps(part('said', PRELOAD))}).textContent")
    until_drawn(tab, before)


def test_a_bad_speed_is_refused_in_words(tab: Tab) -> None:
    for text, words in (("fast", "read at: 'fast', expected a number"), ("6 kN", "read at: unit 'kN'")):
        tab.type_into("#read-at", text)
        until_status(tab, words)
    tab.type_into("#read-at", "99 krpm")
    tab.until("document.querySelector('#reading').textContent.includes('expected 3000 to 12000 rpm')")


def test_no_request_leaves_this_computer(tab: Tab, site: Site) -> None:
    tab.type_into("#read-at", "5000")
    tab.until("document.querySelector('#reading').textContent.startsWith('At ')")
    assert len(tab.requested) > 10
    assert [url for url in tab.requested if not url.startswith((site.address, "data:", "blob:"))] == []
    # Nor would a button of plotly's send a chart to its makers.
    titles = tab.evaluate("[...document.querySelectorAll('.modebar-btn')].map(e => e.dataset.title)")
    assert {title.split()[0] for title in titles} == {"Download", "Zoom", "Pan", "Reset"}


def test_the_browser_would_refuse_a_foreign_request(chromium: Browser, site: Site) -> None:
    tab = chromium.tab()
    tab.open(site.address)
    tab.until(DRAWN)
    tried = "fetch('http://localhost:1/').then(() => 'went', e => 'refused')"
    assert tab.evaluate(tried) == "refused"
    assert any("Content Security Policy" in said for said in tab.complaints)
    chromium.close(tab)


def test_a_second_user_does_not_disturb_the_first(chromium: Browser, tab: Tab, site: Site) -> None:
    tab.type_into(part("field", PRELOAD), "700")
    tab.type_into("#read-at", "5000")
    tab.until("document.querySelector('#reading').textContent.startsWith('At ')")
    first, read = {graph: curve(tab, graph) for graph in ("frf", "gain", "lobes")}, tab.text("#reading")
    with page(chromium, site) as other:
        assert value(other, PRELOAD) == "592.44"
        before = curve(other, "frf")
        other.type_into(part("field", PRELOAD), "1500")
        press(other, part("lock", DAMPING))
        until_drawn(other, before)
        press(tab, "#keep")
        tab.until("!document.querySelector('#back').disabled")
        assert value(other, PRELOAD) == "1500"
        assert other.evaluate("document.querySelector('#back').disabled")
    assert value(tab, PRELOAD) == "700"
    assert not tab.evaluate(f"document.querySelector({json.dumps(part('field', DAMPING))}).disabled")
    assert tab.text("#reading") == read
    press(tab, "#forget")
    tab.wait(lambda: {g: curve(tab, g) for g in first} == first, "the first user's curves are as before")


def test_everything_is_reached_and_done_by_the_keyboard(tab: Tab) -> None:
    seen: list[Any] = []
    while len(seen) < 200:
        tab.press("Tab")
        here = tab.evaluate(
            "(() => { const e = document.activeElement, s = getComputedStyle(e);"
            "return [e === document.body ? '' : e.id || e.textContent,"
            "parseFloat(s.outlineWidth), s.outlineStyle]; })()"
        )
        if seen and here[0] == seen[0][0]:
            break
        seen.append(here)
        if here[0] == '{"control":1,"part":"slider"}':
            before, old = curve(tab, "frf"), value(tab, PRELOAD)
            tab.press("ArrowRight", 3)
            until_drawn(tab, before)
            assert float(value(tab, PRELOAD)) > float(old)
        if here[0] == "read-at":
            tab.write("6000")
            tab.press("Tab")
            assert tab.evaluate("document.activeElement.id") == "read"
            tab.press("Space")
            tab.until("document.querySelector('#reading').textContent.startsWith('At 6000 rpm')")
    reached = {name for name, *_ in seen}
    wanted = {"reset-all", "keep", "read-at", "refine", "connection", "name", "save", "export", "report"}
    wanted |= {json.dumps({"control": PRELOAD, "part": p}, separators=(",", ":")) for p in ("field", "slider", "lock")}
    assert wanted <= reached
    # What has the focus is seen to have it.
    assert [name for name, width, style in seen if name not in (None, "") and (width < 2 or style == "none")] == []


def test_a_is_kept_as_thin_lines_and_compared(tab: Tab) -> None:
    lines = len(curve(tab, "lobes"))
    press(tab, "#keep")
    tab.until("!document.querySelector('#back').disabled")
    tab.type_into(part("field", PRELOAD), "1200")
    tab.until("document.querySelector('#differences table')?.textContent.includes('1200')")
    assert len(curve(tab, "lobes")) > lines
    widths = tab.evaluate("document.querySelector('#gain .js-plotly-plot')._fullData.map(t => t.line.width)")
    assert widths == [1.5, 1.5, 3.5, 3.5]
    rows = tab.evaluate("[...document.querySelectorAll('#differences tbody tr')].map(r => r.innerText.split('\\t'))")
    table = {row[0]: row[1:] for row in rows}
    assert table["preload [N]"] == ["592.44", "1200", "+103 %"]
    assert float(table["static compliance [µm/N]"][1]) < float(table["static compliance [µm/N]"][0])
    press(tab, "#back")
    until_status(tab, "back at A")
    assert value(tab, PRELOAD) == "592.44"


def test_a_file_name_that_leads_out_of_the_folder_is_refused(tab: Tab, site: Site) -> None:
    before = set(site.folder.parent.rglob("*"))
    for name in ("../escaped", "/tmp/escaped", "..", "a/b", "", "a\\b", "~", "%2e%2e%2fx"):
        tab.type_into("#name", name)
        for button in ("save", "export", "report"):
            press(tab, f"#{button}")
            assert "expected letters, digits" in until_status(tab, "Nothing was written")
            tab.evaluate("dash_clientside.set_props('status', {children: ''})")
    assert set(site.folder.parent.rglob("*")) == before


def test_an_fmu_is_exported_of_the_machine_as_set(tab: Tab, site: Site) -> None:
    tab.type_into(part("field", TEETH), "5")
    tab.type_into("#name", "five")
    press(tab, "#export")
    assert until_status(tab, "Wrote").endswith("It computes in Python.")
    text, target = site.exported[-1]
    assert target == site.folder / "five.fmu"
    assert "teeth = 5" in text
    # A file that is there is not written over.
    press(tab, "#export")
    until_status(tab, "is there already")


def test_the_page_is_legible_and_nothing_overlaps_at_any_size(tab: Tab) -> None:
    for width, height in ((1024, 768), (1280, 800), (1920, 1080)):
        tab.size(width, height)
        tab.until(f"innerWidth === {width} && document.querySelector('#lobes .main-svg').clientWidth < {width}")
        tab.until("document.documentElement.scrollWidth <= innerWidth")
        small = tab.evaluate(
            "[...document.querySelectorAll('body *')].filter(e => [...e.childNodes].some(n => n.nodeType === 3 &&"
            "n.textContent.trim()) && e.getClientRects().length && parseFloat(getComputedStyle(e).fontSize) < 15.5)"
            ".map(e => e.tagName + ' ' + e.className + ' ' + e.textContent)"
        )
        assert small == []
        overlapping = tab.evaluate(
            "[...document.querySelectorAll('.control')].filter(row => { const parts = [...row.children]"
            ".filter(e => !e.matches('.unseen, .said')).map(e => e.getBoundingClientRect());"
            "return parts.some((a, i) => parts.slice(i + 1).some(b => a.right > b.left + 1 && b.right > a.left + 1 &&"
            "a.bottom > b.top + 1 && b.bottom > a.top + 1)); }).length"
        )
        assert overlapping == 0


def test_only_the_loopback_listens(site: Site) -> None:
    listens = [row.split()[1] for row in Path("/proc/net/tcp").read_text().splitlines()[1:] if row.split()[3] == "0A"]
    mine = [place for place in listens if int(place.split(":")[1], 16) == site.port]
    assert mine == [f"0100007F:{site.port:04X}"]
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", site.port), timeout=5)


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "127.0.0.1.evil.example"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_a_stranger_is_refused(site: Site, headers: dict[str, str]) -> None:
    request = urllib.request.Request(f"{site.address}_dash-layout", headers=headers)
    with pytest.raises(urllib.error.HTTPError, match="403") as refused:
        urllib.request.urlopen(request, timeout=10)
    refused.value.close()


@pytest.mark.parametrize("body", [b"{bad", b"{}", b"[]", b'{"output": "nothing.there", "inputs": []}'])
def test_a_broken_request_gets_no_traceback(site: Site, body: bytes) -> None:
    request = urllib.request.Request(
        f"{site.address}_dash-update-component", body, {"Content-Type": "application/json"}
    )
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(request, timeout=10)
    with refused.value as answer:
        assert b"Traceback" not in answer.read()
        assert answer.code in (400, 404, 500)


@pytest.mark.slow
def test_exact_lobes_pass_through_every_reading(tab: Tab) -> None:
    assert "Preview" in tab.text("#headline")
    press(tab, "#refine")
    tab.until("!document.querySelector('#headline').textContent.includes('Preview')", 300)
    speed, depth = (curve(tab, "lobes", axis)[1] for axis in "xy")
    for i in range(0, len(speed), 40):
        tab.type_into("#read-at", repr(speed[i]))
        tab.until(f"document.querySelector('#reading').textContent.startsWith('At {speed[i]:g} rpm: ')")
        assert float(tab.text("#reading").split()[5]) == pytest.approx(depth[i], rel=1e-4)


@pytest.mark.slow
def test_the_fmu_of_a_setting_is_verified(site: Site, tmp_path: Path) -> None:
    from machines.answers.explore import exported
    from machines.explore import Explorer

    machine = LIBRARY / "guide_mill.toml"
    explorer = Explorer(machine, joints=identified(machine)[0])
    source = explorer.save({"cutting.teeth": 5.0}, tmp_path, "five")[0]
    assert "verified with" in exported(source, tmp_path / "five.fmu")[0]
    assert jointlib(["fmu", "--verify", str(tmp_path / "five.fmu")]).status == 0


def test_the_machine_is_drawn_with_its_modes(tab: Tab) -> None:
    tab.until("document.querySelectorAll('#machine-view select option').length > 1")
    assert tab.text("#machine-view select option:nth-child(2)").endswith("%")
    assert "cutter (lumped) has no place in space" in tab.text("#view-said")
    shown = "document.querySelector('#machine-view canvas').toDataURL()"
    before = tab.evaluate(shown)
    tab.click_on("#machine-view [data-view=top]")
    tab.wait(lambda: tab.evaluate(shown) != before, "the machine is seen from above")


def test_what_was_measured_is_laid_over_the_receptance_and_follows_the_sliders(
    chromium: Browser, tmp_path_factory: pytest.TempPathFactory
) -> None:
    package("dash")
    from machines.explore import Explorer

    machine, tip = LIBRARY / "three_joints.toml", LIBRARY / "three_joints" / "tip.measurement.toml"
    with (
        serving(Explorer(machine, measured=(tip,)), tmp_path_factory.mktemp("measured")) as site,
        page(chromium, site) as tab,
    ):
        tab.until("document.querySelectorAll('#measured td').length > 4")
        names = tab.evaluate("document.querySelector('#frf .js-plotly-plot')._fullData.map(t => t.name)")
        assert names == [*["x, measured"] * 5, "x, at rest"]
        told = tab.text("#measured")
        assert "tip_20N.csv" in told
        stiffness = next(
            i for i, c in enumerate(_shown(machine)) if c.key.startswith("connection.bearing.joint.linear")
        )
        tab.type_into(part("field", stiffness), "60")
        tab.wait(lambda: tab.text("#measured") != told, "the differences follow")


def _shown(machine: Path) -> tuple[Any, ...]:
    from machines.explore import Explorer
    from machines.explore.page import grouped

    return tuple(grouped(Explorer(machine).controls))
