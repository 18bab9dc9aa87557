"""The report in a real browser: it loads, shows its sections, and is not blank."""

from __future__ import annotations

import html
import re
import subprocess
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from conftest import Left
from tools import require

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)


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
