"""Frequency and damping over amplitude, and the stiffness and damping of the mode that follow from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.measurement import Measurement, Record
from jointlib.ringdown.cosine_fits import Pieces, pieces_of
from jointlib.ringdown.crossings import by_crossings
from jointlib.ringdown.decay import Decay, free_decay, motion_of
from jointlib.ringdown.half_cycles import half_cycles
from jointlib.ringdown.modes import modes_of
from jointlib.ringdown.strokes import strokes

_LEAST = 5
"""Pieces that make a backbone."""
_ORDER = 5
"""Of the polynomial in ln A that the points of one decay are held against."""
_SWINGS = 0.25
"""Of its mean; by which damping may leave a smooth curve over amplitude before it is a beat."""
_FORM = 0.03
"""Of its span, by which a backbone may differ from a polynomial."""
_CHECKED = 30.0
"""Times the noise, above which zero crossings tell as much."""


@dataclass(frozen=True)
class Backbone:
    """One mode in one decay: arrays over its pieces, largest amplitude first."""

    record: str
    condition: str
    time: Array
    """s after the beginning of the record."""
    amplitude: Array
    """m, peak, at the place of the channel."""
    omega: Array
    """rad/s."""
    damping_ratio: Array
    omega_error: Array
    ratio_error: Array
    stiffness: Array
    """Over the modal mass, 1/s²."""
    damping: Array
    """Over the modal mass, 1/s."""
    stiffness_error: Array
    damping_error: Array
    second: Array
    """Second harmonic over the first; nan where a filter took it away."""
    second_error: Array
    checked: tuple[float, float]
    """Median of ω and of ζ by zero crossings over those told here, minus 1; nan where noise hides them."""
    alone: bool
    """No other mode stands out of the record."""
    messages: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.amplitude)

    @property
    def gain(self) -> ComplexArray:
        """k + jωc over the modal mass, 1/s²: what the describing function of everything that holds the mode is."""
        return np.asarray(self.stiffness + 1j * self.omega * self.damping)

    @cached_property
    def smoothed(self) -> Array:
        """k and ωc over the modal mass, 1/s², noise smoothed, shape (2, pieces)."""
        loss, error = self.omega * self.damping, self.omega * self.damping_error
        return np.array([
            _smooth(self.amplitude, self.stiffness, self.stiffness_error),
            _smooth(self.amplitude, loss, error),
        ])  # fmt: skip


class TooShort(InputError):
    """A decay that is over before it tells frequency and damping over amplitude."""


def backbones(measurement: Measurement, records: Sequence[Record]) -> tuple[tuple[Backbone, ...], ...]:
    """By record, the modes that stand out of it, the largest first; a decay that is too short is left out and said,
    as those from small levels are where there is much dry friction."""
    found, short = list[tuple[Backbone, ...]](), list[TooShort]()
    channel = motion_of(measurement).name
    parts = [strokes(record, channel, measurement.band) for record in records]
    for record in (part for some in parts for part in some):
        try:
            found.append(of_decay(free_decay(measurement, record), measurement))
        except TooShort as error:
            short.append(error)
    if not found and short:
        raise short[0]
    said = [
        f"{record.name}: {len(some)} strokes one after the other, told apart by their rows."
        for record, some in zip(records, parts, strict=True)
        if len(some) > 1
    ]
    said += [f"{one}. It is left out." for one in short]
    if said:
        first, *others = found[0]
        found[0] = (replace(first, messages=(*said, *first.messages)), *others)
    return tuple(found)


def of_decay(decay: Decay, measurement: Measurement) -> tuple[Backbone, ...]:
    """The modes in one decay."""
    modes = modes_of(decay, measurement.band)
    found = list[Backbone]()
    for mode in modes:
        pieces = pieces_of(decay, mode)
        if len(pieces) < _LEAST:
            if found:
                continue
            pieces = half_cycles(decay) if mode.width is None else pieces
        if len(pieces) < _LEAST:
            frequency = float(np.median(pieces.omega)) / (2 * np.pi) if len(pieces) else mode.frequency
            raise TooShort(
                f"{decay.name}: {len(pieces)} pieces of the motion at {frequency:.4g} Hz stand out of the noise and "
                f"fall slowly enough to have a damping, expected {_LEAST}: a higher level, a longer record, less noise"
            )
        checked = _check(decay, pieces, by_crossings(decay, mode, pieces))
        said = (*(() if found else decay.messages), *((mode.message,) if mode.message else ()))
        found.append(_backbone(decay, pieces, checked, said, len(modes) == 1 and mode.width is None))
    return tuple(found)


def _check(decay: Decay, pieces: Pieces, other: tuple[Array, Array]) -> tuple[float, float]:
    clear = pieces.amplitude * pieces.omega**decay.order > _CHECKED * decay.noise
    ratio = [x / y - 1 for x, y in zip(other, (pieces.omega, pieces.decay), strict=True)]
    usable = [r[clear & np.isfinite(r)] for r in ratio]
    return tuple(float(np.median(r)) if len(r) else float("nan") for r in usable)  # type: ignore[return-value]


def _backbone(
    decay: Decay, p: Pieces, checked: tuple[float, float], messages: tuple[str, ...], alone: bool
) -> Backbone:
    """Errors of stiffness and damping contain what that of the amplitude makes of them, and how far they scatter."""
    stiffness, damping = p.stiffness, p.damping
    by_log, by_omega, by_decay = p.errors
    stiffness_error, damping_error = 2 * p.omega * by_omega, 2 * by_decay
    for _ in range(2):
        slope = [
            np.gradient(_smooth(p.amplitude, v, e), np.log(p.amplitude))
            for v, e in ((stiffness, stiffness_error), (damping, damping_error))
        ]
        stiffness_error = np.hypot(2 * p.omega * by_omega, slope[0] * by_log)
        damping_error = np.hypot(2 * by_decay, slope[1] * by_log)
    scatter = [_scatter(p.amplitude, v, e) for v, e in ((stiffness, stiffness_error), (damping, damping_error))]
    _refuse_beat(decay, p, damping, damping_error * scatter[1])
    stiffness_error, damping_error = stiffness_error * scatter[0], damping_error * scatter[1]
    if max(scatter) > 3:
        messages = (
            *messages,
            f"{decay.name}: frequency and damping scatter {max(scatter):.2g} times more than the noise; errors are "
            "raised by that.",
        )
    size = np.hypot(p.omega, p.decay)
    return Backbone(
        decay.name,
        decay.condition,
        p.time + decay.first / decay.rate,
        p.amplitude,
        p.omega,
        p.decay / size,
        stiffness_error / (2 * p.omega),
        damping_error / (2 * size),
        stiffness,
        damping,
        stiffness_error,
        damping_error,
        p.second,
        p.second_error,
        checked,
        alone,
        messages,
    )


def _smooth(amplitude: Array, value: Array, error: Array) -> Array:
    """A polynomial in ln A through the points of one decay, of the logarithm of the value where all are positive."""
    u = np.log(amplitude)
    u = (u - np.mean(u)) / max(np.ptp(u), 1e-12)
    order = _order(len(u))
    if np.all(value > 0):
        return np.asarray(np.exp(np.polyval(np.polyfit(u, np.log(value), order, w=value / error), u)))
    return np.asarray(np.polyval(np.polyfit(u, value, order, w=1 / error), u))


def _order(count: int) -> int:
    return max(1, min(_ORDER, (count - 1) // 2))


def _scatter(amplitude: Array, value: Array, error: Array) -> float:
    """By how much the points leave a smooth curve more than their errors say, 1 at least; a bend is no noise."""
    order = _order(len(amplitude))
    smooth = _smooth(amplitude, value, error)
    left = np.maximum(np.abs(value - smooth) - _FORM * np.ptp(smooth), 0.0) / error
    free = np.sqrt(max(1.0, len(left) - order - 1) / len(left))
    return float(max(1.0, np.median(left) / (0.6745 * free)))


def _refuse_beat(decay: Decay, p: Pieces, damping: Array, error: Array) -> None:
    """Two modes too close to be told apart beat: amplitude or damping swings."""
    rise = np.diff(np.log(p.amplitude))
    beats = (rise > 0.02) & (rise > 5 * np.hypot(p.errors[0][1:], p.errors[0][:-1]))
    left = damping - _smooth(p.amplitude, damping, 2 * p.errors[2])
    clear = (np.abs(left) > 6 * 2 * p.errors[2]) & (np.abs(left) > _SWINGS * abs(float(np.median(damping))))
    if np.any(beats) or np.count_nonzero(clear) > max(2, len(p) // 4):
        raise InputError(
            f"{decay.name}: the motion at {decay.frequency:.4g} Hz swings while it decays: two modes beat, too close "
            "to be told apart; neither has a frequency and a damping of its own here"
        )
