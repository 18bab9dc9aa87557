"""Draw docs/picture.png from the folder of a run: ``python docs/picture.py out``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from machines.report.drawing import AFTER, BEFORE, MEASURED, shades, sheet


def main(run: Path) -> None:
    """Left: what the joint model left unexplained and what the mended one does; right: what that does to the lobes."""
    loop = np.load(run / "guide.trace" / "trace.npz")
    lobes = np.load(run / "lobes.npz")
    z, f = loop["loop_displacement"], loop["loop_measured"]
    slope = z @ f / (z @ z)
    with sheet(3, width=12.0, height=3.9, width_ratios=[1, 1, 1.6]) as paper:
        before, after, chart = paper.axes
        for axes, word, colour in ((before, "before", BEFORE), (after, "after", AFTER)):
            axes.plot(z * 1e6, f - slope * z, color=MEASURED, linewidth=0.8, label="records")
            axes.plot(z * 1e6, loop[f"loop_{word}"] - slope * z, color=colour, linewidth=0.8, label=f"model {word}")
            axes.set(xlabel="displacement of the guide [µm]", title=f"Guide, model {word}", ylim=(-115, 160))
            axes.legend(loc="upper left", fontsize=8)
        before.set(ylabel="force − straight part [N]")
        widths = np.linspace(4.0, 1.2, len(lobes["amplitude"]))
        colours = shades(len(widths))
        for A, depth, colour, width in zip(lobes["amplitude"], lobes["depth"], colours, widths, strict=True):
            label = f"{A * 1e6:g} µm" if A else "vanishing"
            chart.plot(lobes["speed"], depth * 1e3, color=colour, linewidth=width, label=label)
        chart.set(
            xlabel="spindle speed [rpm]", ylabel="limiting depth of cut [mm]", title="Machine, stable below", ylim=0
        )
        chart.set_ylim(0, 1.25 * chart.get_ylim()[1])
        chart.legend(title="vibration of the tool", loc="upper center", ncol=4, fontsize=8)
        before.figure.savefig(Path(__file__).with_name("picture.png"), dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
