"""Bands on receptances and lobes: the whole computation repeated for samples of what was identified and measured.

Every quantity (a parameter of a joint, a line of a measured FRF) has its own stream of random numbers, told by the seed
and its name. The same samples thus stand behind every speed, amplitude and depth, and behind a changed design: the
difference between two bands is one of the machines and not of chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar
from zlib import crc32

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import CheckFailed, InputError
from jointlib.frf import FRF
from jointlib.joint import Joint
from jointlib.parameter import parameters_of

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

T = TypeVar("T")

SHARES = (0.025, 0.5, 0.975)
_COUNT = 1000
_LINES = 600
_INSIDE = 1e-9
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


def draws(name: str, count: int, size: int, seed: int = 0) -> Array:
    """Standard normal numbers of a named quantity, (count, size); more samples leave the first ones as they are."""
    return np.random.default_rng([seed, crc32(name.encode())]).standard_normal((count, size))


def sampled_joint(joint: Joint, name: str, count: int, seed: int = 0) -> tuple[list[Joint], int]:
    """Joints drawn from the covariance of an identified one, and how many parameters met a bound."""
    if joint.covariance is None:
        return [joint] * count, 0
    names, matrix = joint.covariance.names, np.asarray(joint.covariance.matrix, dtype=float)
    # The eigenvectors allow for a covariance that is singular, as of two parameters that only occur together.
    size, vectors = np.linalg.eigh(matrix / np.outer(_scale(matrix), _scale(matrix)))
    root = _scale(matrix)[:, None] * vectors * np.sqrt(np.maximum(size, 0.0))
    centre = np.array([joint.parameters[n] for n in names])
    found = centre + draws(name, count, len(names), seed) @ root.T
    low, high = np.array([_bounds(joint, n) for n in names]).T
    kept = np.clip(found, low, high)
    joints = [joint.with_parameters(dict(zip(names, row.tolist(), strict=True))) for row in kept]
    return [replace(j, validity=joint.validity) for j in joints], int(np.count_nonzero(kept != found))


def _scale(matrix: Array) -> Array:
    deviation = np.sqrt(np.diag(matrix))
    return np.where(deviation > 0, deviation, 1.0)


def _bounds(joint: Joint, name: str) -> tuple[float, float]:
    """What a parameter may be; strictly above a bound is a billionth of its value above it."""
    part, _, field = name.partition(".")
    law = dict(zip(joint.part_names, joint.laws, strict=True))[part]
    (found,) = (p for p in parameters_of(law) if p.name == field.partition("[")[0])
    above = found.above + _INSIDE * abs(joint.parameters[name] - found.above) if np.isfinite(found.above) else -np.inf
    return max(found.lower, above), found.upper


def sampled_value(part: Measured, count: int, seed: int = 0) -> list[Measured]:
    """Measured FRFs with errors of the variance that was measured with them, independent from line to line."""
    if part.variance is None:
        return [part] * count
    size = part.value.size
    normal = draws(part.name, count, 2 * size, seed).reshape(count, 2, *part.value.shape)
    error = np.sqrt(part.variance / 2) * (normal[:, 0] + 1j * normal[:, 1])
    # One record stands on both sides of the diagonal where the other was not measured.
    mirrored = np.triu(np.all(part.value == part.value.swapaxes(1, 2), axis=0), 1)
    error = np.where(mirrored.T, error.swapaxes(2, 3), error)
    return [replace(part, value=part.value + e) for e in error]


def refuse_certain(machine: Machine) -> None:
    """Raise where nothing in the machine has an error that could be drawn."""
    varied = any(c.variance is not None for c in machine.components if isinstance(c, Measured))
    if not varied and all(joint.covariance is None for joint in machine.joints()):
        raise InputError(
            f"{machine.where}: no joint has a covariance and no measured FRF a variance, so there is nothing to sample"
        )


def sampled_machines(machine: Machine, count: int = _COUNT, seed: int = 0) -> tuple[list[Machine], int]:
    """The machine with joints and measured FRFs drawn from what is known of their errors; see `Band.clipped`."""
    joints, clipped = {}, 0
    for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
        joints[connection.name], beyond = sampled_joint(joint, connection.name, count, seed)
        clipped += beyond
    parts = {c.name: sampled_value(c, count, seed) for c in machine.components if isinstance(c, Measured)}
    refuse_certain(machine)
    found = []
    for i in range(count):
        components = tuple(parts[c.name][i] if c.name in parts else c for c in machine.components)
        connections = tuple(replace(c, joint=joints[c.name][i]) if c.name in joints else c for c in machine.connections)
        found.append(replace(machine, components=components, connections=connections))
    return found, clipped


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
    band = chatter_band(machine)
    lines = band.lines if band.said else np.linspace(band.low, band.high, _LINES)
    samples = np.array([chattering_receptance(m, cutting, lines, amplitude) for m in machines])
    return Band(sampled_depths(samples, lines, cutting, speeds, machine.tool_axes), clipped, method)


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
    receptance: ComplexArray, lines: Array, cutting: Cutting, speed: ArrayLike, axes: tuple[str, ...]
) -> Array:
    """Limiting depths in m, (count, speeds), of many receptances (count, lines, axes, axes) at once.

    Between the lines (Hz) the inverse eigenvalue of the loop runs straight, as the dynamic stiffness nearly does.
    """
    if cutting.process != "milling":
        along = cutting.rotation[0][["xy".index(axis) for axis in axes]]
        receptance, stiffness = (along @ receptance @ along)[:, :, None, None], turning.loop_stiffness(cutting)
    else:
        stiffness = zero_order.loop_stiffness(cutting, axes)
    count, n = len(receptance), len(lines)
    value = loop_eigenvalues(stiffness, receptance.reshape(count * n, *receptance.shape[2:])).reshape(count, n, -1)
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    depth = np.full((count, len(speeds)), np.inf)
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
            np.minimum.at(depth[:, i], row, limiting_depth(root))
    return depth


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
