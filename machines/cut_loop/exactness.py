"""What zero order misses at the conditions of test cuts, learnt from exact charts of tools with other modes.

The logarithm of exact over zero-order depth is a polynomial of second order in the logarithms of the frequencies of the
modes that the tool feels, and of first order in those of their damping ratios, at every condition. What the polynomial
misses of the charts it was learnt from stands beside it, as scatter of the border.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import each

from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.process.cutting import Cutting
from ..cutting.rest.solve import stability_lobes
from ..indices import Mask
from ..model.machine import Machine
from ..tool.tool_model import ToolModel
from .borders import Condition, border
from .sampled_tool import Drawn, SampledTool, features

TOOLS = 40
"""With other modes, for which charts are computed."""
_FREQUENCY, _DAMPING = 0.03, 0.3
"""Deviations of the logarithms that they have at least."""
_MOST = np.log(4.0)
_RIDGE = 1e-3


@dataclass(frozen=True, eq=False)
class Exactness:
    """Exact over zero order, by condition.

    Parameters
    ----------
    weights
        Of the polynomial, (conditions, terms).
    low, high
        Of the logarithms that it was learnt from, (conditions,); none beyond is told.
    scatter
        What it misses of them, (conditions,).
    shift
        Hz from zero order's frequency of chatter to the exact one, (conditions,).
    flip
        Where most of the charts flip.
    modes, centre
        The modes it depends on, and their ln|s| and ln ζ in the middle, (2, modes).
    """

    weights: Array
    low: Array
    high: Array
    scatter: Array
    shift: Array
    flip: Mask
    modes: tuple[int, ...]
    centre: Array

    def logarithm(self, drawn: Drawn, k: int) -> Array:
        """ln(exact/zero order) of every sample at condition k."""
        terms = _terms(features(drawn.poles[:, list(self.modes)]) - self.centre)
        return np.asarray(np.clip(terms @ self.weights[k], self.low[k], self.high[k]))


def learnt(
    machine: Machine, tool: SampledTool, conditions: Sequence[Condition], seed: int, tools: int = TOOLS
) -> Exactness:
    """Compare charts at the conditions of cuts; in turning zero order is exact. One tool is the machine as it is."""
    count, modes = len(conditions), tuple(tool.felt())
    zeros = np.zeros(count)
    centre = np.median(features(tool.poles[:, list(modes)]), axis=0) if modes else np.zeros((0,))
    size = _terms(np.zeros((1, 2 * len(modes)))).shape[1]
    plain = Exactness(
        np.zeros((count, size)), zeros, zeros, zeros, zeros, np.zeros(count, dtype=bool), modes, centre.ravel()
    )
    if conditions[0].cutting.process != "milling" and conditions[0].cutting.plain:
        return plain
    if tool.nominal is None:
        return _of_machine(machine, tool, conditions, plain)
    spread = np.std(features(tool.poles[:, list(modes)]), axis=0)
    floor = np.repeat([_FREQUENCY, _DAMPING], len(modes))
    rng = np.random.default_rng([seed, 20])
    apart = np.maximum(spread, floor) * rng.standard_normal((tools, 2 * len(modes)))
    apart[0] = 0.0
    y = np.zeros((tools, count))
    off, flip = np.zeros((tools, count)), np.zeros((tools, count), dtype=bool)
    for i, row in enumerate(each("exact charts of like tools", apart, tools)):
        one = _other(tool.nominal, modes, np.exp(row[: len(modes)]), np.exp(row[len(modes) :]), tool)
        y[i], off[i], flip[i] = _compared(one, conditions, tool)
    terms = _terms(apart)
    inverse = np.linalg.inv(terms.T @ terms + _RIDGE * np.eye(terms.shape[1]))
    weights = np.asarray(inverse @ terms.T @ y, dtype=float)
    left = y - terms @ weights
    freedom = max(tools - terms.shape[1], 1)
    scatter = np.sqrt(np.sum(left**2, axis=0) / freedom)
    return replace(
        plain,
        weights=weights.T,
        low=np.min(y, axis=0),
        high=np.max(y, axis=0),
        scatter=scatter,
        shift=np.median(off, axis=0),
        flip=np.mean(flip, axis=0) > 0.5,
        centre=features(_sorted(tool.nominal)[None, list(modes)])[0],
    )


def _of_machine(machine: Machine, tool: SampledTool, conditions: Sequence[Condition], plain: Exactness) -> Exactness:
    """Of a tool known on lines: the exact chart of the machine as it is, at every condition."""
    low, shift, flip = np.zeros(len(conditions)), np.zeros(len(conditions)), np.zeros(len(conditions), dtype=bool)
    middle = np.median(tool.tangential), np.median(tool.normal)
    assert tool.receptance is not None
    G = np.mean(tool.receptance, axis=0)[None]
    for k, at in enumerate(conditions):
        table = {**(machine.cutting or {}), "mode": at.cutting.mode, "immersion": at.cutting.immersion}
        one = replace(machine, cutting=table) if at.cutting.process == "milling" else machine
        try:
            chart = lobes_at_amplitude(one, [at.speed])
        except (CheckFailed, InputError) as error:
            raise InputError(f"{machine.where}: no exact chart at the speeds of the cuts: {error}") from None
        tangential, normal = (np.array([float(m)]) for m in middle)
        rough, at_rough = border(G, tool.lines, at, tangential, normal, np.zeros(1))
        low[k], shift[k], flip[k] = _told(
            chart.depth[0], chart.chatter_frequency[0], str(chart.kind[0]), rough[0], at_rough[0], at
        )
    return replace(plain, low=low, high=low, shift=shift, flip=flip)


def _compared(tool: ToolModel, conditions: Sequence[Condition], of: SampledTool) -> tuple[Array, Array, Mask]:
    """ln ratio, Hz of shift and flips of one tool at every condition."""
    y, off, flip = np.zeros(len(conditions)), np.zeros(len(conditions)), np.zeros(len(conditions), dtype=bool)
    G = tool(of.lines)[None]
    groups: dict[Cutting, list[int]] = {}
    for k, at in enumerate(conditions):
        groups.setdefault(at.cutting, []).append(k)
    for cutting, rows in groups.items():
        try:
            chart = stability_lobes(tool, cutting, [conditions[k].speed for k in rows])
        except CheckFailed:
            continue
        tangential, normal = cutting.tangential or cutting.specific or 0.0, cutting.normal or 0.0
        damping = cutting.process_damping or 0.0
        for i, k in enumerate(rows):
            K_t, K_n, C = (np.array([value]) for value in (tangential, normal, damping))
            rough, at_rough = border(G, of.lines, conditions[k], K_t, K_n, C)
            found = chart.depth[i], chart.chatter_frequency[i], str(chart.kind[i])
            y[k], off[k], flip[k] = _told(*found, rough[0], at_rough[0], conditions[k])
    return y, off, flip


def _told(
    depth: float, frequency: float, kind: str, rough: float, at_rough: float, at: Condition
) -> tuple[float, float, bool]:
    if not (np.isfinite(depth) and np.isfinite(rough)):
        return (
            (0.0 if np.isfinite(depth) == np.isfinite(rough) else _MOST * (1 if np.isfinite(rough) else -1)),
            0.0,
            False,
        )
    off = frequency - at_rough
    off -= at.tooth_frequency * np.round(off / at.tooth_frequency)  # lines a tooth frequency apart are one chatter
    near = kind != "flip" and abs(off) < 0.05 * at_rough
    return float(np.clip(np.log(depth / rough), -_MOST, _MOST)), float(off) if near else 0.0, kind == "flip"


def _sorted(model: ToolModel) -> ComplexArray:
    return np.asarray(model.poles[np.argsort(np.abs(model.poles))])


def _other(model: ToolModel, modes: tuple[int, ...], frequency: Array, ratio: Array, tool: SampledTool) -> ToolModel:
    """The tool with the frequencies and damping ratios of some modes times factors."""
    order = np.argsort(np.abs(model.poles))
    poles, inputs = model.poles.copy(), model.inputs.copy()
    for i, mode in enumerate(modes):
        k = order[mode]
        s = poles[k]
        zeta = min(-s.real / abs(s) * ratio[i], 0.7)
        new = abs(s) * frequency[i] * (-zeta + 1j * np.sqrt(1 - zeta**2))
        poles[k] = new
        inputs[k] *= s.imag / new.imag
    return replace(model, poles=poles, inputs=inputs)


def _terms(apart: Array) -> Array:
    """1, all of first order, and squares and products of the frequencies."""
    modes = apart.shape[1] // 2
    f = apart[:, :modes]
    products = [f[:, i] * f[:, j] for i in range(modes) for j in range(i, modes)]
    return np.stack([np.ones(len(apart)), *apart.T, *products], axis=1)
