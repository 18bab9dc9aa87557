"""What depth and amplitude do together, speed by speed: safe, bistable, chatter of finite size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..process.chart import StabilityLobes
from .amplitude_limits import AmplitudeLimits


@dataclass(frozen=True, eq=False)
class Zones:
    """Depths in m at each speed, (n,), over an ``amplitude`` axis of the tool point in m.

    Up to ``safe`` every vibration dies out; from there to ``onset`` one that is large enough lasts (bistable); from
    ``onset`` to ``ceiling`` chatter starts by itself and meets an amplitude at which it no longer grows.
    """

    safe: Array
    onset: Array
    ceiling: Array
    amplitude: Array

    @classmethod
    def of(cls, limits: AmplitudeLimits) -> Zones:
        """From limits over amplitude."""
        highest = np.fmax.reduce(limits.depth, axis=0)
        return cls(limits.safe, limits.onset, np.fmax(limits.onset, highest), limits.amplitude)

    @classmethod
    def between(cls, charts: Sequence[tuple[float, StabilityLobes]]) -> Zones | None:
        """From charts at some amplitudes (m); None unless one of them is the onset and one is not."""
        onset = next((chart.depth.ravel() for amplitude, chart in charts if amplitude == 0), None)
        if onset is None or len(charts) < 2:
            return None
        depths = [chart.depth.ravel() for _, chart in charts]
        return cls(
            np.min(depths, axis=0), onset, np.max(depths, axis=0), np.array(sorted(size for size, _ in charts if size))
        )

    @property
    def reach(self) -> str:
        """The amplitudes behind it, in words."""
        return f"over {len(self.amplitude)} amplitudes of up to {self.amplitude[-1] * 1e6:.3g} µm"


def safe_limit(charts: Sequence[StabilityLobes], zones: Zones | None, band: Array | None) -> Array:
    """The depth in m to stay under at each speed: the lowest over amplitudes, and over 95 % of what is uncertain."""
    parts = [chart.sure.ravel() for chart in charts]
    parts += [] if zones is None else [zones.safe]
    parts += [] if band is None else [band[0]]
    return np.asarray(np.fmin.reduce(parts))
