"""Pitches that lift the depth of cut over a band of speeds: searched for by zero order, proved by an exact method.

Unequal pitches break the phase between the waves that two flutes leave (Altintas, Engin & Budak 1999), for a chatter
frequency and a speed; how far they lift the depth depends on the band that they must serve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError

from ...model.machine import Machine
from ...model.spindle_speed import refuse_dependence
from ...tool.at_rest import tool_at_rest
from ...tool.tool_model import ToolModel
from ...tool.tool_point import tool_point
from ..loops.regeneration import loop_eigenvalues
from ..process import zero_order
from ..process.cutting import Cutting
from .frozen_lobes import lobes_at_amplitude

_SPREAD = 1 / 3
"""Share of an even pitch by which one may differ: the chip of a tooth, and its load, differ by as much."""
_SPEEDS = 9
_TRIED, _SEED, _ROUNDS, _BORN = 3, 0, 40, 12
_SCALE, _STEPS = 1.12, 4
"""By which the differences of the best pitches are stretched and shrunk, and how often, while the exact limit grows."""
_A_WAVE = 48
"""Frequencies to a wave of a revolution."""
_PLACES = 1
"""Decimals of a degree to which a grinder is told."""


@dataclass(frozen=True)
class BestPitch:
    """Pitches in degrees, and the least depth in m over speeds (rpm) with them and ``before``, by an exact method."""

    pitch: tuple[float, ...]
    speed: Array
    depth: float
    before: float
    method: str

    def words(self) -> str:
        """What they lift, and where."""
        low, high = float(np.min(self.speed)), float(np.max(self.speed))
        where = f"{low:g} to {high:g} rpm" if high > low else f"{low:g} rpm"
        if self.depth <= self.before:
            return f"No pitches were found that lift the least depth at {where}, {1e3 * self.before:.4g} mm."
        degrees = ", ".join(f"{angle:g}" for angle in self.pitch)
        return (
            f"pitch = [{degrees}] lifts the least depth at {where} from {1e3 * self.before:.4g} to "
            f"{_mm(self.depth)} ({self.method}; looked for by zero order)."
        )


def _mm(depth: float) -> str:
    return f"{1e3 * depth:.4g} mm" if np.isfinite(depth) else "any depth"


def best_pitch(machine: Machine, low: float, high: float) -> BestPitch:
    """The pitches with the largest least depth between two speeds in rpm, each within a third of an even one.

    The zero-order limit, which takes a millisecond, is searched over all pitches by differential evolution (Storn &
    Price 1997); its best, the pairs and the ramps that it likes best, and the cutter as it is are computed exactly.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    if cutting.process != "milling" or cutting.cuts_per_revolution < 2:
        raise InputError(f"{machine.where}: pitches are those of a milling cutter of two teeth or more")
    refuse_dependence(machine, "pitches")
    count = _SPEEDS if high > low else 1
    speeds = np.geomspace(low, high, count) if count > 1 else np.array([low])
    preview = _preview(machine, cutting, speeds)
    tried = _candidates(cutting.cuts_per_revolution, preview)
    before = _exact(machine, speeds, cutting.pitch)
    found = [(_exact(machine, speeds, pitch), pitch) for pitch in tried]
    (depth, method), pitch = max(found, key=lambda one: one[0][0])
    for factor in (_SCALE, 1 / _SCALE):
        for _ in range(_STEPS):
            other = _scaled(pitch, factor)
            if other == pitch or (more := _exact(machine, speeds, other)[0]) <= depth:
                break
            depth, pitch = more, other
    return BestPitch(pitch, speeds, depth, before[0], method)


def _scaled(pitch: tuple[float, ...], factor: float) -> tuple[float, ...]:
    """All differences from even pitches times a factor, as far as they may."""
    even = 360 / len(pitch)
    differ = np.array(pitch) - even
    factor = min(factor, _SPREAD * even / float(np.max(np.abs(differ)))) if np.any(differ) else 1.0
    first = np.round(even + factor * differ[:-1], _PLACES)
    return (*first.tolist(), round(360 - float(np.sum(first)), _PLACES))


