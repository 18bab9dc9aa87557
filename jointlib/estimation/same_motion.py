"""Displacement, velocity and acceleration of one point: whether one is the derivative of the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.estimation.settings import EXCITED
from jointlib.lab.unit_smell import RATES, UNITS, smell_of
from jointlib.measurement import QUANTITIES, Channel, Measurement, Record

_ORDER = {"displacement": 0, "position": 0, "velocity": 1, "acceleration": 2}
_BLOCKS, _LONGEST, _SHORTEST = 8, 4096, 32
"""Blocks that the shortest record is cut into, and samples of the longest and shortest of them."""
_COHERENT = 0.9
"""Coherence of lines in which both channels have signal; it bounds what their noise does to the factor to 10 %."""
_MOST = 0.9
"""Share of those lines that must say the same."""
_REFUSED, _TOLD = 1.3, 1.05
"""Factors from which on channels are refused, and told, to differ."""
_FLAT = 2.0
"""Ratio of the factors of those lines above which they are none of a unit: another point, or a filter."""
_DENSE = 8
"""Samples of a period on the highest line that is used."""
_LITTLE = 1e-3
"""Share of the largest power below which a line tells no delay."""
_LATE, _SIGMAS, _TURN = 1.5, 6.0, 0.1
"""Samples, standard errors and radians from which on a delay is told."""


@dataclass(frozen=True)
class _Gain:
    """Upper channel over the derivative of the lower one, on the lines in which both have signal."""

    frequency: Array
    value: ComplexArray
    weight: Array
    """Power of the upper channel."""
    rate: float


def refuse_other_motion(m: Measurement, records: Sequence[Record]) -> list[str]:
    """Sentences on channels of one point that differ a little; `InputError` where they contradict each other."""
    wrong, doubted = list[str](), list[str]()
    for channels in _points(m):
        for lower, upper in combinations(channels, 2):
            gain = _gain(lower, upper, records)
            if gain is not None:
                fault, doubt = _said(lower, upper, gain)
                wrong += [f"{m.source}: {fault}"] if fault else []
                doubted += [doubt] if doubt else []
    if wrong:
        raise InputError(*wrong)
    return doubted


def _points(m: Measurement) -> list[list[Channel]]:
    """Channels of motion by the point they are of, the one of each quantity that is used, displacements first."""
    if m.kind == "path":
        travel = "displacement" if m.of("displacement") else "position"
        return [[found[0] for q in (travel, "velocity", "acceleration") if (found := _of(m, q))]]
    if m.kind not in EXCITED:
        return []
    wanted = ("displacement", "velocity", "acceleration")
    places = dict.fromkeys(c.dof for c in m.channels if c.dof is not None and c.quantity in wanted)
    by_place = [[[c for c in _of(m, q) if c.dof == place] for q in wanted] for place in places]
    return [[found[0] for found in quantities if found] for quantities in by_place]


def _of(m: Measurement, quantity: str) -> list[Channel]:
    """Channels of a quantity in its unit; volts that are no sensor's tell no motion."""
    return [c for c in m.of(quantity) if c.si_unit == QUANTITIES[quantity]]


def _gain(lower: Channel, upper: Channel, records: Sequence[Record]) -> _Gain | None:
    """By Welch's method over all records; None where no line has signal in both.

    Both are differentiated before they are windowed, so that what a window does, it does to both. |H| is the root of
    the ratio of their powers, between H1 and H2; the central differences are taken back.
    """
    order = _ORDER[upper.quantity] - _ORDER[lower.quantity]
    length = min(max(min(len(r) for r in records) // _BLOCKS, _SHORTEST), _LONGEST)
    used = [r for r in records if len(r) >= 2 * length and r.sample_rate == records[0].sample_rate]
    if not used or not used[0].sample_rate:
        return None
    rate, power = used[0].sample_rate, list[tuple[Array, Array, ComplexArray]]()
    for r in used:
        x, y = r.channels[lower.name], r.channels[upper.name]
        for _ in range(order):
            x = np.gradient(x, 1 / rate)
        x, y = x[order:-order], y[order:-order]
        own = [scipy.signal.csd(a, b, rate, nperseg=length)[1] * len(x) for a, b in ((x, x), (y, y), (x, y))]
        power.append((own[0].real, own[1].real, own[2]))
    of_x, of_y, between = (np.sum([p[i] for p in power], axis=0) for i in range(3))
    frequency = scipy.fft.rfftfreq(length, 1 / rate)
    coherent = np.abs(between) ** 2 > _COHERENT * of_x * of_y
    kept = coherent & (of_x > 0) & (of_y > 0) & (frequency > 0) & (frequency < rate / _DENSE)
    if not np.any(kept):
        return None
    f = frequency[kept]
    step = 2 * np.pi * f / rate
    size = np.sqrt(of_y[kept] / of_x[kept]) * (np.sin(step) / step) ** order
    return _Gain(f, size * np.exp(1j * np.angle(between[kept])), of_y[kept], rate)


def _said(lower: Channel, upper: Channel, gain: _Gain) -> tuple[str, str]:
    """What is wrong beyond doubt with two channels, and what is doubtful; empty where nothing is."""
    size, phase = np.abs(gain.value), np.angle(gain.value)
    low, high = (float(np.quantile(size, share)) for share in (1 - _MOST, _MOST))
    flat = high < _FLAT * low
    turned = bool(flat and np.mean(np.cos(phase) < -np.sqrt(0.5)) >= _MOST)
    off = flat and (low > _REFUSED or high < 1 / _REFUSED)
    factor = float(np.sqrt(np.average(size**2, weights=gain.weight)))
    derivative = "second derivative" if _ORDER[upper.quantity] - _ORDER[lower.quantity] == 2 else "derivative"
    one, other = f"{upper.quantity} {upper.name!r}", f"the {derivative} of {lower.quantity} {lower.name!r}"
    times = (
        f"is {-factor if turned else factor:.4g} times {other} ({gain.frequency[0]:.3g} to {gain.frequency[-1]:.3g} Hz)"
    )
    if off or turned:
        smell = smell_of(factor, {**UNITS, **RATES})
        words = [f"a unit ({smell[1]})" if smell else "a range or sensitivity"] if off else []
        words += ["a turned sign"] if turned else []
        return (
            f"{one} {times}, expected once; that smells of {' and '.join(words)}: mend unit, gain or direction of the "
            "[[channel]] that is wrong, or take one of the two out"
        ), ""
    doubts = [f"{one} {times}; look at unit, gain and range of both."] if low > _TOLD or high < 1 / _TOLD else []
    late = _delay(gain, phase)
    if late:
        word = "after" if late > 0 else "before"
        doubts.append(f"{one} comes {abs(late) * 1e3:.3g} ms {word} {other}: a filter, or a clock of its own.")
    return "", " ".join(doubts)


def _delay(gain: _Gain, phase: Array) -> float:
    """s by which one comes after the other, −φ/ω of weighted least squares; 0 where that is not beyond doubt."""
    told = gain.weight > _LITTLE * np.max(gain.weight)
    omega, phase, weight = 2 * np.pi * gain.frequency[told], phase[told], gain.weight[told]
    if len(omega) < 3 or np.max(np.abs(phase)) > np.pi / 2:
        return 0.0
    power = float(np.sum(weight * omega**2))
    late = -float(np.sum(weight * phase * omega)) / power
    error = float(np.sqrt(np.sum(weight * (phase + late * omega) ** 2) / (len(omega) - 1) / power))
    clear = abs(late) > max(_LATE / gain.rate, _SIGMAS * error) and abs(late) * omega[-1] > _TURN
    return late if clear else 0.0
