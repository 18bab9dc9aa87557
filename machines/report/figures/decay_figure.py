"""Frequency and damping of free decays over amplitude."""

from __future__ import annotations

from collections.abc import Mapping

from jointlib.arrays import Array

from ..drawing import MEASURED, sheet
from ..page import Figure
from .residual_figures import WORDS, length_unit


def decay_figures(plots: Mapping[str, Array]) -> list[Figure]:
    """Measured points with their errors, and the model before and after; nothing where no decay was traced."""
    if "decay_amplitude" not in plots:
        return []
    A = plots["decay_amplitude"]
    factor, unit = length_unit(A)
    with sheet(2, width=10.0, height=3.8) as paper:
        for axes, key, scale, label in (
            (paper.axes[0], "frequency", 1.0, "frequency [Hz]"),
            (paper.axes[1], "damping", 100.0, "damping [%]"),
        ):
            axes.errorbar(
                A * factor,
                scale * plots[f"decay_{key}"],
                1.96 * scale * plots[f"decay_{key}_error"],
                fmt=".",
                color=MEASURED,
                markersize=4,
                elinewidth=0.8,
                label="measured",
            )
            for word, colour, _ in WORDS:
                if f"decay_model_{key}_{word}" in plots:
                    x, y = plots[f"decay_model_amplitude_{word}"], plots[f"decay_model_{key}_{word}"]
                    axes.plot(x * factor, scale * y, color=colour, label=f"model {word}")
            axes.set(xlabel=f"amplitude [{unit}]", ylabel=label, xscale="log")
            axes.legend(fontsize=8)
    caption = (
        "Frequency and damping of the free decay over its amplitude, all levels together. Bars: 95 % from noise. "
        "Lines: what the describing function of the joint makes of them."
    )
    return [Figure(paper.svg, caption)]