def _exact(machine: Machine, speeds: Array, pitch: tuple[float, ...] | None) -> tuple[float, str]:
    cutting = {**(machine.cutting or {}), "pitch": pitch}
    if pitch is None:
        del cutting["pitch"]
    chart = lobes_at_amplitude(replace(machine, cutting=cutting), speeds, method="multi-frequency")
    return float(np.min(chart.depth)), chart.method


def _preview(machine: Machine, cutting: Cutting, speeds: Array) -> Callable[[tuple[float, ...]], float]:
    """The least zero-order limit in m at speeds in rpm by pitches in degrees, without what flanks rub.

    Pitches only change the mean of the delays, so the eigenvalues of the tool in the cut are found once.
    """
    tip = tool_at_rest(machine)
    point = tool_point(tip, tip.axes, tip.lines) if isinstance(tip, ToolModel) else tip
    waves = (point.lines[-1] - point.lines[0]) * 60 / float(np.min(speeds))
    f = np.union1d(point.lines, np.linspace(point.lines[0], point.lines[-1], int(waves * _A_WAVE) + 2))
    value = loop_eigenvalues(zero_order.loop_stiffness(cutting, point.axes)[None], point(f))
    if value.shape[1] == 2:
        straight, crossed = (np.abs(value[1:, ::turn] - value[:-1]).sum(axis=1) for turn in (1, -1))
        value = np.where(np.append(False, np.cumsum(crossed < straight) % 2 == 1)[:, None], value[:, ::-1], value)
    turned = 2j * np.pi * f / (speeds[:, None] / 60)

    def least(pitch: tuple[float, ...]) -> float:
        late = 1 - np.mean([np.exp(-turned * (angle / 360)) for angle in pitch], axis=0)
        loop = value * late[..., None]
        before, after = loop[:, :-1], loop[:, 1:]
        share = before.imag / np.where(before.imag == after.imag, 1.0, before.imag - after.imag)
        real = before.real + share * (after.real - before.real)
        crosses = (before.imag * after.imag <= 0) & (real < 0)
        return float(np.min(-1 / real[crosses])) if np.any(crosses) else np.inf

    return least


def _candidates(teeth: int, preview: Callable[[tuple[float, ...]], float]) -> list[tuple[float, ...]]:
    even = 360 / teeth
    reach = np.full(teeth - 1, _SPREAD * even)

    def taken(parts: Array) -> tuple[float, ...]:
        first = np.round(even + np.asarray(parts), _PLACES)
        return (*first.tolist(), round(360 - float(np.sum(first)), _PLACES))

    def cost(parts: Array) -> float:
        pitch = taken(parts)
        beyond = abs(pitch[-1] - even) - _SPREAD * even
        if beyond > 0:
            return float(beyond)
        return -float(min(preview(pitch), 1.0))

    steps = np.linspace(-_SPREAD, _SPREAD, 25)[1:-1] * even
    families = [[taken(step * np.array(shape[:-1])) for step in steps if step] for shape in _shapes(teeth)]
    best = [max(family, key=preview) for family in families]
    if teeth > 2:
        start = np.array([np.array(one[:-1]) - even for one in best])
        rng = np.random.default_rng(_SEED)
        more = rng.uniform(-_SPREAD / 2 * even, _SPREAD / 2 * even, (_BORN * (teeth - 1), teeth - 1))
        found = scipy.optimize.differential_evolution(
            cost,
            scipy.optimize.Bounds(-reach, reach),
            init=np.vstack([start, more]),
            maxiter=_ROUNDS,
            seed=_SEED,
            polish=False,
            tol=1e-3,
        )
        best.append(taken(found.x))
    return list(dict.fromkeys(best))[:_TRIED]


def _shapes(teeth: int) -> list[Array]:
    """Pairs (one wide, one narrow) where teeth are even in number, and a ramp."""
    ramp = np.linspace(-1, 1, teeth)
    pairs = [np.resize([1.0, -1.0], teeth)] if teeth % 2 == 0 else []
    return [*pairs, ramp] if teeth > 2 else pairs
