"""Receptances as pictures: real and imaginary part, magnitude and phase, or Nyquist's curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.shown.pictures import draw_magnitude, literal

from ...cutting.process.chart import draw_limit
from ..drawing import AFTER, sheet
from ..page import Figure

PLOTS = ("mag-phase", "re-im", "nyquist")


@dataclass(frozen=True, eq=False)
class Curve:
    """One receptance in m/N over frequency in Hz, with its place in the picture."""

    frequency: Array
    receptance: ComplexArray
    label: str = ""
    colour: Any = AFTER
    style: str = "-"


@dataclass(frozen=True, eq=False)
class Lobes:
    """Limiting depth in m and chatter frequency in Hz over spindle speed in rpm, with its place in the picture."""

    speed: Array
    depth: Array
    chatter_frequency: Array
    label: str = ""
    colour: Any = AFTER
    style: str = "-"


def receptance_figure(
    panels: Sequence[tuple[str, Sequence[Curve]]],
    plot: str = "mag-phase",
    caption: str = "",
    *,
    lobes: Sequence[Lobes] = (),
    png: bool = False,
) -> Figure:
    """A column for each (title, curves); units are µm/N and degrees, the factor of time is e^(+jωt).

    ``lobes`` stand in a last column, depth above chatter frequency.

    The phase of a driving point runs from 0 below its resonances towards −180° above one; it is drawn between −360°
    and 0 where a curve does not begin above, so that it does not jump at −180°.
    """
    count = max(len(panels) + bool(lobes), 1)
    rows, height = (1, 4.2) if plot == "nyquist" else (2, 5.0)
    layout: dict[str, Any] = {"squeeze": False}
    layout |= (
        {} if plot == "nyquist" else {"sharex": "col", "height_ratios": [1.6, 1] if plot == "mag-phase" else [1, 1]}
    )
    with sheet(count, rows, width=max(5.2 * count, 7.0), height=height, png=png, **layout) as paper:
        for column, (title, curves) in enumerate(panels):
            axes = paper.axes[:, column]
            axes[0].set_title(literal(title))
            for curve in curves:
                _draw(axes, curve, plot)
            _words(axes, plot)
            if any(curve.label for curve in curves):
                axes[0].legend()
        if lobes:
            _draw_lobes(paper.axes[:, -1], lobes)
    return Figure(paper.svg, caption, paper.png)


def _draw_lobes(axes: Any, lobes: Sequence[Lobes]) -> None:
    for one in lobes:
        known, look = np.isfinite(one.depth), {"color": one.colour, "linestyle": one.style}
        draw_limit(axes[0], one.speed, one.depth, label=literal(one.label), **look)
        if len(axes) > 1:
            frequency = np.where(known, one.chatter_frequency, np.nan)
            axes[1].plot(one.speed, frequency, ".", markersize=3, color=one.colour)
    axes[0].set_title("Stability lobes")
    axes[0].set(ylabel="limiting depth [mm]", ylim=(0.0, None))
    axes[-1].set(xlabel="spindle speed [rpm]")
    if len(axes) > 1:
        axes[1].set(ylabel="chatter [Hz]")
    axes[0].legend()


def _draw(axes: Any, curve: Curve, plot: str) -> None:
    H = curve.receptance * 1e6
    label = literal(curve.label) if curve.label else None
    look: dict[str, Any] = {"color": curve.colour, "linestyle": curve.style}
    if plot == "nyquist":
        axes[0].plot(H.real, H.imag, label=label, **look)
    elif plot == "re-im":
        axes[0].plot(curve.frequency, H.real, label=label, **look)
        axes[1].plot(curve.frequency, H.imag, **look)
    else:
        draw_magnitude(axes[0], curve.frequency, curve.receptance, label=label, **look)
        axes[1].plot(curve.frequency, _phase(H), **look)


def _phase(H: ComplexArray) -> Array:
    """Degrees from just above 0 down to −360, with gaps where the curve wraps round."""
    phase = np.degrees(np.angle(H))
    phase = np.where(phase > _SLACK, phase - 360, phase)
    wraps = np.abs(np.diff(phase, prepend=phase[:1])) > 180
    return np.asarray(np.where(wraps, np.nan, phase))


_SLACK = 20.0
"""Degrees above zero that a measured phase may stray."""


def _words(axes: Any, plot: str) -> None:
    if plot == "nyquist":
        axes[0].set(xlabel="Re x/F [µm/N]", ylabel="Im x/F [µm/N]")
        axes[0].set_aspect("equal", adjustable="datalim")
        axes[0].axhline(0.0, color="#57606a", linewidth=0.8)
    elif plot == "re-im":
        axes[0].set(ylabel="Re x/F [µm/N]")
        axes[1].set(xlabel="frequency [Hz]", ylabel="Im x/F [µm/N]")
        for part in axes:
            part.axhline(0.0, color="#57606a", linewidth=0.8)
    else:
        axes[0].set(ylabel="|x/F| [µm/N]")
        axes[1].set(xlabel="frequency [Hz]", ylabel="phase [°]")
        low, high = axes[1].get_ylim()
        axes[1].set_yticks([tick for tick in (-360, -270, -180, -90, 0) if low - 60 <= tick <= high + 60])
