"""The tool point while it chatters with an amplitude: joints held, receptance, direction of the force."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError, Outcome
from jointlib.shown.progress import each

from ...deadline import OutOfTime, in_time, within
from ...indices import Index
from ...model.machine import Machine
from ...operating.operating_point import OpenTool, OperatingPoint
from ...tool.at_rest import tip_at_rest
from ...tool.chatter_band import chatter_band
from ...tool.tool_point import share_along
from ..process import turning
from ..process.cutting import Cutting
from ..process.zero_order import loop_stiffness

LINES = 600
_TRIED = (3, 24)
_MANY, _PATIENCE = 4.0, 5.0
_HALVINGS = 4
_STRAIGHT, _ROUGH = 1e-4, 1e-2
"""Share by which a receptance may be off between its lines, and where it only tells where to start."""
_FAINT = 5e-3
"""Share of the largest receptance below which no resonance is looked for."""
_NEAR, _HIDDEN = 0.5, 0.1
"""Share of the chatter at the deepest cut asked for, and by how much the receptance may be off far from it."""
_APART = 4
"""Lines apart of those to begin with where only some will matter."""
_ROUNDS = 3
_ALIGNED, _TOWARDS = 1e-6, 1e-2
"""How nearly a force points where it chatters first, and where the receptance only tells where to start."""
_SIDE_LINES = 4.0


def wide_receptance(machine: Machine, amplitude: float, points: int = LINES) -> OperatingPoint:
    """About the receptance over a band that holds side lines of the chatter too, where all components are known there.

    It tells where its resonances are and what the joints do there; lines between are not close enough to interpolate,
    and joints that do not settle at once stay as they were last seen.
    """
    try:
        return operating_receptance(machine, amplitude, points, _SIDE_LINES, rough=True)
    except FrequencyMismatch:
        return operating_receptance(machine, amplitude, points, rough=True)


def operating_receptance(
    machine: Machine,
    amplitude: float,
    points: int = LINES,
    beyond: float = 1.0,
    cutting: Cutting | None = None,
    rough: bool = False,
    deepest: float = np.inf,
) -> OperatingPoint:
    """Tool-point receptance at an amplitude in m, on lines over the machine's band that are close enough.

    Lines are halved where the inverse receptance, which the lobe solver interpolates, is off by more than a share of
    ``straight`` between them. Where the joint jumps from one state to another no spacing is close enough; there the
    halving ends. Where only depths of up to ``deepest`` (m) are asked for in turning, it begins with fewer lines, and
    those that chatter far beyond it are halved once, or as long as the receptance is not what it seemed between them.
    The band is widened by the factor ``beyond`` at both ends. In milling the tool vibrates as the ``cutting`` drives
    it, by default that of the machine.
    """
    if cutting is None:
        if machine.cutting is None:
            raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
        cutting = Cutting(**machine.cutting)
    lines = _lines(machine, points, beyond)
    few = 0 < deepest < np.inf and not chatter_band(machine).said
    level = 0.0
    if 0 < deepest < np.inf:
        share = share_along(machine.tool_axes, cutting.rotation[0])
        level = _NEAR / (2 * abs(float(turning.loop_stiffness(cutting)[0, 0])) * deepest)
    tool = None if rough else known_tool(machine, cutting, amplitude)
    ask = _rough(machine, cutting, amplitude, lines) if tool is None else tool.at
    point = ask(lines[_telling(machine, points)] if few else lines)
    ends, straight = np.arange(len(point.frf.frequency) - 1), _ROUGH if rough else _STRAIGHT
    even = float(np.max(np.diff(lines)))
    rounds = _HALVINGS + (int(np.log2(_APART)) if few else 0)
    for _ in each("refinements of the lines", range(rounds), rounds):
        lines = point.frf.frequency
        if rough:
            size = np.linalg.norm(point.frf.receptance, axis=(1, 2))
            fine = np.array([outcome is not Outcome.STALLED for outcome in point.outcomes])
            loud = np.maximum(size[ends], size[ends + 1]) >= _FAINT * np.max(size)
            ends = ends[loud & fine[ends] & fine[ends + 1]]
        if few:
            ends = ends[lines[ends + 1] - lines[ends] > 1.5 * even / 2**_HALVINGS]
        if not len(ends):
            break
        middle = (lines[ends] + lines[ends + 1]) / 2
        found = ask(middle)
        inverse = np.linalg.inv(point.frf.receptance)
        mean = np.linalg.inv((inverse[ends] + inverse[ends + 1]) / 2)
        error = np.linalg.norm(mean - found.frf.receptance, axis=(1, 2))
        size = np.linalg.norm(found.frf.receptance, axis=(1, 2))
        coarse = error > straight * size
        if level:
            chatters = _chatters(point, share)
            near = np.maximum(chatters[ends], chatters[ends + 1]) >= level
            near |= _chatters(found, share) >= level
            coarse &= near | (error > _HIDDEN * size)
            if few:
                coarse |= near & (lines[ends + 1] - lines[ends] > 1.5 * even)
        point = _merged(point, found)
        # Both halves of an interval that was too coarse are looked at again.
        after = np.searchsorted(point.frf.frequency, middle[coarse])
        ends = np.unique(np.concatenate([after - 1, after]))
    return point


def _lines(machine: Machine, points: int, beyond: float) -> Array:
    """Lines in Hz to begin with."""
    band = chatter_band(machine)
    low, high = band.low, band.high
    lines = band.lines if band.said else np.linspace(low, high, points)
    if beyond > 1:
        count = points // 10
        lines = np.concatenate(
            [np.geomspace(low / beyond, low, count)[:-1], lines, np.geomspace(high, high * beyond, count)[1:]]
        )
    return lines


def _rough(machine: Machine, cutting: Cutting, amplitude: float, lines: Array) -> Callable[[Array], OperatingPoint]:
    """About what the tool does on lines (Hz) that are asked for."""
    tool = OpenTool(machine, lines)
    return lambda some: chattering(tool.on(some), cutting, amplitude, True)[0]


class Known:
    """The tool at one amplitude on all lines that were ever asked for: its ``point``."""

    def __init__(self, machine: Machine, cutting: Cutting, amplitude: float) -> None:
        self._tool = OpenTool(machine, np.ones(1))
        self._cutting, self._amplitude = cutting, amplitude
        self.point: OperatingPoint | None = None

    def at(self, lines: Array) -> OperatingPoint:
        """On ascending lines in Hz."""
        missing = lines if self.point is None else np.setdiff1d(lines, self.point.frf.frequency)
        if len(missing):
            new = chattering(self._tool.on(missing), self._cutting, self._amplitude)[0]
            self.point = new if self.point is None else _merged(self.point, new)
        assert self.point is not None
        return _part(self.point, np.searchsorted(self.point.frf.frequency, lines))


known_tool = lru_cache(maxsize=12)(Known)
"""For those who ask for one amplitude again."""


@lru_cache(maxsize=2)
def _telling(machine: Machine, points: int) -> Index:
    """Lines to begin with where only some will matter: some, and all where the tool at rest has more to tell."""
    lines = _lines(machine, points, 1.0)
    G = tip_at_rest(machine, lines)(lines)
    first, every = np.arange(0, len(lines), _APART), np.arange(len(lines))
    first = np.append(first, len(lines) - 1) if first[-1] < len(lines) - 1 else first
    left = np.clip(np.searchsorted(first, every, side="right") - 1, 0, len(first) - 2)
    start, end = first[left], first[left + 1]
    share, inverse = ((every - start) / (end - start))[:, None, None], np.linalg.inv(G)
    between = np.linalg.inv((1 - share) * inverse[start] + share * inverse[end])
    more = np.linalg.norm(between - G, axis=(1, 2)) > _HIDDEN * np.linalg.norm(G, axis=(1, 2))
    return np.flatnonzero(np.isin(every, first) | np.isin(left, left[more]))


def _chatters(point: OperatingPoint, share: Array) -> Array:
    """−Re G along the chip thickness in m/N, 0 where it is positive: in turning 1/(2·K_s·depth) of the lobe there."""
    along = np.einsum("a,fab,b->f", share, point.frf.receptance, share)
    return np.asarray(np.maximum(-along.real, 0.0))


def seconds_of_chart(machine: Machine, cutting: Cutting, amplitude: float, enough: float = np.inf) -> float:
    """About how long `wide_receptance` takes at an amplitude in m, from a few of its lines.

    Fewer serve where they tell of many times ``enough`` (s) already, and they are not waited for to the end.
    """
    band = chatter_band(machine)
    needed = 0.0
    for tried in _TRIED:
        tool = OpenTool(machine, np.geomspace(band.low, band.high, tried))
        tool.vibrating(0.0)
        begun, times = time.process_time(), max(LINES, len(band.lines)) / tried * (1 + _HALVINGS / 2)
        try:
            with within(max(_PATIENCE, 2 * _MANY * enough / times)):
                chattering(tool, cutting, amplitude, True)
        except OutOfTime:
            in_time()
        needed = (time.process_time() - begun) * times
        if needed > _MANY * enough:
            break
    return needed


def chattering_point(
    machine: Machine, cutting: Cutting, frequency: float, amplitude: float
) -> tuple[OperatingPoint, ComplexArray]:
    """The tool point at one frequency (Hz) and amplitude (m), and the force direction that chatters first, (axes,)."""
    point, direction = chattering(OpenTool(machine, np.array([frequency])), cutting, amplitude)
    return point, direction[0]


def chattering_receptance(machine: Machine, cutting: Cutting, lines: Array, amplitude: float) -> ComplexArray:
    """Tool-point receptance in m/N on given lines (Hz), frozen at an amplitude of the tool in m."""
    return on_lines(machine, cutting, lines, amplitude).frf.receptance


def on_lines(machine: Machine, cutting: Cutting, lines: Array, amplitude: float) -> OperatingPoint:
    """The tool point at ascending lines, vibrating along the direction that chatters first."""
    return chattering(OpenTool(machine, lines), cutting, amplitude)[0]


def chattering(
    tool: OpenTool, cutting: Cutting, amplitude: float, rough: bool = False
) -> tuple[OperatingPoint, ComplexArray]:
    """The tool point on all lines at an amplitude in m, and per line the force direction that chatters first."""
    axes = tool.machine.tool_axes
    lines = tool.frequency
    direction: ComplexArray = np.zeros((len(lines), len(axes)), dtype=complex)
    direction[:, 0] = 1.0
    if cutting.process != "milling":
        direction[:] = cutting.rotation[0][["xy".index(axis) for axis in axes]]
    point = tool.vibrating(amplitude, direction, ramp=not rough)
    if amplitude == 0 or cutting.process != "milling" or len(axes) == 1:
        return point, direction
    D = loop_stiffness(cutting, axes)
    left = np.arange(len(lines))
    for _ in range(_ROUNDS):
        new = _chattering(D @ point.frf.receptance[left])
        old = direction[left]
        turned = 1 - np.abs(np.sum(new.conj() * old, axis=1)) / np.linalg.norm(old, axis=1)
        direction[left] = new
        left = left[turned > (_TOWARDS if rough else _ALIGNED)]
        if not len(left):
            break
        again = tool.vibrating(amplitude, direction[left], left, not rough)
        point = _replaced(point, left, again)
    return point, direction


def _replaced(point: OperatingPoint, at: Array, new: OperatingPoint) -> OperatingPoint:
    """The operating point with some of its lines computed anew."""
    receptance, gain = point.frf.receptance.copy(), point.gain.copy()
    amplitude, force = point.joint_amplitude.copy(), point.force.copy()
    receptance[at], gain[at] = new.frf.receptance, new.gain
    amplitude[at], force[at] = new.joint_amplitude, new.force
    outcomes = list(point.outcomes)
    for i, outcome in zip(at, new.outcomes, strict=True):
        outcomes[i] = outcome
    return OperatingPoint(replace(point.frf, receptance=receptance), gain, amplitude, force, tuple(outcomes))


def _part(point: OperatingPoint, rows: Index) -> OperatingPoint:
    """The operating point on some of its lines."""
    frf = replace(point.frf, frequency=point.frf.frequency[rows], receptance=point.frf.receptance[rows])
    outcomes = tuple(point.outcomes[i] for i in rows.tolist())
    return replace(
        point,
        frf=frf,
        gain=point.gain[rows],
        joint_amplitude=point.joint_amplitude[rows],
        force=point.force[rows],
        outcomes=outcomes,
    )


def _merged(first: OperatingPoint, second: OperatingPoint) -> OperatingPoint:
    frequency = np.concatenate([first.frf.frequency, second.frf.frequency])
    order = np.argsort(frequency)
    receptance = np.concatenate([first.frf.receptance, second.frf.receptance])[order]
    outcomes = (*first.outcomes, *second.outcomes)
    return OperatingPoint(
        replace(first.frf, frequency=frequency[order], receptance=receptance),
        np.concatenate([first.gain, second.gain])[order],
        np.concatenate([first.joint_amplitude, second.joint_amplitude])[order],
        np.concatenate([first.force, second.force])[order],
        tuple(outcomes[i] for i in order),
    )


def _chattering(loop: ComplexArray) -> ComplexArray:
    """Unit force direction, per line, of the eigenvector of D·G that reaches its limit at the smallest depth."""
    values, vectors = np.linalg.eig(loop)
    first = np.argmin(values.real, axis=1)
    chosen: ComplexArray = np.take_along_axis(vectors, first[:, None, None], axis=2)[:, :, 0]
    return chosen
