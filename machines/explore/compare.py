"""Curves in words and numbers: what stands in the head line, beside a click, and in the table A against now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dash import html

from ..compare.comparison import Comparison
from ..report.comparison_section import HEADER, comparison_rows
from ..study.words import alike
from .controls import Control
from .curves import Curves
from .measured import Measured
from .scene import Reading

PREVIEW = "zero-order"
"""The method of quick charts that only a preview may rest on."""


def headline(curves: Curves) -> str:
    """The smallest and the largest limit of the chart."""
    if not len(curves.speed):
        return "This machine file has no cut with a range of speeds, so there are no lobes."
    stable = "Preview: stable" if curves.method == PREVIEW else "Stable"
    finite = np.isfinite(curves.depth)
    if not finite.any():
        return f"{stable} at any depth at the speeds drawn."
    low = np.flatnonzero(finite)[np.argmin(curves.depth[finite])]
    chatter = f"chatter at {curves.chatter_frequency[low]:.4g} Hz"
    said = f"{stable} below {_mm(curves, low)} at the speeds drawn ({chatter})"
    if not finite.all():
        return f"{said}; any depth at {curves.speed[~finite][0]:.0f} rpm"
    high = int(np.argmax(curves.depth))
    return f"{said}, up to {_mm(curves, high)} at {curves.speed[high]:.0f} rpm"


def _mm(curves: Curves, index: int) -> str:
    return f"{curves.depth[index] * 1e3:.3g}\N{NO-BREAK SPACE}mm"


def reading_words(reading: Reading) -> str:
    """Depth and chatter frequency at one speed, to the digits of ``jointlib lobes``."""
    if not np.isfinite(reading.depth):
        return f"At {reading.speed:g} rpm: stable at any depth."
    return (
        f"At {reading.speed:g} rpm: stable below {reading.depth * 1e3:.6g} mm, "
        f"chatter {reading.chatter_frequency:.6g} Hz ({reading.kind}, lobe {reading.lobe}, {reading.method})"
    )


def differences(controls: Sequence[Control], before: Setting | None, now: Setting) -> Any:
    """What was moved since A, and what came of it."""
    if before is None:
        return "Nothing is kept as A yet."
    rows = [
        (f"{c.label} [{c.unit}]" if c.unit else c.label, before.values[c.key], now.values[c.key])
        for c in controls
        if before.values[c.key] != now.values[c.key] and not c.choices
    ]
    chosen = [
        _cells(c.label, c.told(before.values[c.key]), c.told(now.values[c.key]), "–")
        for c in controls
        if before.values[c.key] != now.values[c.key] and c.choices
    ]
    results = [(name, a, b) for (name, a), (_, b) in zip(before.results, now.results, strict=True)]
    body = [*chosen, *(_row(*row) for row in [*rows, *results])]
    head = html.Thead(html.Tr([html.Th(word, scope="col") for word in ("", "A", "now", "change")]))
    return html.Table([head, html.Tbody(body)])


def measured_over(laid: Sequence[Comparison], records: tuple[Sequence[Measured], Sequence[str]]) -> Any:
    """How far the receptance that is drawn is off at each measured resonance, and on the whole."""
    if not laid:
        return [html.P(said) for said in records[1]]
    rows = [html.Tr([html.Td(cell) for cell in row]) for row in comparison_rows(laid)]
    head = html.Thead(html.Tr([html.Th(word, scope="col") for word in HEADER]))
    moved = ", ".join(f"{one.record.name} {one.moved * 1e6:.3g} µm" for one in records[0])
    said = [*(c.sentence() for c in laid), *records[1], *(w for c in laid for w in c.warnings)]
    said.append(
        f"While it was measured the tool moved by up to: {moved}. The prediction is the receptance at the amplitude "
        "that the slider has."
    )
    return [html.Table([head, html.Tbody(rows)]), html.Ul([html.Li(one) for one in dict.fromkeys(said)])]


@dataclass(frozen=True)
class Setting:
    """One side of the comparison."""

    values: Mapping[str, float]
    curves: Curves
    static_compliance: float
    """m/N, the larger of x and y."""

    @property
    def results(self) -> list[tuple[str, float]]:
        """The numbers that a designer compares."""
        largest = {axis: float(np.abs(h).max()) * 1e6 for axis, h in self.curves.receptance.items()}
        peaks = [(f"largest receptance {axis} [µm/N]", peak) for axis, peak in largest.items()]
        stiff = [("static compliance [µm/N]", self.static_compliance * 1e6), *peaks]
        if not len(self.curves.speed):
            return stiff
        depth, speed = self.curves.depth * 1e3, self.curves.speed
        low, high = int(np.argmin(depth)), int(np.argmax(depth))
        return [
            ("smallest limiting depth [mm]", float(depth[low])),
            ("largest limiting depth [mm]", float(depth[high])),
            ("at the speed [rpm]", float(speed[high])),
            *stiff,
        ]


def _row(name: str, a: float, b: float) -> Any:
    change = f"{100 * (b / a - 1):+.3g} %" if np.isfinite([a, b]).all() and a else "–"
    told = (f"{v:.5g}" if np.isfinite(v) else "any" for v in (a, b))
    return _cells(name, *told, "same" if alike(a, b) else change)


def _cells(name: str, *told: str) -> Any:
    return html.Tr([html.Th(name, scope="row"), *map(html.Td, told)])
