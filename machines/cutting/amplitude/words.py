"""What depth and amplitude mean at a chosen speed, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .amplitude_limits import AmplitudeLimits, Cycle
from .fate import Fate
from .unstable_depths import UnstableDepths

_SAME = 1e-3
"""Share by which depths must differ before a zone between them is spoken of."""
_EXAMPLE = 0.5


def told(limits: AmplitudeLimits, index: int = 0, teeth: tuple[float, float] | None = None) -> tuple[str, ...]:
    """The safe depth at one speed, the zone where a knock starts chatter, and where chatter starts by itself.

    Said of vibrations up to `AmplitudeLimits.known` only. With ``teeth``, the depth and the vibration in m that their
    joints are shaken by, all of them are those beside it; far above that depth the teeth may quench what starts.
    """
    at = f"At {limits.speed[index]:g} rpm"
    at += "" if teeth is None else f", beside the {um(teeth[1])} that the teeth of a cut of {mm(teeth[0])} force,"
    reach, high = float(limits.known[index]), float(limits.onset[index])
    low = limits.safe_up_to(reach, index)
    if not np.isfinite(low):
        return (f"{at} no vibration of up to {um(reach)} at the tool lasts, at any depth.",)
    said = [f"{at} every vibration of up to {um(reach)} at the tool dies out below {mm(low)}."]
    if high > (1 + _SAME) * low:
        depth = low + _EXAMPLE * (high - low) if np.isfinite(high) else 1.1 * low
        knocks = [c.amplitude for c in limits.cycles(depth, index) if not c.stable and c.amplitude < reach]
        example = f" (at {mm(depth)} one of more than {um(knocks[0], _milled(limits))})" if knocks else ""
        upper = f"Between that and {mm(high)}" if np.isfinite(high) else "Above that"
        said.append(f"{upper} the cut is quiet unless a knock{example} starts a chatter that then lasts.")
    if np.isfinite(high):
        above, deeper = (
            ("Above", "") if teeth is None else ("Just above", " (deeper, the teeth may quench it: --depth)")
        )
        said.append(
            f"{above} {mm(high)} it chatters by itself at {limits.onset_frequency[index]:.1f} Hz"
            f"{_settling(limits, high, index)}{deeper}."
        )
    return tuple(said)


def told_so_far(limits: AmplitudeLimits, budget: float) -> list[str]:
    """The lowest depths of limits that ended with their time, of ``budget`` s; what lies between is not told."""
    sizes = limits.amplitude
    said = [
        f"Time was up after {budget:.3g} s: limits over amplitude are known at {len(sizes)} amplitudes from "
        f"{um(sizes[0])} to {um(sizes[-1])}; what lies between them and becomes of a cut was not looked for."
    ]
    for rpm, low, size in zip(limits.speed, limits.safe, limits.safe_amplitude, strict=True):
        at = f"at {um(size)}" if size else "of the smallest vibrations"
        said.append(
            f"At {rpm:g} rpm the lowest of them is {mm(low)}, {at}."
            if np.isfinite(low)
            else f"At {rpm:g} rpm none of them bounds the depth."
        )
    return said


def of_fate(fate: Fate, reach: str, forced: float = 0.0) -> str:
    """A fate in a sentence; ``reach`` says up to where amplitudes are known."""
    at = f"At {fate.speed:g} rpm and {mm(fate.depth)}"
    at += f", beside the {um(forced)} that the teeth force," if forced else ""
    if fate.above:
        grow = "grow" if fate.grows else "die out"
        at = at.rstrip(",")
        return f"{at}, above a lens, the smallest vibrations {grow}; what becomes of larger ones is not computed there."
    if not fate.cycles and fate.grows:
        return f"{at} chatter starts by itself and grows beyond {reach}."
    end = f", looked at up to {reach}" if fate.cycles and fate.cycles[-1].stable else ""
    told = story(fate.grows, fate.cycles, reach, f"of up to {um(fate.reach)}", fate.milled)
    return f"{at} {told}{end}."


def moved_by_teeth(limits: AmplitudeLimits, depth: float, index: int = 0) -> str:
    """Of a cut beside whose teeth nothing is known."""
    at = f"At {limits.speed[index]:g} rpm and {mm(depth)}"
    return f"{at} the teeth shake the joints; what becomes of chatter beside that, a simulation tells (--witness)."


def reach_words(limits: AmplitudeLimits, index: int = 0) -> str:
    """The largest amplitude that sentences are made of, and why it is that."""
    reach = float(limits.known[index])
    return um(reach) + (", where edges begin to leave the cut" if reach < limits.largest[index] else "")


LOWER_EDGE = (
    "What is said of amplitude there holds at the lower edge of the first unstable zone: at the upper edge of a lens "
    "thresholds and stable cycles change places."
)


def told_lenses(found: UnstableDepths) -> tuple[str, ...]:
    """Where the cut is stable again above its limiting depth; nothing where it is not."""
    if not found.lenses:
        return ()
    zones = [f"{_between('from', 'to', one.low, one.high)} ({one.kind})" for one in found.intervals]
    ends = [*(one.low for one in found.intervals[1:]), np.inf]
    gaps = [_between("between", "and", one.high, end) for one, end in zip(found.intervals, ends, strict=True)]
    gaps = gaps[: len(found.lenses)]
    return (
        f"At {found.speed:g} rpm it chatters {' and '.join(zones)}; it is stable again {' and '.join(gaps)}, "
        f"looked at up to {mm(found.deepest)}.",
    )


def _between(first: str, last: str, low: float, high: float) -> str:
    """Two depths in m as a stretch in mm, or what is above the first."""
    if not np.isfinite(high):
        return f"above {low * 1e3:.4g} mm"
    return f"{first} {low * 1e3:.4g} {last} {high * 1e3:.4g} mm"


def story(grows: bool, cycles: Sequence[Cycle], largest: str, sizes: str, about: bool = False) -> str:
    """From the smallest vibration to the largest: whether the smallest grows, and what changes at each cycle.

    With ``about`` the amplitudes of the cycles are told as known to a quarter.
    """
    if not cycles:
        return f"vibrations {sizes} at the tool {'grow' if grows else 'die out'}"
    first, *rest = cycles
    parts = [
        f"chatter starts by itself and settles at {_size(first, about)}"
        if grows
        else f"vibrations below {um(first.amplitude, about)} at the tool die out"
    ]
    parts += [
        f"larger ones settle at {_size(c, about)}"
        if c.stable
        else f"a knock beyond {um(c.amplitude, about)} makes it grow beyond {largest}"
        if c is cycles[-1]
        else f"a knock beyond {um(c.amplitude, about)} makes it grow again"
        for c in rest
    ]
    if len(cycles) == 1 and not first.stable:
        parts.append(f"larger ones grow beyond {largest}")
    return ", ".join(parts)


def _settling(limits: AmplitudeLimits, onset: float, index: int) -> str:
    """Where chatter just above its onset settles, if inside the amplitudes looked at."""
    stable = [c for c in limits.cycles(1.02 * onset, index) if c.stable and c.amplitude < limits.known[index]]
    return f"; 2 % above, it settles at {_size(stable[0], _milled(limits))}" if stable else ""


def _size(cycle: Cycle, about: bool) -> str:
    at = f" ({cycle.frequency:.1f} Hz)" if np.isfinite(cycle.frequency) else ""
    return f"{um(cycle.amplitude, about)}{at}"


def _milled(limits: AmplitudeLimits) -> bool:
    """Whether the tool holds further lines beside the chatter line, which a joint held on that one does not feel."""
    return limits.method != "turning"


def um(size: float, about: bool = False) -> str:
    """A length in µm, three digits; or two, about."""
    return f"about {size * 1e6:.2g} µm" if about else f"{size * 1e6:.3g} µm"


def mm(depth: float) -> str:
    """A depth in mm, three digits."""
    return f"{depth * 1e3:.3g} mm"
