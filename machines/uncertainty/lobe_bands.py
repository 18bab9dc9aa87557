"""Bands on receptances and lobes: the whole computation repeated for samples of what was identified and measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import CheckFailed, InputError
from jointlib.frf import FRF

from ..components.measured import Measured
from ..cutting.amplitude.chattering_tool import chattering_receptance
from ..cutting.amplitude.frozen_lobes import frozen_lobes
from ..cutting.loops.regeneration import limiting_depth, loop_eigenvalues, wave_fraction
from ..cutting.process import turning, zero_order
from ..cutting.process.cutting import Cutting
from ..cutting.rest.solve import stability_lobes
from ..model.machine import Machine
from ..operating.operating_point import operating_point
from ..tool.chatter_band import chatter_band
from .drawn_machines import sampled_machines, sampled_value

T = TypeVar("T")

SHARES = (0.025, 0.5, 0.975)
_COUNT = 1000
_LINES = 600
_REFUSED = 0.05


@dataclass(frozen=True, eq=False)
class Band:
    """Samples of a result, (count, …), with their quantiles at 2.5, 50 and 97.5 %, (3, …)."""

    samples: Array
    clipped: int = 0
    """How many sampled parameters fell outside their bounds and were set to them."""
    method: str = ""
    """That of the lobes."""
    failed: int = 0
    """Samples whose chart could not be computed; they are left out."""

    @property
    def quantiles(self) -> Array:
        """Values that were drawn, so that a depth without bound may be one of them."""
        return np.asarray(np.quantile(self.samples, SHARES, axis=0, method="inverted_cdf"))


def frf_band(
    machine: Machine, frequency: ArrayLike, amplitude: float = 0.0, count: int = _COUNT, seed: int = 0
) -> Band:
    """Band of the size of the tool-point receptance in m/N, (3, lines, axes, axes), at a tool amplitude in m."""
    machines, clipped = sampled_machines(machine, count, seed)
    samples = [np.abs(operating_point(m, frequency, amplitude).frf.receptance) for m in machines]
    return Band(np.array(samples), clipped)


def lobe_band(
    machine: Machine,
    speed: ArrayLike,
    amplitude: float = 0.0,
    count: int = _COUNT,
    seed: int = 0,
    method: str | None = None,
) -> Band:
    """Band of the limiting depth in m, (3, speeds), at an amplitude of the tool in m.

    ``method`` is as in `lobes_at_amplitude`. Turning and zero order compute all samples at once, a preview in milling;
    the exact methods compute a chart per sample, and cost that many charts. Samples that a method refuses are left out
    and counted, up to one in twenty.
    """
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
    cutting = Cutting(**dict(machine.cutting))
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    machines, clipped = sampled_machines(machine, count, seed)
    if method is None and cutting.process != "milling":
        method = "turning"
    if method not in ("turning", "zero-order") or not cutting.plain:
        exact = method or frozen_lobes(machine, speeds[:1], amplitude)[0].method
        return _one_by_one(lambda m: frozen_lobes(m, speeds, amplitude, exact)[0].depth, machines, exact, clipped)
    lines = _lines(machine)
    cuts = [Cutting(**dict(m.cutting or {})) for m in machines]
    found = [chattering_receptance(m, cut, lines, amplitude) for m, cut in zip(machines, cuts, strict=True)]
    return Band(sampled_depths(np.array(found), lines, cuts, speeds, machine.tool_axes), clipped, method)


def _lines(machine: Machine) -> Array:
    """Lines in Hz over the band of chatter: those of its measured parts, whose noise its chart has as well."""
    band = chatter_band(machine)
    own = [part.frequency for part in machine.components if isinstance(part, Measured) and part.variance is not None]
    if own:
        every = np.unique(np.concatenate(own))
        inside = every[(every >= band.low) & (every <= band.high)]
        if len(inside) >= _LINES:
            return inside
    return band.lines if band.said else np.linspace(band.low, band.high, _LINES)


def measured_lobe_band(
    frf: FRF,
    cutting: Cutting,
    speed: ArrayLike,
    axes: tuple[str, ...],
    count: int = _COUNT,
    seed: int = 0,
    method: str | None = None,
) -> Band:
    """`lobe_band` of a measured tool-point FRF with its variance; in milling by multi-frequency by default."""
    if frf.variance is None:
        raise InputError("lobe band: the FRF has no variance, expected one with its lines")
    part = Measured("tool", axes, frf.frequency, frf.receptance, variance=frf.variance)
    values = [m.value for m in sampled_value(part, count, seed)]
    if method is None:
        method = "turning" if cutting.process != "milling" else "multi-frequency"
    if method in ("turning", "zero-order") and cutting.plain:
        return Band(sampled_depths(np.array(values), frf.frequency, cutting, speed, axes), method=method)
    drawn = [replace(frf, receptance=value, variance=None) for value in values]
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    return _one_by_one(lambda f: stability_lobes(f, cutting, speeds, method, axes=axes).depth, drawn, method)


def _one_by_one(depth: Callable[[T], Array], samples: Sequence[T], method: str, clipped: int = 0) -> Band:
    """Depths of the samples, one after the other."""
    found, refused = [], 0
    for sample in samples:
        try:
            found.append(depth(sample))
        except (CheckFailed, InputError):
            refused += 1
            if refused > _REFUSED * len(samples):
                raise
    return Band(np.array(found), clipped, method, refused)


def sampled_depths(
    receptance: ComplexArray,
    lines: Array,
    cutting: Cutting | Sequence[Cutting],
    speed: ArrayLike,
    axes: tuple[str, ...],
) -> Array:
    """Limiting depths in m, (count, speeds), of many receptances (count, lines, axes, axes) at once.

    Between the lines (Hz) the inverse eigenvalue of the loop runs straight, as the dynamic stiffness nearly does.
    ``cutting`` is that of all samples, or a sequence with that of each, which differ in their coefficients.
    """
    return sampled_limits(receptance, lines, cutting, speed, axes)[0]


def sampled_limits(
    receptance: ComplexArray,
    lines: Array,
    cutting: Cutting | Sequence[Cutting],
    speed: ArrayLike,
    axes: tuple[str, ...],
) -> tuple[Array, Array]:
    """`sampled_depths` and the chatter frequencies there in Hz, nan where the depth is inf."""
    count, n = receptance.shape[:2]
    cuts = [cutting] if isinstance(cutting, Cutting) else cutting
    cutting = cuts[0]
    if cutting.process != "milling":
        along = cutting.rotation[0][["xy".index(axis) for axis in axes]]
        receptance = (along @ receptance @ along)[:, :, None, None]
        stiffness = np.array([turning.loop_stiffness(one) for one in cuts])
    else:
        stiffness = np.array([zero_order.loop_stiffness(one, axes) for one in cuts])
    of_line = np.repeat(np.broadcast_to(stiffness, (count, *stiffness.shape[1:])), n, axis=0)
    value = loop_eigenvalues(of_line, receptance.reshape(count * n, *receptance.shape[2:])).reshape(count, n, -1)
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    depth, frequency = np.full((count, len(speeds)), np.inf), np.full((count, len(speeds)), np.nan)
    for branch in _followed(value):
        shallow = branch.real < 0
        used = np.flatnonzero(np.any(shallow[:, 1:] & shallow[:, :-1], axis=0))
        if not len(used):
            continue
        part = slice(used[0], used[-1] + 2)
        f, branch, shallow = lines[part], branch[:, part], shallow[:, part]
        both, waves, inverse = shallow[:, 1:] & shallow[:, :-1], wave_fraction(branch), 1 / branch
        for i, period in enumerate(60 / (cutting.cuts_per_revolution * speeds)):
            gathered = f * period - waves
            whole = np.floor(gathered)
            row, column = np.nonzero((whole[:, 1:] != whole[:, :-1]) & both)
            g0, g1 = gathered[row, column], gathered[row, column + 1]
            share = (np.maximum(whole[row, column], whole[row, column + 1]) - g0) / (g1 - g0)
            root = 1 / ((1 - share) * inverse[row, column] + share * inverse[row, column + 1])
            found, at = limiting_depth(root), f[column] + share * (f[column + 1] - f[column])
            np.minimum.at(depth[:, i], row, found)
            lowest = found == depth[row, i]
            frequency[row[lowest], i] = at[lowest]
    return depth, frequency


def _followed(value: ComplexArray) -> list[ComplexArray]:
    """Branches (count, lines) of the eigenvalues (count, lines, 1 or 2), each running on smoothly."""
    if value.shape[2] == 1:
        return [value[:, :, 0]]
    before, after = value[:, :-1], value[:, 1:]
    straight = np.sum(np.abs(after - before), axis=2)
    crossed = np.sum(np.abs(after[:, :, ::-1] - before), axis=2)
    swapped = np.concatenate([np.zeros((len(value), 1), dtype=bool), np.cumsum(crossed < straight, axis=1) % 2 == 1], 1)
    first = np.where(swapped, value[:, :, 1], value[:, :, 0])
    return [first, np.where(swapped, value[:, :, 0], value[:, :, 1])]
