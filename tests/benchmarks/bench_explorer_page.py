"""From a key on a slider of guide_mill to the last picture in headless Chromium. Run it as a script.

OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_explorer_page.py
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "cli"))
from browser import Tab, running
from explorer_site import curve, page, part, serving, until_drawn

from machines.answers.explore import identified
from machines.explore import Explorer

MILL = Path(__file__).parents[2] / "machines" / "library" / "guide_mill.toml"
AMPLITUDE, PRELOAD, PRESSES = 0, 1, 16
LISTEN = """
window.took = []; window.since = 0;
addEventListener('keydown', () => { window.since = performance.now(); }, true);
document.querySelector('#gain .js-plotly-plot').on('plotly_afterplot', () => {
    if (window.since) window.took.push(performance.now() - window.since); window.since = 0; })
"""


def took(tab: Tab) -> np.ndarray:
    """Milliseconds from each key to the last picture."""
    tab.evaluate("window.took = []")
    tab.focus(part("slider", PRELOAD))
    for count in range(1, PRESSES + 1):
        tab.press("ArrowRight")
        tab.until(f"window.took.length >= {count}")
    return np.array(tab.evaluate("window.took"))


def main() -> None:
    explorer = Explorer(MILL, joints=identified(MILL)[0])
    with tempfile.TemporaryDirectory() as name, serving(explorer, Path(name) / "out") as site:
        folder = Path(name)
        with running("chromium", folder / "profile") as browser, page(browser, site) as tab:
            tab.evaluate(LISTEN)
            for amplitude in ("0", "1", "5", "20"):
                before = curve(tab, "frf")
                tab.type_into(part("field", AMPLITUDE), amplitude)
                if amplitude != "0":
                    until_drawn(tab, before)
                times = took(tab)
                print(
                    f"{PRESSES} keys at {amplitude} um: {np.min(times):.0f} to {np.max(times):.0f} ms, median "
                    f"{np.median(times):.0f} ms"
                )


if __name__ == "__main__":
    main()
