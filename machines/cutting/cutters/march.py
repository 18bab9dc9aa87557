"""The map over one pattern applied element by element, without a matrix of it: for slow spindles.

It is the map of `pattern_map` and has its multipliers. That one answers with all nodes of the pattern together, and a
slow spindle asks for thousands. Here the state x of the modes passes from element to element, and in each of them

    f = K₁·x + K₂·q + K₃·q_before,   q = R·x + T·f,   x ← E·x + L·f,

with the few q of the pattern that the element looks back at. The work grows as the pattern does, and the largest
multipliers come from some tens of turns (Arnoldi's method, ARPACK).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ...deadline import in_time
from ...indices import Index
from ...tool.tool_model import ToolModel
from ..loops.collocation import chebyshev
from ..process.cutter import Cutter
from .elements import Acts, Nodes
from .pattern_map import MORE, pattern_nodes

_FIRST, _BASIS = 6, 30
"""Multipliers asked for to begin with, and turns beyond twice as many that find them."""
EXACT = 1e-10
"""Relative error of multipliers."""
_ROUNDS = 60
_KEPT = 200
"""Elements of different length whose tool is kept."""


@dataclass(frozen=True, eq=False)
class Tool:
    """What a tool answers in an element of ``count`` nodes, of modal states (Re, Im) and forces at its nodes.

    ``entry`` and ``reply`` give motions at the nodes, ``entry_rate`` and ``reply_rate`` their velocities, ``push`` the
    state at the end; ``ring`` is what a state becomes without forces, by mode.
    """

    entry: Array
    reply: Array
    entry_rate: Array
    reply_rate: Array
    push: Array
    ring: ComplexArray

    @classmethod
    def of(cls, model: ToolModel, count: int, duration: float) -> Tool:
        """Over a duration in s."""
        n, modes = len(model.axes), len(model.poles)
        x, derivative, _ = chebyshev(count)
        seen = model.weight[:, None] * model.outputs
        moving = seen * model.poles[:, None]
        inverse = np.linalg.inv(2 / duration * derivative[1:, 1:] - model.poles[:, None, None] * np.eye(count))
        free = np.exp(model.poles[:, None] * (duration * (x[1:] + 1) / 2))
        found = list[Array]()
        for look, direct in ((seen, model.direct), (moving, np.einsum("pa,pb->ab", seen, model.inputs).real)):
            turned = np.einsum("pa,pk->kap", look, free).reshape(count * n, modes)
            pairs = (look[:, :, None] * model.inputs[:, None, :]).reshape(modes, n * n)
            sent = (pairs.T @ inverse.reshape(modes, count * count)).real.reshape(n, n, count, count)
            sent[:, :, np.arange(count), np.arange(count)] += direct[:, :, None]
            found += [np.concatenate([turned.real, -turned.imag], axis=1)]
            found += [sent.transpose(2, 0, 3, 1).reshape(count * n, count * n)]
        push = np.einsum("pl,pb->plb", inverse[:, -1], model.inputs).reshape(modes, count * n)
        push = np.concatenate([push.real, push.imag])
        entry, reply, entry_rate, reply_rate = found
        return cls(entry, reply, entry_rate, reply_rate, push, np.exp(model.poles * duration))


@dataclass(frozen=True, eq=False)
class Step:
    """One element at a depth: where it looks, what it does; ``act`` is [K₁, K₂, K₃]."""

    tool: Tool
    nodes: slice
    enters: bool
    """Whether the output before its nodes is none of another element."""
    looked: Index
    remembered: Index
    act: Array


@dataclass(frozen=True, eq=False)
class March:
    """The map over one pattern at a speed in rpm and a depth in m."""

    model: ToolModel
    nodes: Nodes
    steps: tuple[Step | ComplexArray, ...]
    """Elements; what a free flight makes of the modes in its place."""

    @property
    def states(self) -> int:
        """Modal states, Re and Im."""
        return 2 * len(self.model.poles)

    @cached_property
    def met(self) -> Index:
        """Outputs of one pattern that the next one looks back at."""
        return np.unique(np.concatenate([np.zeros(0, int)] + [s.remembered for s in self.steps if isinstance(s, Step)]))

    def __call__(self, state: Array) -> Array:
        """(x, q) one pattern on."""
        x, q = state[: self.states], np.zeros(len(self.nodes.places) * len(self.model.axes))
        before = np.zeros_like(q)
        before[self.met] = state[self.states :]
        for step in self.steps:
            if not isinstance(step, Step):
                x = _rung(x, step)
                continue
            if step.enters:
                q[step.nodes.start - len(self._seen) : step.nodes.start] = self._seen @ x
            force = step.act @ np.concatenate([x, q[step.looked], before[step.remembered]])
            q[step.nodes] = step.tool.entry @ x + step.tool.reply @ force
            x = _rung(x, step.tool.ring) + step.tool.push @ force
        return np.concatenate([x, q[self.met]])

    @cached_property
    def _seen(self) -> Array:
        seen = (self.model.weight[:, None] * self.model.outputs).T
        return np.concatenate([seen.real, -seen.imag], axis=1)

    def multipliers(self, beyond: float = np.inf, count: int = _FIRST, tolerance: float = EXACT) -> ComplexArray:
        """The largest ones, the largest first: all whose size is ``beyond`` or more, and ``count`` or some more.

        To a relative ``tolerance``.
        """
        size = self.states + len(self.met)
        operator = scipy.sparse.linalg.LinearOperator((size, size), matvec=self, dtype=float)
        while 3 * count + _BASIS < size:
            in_time()
            basis, start = 2 * count + _BASIS, np.cos(np.arange(size) ** 2)
            try:
                found, _ = scipy.sparse.linalg.eigs(
                    operator, count, ncv=basis, v0=start, maxiter=_ROUNDS, tol=tolerance
                )
            except scipy.sparse.linalg.ArpackNoConvergence:  # more turns at once
                count *= 2
                continue
            found = found[np.argsort(-np.abs(found), kind="stable")]
            if abs(found[-1]) < beyond:
                return np.asarray(found)
            count *= 2
        every = np.linalg.eigvals(np.stack([self(e) for e in np.eye(size)], axis=1)).astype(complex)
        return np.asarray(every[np.argsort(-np.abs(every), kind="stable")])


@dataclass(frozen=True, eq=False)
class Marcher:
    """Maps of a tool and a cutter at one speed in rpm at any depth; what no depth changes is computed once."""

    model: ToolModel
    cutter: Cutter
    speed: float
    more: int = MORE

    def at(self, depth: float) -> March:
        """The map at a depth in m."""
        nodes, cuts = self._cut(depth) if self.cutter.twisted else self._straight
        turning, n = 2 * np.pi * self.speed / 60, len(self.model.axes)
        steps, last, held = list[Step | ComplexArray](), -1, iter(cuts)
        for part, span in zip(nodes.parts, nodes.spans, strict=True):
            if span is None:
                steps.append(np.exp(self.model.poles * (part.end - part.start) / turning))
                continue
            _, _, first, count = span
            cut = next(held)
            act = np.asarray(np.linalg.solve(np.eye(len(cut.back)) + depth * cut.back, -depth * cut.act))
            own = slice((first + 1) * n, (first + 1 + count) * n)
            steps.append(Step(cut.tool, own, first > last, cut.looked, cut.remembered, act))
            last = first + count
        return March(self.model, nodes, tuple(steps))

    @cached_property
    def _straight(self) -> tuple[Nodes, list[_Cut]]:
        return self._cut(1.0)

    def _cut(self, depth: float) -> tuple[Nodes, list[_Cut]]:
        nodes = pattern_nodes(self.model.fastest, self.cutter, depth, self.speed, self.more)
        axes = ["xy".index(axis) for axis in self.model.axes]
        turning, found, acts = 2 * np.pi * self.speed / 60, list[_Cut](), nodes.acts(depth, axes)
        for part, span in zip(nodes.parts, nodes.spans, strict=True):
            if span is not None:
                tool = self._tool(span[3], (part.end - part.start) / turning)
                found.append(_Cut.of(tool, next(acts), span[2] + 1, self.cutter.rubbing(self.speed)))
        return nodes, found

    def _tool(self, count: int, duration: float) -> Tool:
        """Elements that last as long, but for rounding, share what the tool answers."""
        key = count, round(duration * self.model.fastest, 9)
        if key not in self._known:
            if len(self._known) > _KEPT:
                self._known.clear()
            self._known[key] = Tool.of(self.model, count, duration)
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[int, float], Tool]:
        return {}


@dataclass(frozen=True, eq=False)
class _Cut:
    """The cut in one element per depth: f = −b·(act·[x; q; q_before] + back·f)."""

    tool: Tool
    act: Array
    back: Array
    looked: Index
    remembered: Index

    @classmethod
    def of(cls, tool: Tool, acts: Acts, first: int, rubbing: float) -> _Cut:
        """Of an element whose nodes begin at output ``first``, with C/v in N s/m²."""
        count, n = acts.rubs.shape[:2]
        own, looked = laid(acts.own, count * n)
        before, remembered = laid(acts.before, count * n)
        here = (looked >= first * n) & (looked < (first + count) * n)
        entry, back = own[:, here] @ tool.entry, own[:, here] @ tool.reply
        if rubbing:
            rubs = np.zeros((count, n, count, n))
            rubs[np.arange(count), :, np.arange(count)] = rubbing * acts.rubs
            rub = rubs.reshape(back.shape)
            entry, back = entry + rub @ tool.entry_rate, back + rub @ tool.reply_rate
        return cls(tool, np.concatenate([entry, own[:, ~here], -before], axis=1), back, looked[~here], remembered)


def laid(blocks: dict[int, Array], rows: int) -> tuple[Array, Index]:
    """Blocks beside each other and their columns, those that take part."""
    if not blocks:
        return np.zeros((rows, 0)), np.zeros(0, int)
    n = next(iter(blocks.values())).shape[-1]
    every = [np.arange(first * n, (first + block.shape[2]) * n) for first, block in blocks.items()]
    columns, place = np.unique(np.concatenate(every), return_inverse=True)
    laid = np.zeros((rows, len(columns)))
    for block, at in zip(blocks.values(), np.split(place, np.cumsum([len(one) for one in every])[:-1]), strict=True):
        laid[:, at] += block.reshape(rows, -1)
    return laid, columns


def _rung(x: Array, ring: ComplexArray) -> Array:
    """Modal states (Re, Im) turned and shrunk."""
    turned = ring * (x[: len(ring)] + 1j * x[len(ring) :])
    return np.concatenate([turned.real, turned.imag])
