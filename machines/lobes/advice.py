"""What a set of lobe charts tells the one who sets the machine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .chart import StabilityLobes
from .cutting import Cutting
from .pocket import WANDER, pocket

_MATTERS = 0.05
"""Share by which the depth must change with amplitude before a sentence is made of it."""


def advice(charts: Sequence[tuple[float, StabilityLobes]], cutting: Cutting) -> tuple[str, ...]:
    """Sentences on the recommended pocket, the depth that is safe at every speed, and what amplitude does.

    ``charts`` holds (tool-point amplitude in m, chart) with the same speeds, amplitudes ascending. Where the limiting
    depth grows with amplitude, a vibration settles at the amplitude whose limit is the depth of the cut; where it
    falls, the vibration is a threshold above which it grows.
    """
    depths = np.array([chart.depth.ravel() for _, chart in charts])
    lowest = [chart.minimum_depth for _, chart in charts]
    k = int(np.argmin(lowest))
    speeds = charts[0][1].speed.ravel()
    best = pocket([chart for _, chart in charts], cutting)
    chatter = charts[k][1].minimum_frequency
    if not np.isfinite(lowest[k]):
        return ("No chatter was found at any speed and depth, inside the frequencies that were searched.",)
    where = "" if charts[k][1].branches else "in the range "
    said = []
    if best is not None:
        said.append(f"Recommended: {best.words()}; it holds for speeds {100 * WANDER:g} % off as well.")
    said.append(f"Below {_mm(lowest[k])} every speed {where}is stable (chatter would come at {chatter:.0f} Hz).")
    if len(charts) > 1 and charts[0][0] == 0:
        worst = int(np.argmin(depths[0]))
        first, last = depths[0, worst], depths[-1, worst]
        size, at = f"{charts[-1][0] * 1e6:g} µm", f"{speeds[worst]:.0f} rpm"
        if last > (1 + _MATTERS) * first:
            said.append(
                f"At {at} a vibration of {size} at the tool point dies out below {_mm(last)}: chatter that sets in "
                f"from {_mm(first)} on stays smaller than that, because the joints damp it more as it grows."
            )
        elif last < (1 - _MATTERS) * first:
            said.append(
                f"At {at} a vibration of {size} at the tool point, once started, lasts from {_mm(last)} on, below the "
                f"{_mm(first)} at which it starts by itself."
            )
    return tuple(said)


def _mm(depth: float) -> str:
    return f"{depth * 1e3:.3g} mm" if np.isfinite(depth) else "any depth"
