"""What zero order misses at test cuts whose cutter is no plain one, learnt from multipliers of tools with other modes.

How far in ln b a depth lies from the border is exact less zero order a polynomial of second order in the logarithms of
the frequencies of the modes that the tool feels and of the size of the forces, and of first order in those of the
damping ratios, at every depth that is asked for. What the polynomial misses of the tools that it was learnt from stands
beside it, as scatter of the border.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import each

from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.cutters.many_tools import Teeth, Tools
from ..indices import Index
from ..model.machine import Machine
from .borders import Condition, border, met
from .growth import FAR, asked_of, to_border
from .passes import factors
from .sampled_tool import Drawn, SampledTool, features

TOOLS = 60
"""With other modes, whose multipliers are computed; at least twice the terms of the polynomial."""
_FREQUENCY, _DAMPING, _FORCE = 0.03, 0.3, 0.3
"""Deviations of the logarithms that they have at least."""
_RIDGE = 1e-3
_NEAR, _DOUBTED = 0.7, 0.1
"""ln of depths from the border at which a tool counts half, and what one counts of which nothing is learnt."""
_LIKE = 0.02
"""Of a chatter frequency, within which shifts are those of one mode."""


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A value at every depth: ``weights`` of the terms, (terms, depths); none is told beyond ``low`` and ``high``,
    (depths,)."""

    weights: Array
    low: Array
    high: Array

    @classmethod
    def constant(cls, value: float, terms: int, depths: int) -> Polynomial:
        """The same at every depth, whatever the tool."""
        one = np.full(depths, value)
        return cls(np.zeros((terms, depths)), one, one)

    @classmethod
    def fitted(cls, terms: Array, values: Array, trust: Array) -> Polynomial:
        """To values of tools, (tools, depths), by how much each is believed."""
        weighed = terms.T * trust.T[:, None]  # (depths, terms, tools)
        square = weighed @ terms + _RIDGE * np.eye(terms.shape[1])
        weights = np.asarray(np.linalg.solve(square, weighed @ values.T[:, :, None])[:, :, 0].T, dtype=float)
        believed = np.where(trust > _DOUBTED, values, np.nan)
        believed = np.where(np.all(np.isnan(believed), axis=0), values, believed)
        return cls(weights, np.nanmin(believed, axis=0), np.nanmax(believed, axis=0))

    def of(self, terms: Array) -> Array:
        """Of tools by their terms, (tools, depths)."""
        return np.asarray(np.clip(terms @ self.weights, self.low, self.high))


@dataclass(frozen=True, eq=False)
class Learnt:
    """Exact less zero order at one condition, at its depths.

    Parameters
    ----------
    missed
        ln(b_lim/b) of exact less zero order.
    shift
        Hz from zero order's frequency of chatter to the exact one.
    scatter
        Of ln b, what the polynomial misses of it.
    flip
        Whether it flips.
    """

    missed: Polynomial
    shift: Polynomial
    scatter: float = 0.0
    flip: bool = False


@dataclass(frozen=True, eq=False)
class Exactness:
    """What was learnt, by condition; ``modes`` it depends on, and in the middle their ln|s| and ln ζ and ln K_t."""

    of: tuple[Learnt, ...]
    modes: tuple[int, ...]
    centre: Array

    def beside(self, drawn: Drawn, k: int) -> tuple[Array, Array]:
        """ln(b_lim/b), and Hz, of exact less zero order of every sample at condition k, (samples, depths)."""
        terms = _terms(_features(drawn, self.modes) - self.centre)
        return self.of[k].missed.of(terms), self.of[k].shift.of(terms)


def of_zero_order(
    tool: SampledTool, at: Condition, changed: Drawn, rows: Index, still: list[ComplexArray] | None = None
) -> tuple[Array, Array]:
    """The border in m and Hz by zero order, (draws,), from eigenvalues that stand ``still`` where they are known."""
    if still is not None:
        return met(still, tool.lines, at)
    damping = changed.damping + (at.cutting.process_damping or 0.0)
    return border(tool.response(changed, rows), tool.lines, at, changed.tangential, changed.normal, damping)


