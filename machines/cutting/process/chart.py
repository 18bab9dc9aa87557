"""The stability chart: the limiting depth of cut over spindle speed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import Outcome
from jointlib.shown.pictures import axes_of, name_curves
from jointlib.shown.result import Columns, Shown

from ...indices import Mask

Words: TypeAlias = NDArray[np.str_]
Integers: TypeAlias = NDArray[np.int64]
METHODS = {
    "turning": ("turning", "boring"),
    "zero-order": ("milling",),
    "multi-frequency": ("milling",),
    "collocation": ("milling", "turning", "boring"),
}
"""The methods and the processes each is for."""

BY_SPEED = ("speed", "depth", "chatter_frequency", "kind", "lobe", "known_below")
"""Fields of a chart with a value per speed."""
UNSEEN = "The lines tell of modes above"
"""How the sentence begins that tells of them."""
_BOUND = re.compile(r"[0-9.]+e-[0-9]+")


@dataclass(frozen=True)
class LobeBranch:
    """One stretch of the stability boundary with the chatter frequency as its parameter.

    Every lobe number k maps the same stretch to spindle speeds rpm_k = 60·f/(N·(phase + k)).

    Parameters
    ----------
    frequency
        Chatter frequency in Hz, ascending.
    depth
        Limiting depth in m.
    phase
        Fraction of a wave, in (0, 1), that is left on the surface beside the k whole ones.
    cuts_per_revolution
        N.
    """

    frequency: Array
    depth: Array
    phase: Array
    cuts_per_revolution: int

    def speed(self, lobe: int) -> Array:
        """Spindle speed in rpm at which the stretch is met in lobe k = 0, 1, 2, …"""
        return 60 * self.frequency / (self.cuts_per_revolution * (self.phase + lobe))


@dataclass(frozen=True, repr=False)
class StabilityLobes(Shown):
    """Limiting depth of cut at given spindle speeds: the first crossing from zero depth.

    Arrays have the shape of ``speed``.

    Parameters
    ----------
    method
        The method that made the chart.
    speed
        Spindle speed in rpm.
    depth
        Limiting depth in m; inf where the cut is stable at any depth.
    chatter_frequency
        Hz; nan where the depth is inf. Of the lines that chatter holds at once, a tooth frequency apart, the one at
        which the tool moves most.
    kind
        ``"hopf"`` or ``"flip"``, with unequal pitches also ``"fold"`` (it repeats with the flutes); empty where the
        depth is inf.
    lobe
        Whole waves between two cuts; −1 where the depth is inf.
    known_below
        Depth in m below which nothing beyond what is known of the tool chatters, as far as the lines tell; larger
        depths hold up to ``known_to`` only. inf where all that matters is known.
    minimum_depth
        Depth in m below which every speed is stable (at least inside the band), for multi-frequency and collocation
        every given speed, or every speed between them where ``minimum_at`` is set; inf if there is none.
    minimum_frequency
        Chatter frequency in Hz at the minimum depth; nan if there is none.
    minimum_phase
        Fraction of a wave at the minimum depth, see `LobeBranch`.
    cuts_per_revolution
        N: teeth in milling, 1 in turning.
    branches
        The boundary by chatter frequency, for drawing the lobes whole; empty for multi-frequency and collocation.
    outcome
        How the computation ended.
    notes
        What the method does not cover, a sentence each.
    warnings
        What was met in this computation and bears on the result, a sentence each.
    known_to
        Hz above which nothing is known of the tool, so that chatter there is not excluded; None where no mode is left
        out.
    minimum_at
        rpm of the minimum depth where it was looked for between the speeds as well, see `over_the_range`.
    left_out
        Speeds in rpm that were asked for and not computed, as time was up.
    """

    method: str
    speed: Array
    depth: Array
    chatter_frequency: Array
    kind: Words
    lobe: Integers
    known_below: Array
    minimum_depth: float
    minimum_frequency: float
    minimum_phase: float
    cuts_per_revolution: int
    branches: tuple[LobeBranch, ...]
    outcome: Outcome
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    known_to: float | None = None
    minimum_at: float | None = None
    left_out: tuple[float, ...] = ()

    def minimum_speed(self, lobe: ArrayLike) -> Array:
        """Spindle speeds in rpm at which lobes k touch the minimum depth."""
        waves = self.minimum_phase + np.asarray(lobe, dtype=float)
        return np.asarray(60 * self.minimum_frequency / (self.cuts_per_revolution * waves))

    def curves(self, lobe: int) -> tuple[tuple[Array, Array], ...]:
        """Lobe k drawn whole: (speed in rpm, depth in m) of each stretch of the boundary."""
        return tuple((branch.speed(lobe), branch.depth) for branch in self.branches)

    @property
    def sure(self) -> Array:
        """Depth in m, no larger than what is known of the tool bears out."""
        return np.minimum(self.depth, self.known_below)

    @property
    def doubtful(self) -> Mask:
        """Where the depth holds no further than up to ``known_to``."""
        open_ended = ~np.isfinite(self.depth) & (self.known_to is not None)
        return np.asarray((self.depth > self.known_below) | open_ended)

    @property
    def up_to(self) -> str:
        """Up to which frequency the minimum depth holds, in words; empty where nothing known denies it above."""
        doubted = bool(self.known_to) and self.minimum_depth > np.min(self.known_below)
        return f", up to {self.known_to:g} Hz," if doubted else ""

    @property
    def everywhere(self) -> bool:
        """Whether the minimum depth is that of all speeds in its range, not of those computed alone."""
        return bool(self.branches) or self.minimum_at is not None

    @property
    def reach(self) -> str:
        """The speeds that the minimum depth is of, in words."""
        if self.minimum_at is not None:
            return f"every speed from {float(np.min(self.speed)):g} to {float(np.max(self.speed)):g} rpm"
        return "every speed" if self.everywhere else "these speeds"

    @property
    def short_of(self) -> str:
        """``, 26 of 200 speeds, time was up`` where that is so, for the name of its curve."""
        asked = self.speed.size + len(self.left_out)
        return f", {self.speed.size} of {asked} speeds, time was up" if self.left_out else ""

    def finding(self) -> str:
        """Below which depth the cut is stable, and the chatter above it."""
        if not np.isfinite(self.minimum_depth):
            known = "" if self.known_to is None else f" up to {self.known_to:g} Hz, above which nothing is known"
            return f"no chatter at any depth{known} ({self.method})"
        return (
            f"stable at {self.reach}{self.up_to} below {self.minimum_depth * 1e3:.4g} mm, chatter at "
            f"{self.minimum_frequency:.4g} Hz ({self.method}; chart of {_speeds(self.speed)})"
        )

    def columns(self) -> Columns:
        """A row per speed."""
        return {
            "speed": (np.ravel(self.speed), "rpm"),
            "depth": (np.ravel(self.depth), "m"),
            "chatter_frequency": (np.ravel(self.chatter_frequency), "Hz"),
            "kind": (np.ravel(self.kind), ""),
            "lobe": (np.ravel(self.lobe), ""),
        }

    def plot(self, ax: Any = None) -> Any:
        """Limiting depth in mm over speed in rpm."""
        axes = axes_of(ax)
        draw_limit(axes, self.speed, self.depth, self.left_out, label=f"{self.method}{self.short_of}")
        axes.set(xlabel="spindle speed [rpm]", ylabel="depth of cut [mm]", ylim=(0.0, None))
        return axes


def joined(known: Sequence[StabilityLobes]) -> StabilityLobes:
    """One chart of several, with ascending speeds."""
    order = np.argsort(np.concatenate([one.speed for one in known]))
    values: dict[str, Any] = {key: np.concatenate([getattr(one, key) for one in known])[order] for key in BY_SPEED}
    least = min(known, key=lambda one: one.minimum_depth)
    least_known = sorted(known, key=lambda one: float(np.min(one.known_below)))
    said = _widest([said for one in least_known for said in one.warnings])
    return replace(least, **values, warnings=said)


def _widest(said: list[str]) -> tuple[str, ...]:
    """Of sentences that differ by a bound alone (3e-05) the one with the largest; of unseen modes the first."""
    found = {}
    unseen = [sentence for sentence in said if sentence.startswith(UNSEEN)]
    said = [sentence for sentence in said if sentence not in unseen[1:]]
    for sentence in sorted(said, key=lambda one: max(map(float, _BOUND.findall(one)), default=0.0)):
        found[_BOUND.sub("", sentence)] = sentence
    return tuple(found.values())


def draw_limit(axes: Any, speed: Array, depth: Array, left_out: Sequence[float] = (), **look: Any) -> None:
    """A limit in m as a curve in mm over speed in rpm, with gaps where it is stable at any depth.

    Where speeds were ``left_out`` there are points, not joined over these.
    """
    speed, shown = np.ravel(speed), np.where(np.isfinite(depth), depth * 1e3, np.nan).ravel()
    if len(left_out):
        at = np.searchsorted(speed, left_out)
        speed, shown = np.insert(speed, at, left_out), np.insert(shown, at, np.nan)
        look = {"marker": "o", "markersize": 3, **look}
    axes.plot(speed, shown, **look)


def draw_charts(
    charts: Iterable[tuple[float, StabilityLobes]],
    ax: Any = None,
    others: Iterable[tuple[str, StabilityLobes | None]] = (),
) -> Any:
    """The limits of charts by tool-point amplitude (m), over each other, and those of other tools by name."""
    axes = axes_of(ax)
    for amplitude, chart in charts:
        label = f"limit at {amplitude * 1e6:g} µm" if amplitude else "onset of chatter"
        draw_limit(axes, chart.speed, chart.depth, chart.left_out, label=label + chart.short_of)
    for name, other in others:
        if other is not None:
            draw_limit(axes, other.speed, other.depth, other.left_out, label=name + other.short_of, linestyle="--")
    axes.set(xlabel="spindle speed [rpm]", ylabel="depth of cut [mm]", ylim=(0.0, None))
    name_curves(axes)
    return axes


def _speeds(speed: Array) -> str:
    low, high = float(np.min(speed)), float(np.max(speed))
    return f"{low:.6g} rpm" if low == high else f"{low:.6g} to {high:.6g} rpm"
