"""Lobes of a machine whose joints depend on amplitude: the depth at which a vibration of given size just persists."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError, Outcome

from ..assembly import Assembly
from ..indices import Mask
from ..limits import beyond_frequency
from ..machine import Machine
from ..operating import OpenTool, OperatingPoint
from ..working_point import tangents
from .chart import StabilityLobes
from .chatter_band import ChatterBand, chatter_band
from .cutting import Cutting
from .developed_lobes import developed_lobes
from .solve import stability_lobes
from .tool_point import ToolPoint
from .zero_order import loop_stiffness

_LINES = 600
_HALVINGS = 4
_STRAIGHT = 1e-4
_ROUNDS = 3
_ALIGNED = 1e-6
_SIDE_LINES = 4.0


def lobes_at_amplitude(
    machine: Machine, speed: ArrayLike, amplitude: float = 0.0, method: str | None = None, points: int = _LINES
) -> StabilityLobes:
    """Stability lobes of a machine while its tool point vibrates with ``amplitude`` (m, the larger of x and y).

    Every joint is frozen at the describing-function gain it has at that amplitude, G(ω; A) is the receptance that
    follows, and b_lim(rpm, A) is computed from it: the depth at which a chatter line of that size neither grows nor
    dies. Amplitude 0 is the onset from rest. In milling see `DevelopedChatter`; by the zero-order approximation the
    vibration is, at each frequency, that of the eigenvector that chatters first.

    Parameters
    ----------
    machine
        With a tool point, a cutting operation and a frequency range; every connection must have its joint.
    speed
        Spindle speeds in rpm, any shape.
    amplitude
        m, peak.
    method
        As in `stability_lobes`.
    points
        Lines to begin with; more are added where the receptance bends.
    """
    return frozen_lobes(machine, speed, amplitude, method, points)[0]


def frozen_lobes(
    machine: Machine, speed: ArrayLike, amplitude: float = 0.0, method: str | None = None, points: int = _LINES
) -> tuple[StabilityLobes, Mask]:
    """`lobes_at_amplitude`, and per speed whether a joint is held at its limit at the chatter frequency."""
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
    axes = machine.tool_axes
    cutting = Cutting(**machine.cutting)
    if cutting.process != "milling" and not cutting.feed_direction and "x" not in axes:
        raise InputError(f"{machine.where}: [tool] has no x, the direction of the chip thickness in turning")
    if amplitude > 0 and not Assembly(machine, (), ()).nonlinear:
        amplitude = 0.0
    band = chatter_band(machine)
    exact = band.model if amplitude == 0 else None
    if method == "collocation" and exact is None and cutting.process != "milling":
        from .frozen_modes import collocated_turning

        chart = collocated_turning(machine, cutting, speed, amplitude)
        return chart, _held(machine, cutting, chart, amplitude)
    if (
        cutting.process == "milling"
        and method != "zero-order"
        and (amplitude > 0 or (method == "collocation" and exact is None))
    ):
        table = wide_receptance(machine, amplitude, points)
        chart, held = developed_lobes(machine, cutting, speed, amplitude, method, table)
        return _within(chart, machine, band), held
    if amplitude == 0:
        chart = stability_lobes(exact or tip_at_rest(machine, band.lines), cutting, speed, method)
        return _within(chart, machine, band), np.zeros(chart.depth.shape, dtype=bool)
    point = operating_receptance(machine, amplitude, points)
    chart = stability_lobes(point.frf, cutting, speed, method, axes=axes)
    chart = _within(replace(chart, warnings=chart.warnings + _limits(point, chart)), machine, band)
    limited = np.array([outcome is not Outcome.CONVERGED for outcome in point.outcomes])
    return chart, _chattering_on(limited, point.frf.frequency, chart.chatter_frequency)


def _within(chart: StabilityLobes, machine: Machine, band: ChatterBand) -> StabilityLobes:
    """The chart with what is to be said of the frequencies over which the machine was searched."""
    said = chart.warnings + band.said + beyond_frequency(machine, band.low, band.high)
    return replace(chart, warnings=said, known_to=None if band.whole else band.high)


def wide_receptance(machine: Machine, amplitude: float, points: int = _LINES) -> OperatingPoint:
    """The receptance over a band that holds side lines of the chatter too, where all components are known there."""
    try:
        return operating_receptance(machine, amplitude, points, _SIDE_LINES)
    except FrequencyMismatch:
        return operating_receptance(machine, amplitude, points)


def operating_receptance(
    machine: Machine,
    amplitude: float,
    points: int = _LINES,
    beyond: float = 1.0,
    cutting: Cutting | None = None,
) -> OperatingPoint:
    """Tool-point receptance at an amplitude in m, on lines over the machine's band that are close enough.

    Lines are halved where the inverse receptance, which the lobe solver interpolates, is not nearly straight between
    them. Where the joint jumps from one state to another no spacing is close enough; there the halving ends. The band
    is widened by the factor ``beyond`` at both ends. In milling the tool vibrates as the ``cutting`` drives it, by
    default that of the machine.
    """
    if cutting is None:
        if machine.cutting is None:
            raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
        cutting = Cutting(**machine.cutting)
    band = chatter_band(machine)
    low, high = band.low, band.high
    lines = band.lines if band.said else np.linspace(low, high, points)
    if beyond > 1:
        count = points // 10
        lines = np.concatenate(
            [np.geomspace(low / beyond, low, count)[:-1], lines, np.geomspace(high, high * beyond, count)[1:]]
        )
    point = _point(machine, cutting, lines, amplitude)
    ends = np.arange(len(lines) - 1)
    for _ in range(_HALVINGS):
        lines = point.frf.frequency
        middle = (lines[ends] + lines[ends + 1]) / 2
        found = _point(machine, cutting, middle, amplitude)
        inverse = np.linalg.inv(point.frf.receptance)
        straight = np.linalg.inv((inverse[ends] + inverse[ends + 1]) / 2)
        error = np.linalg.norm(straight - found.frf.receptance, axis=(1, 2))
        coarse = error > _STRAIGHT * np.linalg.norm(found.frf.receptance, axis=(1, 2))
        point = _merged(point, found)
        # Both halves of an interval that was too coarse are looked at again.
        after = np.searchsorted(point.frf.frequency, middle[coarse])
        ends = np.unique(np.concatenate([after - 1, after]))
        if not len(ends):
            break
    return point


def tip_at_rest(machine: Machine, lines: Array) -> ToolPoint:
    """The tool point for small vibrations, known at every frequency; ``lines`` (Hz) are where a search starts."""
    axes, tool = machine.tool_axes, machine.tool_dofs
    if not axes:
        raise InputError(f"{machine.where}: no tool point, expected [tool] with x or y")
    assembly = Assembly(machine, tool, tool)
    return ToolPoint(lambda f: assembly.coupled(2 * np.pi * f, tangents(machine, f)), lines, axes, sampled=False)


def chattering_point(
    machine: Machine, cutting: Cutting, frequency: float, amplitude: float
) -> tuple[OperatingPoint, ComplexArray]:
    """The tool point at one frequency (Hz) and amplitude (m), and the force direction that chatters first, (axes,)."""
    point, direction = chattering(OpenTool(machine, np.array([frequency])), cutting, amplitude)
    return point, direction[0]


def chattering_receptance(machine: Machine, cutting: Cutting, lines: Array, amplitude: float) -> ComplexArray:
    """Tool-point receptance in m/N on given lines (Hz), frozen at an amplitude of the tool in m."""
    return _point(machine, cutting, lines, amplitude).frf.receptance


def _point(machine: Machine, cutting: Cutting, lines: Array, amplitude: float) -> OperatingPoint:
    """The tool point at ascending lines, vibrating along the direction that chatters first."""
    return chattering(OpenTool(machine, lines), cutting, amplitude)[0]


def chattering(tool: OpenTool, cutting: Cutting, amplitude: float) -> tuple[OperatingPoint, ComplexArray]:
    """The tool point on all lines at an amplitude in m, and per line the force direction that chatters first."""
    axes = tool.machine.tool_axes
    lines = tool.frequency
    direction: ComplexArray = np.zeros((len(lines), len(axes)), dtype=complex)
    direction[:, 0] = 1.0
    if cutting.process != "milling":
        direction[:] = cutting.rotation[0][["xy".index(axis) for axis in axes]]
    point = tool.vibrating(amplitude, direction)
    if amplitude == 0 or cutting.process != "milling" or len(axes) == 1:
        return point, direction
    D = loop_stiffness(cutting, axes)
    turning = np.arange(len(lines))
    for _ in range(_ROUNDS):
        new = _chattering(D @ point.frf.receptance[turning])
        old = direction[turning]
        turned = 1 - np.abs(np.sum(new.conj() * old, axis=1)) / np.linalg.norm(old, axis=1)
        direction[turning] = new
        turning = turning[turned > _ALIGNED]
        if not len(turning):
            break
        again = tool.vibrating(amplitude, direction[turning], turning)
        point = _replaced(point, turning, again)
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


def _limits(point: OperatingPoint, chart: StabilityLobes) -> tuple[str, ...]:
    """A sentence for every limit that a joint met where the chart chatters, with how much of it that touches."""
    said = []
    lines = point.frf.frequency
    for outcome, count in Counter(o for o in point.outcomes if o is not Outcome.CONVERGED).items():
        limited = np.array([o is outcome for o in point.outcomes])
        touched = int(np.count_nonzero(_chattering_on(limited, lines, chart.chatter_frequency)))
        if not touched:
            continue
        said.append(
            f"On {count} of {len(lines)} lines, {lines[limited][0]:.0f} to {lines[limited][-1]:.0f} Hz, a joint "
            f"is held at its limit ({outcome.value}); {touched} of {chart.depth.size} speeds chatter there."
        )
    return tuple(said)


def _held(machine: Machine, cutting: Cutting, chart: StabilityLobes, amplitude: float) -> Mask:
    """Per speed, whether a joint is held at its limit while the tool chatters with an amplitude in m."""
    chatter = np.unique(chart.chatter_frequency[np.isfinite(chart.chatter_frequency)])
    if amplitude == 0 or not len(chatter):
        return np.zeros(chart.depth.shape, dtype=bool)
    point = _point(machine, cutting, chatter, amplitude)
    limited = np.array([outcome is not Outcome.CONVERGED for outcome in point.outcomes])
    return _chattering_on(limited, chatter, chart.chatter_frequency)


def _chattering_on(chosen: Mask, lines: Array, chatter: Array) -> Mask:
    """Whether the line at or above each chatter frequency is one of the chosen; false where nothing chatters."""
    at = np.clip(np.searchsorted(lines, np.nan_to_num(chatter)), 0, len(lines) - 1)
    return np.asarray(np.isfinite(chatter) & chosen[at])


def _chattering(loop: ComplexArray) -> ComplexArray:
    """Unit force direction, per line, of the eigenvector of D·G that reaches its limit at the smallest depth."""
    values, vectors = np.linalg.eig(loop)
    first = np.argmin(values.real, axis=1)
    chosen: ComplexArray = np.take_along_axis(vectors, first[:, None, None], axis=2)[:, :, 0]
    return chosen
