"""Floquet multipliers of a tool with modes and any cutter, by collocation over one pattern of it.

    M q̈ + (C + b·D(t)) q̇ + K q = −b·Σ_j H_j(t)·[q(t) − q(t − τ_j)]

With the modal state x and motions q at nodes, q and q̇ answer to the force f at the nodes as

    q = R·x(0) + T·f,   q̇ = R'·x(0) + T'·f,   x(T) = E·x(0) + L·f,

where R, T, E and L know the tool and the nodes only, and f = −b·(own·q − before·q_before + rubs·q̇) the cut. The
multipliers are the eigenvalues of (x, q) → (x, q) one pattern on (cf. Butcher et al. 2009; Sims et al. 2008).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...tool.tool_model import ToolModel
from ..loops.collocation import chebyshev
from ..process.cutter import Cutter
from .elements import Nodes, elements

MORE, FINER = 6, 3
"""Nodes beyond the phase that the fastest mode turns in an element, and how many more prove them."""
_SHARE = 0.75
_LONGEST = 40.0


@dataclass(frozen=True, eq=False)
class Answers:
    """What the tool answers over one pattern at several speeds, first axis; see the module."""

    nodes: Nodes
    speed: Array
    state: Array
    """E."""
    push: Array
    """L."""
    entry: Array
    """R."""
    reply: Array
    """T."""
    entry_rate: Array
    reply_rate: Array

    @classmethod
    def of(cls, model: ToolModel, nodes: Nodes, speed: Array) -> Answers:
        """March through the pattern, mode by mode exactly, with the force a polynomial in every element."""
        modes, n, many, acting = len(model.poles), len(model.axes), len(nodes.places), len(nodes.acting)
        turning = 2 * np.pi * speed / 60
        shape = len(speed)
        state = np.broadcast_to(np.concatenate([np.eye(modes), 1j * np.eye(modes)], axis=1), (shape, modes, 2 * modes))
        state = state.astype(complex)
        pushed = np.zeros((shape, modes, acting * n), dtype=complex)
        R, T = np.zeros((shape, many, n, 2 * modes)), np.zeros((shape, many, n, acting * n))
        R1, T1 = np.zeros((shape, acting, n, 2 * modes)), np.zeros((shape, acting, n, acting * n))
        seen = model.weight[:, None] * model.outputs
        moving = seen * model.poles[:, None]
        at_once = (np.einsum("pa,pb->ab", seen, model.inputs)).real
        done = 0
        for part, span in zip(nodes.parts, nodes.spans, strict=True):
            duration = (part.end - part.start) / turning
            ring = np.exp(model.poles * duration[:, None])
            if span is None:
                state, pushed = ring[..., None] * state, ring[..., None] * pushed
                continue
            _, _, first, count = span
            x, derivative, _ = chebyshev(count)
            if first not in nodes.acting:
                R[:, first] = np.einsum("pa,zpc->zac", seen, state).real
                T[:, first, :, : done * n] = np.einsum("pa,zpc->zac", seen, pushed[:, :, : done * n]).real
            rate = 2 / duration[:, None, None, None]
            inverse = np.linalg.inv(rate * derivative[1:, 1:] - model.poles[:, None, None] * np.eye(count))
            free = np.exp(model.poles[:, None] * (duration[:, None, None] * (x[1:] + 1) / 2))
            rows, columns = slice(first + 1, first + 1 + count), slice(done * n, (done + count) * n)
            sent = np.einsum("zpkl,pb->zpklb", inverse, model.inputs)
            for look, entry, reply, to in ((seen, R, T, rows), (moving, R1, T1, slice(done, done + count))):
                turned = np.einsum("pa,zpk->zkap", look, free).reshape(shape, count * n, modes)
                entry[:, to] = (turned @ state).real.reshape(shape, count, n, -1)
                if done:
                    reply[:, to, :, : done * n] = (turned @ pushed[:, :, : done * n]).real.reshape(shape, count, n, -1)
                reply[:, to, :, columns] = np.einsum("pa,zpklb->zkalb", look, sent).real.reshape(
                    shape, count, n, count * n
                )
            for k in range(count):
                own = slice((done + k) * n, (done + k + 1) * n)
                T[:, first + 1 + k, :, own] += model.direct
                T1[:, done + k, :, own] += at_once
            pushed[:, :, : done * n] *= free[:, :, -1:]
            pushed[:, :, columns] = sent[:, :, -1].reshape(shape, modes, count * n)
            state = ring[..., None] * state
            done += count
        flat = (shape, many * n, -1)
        return cls(
            nodes,
            speed,
            np.concatenate([state.real, state.imag], axis=1),
            np.concatenate([pushed.real, pushed.imag], axis=1),
            R.reshape(flat),
            T.reshape(flat),
            R1.reshape(shape, acting * n, -1),
            T1.reshape(shape, acting * n, -1),
        )


@dataclass(frozen=True, eq=False)
class PatternMap:
    """The map over one pattern at several speeds and one depth in m."""

    answers: Answers
    depth: float
    own: Array
    before: Array
    rubs: Array
    """(C/v)·rubs of every speed."""

    @classmethod
    def of(cls, answers: Answers, depth: float, axes: list[int]) -> PatternMap:
        """Of the cut at a depth."""
        own, before, rubs = answers.nodes.forces(depth, axes)
        cutter = answers.nodes.cutter
        share = np.array([cutter.rubbing(rpm) for rpm in answers.speed.tolist()])
        k, n = rubs.shape[:2]
        whole = np.zeros((k, n, k, n))
        whole[np.arange(k), :, np.arange(k)] = rubs
        return cls(answers, depth, own, before, share[:, None, None] * whole.reshape(k * n, k * n))

    def maps(self) -> Array:
        """(x, q) → (x, q) one pattern on, only those q that are looked back at; (speeds, size, size)."""
        a, b = self.answers, self.depth
        met = np.flatnonzero(np.any(self.before, axis=0))
        entry, reply = self.own @ a.entry, self.own @ a.reply
        if np.any(self.rubs):
            entry, reply = entry + self.rubs @ a.entry_rate, reply + self.rubs @ a.reply_rate
        acts = np.broadcast_to(self.before[:, met], (len(a.speed), len(self.before), len(met)))
        pulled = np.linalg.solve(np.eye(reply.shape[-1]) + b * reply, -b * np.concatenate([entry, -acts], axis=2))
        held = np.concatenate([np.concatenate([a.push, a.reply[:, met]], axis=1) @ pulled], axis=2)
        states = a.state.shape[-1]
        held[:, :states, :states] += a.state
        held[:, states:, :states] += a.entry[:, met]
        return np.asarray(held)

    def closed(self, fraction: Array, i: int = 0) -> ComplexArray:
        """b·A(ν) at one of the speeds: a vibration keeps itself alive where −1 is an eigenvalue; (g, m, m)."""
        a = self.answers
        turn = np.exp(2j * np.pi * fraction)[:, None, None]
        ring = np.linalg.solve(turn * np.eye(a.state.shape[-1]) - a.state[i], a.push[i].astype(complex))
        moved = a.reply[i] + a.entry[i] @ ring
        found = (self.own - self.before / turn) @ moved
        if np.any(self.rubs[i]):
            found = found + self.rubs[i] @ (a.reply_rate[i] + a.entry_rate[i] @ ring)
        return np.asarray(self.depth * found)

    def force(self, fraction: float, carried: ComplexArray, orders: Array) -> ComplexArray:
        """Harmonics of the force at ω + qω_P for an eigenvector of `closed`, (orders, axes)."""
        nodes, pattern = self.answers.nodes, self.answers.nodes.cutter.pattern
        weight = []
        for span in nodes.spans:
            if span is not None:
                start, end, _, count = span
                weight.append(chebyshev(count)[2] * (end - start) / pattern / 2)
        time = nodes.places[nodes.acting] / pattern
        f = carried.reshape(len(time), -1) * np.concatenate(weight)[:, None]
        return np.asarray(np.exp(-2j * np.pi * (fraction + orders)[:, None] * time) @ f)


def pattern_nodes(fastest: float, cutter: Cutter, depth: float, slowest: float, more: int = MORE) -> Nodes:
    """Nodes that resolve modes up to ``fastest`` (rad/s) at all speeds from ``slowest`` (rpm) on, at a depth in m."""
    turning, parts, counts = 2 * np.pi * slowest / 60, [], []
    for part in elements(cutter, depth):
        theta = (fastest + 2 * turning) * (part.end - part.start) / turning
        pieces = max(1, int(np.ceil(theta / _LONGEST))) if part.flutes else 1
        for edge in range(pieces):
            width = (part.end - part.start) / pieces
            start = part.start + edge * width
            parts.append(type(part)(start, part.end if edge == pieces - 1 else start + width, part.flutes))
            counts.append(int(np.ceil(_SHARE * theta / pieces)) + more)
    return Nodes.of(cutter, tuple(parts), tuple(counts))


def pattern_map(model: ToolModel, cutter: Cutter, speed: Array, depth: float, more: int = MORE) -> PatternMap:
    """The map at speeds in rpm and a depth in m."""
    nodes = pattern_nodes(model.fastest, cutter, depth, float(np.min(speed)), more)
    axes = ["xy".index(axis) for axis in model.axes]
    return PatternMap.of(Answers.of(model, nodes, speed), depth, axes)
