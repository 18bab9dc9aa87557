"""Estimated frequency responses with what they rest on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.frf import Quantity
from jointlib.shown.pictures import axes_of, draw_magnitude, literal, name_curves
from jointlib.shown.result import Columns, Shown


@dataclass(frozen=True, eq=False)
class EstimatedFRF:
    """Motion over force between two degrees of freedom, estimated from records; arrays have an entry per line."""

    drive: str
    response: str
    frequency: Array
    """Hz, ascending, above 0."""
    value: ComplexArray
    """In the unit of ``quantity``."""
    quantity: Quantity
    variance: Array | None
    """E|error|² of ``value``; None where one average tells nothing of it."""
    coherence: Array
    averages: float
    """Independent averages n."""
    force: float
    """N: peak of the harmonic force that would move the response as far at its highest resonance."""
    condition: str | None = None
    records: tuple[str, ...] = ()
    radius: Array | None = None
    """|error| of ``value`` lies below it with a probability of 95 %, few averages being a part of the doubt."""
    alike: Array | None = None
    """Lines that err together with each: so many tell no more than one does; None where each errs for itself."""

    @property
    def name(self) -> str:
        """Response, drive and condition in words."""
        return f"{self.response} from {self.drive}" + (f", {self.condition}" if self.condition else "")

    @property
    def receptance(self) -> ComplexArray:
        """m/N."""
        return np.asarray(self.value / self.quantity.per_receptance(self.frequency))

    @property
    def deviation(self) -> Array | None:
        """√(E|error|²) of the receptance in m/N."""
        if self.variance is None:
            return None
        return np.asarray(np.sqrt(self.variance) / np.abs(self.quantity.per_receptance(self.frequency)))

    @property
    def deviation_together(self) -> Array | None:
        """The same for what is fitted to many lines: larger by √n where n lines err together."""
        own = self.deviation
        return own if own is None or self.alike is None else np.asarray(own * np.sqrt(self.alike))


@dataclass(frozen=True, repr=False, eq=False)
class Estimate(Shown):
    """What the records of a measurement give: frequency responses, what was left out, and what a reader must know."""

    frfs: tuple[EstimatedFRF, ...]
    left_out: tuple[str, ...] = ()
    """Hits and records that were not used, a sentence each."""
    notes: tuple[str, ...] = ()
    simulated: bool = False

    def finding(self) -> str:
        """How many responses, over which lines, and how well force and motion hang together."""
        first = self.frfs[0]
        good = min(float(np.median(f.coherence)) for f in self.frfs)
        many = f"{len(self.frfs)} frequency response{'s' if len(self.frfs) > 1 else ''}"
        said = (
            f"{'simulated: ' * self.simulated}{many}, {first.frequency[0]:.4g} to {first.frequency[-1]:.5g} Hz in "
            f"{len(first.frequency)} lines"
        )
        said += "" if first.averages <= 1 else f", coherence {good:.4g} or better in the median"
        return f"{said}; {len(self.left_out)} left out" if self.left_out else said

    def columns(self) -> Columns:
        """A row per response."""
        return {
            "response": ([f.response for f in self.frfs], ""),
            "drive": ([f.drive for f in self.frfs], ""),
            "condition": ([f.condition or "" for f in self.frfs], ""),
            "lines": ([len(f.frequency) for f in self.frfs], ""),
            "averages": ([f.averages for f in self.frfs], ""),
            "coherence": ([float(np.median(f.coherence)) for f in self.frfs], ""),
            "force": ([f.force for f in self.frfs], "N"),
        }

    def plot(self, ax: Any = None) -> Any:
        """Receptances in µm/N over Hz with the band of 95 % of each line; below, without ``ax``, the coherence."""
        if ax is not None:
            return self._receptances(ax)
        from matplotlib.figure import Figure

        upper, lower = Figure(figsize=(7.0, 5.5), layout="constrained").subplots(
            2, 1, sharex=True, height_ratios=[2.4, 1.0]
        )
        self._receptances(upper).set(xlabel="")
        for f in self.frfs:
            lower.plot(f.frequency, f.coherence, linewidth=0.9)
        lower.set(xlabel="frequency [Hz]", ylabel="coherence", ylim=(0, 1.03))
        return upper

    def _receptances(self, ax: Any) -> Any:
        axes = axes_of(ax)
        for f in self.frfs:
            draw_magnitude(axes, f.frequency, f.receptance, linewidth=0.9, label=literal(f.name))
            if f.radius is not None:
                size = np.abs(f.receptance)
                off = f.radius / np.abs(f.quantity.per_receptance(f.frequency))
                low, high = np.maximum(size - off, size / 100), size + off
                axes.fill_between(f.frequency, low * 1e6, high * 1e6, alpha=0.25, linewidth=0)
        axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]")
        name_curves(axes)
        return axes


def pairs_both_ways(frfs: Sequence[EstimatedFRF]) -> list[tuple[EstimatedFRF, EstimatedFRF]]:
    """Responses at i from j and at j from i, of one condition and on the same lines."""
    return [
        (a, b)
        for n, a in enumerate(frfs)
        for b in frfs[n + 1 :]
        if (a.drive, a.response, a.condition) == (b.response, b.drive, b.condition)
        and a.drive != a.response
        and np.array_equal(a.frequency, b.frequency)
    ]
