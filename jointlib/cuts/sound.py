"""The spectrum of a cut: what repeats with the revolution, the lines beside that, and the noise they stand out of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

FEWEST = 12
"""Revolutions."""
_WITHIN = 0.01
"""Share of the nominal speed within which the true one is looked for."""
STANDS_OUT = 10.0
"""Times the middle of the spectrum around it, in amplitude, from which on a line is one."""
_TRACE = 4.5
"""Times from which on a line is kept, to be found again in other records: no noise reaches that in a million lines."""
_AWAY, _BESIDE = 3.0, 1.25
"""Widths that a line is told from those of the spindle at, and those at which it is no longer a part of them."""
_WANDERS, _AT_MOST = 0.002, 0.1
"""Share of a frequency by which lines of a spindle that does not keep its speed are off, up to one of the speed."""
_LEAKS = 0.06
"""Amplitude over that of the line of the spindle from which on what stands beside it is something else."""
_AROUND, _AROUND_SHARE = 10.0, 0.03
"""Half of what is looked at around a line: in widths or as a share of its frequency, whichever is more. A hump that
noise makes of a mode is as wide as that, a line of chatter is not."""
_HUMP, _FALLS = 100.0, 15.0
"""Power over the middle of the whole spectrum from which on noise is a hump, and by which it falls to either side."""
_OCTAVES = 3.0
_PADDED = 4


@dataclass(frozen=True)
class Line:
    """A narrow line away from those of the spindle."""

    frequency: float
    """Hz."""
    power: float
    """Mean square, in the unit of the record."""
    above: float
    """Times the middle of the spectrum around it, in amplitude."""

    @property
    def loud(self) -> bool:
        """Whether it stands out enough to be told of its own record alone."""
        return self.above >= STANDS_OUT


@dataclass(frozen=True)
class Hump:
    """Noise about one frequency: a mode that noise shakes, or chatter too irregular for lines."""

    frequency: float
    """Hz of its top."""
    power: float


@dataclass(frozen=True, eq=False)
class Sound:
    """What the spectrum of a record holds; powers are mean squares in its unit.

    Parameters
    ----------
    turning
        Revolutions per second; 0 of a record without a cut, in which every line is one.
    width
        Hz of a line.
    lines
        Away from those of the spindle, by frequency.
    repeated
        Power of the lines of the spindle.
    noise
        Power of what is left.
    faintest
        Power that a line must have to stand out.
    beside
        Power so close to lines of the spindle that nobody can tell what it is.
    tooth, half, others
        Largest power of a line of the teeth, halfway between two of them, and of the revolution elsewhere.
    half_frequency, other_frequency
        Hz of the line halfway, and of that elsewhere.
    in_step
        Power of all lines of the revolution that are none of the teeth.
    hump
        The highest of the noise, None where it is flat or grows to one side only.
    floor
        The middle of the spectrum around frequencies in Hz: (frequencies, levels), and that of the whole.
    said
        Half sentences on what was left out of the record.
    useless
        Why the record cannot tell of its cut; empty where it can.
    """

    turning: float
    teeth: int
    width: float
    lines: tuple[Line, ...]
    repeated: float
    noise: float
    faintest: float
    beside: float
    tooth: float
    half: float
    others: float
    half_frequency: float
    other_frequency: float
    in_step: float
    hump: Hump | None
    floor: tuple[Array, Array, float]
    said: tuple[str, ...] = ()
    useless: str = ""

    def over(self, frequency: float) -> tuple[float, float]:
        """The middle of the spectrum around a frequency, and that over the middle of the whole."""
        level = float(np.interp(frequency, *self.floor[:2]))
        return level, level / self.floor[2]

    def hides(self, frequency: float) -> bool:
        """Whether a line there cannot be told from those of the spindle."""
        if self.turning == 0:
            return False
        order = frequency / self.turning
        wanders = min(_WANDERS * frequency, _AT_MOST * self.turning)
        return abs(order - round(order)) * self.turning <= max(_AWAY * self.width, _BESIDE * self.width + wanders)


def listen(signal: Array, rate: float, speed: float, teeth: int, where: str) -> Sound:
    """The spectrum of a record, (samples,), of a cut at a nominal speed in rpm; 0 of one without a cut."""
    x = np.asarray(signal, dtype=float) - np.mean(signal)
    nominal = speed / 60
    if speed and len(x) / rate * nominal < FEWEST:
        turns = len(x) / rate * nominal
        raise InputError(f"{where}: holds {turns:.3g} revolutions, expected at least {FEWEST} to tell a cut by")
    if not np.any(x):
        raise InputError(f"{where}: never changes, expected the sound or vibration of a cut")
    size = _PADDED * 2 ** int(np.ceil(np.log2(len(x))))
    window = np.hanning(len(x))
    spectrum = 2 * np.abs(np.fft.rfft(x * window, size)) ** 2 / (size * np.sum(window**2))
    step, width = rate / size, 2 * rate / len(x)
    frequency = np.arange(len(spectrum)) * step
    turning = _turning(spectrum, step, nominal, teeth, rate / 2) if speed else 0.0
    order = frequency / turning if speed else np.full(len(frequency), 0.5)
    apart = np.abs(order - np.round(order)) * turning if speed else np.full(len(frequency), np.inf)
    reach = _BESIDE * width + np.minimum(_WANDERS * frequency, _AT_MOST * turning)
    audible = (frequency > (0.5 * turning if speed else width)) & (frequency < 0.8 * rate / 2)
    away = audible & (apart > np.maximum(_AWAY * width, reach))
    at, level = _floor(spectrum, frequency, away, width)
    floor = np.maximum(np.interp(frequency, at, level), 1e-14 * float(np.max(spectrum)))
    lines = _lines(spectrum, floor, away, step)
    spindle = audible & ~away
    above = np.where(spectrum > _TRACE**2 * floor, spectrum - floor, 0.0)
    beside = spindle & (apart > reach)
    near = np.interp(np.round(order) * turning, frequency, spectrum) if speed else spectrum
    foreign = float(np.sum(above[beside & (spectrum > _LEAKS**2 * near) & (spectrum > STANDS_OUT**2 * floor)]))
    repeated = float(np.sum(above[spindle])) - foreign
    held = spindle & ~beside
    base = float(np.median(floor[away])) if np.any(away) else 0.0
    cell = 1.5 * size / len(x)  # lines of the padded spectrum that the power of one line of the window is spread over
    of_teeth = np.round(order).astype(int) % teeth == 0
    halfway = np.zeros(len(order), dtype=bool)
    if teeth % 2 == 0:
        halfway = (np.round(order).astype(int) % (teeth // 2) == 0) & ~of_teeth
    elsewhere = held & ~of_teeth & ~halfway
    tops = [int(np.argmax(np.where(some, spectrum, 0.0))) for some in (held & halfway, elsewhere)]
    half_frequency, other_frequency = (_refined(spectrum, top) * step for top in tops)
    return Sound(
        turning=turning,
        teeth=teeth,
        width=width,
        lines=lines,
        repeated=repeated,
        noise=max(float(np.mean(x**2)) - repeated - foreign - sum(line.power for line in lines), 0.0),
        faintest=STANDS_OUT**2 * cell * base,
        beside=foreign,
        tooth=cell * float(np.max(above, where=held & of_teeth, initial=0.0)),
        half=cell * float(np.max(above, where=held & halfway, initial=0.0)),
        others=cell * float(np.max(above, where=elsewhere, initial=0.0)),
        half_frequency=half_frequency,
        other_frequency=other_frequency,
        in_step=float(np.sum(above[held & ~of_teeth])),
        hump=_hump(frequency[audible], floor[audible], base),
        floor=(at, level, base),
    )


def _turning(spectrum: Array, step: float, nominal: float, teeth: int, highest: float) -> float:
    """Revolutions per second at which the harmonics of the teeth hold most, evenly weighed so that none decides."""
    orders = teeth * np.arange(1, 7)
    orders = orders[orders * nominal < 0.8 * highest]
    if not len(orders):
        return nominal
    fine = step / orders[-1]
    tried = nominal + fine * np.arange(-int(_WITHIN * nominal / fine), int(_WITHIN * nominal / fine) + 1)
    level = np.log(spectrum + max(float(np.median(spectrum)), 1e-12 * float(np.max(spectrum))))
    held = np.sum(np.interp(orders[:, None] * tried, np.arange(len(level)) * step, level), axis=0)
    return float(tried[np.argmax(held)])


def _floor(spectrum: Array, frequency: Array, away: Array, width: float) -> tuple[Array, Array]:
    """Frequencies, and the middle of the spectrum around each of them without the lines of the spindle."""
    at, level, f = [], [], float(width)
    values, places = spectrum[away], frequency[away]
    while f < frequency[-1]:
        half = max(_AROUND * width, _AROUND_SHARE * f)
        first, last = np.searchsorted(places, (f - half, f + half))
        if first < last and places[last - 1] - places[first] > width:
            at.append(f)
            level.append(float(np.median(values[first:last])))
        f += half / 2
    if not at:
        at, level = [0.0], [float(np.median(values if len(values) else spectrum))]
    return np.array(at), np.array(level)


def _hump(frequency: Array, floor: Array, base: float) -> Hump | None:
    """The highest place of the noise, where it is far above the rest and falls to both sides."""
    top = int(np.argmax(floor)) if len(floor) else 0
    if base <= 0 or floor[top] < _HUMP * base:
        return None
    below, beyond = np.searchsorted(frequency, (frequency[top] / _OCTAVES, frequency[top] * _OCTAVES))
    if max(np.min(floor[below : top + 1]), np.min(floor[top:beyond])) > floor[top] / _FALLS:
        return None
    return Hump(float(frequency[top]), float(np.sum(floor[floor > floor[top] / _HUMP])) / float(np.log(2)))


def _lines(spectrum: Array, floor: Array, away: Array, step: float) -> tuple[Line, ...]:
    """What stands out as far as it stands out, each top with its flanks."""
    high = np.logical_and(away, spectrum > 4 * floor)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], high, [False])).astype(int)))
    found = []
    for first, last in edges.reshape(-1, 2):
        part, below = spectrum[first:last], floor[first:last]
        top = int(np.argmax(part / below))
        above = float(np.sqrt(part[top] / below[top]))
        if above >= _TRACE:
            place = _refined(spectrum, first + int(np.argmax(part))) * step
            found.append(Line(float(place), float(np.sum(part - below)), above))
    return tuple(found)


def _refined(spectrum: Array, line: int) -> float:
    """The top of a line by a parabola through the logarithms around it, in lines."""
    if not 0 < line < len(spectrum) - 1 or np.any(spectrum[line - 1 : line + 2] <= 0):
        return float(line)
    a, b, c = np.log(spectrum[line - 1 : line + 2])
    bend = a - 2 * b + c
    return float(line + (0.5 * (a - c) / bend if bend < 0 else 0.0))
