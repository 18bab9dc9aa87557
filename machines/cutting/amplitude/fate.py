"""What becomes of a vibration in a cut: it dies out, settles, or grows beyond what is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ...indices import Mask
from .amplitude_limits import AmplitudeLimits, Cycle
from .unstable_depths import UnstableDepths

NEAR, ABOUT = 0.08, 0.2
"""Shares by which an amplitude may be missed in turning, and in milling, where it is told as "about"."""
_STARTS, _LEAST, _WITHIN = 9, 0.004, 1 + 1e-9
SMALLEST = 0.03
"""Share of what is known up to which a vibration is one of the smallest."""


@dataclass(frozen=True)
class Fate:
    """What becomes of vibrations of up to ``reach`` (m) at one speed (rpm) and depth (m).

    The smallest grow or die out, and at each cycle, by ascending amplitude, that turns round. ``hertz`` is about the
    frequency of the chatter, ``milled`` whether amplitudes are known to a quarter only.
    """

    speed: float
    depth: float
    grows: bool
    cycles: tuple[Cycle, ...]
    reach: float
    hertz: float
    milled: bool
    above: bool = False
    """Above a first lens, where limits over amplitude say nothing."""

    def end(self, start: float) -> float:
        """The amplitude in m at which a vibration of ``start`` (m) ends: 0, that of a cycle, or inf beyond all."""
        below = [0.0, *(c.amplitude for c in self.cycles if c.amplitude <= start)]
        above = [*(c.amplitude for c in self.cycles if c.amplitude > start), np.inf]
        return above[0] if self.grows == (len(below) % 2 == 1) else below[-1]

    @property
    def starts(self) -> Array:
        """Amplitudes in m of which the end is told for certain: none close to a threshold."""
        tried = np.geomspace(_LEAST, 1 / (1 + self.near), _STARTS) * self.reach
        return np.asarray(tried[self.certain(tried)])

    @property
    def near(self) -> float:
        """Share by which an amplitude may be missed."""
        return ABOUT if self.milled else NEAR

    def certain(self, start: Array) -> Mask:
        """Of which amplitudes in m the end is told for certain."""
        edges = np.array([c.amplitude for c in self.cycles if not c.stable])
        apart = np.all(np.abs(np.log(start[:, None] / edges)) > self.near, axis=1)
        return np.asarray(apart & (start * (1 + self.near) < _WITHIN * self.reach))


def fate_at(
    limits: AmplitudeLimits,
    depth: float,
    index: int = 0,
    lenses: UnstableDepths | None = None,
    multiplier: float | None = None,
) -> Fate:
    """What limits over amplitude say of vibrations at one speed and a depth in m.

    They are those of the first crossing. So nothing but the fate of the smallest is known above the first lens, nor
    where the ``multiplier`` of the smallest is below 1 though the depth is above the onset.
    """
    speed, reach, milled = float(limits.speed[index]), float(limits.known[index]), limits.method != "turning"
    hertz = float(limits.onset_frequency[index])
    above = lenses is not None and bool(lenses.lenses) and depth > lenses.lenses[0].high
    if multiplier is not None and multiplier < 1 and depth > limits.onset[index]:
        above = True
    if above:
        grows = multiplier > 1 if multiplier is not None else lenses is not None and lenses.unstable(depth)
        return Fate(speed, depth, grows, (), SMALLEST * reach, hertz, milled, True)
    cycles = tuple(c for c in limits.cycles(depth, index) if c.amplitude < reach)
    grows = cycles[0].stable if cycles else limits.starts_by_itself(depth, index)
    return Fate(speed, depth, grows, cycles, reach, hertz, milled)
