"""How pictures look: one style, SVG text that is the same for the same data."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from jointlib.arrays import Array
from jointlib.shown.pictures import AFTER as AFTER
from jointlib.shown.pictures import BEFORE as BEFORE
from jointlib.shown.pictures import FLOOR as FLOOR
from jointlib.shown.pictures import MEASURED as MEASURED
from jointlib.shown.pictures import shades as shades

_STYLE: Any = {
    "font.size": 10.0,
    "font.family": "DejaVu Sans",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e5e7eb",
    "grid.linewidth": 0.8,
    "axes.edgecolor": "#57606a",
    "axes.labelcolor": "#1b1f24",
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "jointlib",
}


class Sheet:
    """Axes to draw on; ``svg``, and ``png`` where that is asked for, is filled when the sheet is finished."""

    def __init__(self, axes: Any) -> None:
        self.axes = axes
        self.svg = ""
        self.png = b""


@contextmanager
def sheet(
    columns: int = 1, rows: int = 1, *, width: float = 9.0, height: float = 3.6, png: bool = False, **layout: Any
) -> Iterator[Sheet]:
    """A figure of ``rows`` × ``columns`` axes, size in inches."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasSVG(figure)
        paper = Sheet(figure.subplots(rows, columns, **layout))
        yield paper
        buffer = io.StringIO()
        with warnings.catch_warnings():
            # Where labels leave no room the axes overlap a little; that is no reason to lose a report.
            warnings.filterwarnings("ignore", message="constrained_layout not applied")
            warnings.filterwarnings("ignore", message="Glyph .* missing from font")
            laid_out(figure)
            figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
            if png:
                pixels = io.BytesIO()
                figure.savefig(pixels, format="png", dpi=150, metadata={"Software": None})
                paper.png = pixels.getvalue()
    # The XML prologue has no place inside HTML.
    paper.svg = re.sub(r"^.*?(?=<svg)", "", buffer.getvalue(), flags=re.S)


def laid_out(figure: Any) -> None:
    """Room for every label, found once: a figure with any layout engine, "none" too, is drawn twice at each saving."""
    figure.get_layout_engine().execute(figure)
    figure.set_layout_engine(None)


def thin(*columns: Array, most: int = 2000) -> Sequence[Array]:
    """Every n-th point, so that a picture stays small."""
    step = max(1, -(-len(columns[0]) // most))
    return [c[::step] for c in columns]
