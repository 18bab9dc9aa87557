"""The regenerative loop: a cut fed back through the surface left one tooth pass earlier.

With a mean cutting stiffness D (N/m² of depth) and a receptance G, vibration at ω keeps itself alive where

    1 + b·λ·(1 − e^(−jωτ)) = 0,   λ an eigenvalue of D·G.

Splitting this into size and angle gives the depth and the fraction ψ of a wave between two cuts,

    b = −1/(2·Re λ),   ωτ/2π = k + ψ,   ψ = 1/2 + arg(−λ)/π,   k = 0, 1, 2, …,

for Re λ < 0 only. Turning (Tobias & Fishwick; Tlusty) is D = K_s; the zero-order approximation of milling
(Altintas & Budak 1995) is the mean D of its arc. Written so, the roots at multiples of the tooth frequency,
where 1 − e^(−jωτ) = 0, do not arise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...indices import Index, Mask
from ...tool.tool_point import ToolPoint
from ..process.chart import LobeBranch

_STEP = 0.1
_ROUNDS = 16
_MOST_LINES = 200_000
_FLOOR = 1e-4
_ZERO = 1e-12
_HIGH = 0.9
"""Of the strongest loop; peaks below hold no minimum, whatever the lines beside them hide."""
_LOOKS, _CLOSER = 17, 10
"""Places looked at around a peak, and how often: its neighbours are then 1e-9 of the first ones away."""


@dataclass(frozen=True, eq=False)
class Loops:
    """The loops of several tools, each in its cut. Arrays over frequencies say which tool each entry belongs to.

    Parameters
    ----------
    receptance
        G(frequency in Hz, tool), both of shape (nf,) → (nf, n, n) in m/N.
    stiffness
        D of every tool in N/m², (tools, n, n), n = 1 or 2.
    lines, tool
        Where the search starts, Hz, tool by tool and ascending in each, and the tool, (nf,).
    """

    receptance: Callable[[Array, Index], ComplexArray]
    stiffness: Array
    lines: Array
    tool: Index

    @classmethod
    def of(cls, point: ToolPoint, stiffness: Array) -> Loops:
        """The loop of one tool."""
        return cls(lambda f, tool: point(f), stiffness[None], point.lines, np.zeros(len(point.lines), dtype=np.intp))

    def __call__(self, frequency: Array, tool: Index) -> ComplexArray:
        """λ in 1/m, (nf, n), in no particular order."""
        return loop_eigenvalues(self.stiffness[tool], self.receptance(frequency, tool))


@dataclass(frozen=True, eq=False)
class Trace:
    """Loop eigenvalues followed over frequency, tool by tool.

    ``frequency`` in Hz and ``tool``, shape (m,); ``eigenvalue`` in 1/m, shape (m, n), each column continuous over the
    lines of a tool. ``resolved`` is false for a tool where neighbours stay far apart however fine the lines are.
    """

    frequency: Array
    tool: Index
    eigenvalue: ComplexArray
    resolved: Mask


@dataclass(frozen=True, eq=False)
class Minimum:
    """Of every tool the lowest depth (m) over all speeds, its chatter frequency (Hz) and fraction of a wave."""

    depth: Array
    frequency: Array
    phase: Array
    at_edge: Mask


def loop_eigenvalues(stiffness: Array | ComplexArray, receptance: ComplexArray) -> ComplexArray:
    """Eigenvalues λ of D·G in 1/m; (n, n) or (nf, n, n), and (nf, n, n) give (nf, n), n = 1 or 2, in no order."""
    D = [[stiffness[..., i, k] for k in range(stiffness.shape[-1])] for i in range(stiffness.shape[-1])]
    G = np.moveaxis(receptance, 0, -1)
    if len(D) == 1:
        return np.asarray(D[0][0] * G[0, 0])[:, None]
    (a, b), (c, d) = ([D[i][0] * G[0, k] + D[i][1] * G[1, k] for k in (0, 1)] for i in (0, 1))
    half, difference = (a + d) / 2, (a - d) / 2
    root = np.sqrt(difference**2 + b * c)
    large = half + np.where((half * root.conj()).real >= 0, root, -root)
    product = (D[0][0] * D[1][1] - D[0][1] * D[1][0]) * (G[0, 0] * G[1, 1] - G[0, 1] * G[1, 0])
    small = product / np.where(large == 0, 1, large)
    small = np.where(np.abs(small) > _ZERO * np.abs(large), small, 0)
    return np.stack([large, small], axis=1)


def wave_fraction(eigenvalue: ComplexArray) -> Array:
    """ψ = 1/2 + arg(−λ)/π, in (0, 1) where Re λ < 0."""
    return np.asarray(0.5 + np.angle(-eigenvalue) / np.pi)


def limiting_depth(eigenvalue: ComplexArray) -> Array:
    """b = −1/(2·Re λ) in m, inf where Re λ ≥ 0."""
    negative = eigenvalue.real < 0
    return np.where(negative, -0.5 / np.where(negative, eigenvalue.real, -1.0), np.inf)


def trace(loops: Loops) -> Trace:
    """Follow the loop eigenvalues, halving the line spacing until a step is a tenth of the eigenvalue.

    Only where the boundary can lie: steps that stay far from Re λ < 0, or at depths 10⁴ times the lowest one of the
    tool, are left coarse.
    """
    f, tool, tools = loops.lines, loops.tool, len(loops.stiffness)
    eigenvalue = _followed(loops(f, tool), tool)
    resolved = np.zeros(tools, dtype=bool)
    for _ in range(_ROUNDS):
        inside = tool[1:] == tool[:-1]
        size = np.abs(eigenvalue)
        step, reach = _step_and_reach(eigenvalue, inside)
        strongest = np.zeros(tools)
        np.maximum.at(strongest, tool[:-1], np.max(reach, axis=1))
        fine = (step <= _STEP * np.minimum(size[1:], size[:-1])) | (reach <= _FLOOR * strongest[tool[:-1], None])
        coarse = np.flatnonzero(~np.all(fine, axis=1))
        resolved[:] = True
        resolved[tool[coarse]] = False
        coarse = coarse[np.bincount(tool, minlength=tools)[tool[coarse]] <= _MOST_LINES]
        if not len(coarse):
            break
        middle = (f[coarse] + f[coarse + 1]) / 2
        between = loops(middle, tool[coarse])
        f = np.insert(f, coarse + 1, middle)
        eigenvalue = np.insert(eigenvalue, coarse + 1, between, axis=0)
        tool = np.insert(tool, coarse + 1, tool[coarse])
        eigenvalue = _followed(eigenvalue, tool)
    return Trace(f, tool, eigenvalue, resolved)


def _step_and_reach(eigenvalue: ComplexArray, inside: Mask) -> tuple[Array, Array]:
    """|Δλ| between neighbouring lines, and how negative Re λ may get there: −Re λ plus one step; (m − 1, n)."""
    step = np.abs(np.diff(eigenvalue, axis=0))
    reach = np.maximum(-eigenvalue.real[1:], -eigenvalue.real[:-1]) + step
    reach[~inside] = -np.inf
    return step, reach


def reaching(traced: Trace) -> Mask:
    """Intervals, (m − 1, n), between neighbouring lines of a tool in which Re λ may be negative."""
    return np.asarray(_step_and_reach(traced.eigenvalue, traced.tool[1:] == traced.tool[:-1])[1] > 0)


def lowest_depth(loops: Loops, traced: Trace) -> Minimum:
    """Minimum of −1/(2·Re λ) over frequency, refined between the lines; every speed is stable below it."""
    f, tool, tools = traced.frequency, traced.tool, len(loops.stiffness)
    strength = np.max(-traced.eigenvalue.real, axis=1)
    strongest = np.full(tools, -np.inf)
    np.maximum.at(strongest, tool, strength)
    ends = np.flatnonzero(np.concatenate([[True], tool[1:] != tool[:-1], [True]]))
    first, last = ends[:-1][tool], ends[1:][tool] - 1
    row = np.arange(len(f))
    left, right = np.maximum(row - 1, first), np.minimum(row + 1, last)
    peak = (strength >= strength[left]) & (strength >= strength[right])
    row = np.flatnonzero(peak & (strongest[tool] > 0) & (strength > _HIGH * strongest[tool]))
    out = Minimum(np.full(tools, np.inf), np.full(tools, np.nan), np.full(tools, np.nan), np.zeros(tools, dtype=bool))
    if not len(row):
        return out
    own = tool[row]
    at, _ = highest_between(
        lambda frequency, which: np.max(-loops(frequency, own[which]).real, axis=1),
        f[left[row]],
        f[row],
        f[right[row]],
        strength[row],
    )
    values = loops(at, own)
    value = values[np.arange(len(own)), np.argmin(values.real, axis=1)]
    order = np.lexsort((value.real, own))
    shown, place = np.unique(own[order], return_index=True)
    row, at, value = row[order][place], at[order][place], value[order][place]
    out.depth[shown], out.frequency[shown], out.phase[shown] = limiting_depth(value), at, wave_fraction(value)
    out.at_edge[shown] = np.minimum(at - f[first[row]], f[last[row]] - at) < 1e-6 * at
    return out


def highest_between(
    function: Callable[[Array, Index], Array], low: Array, at: Array, high: Array, value: Array
) -> tuple[Array, Array]:
    """Where functions of frequency are highest between ``low`` and ``high`` (Hz), and how high: at least the ``value``
    known at a place between. ``function`` takes frequencies and the number of the function for each."""
    every = np.arange(len(at))
    for _ in range(_CLOSER):
        looks = np.linspace(low, high, _LOOKS)
        found = function(looks.ravel(), np.tile(every, _LOOKS)).reshape(looks.shape)
        best = np.argmax(found, axis=0)
        better = found[best, every] > value
        at, value = np.where(better, looks[best, every], at), np.where(better, found[best, every], value)
        low, high = looks[np.maximum(best - 1, 0), every], looks[np.minimum(best + 1, _LOOKS - 1), every]
    return at, value


def boundary(traced: Trace, cuts_per_revolution: int) -> tuple[LobeBranch, ...]:
    """The stretches of the boundary, up to depths 10⁴ times the lowest one."""
    strength = -traced.eigenvalue.real
    drawn = strength > _FLOOR * max(float(np.max(strength)), 0.0)
    branches = []
    for i in range(drawn.shape[1]):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], drawn[:, i], [False]])))
        for start, stop in edges.reshape(-1, 2):
            if stop - start > 1:
                values = traced.eigenvalue[start:stop, i]
                frequency = traced.frequency[start:stop]
                branches.append(
                    LobeBranch(frequency, limiting_depth(values), wave_fraction(values), cuts_per_revolution)
                )
    return tuple(branches)


def _followed(eigenvalue: ComplexArray, tool: Index) -> ComplexArray:
    """Columns exchanged line by line so that each one runs on smoothly over the lines of a tool."""
    if eigenvalue.shape[1] == 1:
        return eigenvalue
    before, after = eigenvalue[:-1], eigenvalue[1:]
    straight = np.sum(np.abs(after - before), axis=1)
    crossed = np.sum(np.abs(after[:, ::-1] - before), axis=1)
    exchanged = np.concatenate([[0], np.cumsum((crossed < straight) & (tool[1:] == tool[:-1]))])
    start = np.searchsorted(tool, tool)
    swapped = (exchanged - exchanged[start]) % 2 == 1
    return np.where(swapped[:, None], eigenvalue[:, ::-1], eigenvalue)
