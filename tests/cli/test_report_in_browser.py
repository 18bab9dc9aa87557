"""The report in a real browser: it loads, shows its sections, and is not blank."""

from __future__ import annotations

import html
import re
import subprocess
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from browser import FLAGS
from command_line import jointlib
from conftest import Left
from tools import require


@pytest.fixture(scope="module")
def browser() -> str:
    return require("chromium")


def look(browser: str, folder: Path, report: Path, *words: str) -> str:
    command = [browser, *FLAGS, f"--user-data-dir={folder / 'profile'}", *words, report.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout


def test_the_page_shows_all_sections(browser: str, guide_mill_run: Left, tmp_path: Path) -> None:
    dom = look(browser, tmp_path, guide_mill_run.folder / "report.html", "--dump-dom")
    headings = [html.unescape(re.sub(r"<[^>]+>", "", h)) for h in re.findall(r"<h2[^>]*>(.*?)</h2>", dom)]
    for wanted in (
        "The joint as identified",
        "The machine and its modes",
        "Closing the loop",
        "Describing function",
        "Check against python-control",
        "Forced response",
        "Stability lobes",
        "FMU",
        "What this stands on",
    ):
        assert any(wanted in heading for heading in headings), wanted
    assert dom.count("<svg") >= 6


STUDY = """
schema = "jointlib/study/1"
name = "a cutter"
base = "machines/library/two_mode_tool.toml"
[[factor]]
name = "mass"
path = "component.cutter.modal_mass[0]"
values = [0.3, 0.4]
[[factor]]
path = "cutting.immersion"
values = [0.3, 0.5]
[[factor]]
path = "component.cutter.damping_ratio[0]"
role = "uncertain"
range = [0.03, 0.05]
[conditions]
speeds = 40
[[objective]]
quantity = "minimum-depth"
goal = "max"
[[objective]]
quantity = "static-compliance"
goal = "min"
[sampling]
samples = 3
"""


def test_the_page_of_a_study_answers_every_question(browser: str, here: Path) -> None:
    Path("s.study.toml").write_text(STUDY)
    done = jointlib("study run s.study.toml -o out --workers 1 --json")
    assert (done.status, done.json["report"], done.json["machine"]) == (0, "out/report.html", "out/best.toml")
    dom = look(browser, here, (here / "out" / "report.html").resolve(), "--dump-dom", "--window-size=420,900")
    headings = [html.unescape(re.sub(r"<[^>]+>", "", h)) for h in re.findall(r"<h2[^>]*>(.*?)</h2>", dom)]
    assert headings == [
        "The leading designs",
        "One objective against the other",
        "What it depends on",
        "What separates the first from the second",
        "Over the working space",
        "How sure the ranking is",
        "What was ruled out",
        "The machine file",
        "What this stands on",
    ]
    assert dom.count("<svg") >= 4
    assert not re.findall(r"(?:src|href)=\"(?!#)", dom)
    # The depth that the page tells of the machine file is the one that the command tells.
    told = re.search(r"minimum depth</td><td>([\d.]+) mm", dom)
    assert told is not None
    lobes = jointlib("lobes out/best.toml --method zero-order --json")
    assert 1e3 * lobes.json["minimum_depth"] == pytest.approx(float(told[1]), rel=1e-3)


def test_the_page_is_not_blank(browser: str, guide_mill_run: Left, tmp_path: Path) -> None:
    shot = tmp_path / "report.png"
    look(
        browser,
        tmp_path,
        guide_mill_run.folder / "report.html",
        f"--screenshot={shot}",
        "--window-size=1200,4000",
    )
    picture = np.asarray(matplotlib.image.imread(shot))[:, :, :3]
    assert picture.shape == (4000, 1200, 3)
    # Text and curves on a light ground: some of both in every quarter of the page.
    for quarter in np.array_split(picture, 4):
        assert np.var(quarter) > 1e-3
        assert 0.01 < np.mean(quarter < 0.9) < 0.9
