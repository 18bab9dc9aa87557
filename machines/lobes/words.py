"""What depth and amplitude mean at a chosen speed, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .threshold import AmplitudeLimits, Cycle

_SAME = 1e-3
"""Share by which depths must differ before a zone between them is spoken of."""
_EXAMPLE = 0.5


def told(limits: AmplitudeLimits, index: int = 0) -> tuple[str, ...]:
    """The safe depth at one speed, the zone where a knock starts chatter, and where chatter starts by itself."""
    at = f"{limits.speed[index]:g} rpm"
    low, high = limits.bistable[index].tolist()
    reach = um(limits.largest[index])
    if not np.isfinite(low):
        return (f"At {at} no vibration of up to {reach} at the tool lasts, at any depth.",)
    said = [f"At {at} every vibration of up to {reach} at the tool dies out below {mm(low)}."]
    if high > (1 + _SAME) * low:
        depth = low + _EXAMPLE * (high - low) if np.isfinite(high) else 1.1 * low
        knocks = [c.amplitude for c in limits.cycles(depth, index) if not c.stable]
        example = f" (at {mm(depth)} one of more than {um(knocks[0])})" if knocks else ""
        upper = f"Between that and {mm(high)}" if np.isfinite(high) else "Above that"
        said.append(f"{upper} the cut is quiet unless a knock{example} starts a chatter that then lasts.")
    if np.isfinite(high):
        said.append(
            f"Above {mm(high)} it chatters by itself at {limits.onset_frequency[index]:.1f} Hz"
            f"{_settling(limits, high, index)}."
        )
    return tuple(said)


def told_at(limits: AmplitudeLimits, depth: float, index: int = 0) -> str:
    """What becomes of vibrations at one speed and a depth in m."""
    cycles, largest = limits.cycles(depth, index), limits.largest[index]
    grows = cycles[0].stable if cycles else depth > limits.depth[0, index]
    return f"At {limits.speed[index]:g} rpm and {mm(depth)} {story(grows, cycles, largest, f'of up to {um(largest)}')}."


def story(grows: bool, cycles: Sequence[Cycle], largest: float, sizes: str) -> str:
    """From the smallest vibration to the largest (m): whether the smallest grows, and what changes at each cycle."""
    if not cycles:
        return f"vibrations {sizes} at the tool {'grow' if grows else 'die out'}"
    first, *rest = cycles
    parts = [
        f"chatter starts by itself and settles at {_size(first)}"
        if grows
        else f"vibrations below {um(first.amplitude)} at the tool die out"
    ]
    parts += [
        f"larger ones settle at {_size(c)}" if c.stable else f"a knock beyond {um(c.amplitude)} makes it grow again"
        for c in rest
    ]
    if not cycles[-1].stable:
        parts.append("larger ones grow" if len(cycles) == 1 else f"beyond {um(largest)} too")
    return ", ".join(parts)


def _settling(limits: AmplitudeLimits, onset: float, index: int) -> str:
    """Where chatter just above its onset settles, if inside the amplitudes looked at."""
    stable = [c for c in limits.cycles(1.02 * onset, index) if c.stable]
    return f"; 2 % above, it settles at {_size(stable[0])}" if stable else ""


def _size(cycle: Cycle) -> str:
    return f"{um(cycle.amplitude)} ({cycle.frequency:.1f} Hz)"


def um(size: float) -> str:
    """A length in µm, three digits."""
    return f"{size * 1e6:.3g} µm"


def mm(depth: float) -> str:
    """A depth in mm, three digits."""
    return f"{depth * 1e3:.3g} mm"