def told(
    depth: Array, frequency: Array, changed: Drawn, ladder: Array, known: Exactness | None, k: int
) -> tuple[Array, Array, Array]:
    """ln(b_lim/b) and the frequency of chatter in Hz at depths in m, (draws, depths), and that at the border, (draws,),
    by the border of zero order and what is ``known`` of condition k beside it."""
    with np.errstate(divide="ignore"):
        apart = np.clip(np.log(depth[:, None] / ladder), -FAR, FAR)
    each_depth = np.broadcast_to(frequency[:, None], apart.shape)
    if known is not None:
        missed, shift = known.beside(changed, k)
        apart, each_depth = np.clip(apart + missed, -FAR, FAR), each_depth + shift
    first = np.argmin(np.abs(apart), axis=1)
    return apart, each_depth, each_depth[np.arange(len(apart)), first]


def learnt(
    machine: Machine,
    tool: SampledTool,
    conditions: Sequence[Condition],
    depths: Sequence[Array],
    seed: int,
    tools: int | None = None,
) -> Exactness:
    """Compare with multipliers at the conditions of cuts and their depths; in turning zero order is exact."""
    modes = tuple(tool.felt())
    centre = np.median(_features(tool.drawn(), modes), axis=0)
    size = _terms(np.zeros((1, len(centre)))).shape[1]
    if conditions[0].cutting.process != "milling":
        none = [Polynomial.constant(0.0, size, len(ladder)) for ladder in depths]
        return Exactness(tuple(Learnt(one, one) for one in none), modes, centre)
    if not tool.modal:
        pairs = zip(conditions, depths, strict=True)
        return Exactness(tuple(_of_machine(machine, tool, at, len(x), size) for at, x in pairs), modes, centre)
    count = tools or max(TOOLS, 2 * size)
    spread = np.std(_features(tool.drawn(), modes), axis=0)
    floor = np.concatenate([np.repeat([_FREQUENCY, _DAMPING], len(modes)), [_FORCE]])
    rng = np.random.default_rng([seed, 20])
    off = np.maximum(spread, floor) * rng.standard_normal((count, len(centre)))
    off[0] = 0.0
    rows = np.arange(count) % tool.count
    others, terms = _others(tool, modes, centre + off, rows), _terms(off)
    found = list[Learnt]()
    for at, ladder in zip(each("places of cuts", conditions, len(conditions)), depths, strict=True):
        rough, lines, _ = told(*of_zero_order(tool, at, others, rows), others, ladder, None, 0)
        exact, hertz = by_multipliers(tool, at, others, rows, ladder, lines)
        trust = 1 / (1 + (exact / _NEAR) ** 4)
        missed = Polynomial.fitted(terms, exact - rough, trust)
        left = exact - rough - missed.of(terms)
        scatter = float(np.sqrt(np.sum(trust * left**2) / np.sum(trust) / max(1 - size / count, 1 / count)))
        off_line = np.nan_to_num(hertz - lines)
        # Chatter of another mode is none that the lines of zero order lead to.
        alike = np.isfinite(lines) & (np.abs(off_line - np.median(off_line, axis=0)) < _LIKE * np.nan_to_num(lines))
        shift = Polynomial.fitted(terms, off_line, trust * alike)
        found.append(Learnt(missed, shift, scatter))
    return Exactness(tuple(found), modes, centre)


def by_multipliers(
    tool: SampledTool, at: Condition, changed: Drawn, rows: Index, ladder: Array, beside: Array
) -> tuple[Array, Array]:
    """ln(b_lim/b) and the frequency of chatter in Hz at depths in m, (draws, depths), by the multipliers of a pattern.

    A multiplier tells a frequency but for its sign and whole frequencies of the pattern: it is that next to ``beside``.
    """
    outputs, inputs = factors(changed.residue)
    forces = changed.tangential, changed.normal, changed.damping
    tools = Tools(changed.poles, outputs, inputs, tool.direct[rows], *forces)
    axes = tuple("xy".index(axis) for axis in tool.axes)
    teeth = Teeth(at.cutting, axes, at.speed, 2 * np.pi * _highest(tool, changed))
    grown, angle = (
        np.stack(part, axis=1) for part in zip(*(teeth.growth(tools, b) for b in asked_of(ladder)), strict=True)
    )
    apart = to_border(grown, ladder, changed.poles[:, tool.felt()], at.tooth_frequency)
    pattern = teeth.pattern_frequency
    line = angle[:, : len(ladder)] / (2 * np.pi) * pattern
    either = np.stack([sign * line + pattern * np.round((beside - sign * line) / pattern) for sign in (1.0, -1.0)])
    nearest = np.argmin(np.abs(np.nan_to_num(either - beside)), axis=0)
    return np.clip(apart, -FAR, FAR), np.take_along_axis(either, nearest[None], axis=0)[0]


