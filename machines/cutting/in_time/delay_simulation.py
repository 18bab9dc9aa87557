"""The delay equation of a machine in the cut, in time: joints as they are, not as describing functions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.law import Motion

from ...indices import Mask
from ..process.stretch import Stretch
from .moving_parts import MovingParts, Step, step_of
from .surface import Ground, Surface

_REPEATS = 1e-6
_GRAZING, _SHALLOW = 1e-9, 1e-2
"""Shares of the feed in the chip: nothing, and too little for a lost contact to be spoken of."""


@dataclass(frozen=True)
class Chip:
    """Cutting force by chip thickness, in units of the tangent coefficient at the feed: h₀^(1−q)·h^q/q.

    Without a feed (m) the force is linear and the edge never leaves the cut.
    """

    feed: float | None
    exponent: float

    def force(self, thickness: Array) -> Array:
        """m of chip at the tangent coefficient."""
        if self.feed is None:
            return thickness
        cut = np.maximum(thickness, 0.0)
        if self.exponent == 1:
            return cut
        return np.asarray(self.feed ** (1 - self.exponent) / self.exponent * cut**self.exponent)


@dataclass(frozen=True, eq=False)
class Run:
    """A batch of motions of the tool point.

    ``motion`` in m, (periods, nodes, axes, batch); ``time`` of a period's nodes in s; ``lost`` says in which periods
    an edge that should cut left the cut, (periods, batch); ``escaped``, (batch,), which motions passed all bounds and
    were stopped.
    """

    motion: Array
    time: Array
    period: float
    lost: Mask
    escaped: Mask

    @property
    def duration(self) -> float:
        """Simulated time in s."""
        return self.period * len(self.motion)


@dataclass(frozen=True, eq=False)
class Cut:
    """A tooth period and the cut in it; ``depth`` in m, one per motion of the batch."""

    stretches: tuple[Stretch, ...]
    chip: Chip
    depth: Array


@dataclass(frozen=True, eq=False)
class Period:
    """One period of a cut, ready to be stepped."""

    parts: MovingParts
    cut: Cut
    steps: dict[float, Step]
    bias: Array

    @classmethod
    def of(cls, parts: MovingParts, cut: Cut) -> Period:
        """With the matrices of its steps and the mean force that is left out."""
        return cls(parts, cut, {s.step: step_of(parts, s.step) for s in cut.stretches}, _mean_force(cut))

    def passed(
        self, state: Array, memories: list[Array], ground: Ground, motion: Array
    ) -> tuple[Array, list[Array], Mask]:
        """State and memories after a period and whether an edge left the cut, (batch,).

        The ``ground`` is left as the edges leave it; the ``motion`` of the tool (nodes, axes, batch) is filled.
        """
        lost, first, feed = np.zeros(state.shape[1], dtype=bool), 0, self.cut.chip.feed or 0.0
        for i, stretch in enumerate(self.cut.stretches):
            met = ground.met(i, feed)
            step = self.steps[stretch.step]
            x, v, state, memories = _across(self.parts, step, stretch, self.cut, self.bias, met, state, memories)
            surface, off = _left(stretch, self.cut.chip, met, Surface.ploughed(stretch, x, v))
            ground.leave(i, surface)
            motion[first : first + stretch.steps] = x[:-1]
            lost |= off
            first += stretch.steps
        return state, memories, lost


def simulate(
    parts: MovingParts,
    cut: Cut,
    state: Array,
    memories: list[Array],
    surfaces: list[Surface],
    periods: int,
    reach: float,
) -> Run:
    """Step a batch of motions through ``periods`` tooth periods (of the pattern of flutes, of revolutions in turning).

    Fourth order in the step where forces are smooth: the linear part is exact, forces follow Cox & Matthews (2002), and
    what an edge leaves between two nodes is the cubic through heights and slopes. Edges enter and leave the cut on
    nodes. The constant part of the cutting force is left out, as the joints stand where it holds them. Motions that
    exceed ``reach`` (m) are stopped.

    Parameters
    ----------
    state
        At time 0, (states, batch).
    memories
        State of each joint with a force of its own, (batch, joint states).
    surfaces
        One per stretch, from the period before time 0.
    """
    period = Period.of(parts, cut)
    batch = state.shape[1]
    motion = np.zeros((periods, sum(s.steps for s in cut.stretches), parts.tool, batch))
    lost, escaped = np.zeros((periods, batch), dtype=bool), np.zeros(batch, dtype=bool)
    ground = Ground(cut.stretches, surfaces)
    with np.errstate(over="ignore", invalid="ignore"):
        for p in range(periods):
            state, memories, lost[p] = period.passed(state, memories, ground, motion[p])
            gone = ~(np.max(np.abs(motion[p]), axis=(0, 1)) < reach)
            if np.any(gone):
                escaped |= gone
                motion[p][..., gone] = 0.0
                state[:, gone] = 0.0
                for m, joint in zip(memories, parts.rest, strict=True):
                    m[gone] = joint.initial_state(np.zeros(()))
                ground.flatten(gone)
                if np.all(escaped):
                    break
    lengths = np.concatenate([np.full(s.steps, s.step) for s in cut.stretches])
    return Run(motion, np.cumsum(lengths) - lengths, float(np.sum(lengths)), lost, escaped)


def settled(
    parts: MovingParts, cut: Cut, memories: list[Array], periods: int
) -> tuple[Array, list[Array], list[Surface]]:
    """State, memories and surfaces of the motion that the teeth force, where it repeats with every tooth.

    Then each edge follows the path of the one before it and the chip is that of the feed alone, so that the machine is
    driven by a force that does not depend on its motion, and settles whether the cut is stable or not: until a period
    changes the state by less than 10⁻⁶ of itself, or for ``periods``.
    """
    steps = {s.step: step_of(parts, s.step) for s in cut.stretches}
    bias, batch = _mean_force(cut), len(cut.depth)
    state = np.zeros((len(parts.A), batch))
    still = [
        replace(s, radial=0 * s.radial, radial_between=0 * s.radial_between, radial_rate=0 * s.radial_rate)
        for s in cut.stretches
    ]
    for _ in range(periods):
        before, surfaces = state, list[Surface]()
        for stretch, edge in zip(cut.stretches, still, strict=True):
            met = Surface(np.zeros((*stretch.feed.shape, batch)), np.zeros((*stretch.feed_between.shape, batch))).fed(
                edge, cut.chip.feed or 0.0
            )
            x, v, state, memories = _across(parts, steps[edge.step], edge, cut, bias, met, state, memories)
            surfaces.append(Surface.ploughed(stretch, x, v))
        size = np.abs(state)
        if np.all(np.abs(state - before) <= _REPEATS * np.max(size, axis=1, keepdims=True, initial=0.0)):
            break
    return state, memories, surfaces


def _across(
    parts: MovingParts,
    step: Step,
    stretch: Stretch,
    cut: Cut,
    bias: Array,
    met: Surface,
    u: Array,
    memories: list[Array],
) -> tuple[Array, Array, Array, list[Array]]:
    """Tool displacement and velocity at the nodes of one stretch, (nodes, axes, batch), and what it ends with."""
    j, tool, h = len(parts.rest), parts.tool, stretch.step
    rows, batch = len(parts.P), u.shape[1]
    spring, damper = parts.spring[:, None], parts.damper[:, None]
    cutting = bool(stretch.feed.shape[1])
    twice = 2 * step.half
    offset = bias[:, None] * cut.depth
    x, v = np.empty((stretch.steps + 1, tool, batch)), np.empty((stretch.steps + 1, tool, batch))

    def forces(
        y: Array, duration: float, radial: Array, push: Array, height: Array, along: Array, edge: Array | None
    ) -> tuple[Array, list[Array]]:
        f = np.empty((j + tool, batch))
        after = []
        if j:
            f[:j] = spring * y[:j] + damper * y[j : 2 * j]
            for i, joint in enumerate(parts.rest):
                force, memory = joint.step(Motion(y[i], y[j + i], duration), memories[i])
                f[i] -= force
                after.append(memory)
        if cutting:
            chip = radial @ y[2 * j : 2 * j + tool] - height
            f[j:] = push @ (cut.depth * cut.chip.force(chip)) - offset
            if edge is not None and cut.chip.feed is not None:
                f[j:] += edge @ (cut.depth * (chip > 0))
            if stretch.rubbing:
                rubs = along @ y[2 * j + tool : 2 * j + 2 * tool]
                rubs = rubs if cut.chip.feed is None else np.where(chip > 0, rubs, 0.0)
                f[j:] -= stretch.rubbing * (along.T @ (cut.depth * rubs))
        else:
            f[j:] = -offset
        return f, after

    y = parts.P @ u
    edges = stretch.edge if stretch.edge is not None else [None] * (stretch.steps + 1)
    between = stretch.edge_between if stretch.edge_between is not None else [None] * stretch.steps
    f, _ = forces(y, 0.0, stretch.radial[0], stretch.force[0], met.height[0], stretch.along[0], edges[0])
    x[0], v[0] = y[2 * j : 2 * j + tool], y[2 * j + tool :]
    for k in range(stretch.steps):
        ahead = step.propagate @ u
        middle = (
            stretch.radial_between[k],
            stretch.force_between[k],
            met.between[k],
            stretch.along_between[k],
            between[k],
        )
        end = stretch.radial[k + 1], stretch.force[k + 1], met.height[k + 1], stretch.along[k + 1], edges[k + 1]
        fa, _ = forces(ahead[:rows] + step.half @ f, h / 2, *middle)
        fb, _ = forces(ahead[:rows] + step.half @ fa, h / 2, *middle)
        fc, _ = forces(ahead[rows : 2 * rows] + step.end @ f + twice @ fb, h, *end)
        u = ahead[2 * rows :] + step.first @ f + step.middle @ (fa + fb) + step.last @ fc
        y = parts.P @ u
        f, memories = forces(y, h, *end)
        x[k + 1], v[k + 1] = y[2 * j : 2 * j + tool], y[2 * j + tool :]
    return x, v, u, memories


def _left(stretch: Stretch, chip: Chip, met: Surface, new: Surface) -> tuple[Surface, Mask]:
    """Surface after the edges have passed, and in which motions one of them left the cut.

    Where the feed adds nothing, at the very ends of the arc, older surface lies behind the edge, not before it: any
    point inside the arc meets new surface there after enough passes. So an edge that only grazes is always in the cut.
    """
    if chip.feed is None:
        return new, np.zeros(new.height.shape[2], dtype=bool)
    grazes = stretch.feed[:, :, None] < _GRAZING
    off = (new.height < met.height) & ~grazes
    left = Surface(np.where(off, met.height, new.height), np.maximum(new.between, met.between))
    return left, np.any(off & (stretch.feed[:, :, None] > _SHALLOW), axis=(0, 1))


def _steady(chip: Chip, beyond: Array, push: Array, feed: Array, edge: Array | None) -> Array:
    """Force on the tool per depth in N/m without vibration, (nodes, axes)."""
    thickness = (chip.feed or 0.0) * feed + beyond
    total = np.einsum("kae,ke->ka", push, chip.force(thickness))
    return np.asarray(total if edge is None else total + np.einsum("kae,ke->ka", edge, thickness > 0))


def _mean_force(cut: Cut) -> Array:
    """Mean force on the tool per depth in N/m without vibration, (axes,)."""
    axes = cut.stretches[0].force.shape[1]
    total, period = np.zeros(axes), sum(s.step * s.steps for s in cut.stretches)
    if cut.chip.feed is None:
        return total
    for s in cut.stretches:
        parts = ((s.force, s.feed, s.edge), (s.force_between, s.feed_between, s.edge_between))
        nodes, middles = (_steady(cut.chip, s.beyond, *part) for part in parts)
        total += s.step / 6 * np.sum(nodes[:-1] + nodes[1:] + 4 * middles, axis=0)
    return np.asarray(total / period)
