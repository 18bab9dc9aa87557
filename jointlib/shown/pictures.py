"""Axes to draw a result on, and how receptances look on them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray

BEFORE, AFTER, MEASURED, FLOOR = "#c2410c", "#0b5394", "#6b7280", "#9ca3af"
"""Colours with one meaning on every picture."""


def axes_of(ax: Any = None) -> Any:
    """The axes that are given, or those of a figure of their own that belongs to no window."""
    if ax is not None:
        return ax
    from matplotlib.figure import Figure

    return Figure(figsize=(7.0, 4.0), layout="constrained").subplots()


def literal(text: str) -> str:
    """Words of a user as they are: to a drawing dollar signs would begin and end a formula."""
    return text.replace("$", r"\$")


def shades(count: int) -> list[Any]:
    """Colours from light to dark for levels in ascending order, distinct in grey as well."""
    import matplotlib

    return [matplotlib.colormaps["viridis"](x) for x in np.linspace(0.82, 0.08, max(count, 1))[:count]]


def draw_magnitude(axes: Any, frequency: Array, receptance: ComplexArray, **look: Any) -> None:
    """The size of a receptance (m/N) in µm/N over frequency in Hz, on a logarithmic scale."""
    axes.semilogy(frequency, np.abs(receptance * 1e6), **look)


def draw_stiffness(axes: Any, amplitude: Array, gain: ComplexArray, **look: Any) -> None:
    """Equivalent stiffness Re G (N/m) in N/µm over the amplitude (m) in µm."""
    axes.plot(amplitude * 1e6, gain.real / 1e6, **look)


def name_curves(axes: Any) -> None:
    """A legend, where a curve has a name."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend()


def write_picture(path: Path, axes: Any) -> None:
    """The figure of some axes as .svg or .png, whole or not at all; the same data give the same bytes."""
    import matplotlib

    from jointlib.io.atomic import write

    metadata = {"Date": None, "Creator": None} if path.suffix == ".svg" else {"Software": None}
    with matplotlib.rc_context({"svg.hashsalt": "jointlib"}):
        write(path, lambda file: axes.figure.savefig(file, format=path.suffix[1:], dpi=150, metadata=metadata))
