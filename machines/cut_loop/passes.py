"""How the vibration of many samples grows from one tooth to the next, at a speed and a depth.

Modes with poles λ move by s' = λs + iᵀF, q = 2·Re Σ o·s (G = Σ o·iᵀ/(jω − λ) + conjugates). While teeth cut, the
force −b·u·(x − x_old) hangs on x = vᵀq at their angles and on what it was a tooth before. On the nodes of Gauss rules
over the time in the cut,

    x_k = vᵀq of the free motion − b·Σ_l K_kl·(x_l − x_old,l),   K_kl = 2·Re Σ_modes (v_kᵀo)·I_kl(λ)·(iᵀu_l),

I(λ) = (1 − λA)⁻¹A inside a stretch of the arc (collocation at Gauss nodes, Hairer & Wanner 1996, ch. IV.5) and
e^(λ(t_k − t_l))·w_l from those before it. The states of the modes and x over a tooth period are thus a linear map
of those a period before; its largest eigenvalue is the multiplier. Nothing is averaged: flips and interrupted cuts come
out as they are. Flanks that rub add −b·(C/v)·v·(vᵀq').
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..indices import Index
from .borders import Condition
from .sampled_tool import Drawn

_SPAN, _NODES, _PER_PERIOD = 2.5, 4.0, 4.0
"""Periods of the highest mode in a stretch of the arc, at most; nodes of a stretch, and those to each period of it.
With them a border is off by less than a thousandth of its depth."""
_LARGE = 2.0**20
_SQUARED = 9
"""The map is raised to two to this."""
_FORGOTTEN = 600.0
"""Times e that a mode decays over a tooth period at most; a faster one has come to rest by then as well."""
_PIECE = 128
"""Samples whose powers stay in the cache."""
_TINY = np.float32(1e-36)


@dataclass(frozen=True, eq=False)
class Arc:
    """Nodes over a tooth period: times in s, weights in s, stretch and place in it, angles in rad."""

    time: Array
    weight: Array
    stretch: Index
    place: Index
    angle: Array
    period: float
    stretches: tuple[tuple[int, float], ...]
    """Nodes and length in s of each."""


def arc_of(at: Condition, highest: float) -> Arc:
    """The nodes of a cut of even teeth for modes up to ``highest`` Hz."""
    cutting, period = at.cutting, 1 / at.tooth_frequency
    turning = 2 * np.pi * at.speed / 60
    pitch = 2 * np.pi / cutting.cuts_per_revolution
    first, last = cutting.entry_angle, cutting.exit_angle
    many = int(np.ceil((last - first) / pitch - 1e-9))
    edges = sorted({0.0, *((last - first - i * pitch) / turning for i in range(many)), *([period] if many > 1 else [])})
    edges = [edge for edge in edges if -1e-12 < edge < period * (1 + 1e-9)]
    parts: list[tuple[Any, ...]] = []
    stretches: list[tuple[int, float]] = []
    for low, high in pairwise(edges):
        pieces = int(np.ceil((high - low) * highest / _SPAN))
        for begin, end in zip(*(np.linspace(low, high, pieces + 1)[i:][:pieces] for i in (0, 1)), strict=True):
            length = float(end - begin)
            count = int(np.ceil(_NODES + _PER_PERIOD * length * highest))
            x, w, _, _ = _collocation(count)
            for flute in range(many):
                angle = first + turning * (begin + x * length) + flute * pitch
                if angle[count // 2] < last:
                    here = np.full(count, len(stretches))
                    parts.append((begin + x * length, w * length, here, np.arange(count), angle))
            stretches.append((count, length))
    time, weight, stretch, place, angle = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Arc(time, weight, stretch, place, angle, period, tuple(stretches))


@dataclass(frozen=True, eq=False)
class Pass:
    """The linear relations of a tooth period for many samples, before a depth is chosen.

    Parameters
    ----------
    within
        K of x on the force that chips make, (samples, n, n), above that of y = vᵀq' where flanks rub.
    rubbed
        The same on the force by which they rub; None where they do not.
    into
        x, and y, of the states at the beginning, (samples, n or 2n, states).
    out, rubbed_out
        States at the end of both forces, (samples, states, n).
    free
        States at the end of those at the beginning, (samples, states, states).
    """

    within: Array
    rubbed: Array | None
    into: Array
    out: Array
    rubbed_out: Array | None
    free: Array

    def map(self, depth: Array) -> Array:
        """Of states and chips over a tooth period, (samples, states + n, states + n), at depths in m, (samples,)."""
        b = depth[:, None, None]
        n, states = self.within.shape[2], self.free.shape[1]
        out = np.empty((len(b), states + n, states + n))
        if self.rubbed is None or self.rubbed_out is None:
            # With x = Q·(into·s + b·K·x_old), Q = (1 + b·K)⁻¹, the chips x − x_old are Q·(into·s − x_old).
            Q = np.linalg.inv(np.eye(n) + b * self.within)
            out[:, states:, :states] = Q @ self.into
            pushed = b * self.out
        else:
            both = np.eye(2 * n) + b * np.concatenate([self.within, self.rubbed], axis=2)
            unit = np.broadcast_to(np.eye(2 * n, n), (len(b), 2 * n, n))
            x = np.linalg.solve(both, np.concatenate([self.into, unit], axis=2))
            out[:, states:, :states], Q = x[:, :n, :states], x[:, :n, states:]
            pushed = b * self.out
            rubbed = b * (self.rubbed_out @ x[:, n:])
        out[:, states:, states:] = np.eye(n) - Q
        out[:, :states, :states] = self.free - pushed @ out[:, states:, :states]
        out[:, :states, states:] = pushed @ Q
        if self.rubbed_out is not None:
            out[:, :states, :states] -= rubbed[:, :, :states]
            out[:, :states, states:] += rubbed[:, :, states:]
        return out

    def idle(self) -> Array:
        """The map of a tooth that cuts nothing: chips stay as the last one left them."""
        count, n, states = len(self.free), self.within.shape[2], self.free.shape[1]
        out = np.zeros((count, states + n, states + n))
        out[:, :states, :states] = self.free
        out[:, np.arange(states, states + n), np.arange(states, states + n)] = 1.0
        return out


def pass_of(drawn: Drawn, direct: Array, at: Condition, arc: Arc, axes: tuple[str, ...]) -> Pass:
    """The relations of every sample."""
    rows = ["xy".index(axis) for axis in axes]
    tangential, normal = (part[:, rows] for part in _unit_forces(at, arc))
    _, v = (part[:, rows] for part in at.cutting.tooth(arc.angle))
    o, i = _factors(drawn.residue)
    seen = o @ v.T  # (samples, modes, n)
    u = drawn.tangential[:, None, None] * tangential + drawn.normal[:, None, None] * normal
    poles = drawn.poles
    inside = _inside(poles, arc)
    pushed = i @ u.swapaxes(1, 2)
    rubs = drawn.damping + (at.cutting.process_damping or 0.0)
    grown = np.exp(np.maximum(poles.real, -_FORGOTTEN / arc.period)[:, :, None] * arc.time)
    grown = grown * np.exp(1j * poles.imag[:, :, None] * arc.time)
    waned = arc.weight / grown
    into = _real_rows(seen * grown)
    within = _felt(seen, into, inside, pushed, waned, arc)
    if np.any(direct):
        same = arc.time[:, None] == arc.time
        within = within + (v @ direct @ u.swapaxes(1, 2)) * same
    over = np.exp(poles * arc.period)
    left = waned * over[:, :, None]
    out = _real_columns(left * pushed)
    modes = np.arange(poles.shape[1])
    free = np.zeros((len(poles), 2 * len(modes), 2 * len(modes)))
    free[:, modes, modes] = free[:, modes + len(modes), modes + len(modes)] = over.real
    free[:, modes + len(modes), modes], free[:, modes, modes + len(modes)] = over.imag, -over.imag
    if not np.any(rubs):
        return Pass(within, None, into, out, None, free)
    moving = seen * poles[:, :, None]
    carried = _real_rows(moving * grown)
    at_v = (i @ v.T) * (rubs / at.surface_speed)[:, None, None]
    above = np.concatenate([within, _felt(moving, carried, inside, pushed, waned, arc)], axis=1)
    rubbed = [_felt(*one, inside, at_v, waned, arc) for one in ((seen, into), (moving, carried))]
    return Pass(above, np.concatenate(rubbed, axis=1), np.concatenate([into, carried], axis=1), out,
                _real_columns(left * at_v), free)  # fmt: skip


def multiplier(passing: Array) -> tuple[Array, Array]:
    """ln|μ| and |arg μ| in rad of the largest eigenvalue of maps, (samples, n, n) → (samples,).

    Powers of the map show how it grows, and two steps of what is left of a vector turn by its angle. The powers are
    of single precision, whose error in ln|μ| is a hundredth of what 512 steps leave where two multipliers are alike.
    """
    # Far beyond every border a map outgrows single precision; a power of two takes no digit from it.
    scale = 2.0 ** np.floor(np.log2(np.maximum(np.max(np.abs(passing), axis=(1, 2)) / _LARGE, 1.0)))
    passing = passing / scale[:, None, None]
    parts = [_grown(passing[begin : begin + _PIECE]) for begin in range(0, len(passing), _PIECE)]
    rate, vector = map(np.concatenate, zip(*parts, strict=True))
    one = np.einsum("sij,sj->si", passing, vector)
    two = np.einsum("sij,sj->si", passing, one)
    aa, ab, bb = (np.sum(p * q, axis=1) for p, q in ((one, one), (one, vector), (vector, vector)))
    ca, cb = np.sum(two * one, axis=1), np.sum(two * vector, axis=1)
    full = aa * bb - ab**2
    flat = full < 1e-10 * aa * bb
    safe = np.where(flat, 1.0, full)
    alpha, beta = (ca * bb - cb * ab) / safe, (cb * aa - ca * ab) / safe
    root = np.sqrt((alpha / 2) ** 2 + beta + 0j)
    pair = np.stack([alpha / 2 + root, alpha / 2 - root])
    largest = np.take_along_axis(pair, np.argmax(np.abs(pair), axis=0)[None], axis=0)[0]
    return rate + np.log(scale), np.abs(np.angle(np.where(flat, np.where(ab > 0, 1.0, -1.0), largest)))


def _grown(passing: Array) -> tuple[Array, Array]:
    """By how much a step grows in ln, (samples,), and what many of them leave of a vector, (samples, n)."""
    power = passing.astype(np.float32)
    spare, grown = np.empty_like(power), np.zeros(len(power))
    for _ in range(_SQUARED):
        power, spare = np.matmul(power, power, out=spare), power
        flat = power.reshape(len(power), -1)
        size = np.sqrt(np.maximum(np.einsum("si,si->s", flat, flat), _TINY))
        power /= size[:, None, None]
        before, grown = grown, 2 * grown + np.log(size)
    return (grown - before) / 2 ** (_SQUARED - 1), (
        power @ np.cos(np.arange(power.shape[2], dtype=np.float32) ** 1.5)
    ).astype(float)


@lru_cache(maxsize=64)
def _collocation(count: int) -> tuple[Array, Array, ComplexArray, ComplexArray]:
    """Nodes and weights on [0, 1], the eigenvalues of A, and T with I(λ)_kl = Σ_j a_j/(1 − λ·a_j)·T_jkl for A."""
    x, w = np.polynomial.legendre.leggauss(count)
    x, w = (x + 1) / 2, w / 2
    orders = np.arange(count + 1)
    values = np.polynomial.legendre.legvander(2 * x - 1, count)
    to_coefficients = (2 * orders[:count, None] + 1) * values[:, :count].T * w
    integrals = np.zeros((count, count))
    integrals[:, 0] = x
    for k in range(1, count):
        integrals[:, k] = (values[:, k + 1] - values[:, k - 1]) / (2 * (2 * k + 1))
    size, vectors = np.linalg.eig(integrals @ to_coefficients)
    return x, w, size, np.asarray(vectors.T[:, :, None] * np.linalg.inv(vectors)[:, None, :])


def _inside(poles: ComplexArray, arc: Arc) -> dict[tuple[int, float], ComplexArray]:
    """I(λ) of a stretch by its nodes and length, (samples, modes, nodes, nodes)."""
    found = {}
    for count, length in set(arc.stretches):
        _, _, size, turned = _collocation(count)
        a = size * length
        block = (a / (1 - poles[:, :, None] * a)) @ turned.reshape(count, -1)
        found[count, length] = block.reshape(*poles.shape, count, count)
    return found


def _unit_forces(at: Condition, arc: Arc) -> tuple[Array, Array]:
    """u per K_t and per K_n at the nodes, (n, 2)."""
    first = replace(at.cutting, tangential=1e9, normal=0.0).tooth(arc.angle)[0] / 1e9
    both = replace(at.cutting, tangential=1e9, normal=1e9).tooth(arc.angle)[0] / 1e9
    return first, both - first


def _factors(residue: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """o and i with R = o·iᵀ of every mode, (samples, modes, axes), states in m; residues have rank one."""
    axes = residue.shape[-1]
    largest = np.argmax(np.abs(residue).reshape(*residue.shape[:2], -1), axis=2)
    row, column = largest // axes, largest % axes
    s, m = np.ogrid[: residue.shape[0], : residue.shape[1]]
    pivot = residue[s, m, row, column]
    pivot = np.where(pivot == 0, 1.0, pivot)
    return residue[s, m, :, column] / pivot[:, :, None], residue[s, m, row, :]


def _felt(
    seen: ComplexArray,
    into: Array,
    inside: dict[tuple[int, float], ComplexArray],
    pushed: ComplexArray,
    waned: ComplexArray,
    arc: Arc,
) -> Array:
    """2·Re Σ over modes of seen_k·I_kl·pushed_l, (samples, n, n).

    From the stretches behind, by what each of them leaves: e^(λ·t_k), which ``into`` has, times e^(−λ·t_l).
    """
    if len(arc.stretches) > 1:
        out = into @ _real_columns(waned * pushed)
        out *= arc.stretch[:, None] > arc.stretch
    else:
        out = np.zeros((len(seen), len(arc.time), len(arc.time)))
    for number, key in enumerate(arc.stretches):
        begin, end = np.searchsorted(arc.stretch, (number, number + 1))
        here, at = slice(begin, end), arc.place[begin:end]
        for m in range(seen.shape[1]):
            block = inside[key][:, m] if len(at) == key[0] else inside[key][:, m, at[:, None], at]
            block = block * pushed[:, m, None, here]
            block *= seen[:, m, here, None]
            out[:, here, here] += 2 * block.real
    return out


def _real_rows(part: ComplexArray) -> Array:
    """2·Re of (samples, modes, n) on complex states, as (samples, n, states) on their real and imaginary parts."""
    return np.asarray(np.concatenate([2 * part.real, -2 * part.imag], axis=1).swapaxes(1, 2))


def _real_columns(part: ComplexArray) -> Array:
    return np.asarray(np.concatenate([part.real, part.imag], axis=1))
