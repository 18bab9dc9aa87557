"""The report of a study in a real browser: it loads and shows its sections."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest
from browser import look
from command_line import jointlib

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


@pytest.mark.slow
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