def _highest(tool: SampledTool, changed: Drawn) -> float:
    """Hz of the highest mode for which nodes have to lie closely enough."""
    return float(np.max(np.abs(changed.poles[:, tool.felt()]))) / (2 * np.pi)


def _others(tool: SampledTool, modes: tuple[int, ...], wanted: Array, rows: Index) -> Drawn:
    """Samples whose modes and forces stand where their `_features` are to."""
    one = tool.drawn().of(rows)
    factor = np.exp(wanted - _features(one, modes))
    for i, mode in enumerate(modes):
        one = one.moved(mode, factor[:, i], factor[:, len(modes) + i])
    return replace(one, tangential=one.tangential * factor[:, -1], normal=one.normal * factor[:, -1])


def _of_machine(machine: Machine, tool: SampledTool, at: Condition, many: int, size: int) -> Learnt:
    """Of a tool known on lines: by the exact chart of the machine as it is."""
    middle = np.median(tool.tangential), np.median(tool.normal)
    assert tool.receptance is not None
    G = np.mean(tool.receptance, axis=0)[None]
    table = {**(machine.cutting or {}), "mode": at.cutting.mode, "immersion": at.cutting.immersion}
    try:
        chart = lobes_at_amplitude(replace(machine, cutting=table), [at.speed])
    except (CheckFailed, InputError) as error:
        raise InputError(f"{machine.where}: no exact chart at the speeds of the cuts: {error}") from None
    tangential, normal = (np.array([float(m)]) for m in middle)
    rough, at_rough = border(G, tool.lines, at, tangential, normal, np.zeros(1))
    exact, kind = (float(chart.depth[0]), float(chart.chatter_frequency[0])), str(chart.kind[0])
    missed, shift = _between(*exact, kind, rough[0], at_rough[0], at)
    beside, off = (Polynomial.constant(value, size, many) for value in (missed, shift))
    return Learnt(beside, off, flip=kind == "flip")


def _between(
    depth: float, frequency: float, kind: str, rough: float, at_rough: float, at: Condition
) -> tuple[float, float]:
    """ln of exact over rough depth, and the Hz between their frequencies."""
    if not (np.isfinite(depth) and np.isfinite(rough)):
        same = np.isfinite(depth) == np.isfinite(rough)
        return 0.0 if same else FAR * (1 if np.isfinite(rough) else -1), 0.0
    off = frequency - at_rough
    off -= at.tooth_frequency * np.round(off / at.tooth_frequency)  # lines a tooth frequency apart are one chatter
    near = kind != "flip" and abs(off) < 0.05 * at_rough
    return float(np.clip(np.log(depth / rough), -FAR, FAR)), float(off) if near else 0.0


def _features(drawn: Drawn, modes: tuple[int, ...]) -> Array:
    """ln|s| and ln ζ of modes and ln K_t, (samples, 2·modes + 1)."""
    return np.concatenate([features(drawn.poles[:, list(modes)]), np.log(drawn.tangential)[:, None]], axis=1)


def _terms(off: Array) -> Array:
    """1, all of first order, and squares and products of the frequencies and the forces."""
    modes = off.shape[1] // 2
    f = np.concatenate([off[:, :modes], off[:, -1:]], axis=1)
    products = [f[:, i] * f[:, j] for i in range(modes + 1) for j in range(i, modes + 1)]
    return np.stack([np.ones(len(off)), *off.T, *products], axis=1)
