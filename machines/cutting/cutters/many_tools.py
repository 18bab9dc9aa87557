"""How fast vibration grows in the cut of any cutter, of many tools at once: the march over one pattern, side by side.

It is the map of `march`, whose elements pass the state x of the modes on,

    f = −b·Q·(K₁·x + K₂·q + K₃·q_before),   q = R·x + T·f,   x ← E·x + L·f,   Q = (1 + b·K·T)⁻¹,

with an axis of tools in front. What the cutter does at a depth is the same for all of them but for the size of its
forces. A block of vectors is carried through the pattern until its largest multiplier settles (simultaneous iteration,
Bauer 1957; Golub & Van Loan, Matrix Computations, ch. 7.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...deadline import in_time
from ...indices import Index
from ..loops.collocation import chebyshev
from ..process.cutter import Cutter
from ..process.cutting import Cutting
from .elements import Acts, Nodes
from .march import laid
from .pattern_map import pattern_nodes

UNIT = 1e9
"""N/m², of a coefficient to which those of tools are factors."""
_MORE = 2
"""Nodes beyond the phase that the fastest mode turns in an element: a border is right within a thousandth then."""
_VECTORS, _FIRST, _STRIDE, _TURNS = 8, 12, 4, 40
"""Vectors side by side; tooth periods before the first look, from one look to the next, and looks at most."""
_SETTLED = 5e-4
"""By how much ln|μ| and arg μ of a pattern change from one look to the next where they are believed."""
_PIECE = 64
"""Tools whose matrices stay in the cache."""
_ALIKE = 1e-12


@dataclass(frozen=True, eq=False)
class Tools:
    """Tools of as many modes, and their cuts: G(ω) = Σ o·iᵀ/(jω − s) + conjugates + D.

    Parameters
    ----------
    poles
        s in rad/s, (tools, modes).
    outputs, inputs
        o and i, (tools, modes, axes).
    direct
        D in m/N, (tools, axes, axes).
    tangential, normal
        K_t and K_n in N/m², (tools,).
    damping
        C of process damping in N/m beside that of the cut, (tools,).
    """

    poles: ComplexArray
    outputs: ComplexArray
    inputs: ComplexArray
    direct: Array
    tangential: Array
    normal: Array
    damping: Array

    def of(self, rows: Index) -> Tools:
        """Some of them, in an order."""
        return Tools(*(getattr(self, one.name)[rows] for one in fields(self)))


@dataclass(frozen=True, eq=False)
class Teeth:
    """The cut of one operation at a speed in rpm by tools whose fastest mode that counts has ``fastest`` rad/s."""

    cutting: Cutting
    axes: tuple[int, ...]
    speed: float
    fastest: float

    def growth(self, tools: Tools, depth: float) -> tuple[Array, Array]:
        """ln|μ| of a tooth period on average, and |arg μ| in rad of a pattern, at a depth in m; (tools,) each."""
        parts = list[tuple[Array, Array]]()
        weights, cutters = self._parted(tools)
        nodes = pattern_nodes(self.fastest, cutters[0], depth, self.speed, _MORE)
        cuts = [[_Act.of(acts) for acts in replace(nodes, cutter=one).acts(depth, list(self.axes))] for one in cutters]
        share = cutters[0].rubbing(self.speed), 60 / (np.pi * (self.cutting.diameter or np.inf) * self.speed)
        for begin in range(0, len(tools.poles), _PIECE):
            in_time()
            rows = np.arange(begin, min(begin + _PIECE, len(tools.poles)))
            some = tools.of(rows)
            rubs = share[0] + share[1] * some.damping
            elements = list(self._elements(some, nodes, cuts, weights[:, rows], rubs, depth))
            seen = 2 * some.outputs.swapaxes(1, 2)
            outputs = np.concatenate([seen.real, -seen.imag], axis=2)
            marched = _Marched(outputs, len(nodes.places) * len(self.axes), elements)
            parts.append(marched.largest(len(cutters[0].flutes)))
        rate, angle = (np.concatenate(part) for part in zip(*parts, strict=True))
        return rate / len(cutters[0].flutes), angle

    @property
    def pattern_frequency(self) -> float:
        """Hz."""
        return Cutter.of(self.cutting).frequency(self.speed)

    def _parted(self, tools: Tools) -> tuple[Array, list[Cutter]]:
        """Cutters of coefficients of `UNIT`, and what of each the tools have, (cutters, tools)."""
        ratio = tools.normal / tools.tangential
        if np.ptp(ratio) <= _ALIKE * np.max(np.abs(ratio)):
            units = [(UNIT, UNIT * float(ratio[0]))]
            weights = [tools.tangential / UNIT]
        else:
            units = [(UNIT, 0.0), (UNIT, UNIT)]
            weights = [(tools.tangential - tools.normal) / UNIT, tools.normal / UNIT]
        return np.array(weights), [
            Cutter.of(replace(self.cutting, tangential=tangential, normal=normal)) for tangential, normal in units
        ]

    def _elements(
        self,
        tools: Tools,
        nodes: Nodes,
        cuts: Sequence[Sequence[_Act]],
        weights: Array,
        rubs: Array,
        depth: float,
    ) -> Iterator[_Element | ComplexArray]:
        turning, known, row = 2 * np.pi * self.speed / 60, dict[tuple[int, float], _Answer](), 0
        for part, span in zip(nodes.parts, nodes.spans, strict=True):
            duration = (part.end - part.start) / turning
            if span is None:
                yield np.exp(tools.poles * duration)
                continue
            _, _, first, count = span
            key = count, round(duration * self.fastest, 9)
            if key not in known:
                known[key] = _Answer.of(tools, count, duration, bool(np.any(rubs)))
            n = len(self.axes)
            held = slice((first + 1) * n, (first + 1 + count) * n)
            yield _Element.of(known[key], [one[row] for one in cuts], weights, rubs, held, depth)
            row += 1


@dataclass(frozen=True, eq=False)
class _Answer:
    """`march.Tool` of many tools."""

    entry: Array
    reply: Array
    entry_rate: Array | None
    reply_rate: Array | None
    push: Array
    ring: ComplexArray

    @classmethod
    def of(cls, tools: Tools, count: int, duration: float, rubs: bool) -> _Answer:
        (many, modes, n), poles = tools.outputs.shape, tools.poles
        x, derivative, _ = chebyshev(count)
        inverse = np.linalg.inv(2 / duration * derivative[1:, 1:] - poles[:, :, None, None] * np.eye(count))
        free = np.exp(poles[:, :, None] * (duration * (x[1:] + 1) / 2))
        seen, found = 2 * tools.outputs, list[Array | None]()
        at_once = np.einsum("zpa,zpb->zab", seen, tools.inputs).real
        for look, direct in ((seen, tools.direct), (seen * poles[:, :, None], at_once)):
            if len(found) and not rubs:
                found += [None, None]
                continue
            turned = (free.swapaxes(1, 2)[:, :, None] * look.swapaxes(1, 2)[:, None]).reshape(many, count * n, modes)
            pairs = (look[:, :, :, None] * tools.inputs[:, :, None]).reshape(many, modes, n * n)
            sent = (pairs.swapaxes(1, 2) @ inverse.reshape(many, modes, -1)).real.reshape(many, n, n, count, count)
            sent[:, :, :, np.arange(count), np.arange(count)] += direct[..., None]
            found += [np.concatenate([turned.real, -turned.imag], axis=2)]
            found += [sent.transpose(0, 3, 1, 4, 2).reshape(many, count * n, count * n)]
        push = (inverse[:, :, -1, :, None] * tools.inputs[:, :, None]).reshape(many, modes, count * n)
        entry, reply, entry_rate, reply_rate = found
        assert entry is not None
        assert reply is not None
        ring = np.exp(poles * duration)
        return cls(entry, reply, entry_rate, reply_rate, np.concatenate([push.real, push.imag], axis=1), ring)


@dataclass(frozen=True, eq=False)
class _Act:
    """`Acts` laid side by side, with the columns of outputs that take part, and what rubs as one matrix."""

    own: Array
    looked: Index
    before: Array
    remembered: Index
    rubs: Array

    @classmethod
    def of(cls, acts: Acts) -> _Act:
        count, n = acts.rubs.shape[:2]
        rubs = np.zeros((count, n, count, n))
        rubs[np.arange(count), :, np.arange(count)] = acts.rubs
        return cls(*laid(acts.own, count * n), *laid(acts.before, count * n), rubs.reshape(count * n, count * n))


@dataclass(frozen=True, eq=False)
class _Element:
    """One element of all tools at a depth: force = ``act`` @ (``entry`` @ x + ``own`` @ q + ``before`` @ q_before)."""

    answer: _Answer
    nodes: slice
    act: Array
    entry: Array
    own: Array
    looked: Index
    before: Array
    remembered: Index

    @classmethod
    def of(
        cls, answer: _Answer, acts: Sequence[_Act], weights: Array, rubs: Array, nodes: slice, depth: float
    ) -> _Element:
        own = _weighed([one.own for one in acts], weights)
        looked = acts[0].looked
        here = (looked >= nodes.start) & (looked < nodes.stop)
        entry, back = own[:, :, here] @ answer.entry, own[:, :, here] @ answer.reply
        if answer.entry_rate is not None and answer.reply_rate is not None:
            rub = rubs[:, None, None] * acts[0].rubs
            entry, back = entry + rub @ answer.entry_rate, back + rub @ answer.reply_rate
        act = np.asarray(-depth * np.linalg.inv(np.eye(back.shape[1]) + depth * back), dtype=float)
        before = -_weighed([one.before for one in acts], weights)
        return cls(answer, nodes, act, entry, own[:, :, ~here], looked[~here], before, acts[0].remembered)


def _weighed(parts: Sequence[Array], weights: Array) -> Array:
    return np.asarray(sum(w[:, None, None] * part for w, part in zip(weights, parts, strict=True)))


@dataclass(frozen=True, eq=False)
class _Marched:
    """The map over one pattern of all tools at a depth."""

    outputs: Array
    """q of modal states, (tools, axes, states)."""
    places: int
    elements: Sequence[_Element | ComplexArray]

    def after(self, x: Array, before: Array) -> tuple[Array, Array]:
        """States and outputs, (tools, …, vectors), one pattern on."""
        q, last, n = np.zeros_like(before), 0, self.outputs.shape[1]
        for element in self.elements:
            if not isinstance(element, _Element):
                x = _rung(x, element)
                continue
            answer, nodes = element.answer, element.nodes
            if nodes.start != last:  # after a free flight
                q[:, nodes.start - n : nodes.start] = self.outputs @ x
            wanted = element.entry @ x + element.own @ q[:, element.looked]
            force = element.act @ (wanted + element.before @ before[:, element.remembered])
            q[:, nodes] = answer.entry @ x + answer.reply @ force
            x = _rung(x, answer.ring) + answer.push @ force
            last = nodes.stop
        return x, q

    def largest(self, flutes: int) -> tuple[Array, Array]:
        """ln|μ| and |arg μ| of the pattern, (tools,)."""
        held = [one.remembered for one in self.elements if isinstance(one, _Element)]
        met = np.unique(np.concatenate([np.zeros(0, dtype=int), *held]))
        many, states = len(self.outputs), self.outputs.shape[2]
        size = states + len(met)
        start = np.cos(np.arange(size * _VECTORS).reshape(size, -1) ** 1.5)
        block = np.broadcast_to(start, (many, *start.shape))
        before = np.full((2, many), np.inf)
        now, turns = before, int(np.ceil(_FIRST / flutes))
        for _ in range(_TURNS):
            for _ in range(turns):
                block = self._mapped(block, met)
            block = np.linalg.qr(block)[0]
            after = self._mapped(block, met)
            value = np.linalg.eigvals(block.swapaxes(1, 2) @ after)
            top = np.take_along_axis(value, np.argmax(np.abs(value), axis=1)[:, None], axis=1)[:, 0]
            now = np.array([np.log(np.maximum(np.abs(top), 1e-300)), np.abs(np.angle(top))])
            if np.all(np.abs(now - before) < _SETTLED):
                break
            block, before, turns = after, now, int(np.ceil(_STRIDE / flutes))
        return now[0], now[1]

    def _mapped(self, block: Array, met: Index) -> Array:
        states = self.outputs.shape[2]
        q = np.zeros((len(block), self.places, block.shape[2]))
        q[:, met] = block[:, states:]
        x, q = self.after(block[:, :states], q)
        return np.concatenate([x, q[:, met]], axis=1)


def _rung(x: Array, ring: ComplexArray) -> Array:
    """Modal states (Re, Im), (tools, states, vectors), turned and shrunk."""
    modes = ring.shape[1]
    re, im = ring.real[:, :, None], ring.imag[:, :, None]
    a, b = x[:, :modes], x[:, modes:]
    return np.concatenate([re * a - im * b, im * a + re * b], axis=1)
