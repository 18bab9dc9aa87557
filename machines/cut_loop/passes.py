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

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from jointlib.arrays import Array, ComplexArray

from .borders import UNIT, Condition
from .sampled_tool import Drawn

_SPAN, _NODES, _PER_PERIOD = 2.5, 4.0, 4.0
"""Periods of the highest mode in a stretch of the arc, at most; nodes of a stretch, and those to each period of it.
With them a border is off by less than a thousandth of its depth."""
SINGLE = np.float32
"""Of the relations, which put ln|μ| off by a few millionths; only I(λ) and what the poles turn by need more."""
_DOUBLED, _VANISHED = 4, 1e-4
"""Powers of a force by which 1 and it is inverted, each the square of the one before, and how small the last one has to
be."""
Single = npt.NDArray[np.float32]
SingleComplex = npt.NDArray[np.complex64]


@dataclass(frozen=True, eq=False)
class Arc:
    """A tooth period: for each stretch of it in the cut its length in s, nodes, and their angles, (flutes, nodes)."""

    length: tuple[float, ...]
    angle: tuple[Array, ...]
    period: float


def arc_of(at: Condition, highest: float) -> Arc:
    """The nodes of a cut of even teeth for modes up to ``highest`` Hz."""
    cutting, period = at.cutting, 1 / at.tooth_frequency
    turning = 2 * np.pi * at.speed / 60
    pitch = 2 * np.pi / cutting.cuts_per_revolution
    first, last = cutting.entry_angle, cutting.exit_angle
    many = int(np.ceil((last - first) / pitch - 1e-9))
    edges = sorted({0.0, *((last - first - i * pitch) / turning for i in range(many)), *([period] if many > 1 else [])})
    edges = [edge for edge in edges if -1e-12 < edge < period * (1 + 1e-9)]
    lengths, angles = list[float](), list[Array]()
    for low, high in pairwise(edges):
        pieces = int(np.ceil((high - low) * highest / _SPAN))
        for begin, end in pairwise(np.linspace(low, high, pieces + 1)):
            length = float(end - begin)
            count = int(np.ceil(_NODES + _PER_PERIOD * length * highest))
            angle = first + turning * (begin + _collocation(count)[0] * length) + np.arange(many)[:, None] * pitch
            lengths.append(length)
            angles.append(angle[angle[:, count // 2] < last])
    return Arc(tuple(lengths), tuple(angles), period)


@dataclass(frozen=True, eq=False)
class Stretch:
    """The linear relations of a part of a tooth period for many samples, before a depth is chosen.

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

    within: Single
    rubbed: Single | None
    into: Single
    out: Single
    rubbed_out: Single | None
    free: Single

    def step(self, depth: Array) -> Single:
        """States at the end and x of states at the beginning and x a tooth before, both square, at depths in m."""
        if self.rubbed is not None:
            return self._rubbed_away(depth).step(depth)
        b = depth.astype(SINGLE)[:, None, None]
        n, states = self.within.shape[2], self.free.shape[1]
        out = np.empty((len(b), states + n, states + n), dtype=SINGLE)
        # With x = Q·(into·s + b·K·x_old), Q = (1 + b·K)⁻¹, the chips x − x_old are Q·(into·s − x_old).
        Q = _inverse(b * self.within)
        out[:, states:, :states] = Q @ self.into
        pushed = b * self.out
        np.subtract(np.eye(n, dtype=SINGLE), Q, out=out[:, states:, states:])
        out[:, :states, :states] = self.free - pushed @ out[:, states:, :states]
        out[:, :states, states:] = pushed @ Q
        return out

    def _rubbed_away(self, depth: Array) -> Stretch:
        """The relations at a depth without y, which is W·(into_y·s − b·K_y·chips), W = (1 + b·R_y)⁻¹."""
        assert self.rubbed is not None
        assert self.rubbed_out is not None
        b, n, states = depth.astype(SINGLE)[:, None, None], self.within.shape[2], self.free.shape[1]
        of_y = np.concatenate([self.into[:, n:], self.within[:, n:]], axis=2)
        by = b * np.concatenate([self.rubbed[:, :n], self.rubbed_out], axis=1)
        lost = by @ _inverse(b * self.rubbed[:, n:]) @ of_y
        within, into = self.within[:, :n] - lost[:, :n, states:], self.into[:, :n] - lost[:, :n, :states]
        out, free = self.out - lost[:, n:, states:], self.free - lost[:, n:, :states]
        return Stretch(within, None, into, out, None, free)


@dataclass(frozen=True, eq=False)
class Pass:
    """A tooth period: stretches in the cut, one after the other, and what the states do in the ``rest`` of it."""

    stretches: tuple[Stretch, ...]
    rest: Single

    @property
    def states(self) -> int:
        """Real numbers that tell the modes of a sample."""
        return int(self.rest.shape[1])

    @property
    def nodes(self) -> int:
        """Of all stretches."""
        return sum(int(stretch.within.shape[2]) for stretch in self.stretches)

    def steps(self, depth: Array) -> list[Single]:
        """Of every stretch, see `Stretch.step`; the rest is in the last one."""
        found = [stretch.step(depth) for stretch in self.stretches]
        found[-1][:, : self.states] = self.rest @ found[-1][:, : self.states]
        return found

    def idle(self) -> Single:
        """The map of a tooth that cuts nothing: chips stay as the last one left them."""
        n, states = self.nodes, self.states
        out = np.zeros((len(self.rest), states + n, states + n), dtype=SINGLE)
        free = self.rest
        for stretch in reversed(self.stretches):
            free = free @ stretch.free
        out[:, :states, :states] = free
        out[:, np.arange(states, states + n), np.arange(states, states + n)] = 1.0
        return out


def _inverse(A: Single) -> Single:
    """(1 + A)⁻¹ = (1 − A)·(1 + A²)·(1 + A⁴)·… of (samples, n, n).

    What A feels hangs on what was before, so that its powers vanish; where they are slow to, 1 + A is inverted.
    """
    one = np.eye(A.shape[1], dtype=SINGLE)
    found, power = one - A, A
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(_DOUBLED):
            power = power @ power
            found += found @ power
    slow = ~(np.max(np.abs(power), axis=(1, 2), initial=0.0) < _VANISHED)
    found[slow] = np.linalg.inv(one + A[slow])
    return found


def pass_of(drawn: Drawn, direct: Array, at: Condition, arc: Arc, axes: tuple[str, ...]) -> Pass:
    """The relations of every sample."""
    rows, poles = ["xy".index(axis) for axis in axes], drawn.poles
    o, i = (part.astype(np.complex64) for part in factors(drawn.residue))
    tangential, normal, stiff = (part.astype(SINGLE) for part in (drawn.tangential, drawn.normal, direct))
    rubs = drawn.damping + (at.cutting.process_damping or 0.0)
    rubbing, known, found = bool(np.any(rubs)), dict[tuple[int, int, float], _Kernel](), list[Stretch]()
    for length, angle in zip(arc.length, arc.angle, strict=True):
        key = *angle.shape, round(length / arc.period, 9)
        if key not in known:
            known[key] = _kernel(poles, length, *angle.shape)
        kernel = known[key]
        along, v = (part[:, rows].astype(SINGLE) for part in _directions(at, angle.ravel()))
        u = tangential[:, None, None] * along + normal[:, None, None] * v
        seen, pushed = o @ v.T, i @ u.swapaxes(1, 2)  # (samples, modes, n)
        moving, n = seen * poles[:, :, None].astype(np.complex64), seen.shape[2]
        rows_of = [seen, moving] if rubbing else [seen]
        into, within = _real_rows(seen * kernel.grown), _felt(rows_of, kernel.inside, pushed)
        if np.any(direct):
            within[:, :n] += (v @ stiff @ u.swapaxes(1, 2)) * kernel.together
        out = _real_columns(kernel.left * pushed)
        if not rubbing:
            found.append(Stretch(within, None, into, out, None, kernel.free))
            continue
        at_v = (i @ v.T) * (rubs / at.surface_speed).astype(SINGLE)[:, None, None]
        rubbed = _felt(rows_of, kernel.inside, at_v)
        into = np.concatenate([into, _real_rows(moving * kernel.grown)], axis=1)
        found.append(Stretch(within, rubbed, into, out, _real_columns(kernel.left * at_v), kernel.free))
    return Pass(tuple(found), _turned(poles * (arc.period - sum(arc.length))))


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


@dataclass(frozen=True, eq=False)
class _Kernel:
    """What the modes do in a stretch, whatever its angles: I(λ), and which nodes are at one time; e^(λt) from its begin
    to the nodes, w·e^(λt) from them to its end, and the states from end to end."""

    inside: SingleComplex
    together: Single
    grown: SingleComplex
    left: SingleComplex
    free: Single


def _kernel(poles: ComplexArray, length: float, flutes: int, count: int) -> _Kernel:
    x, w, size, turned = _collocation(count)
    a = size * length
    block = ((a / (1 - poles[:, :, None] * a)) @ turned.reshape(count, -1)).reshape(*poles.shape, count, count)
    grown, left = (np.exp(poles[:, :, None] * (part * length)) for part in (x, 1 - x))
    inside, begun, ended = (part.astype(np.complex64) for part in (block, grown, left * (w * length)))
    together = np.tile(np.eye(count, dtype=SINGLE), (flutes, flutes))
    inside, begun, ended = np.tile(inside, (flutes, flutes)), np.tile(begun, flutes), np.tile(ended, flutes)
    return _Kernel(inside, together, begun, ended, _turned(poles * length))


def _turned(exponent: ComplexArray) -> Single:
    """e^z of modes on the real and imaginary parts of their states, (samples, states, states)."""
    over, modes = np.exp(exponent), np.arange(exponent.shape[1])
    free = np.zeros((len(over), 2 * len(modes), 2 * len(modes)), dtype=SINGLE)
    free[:, modes, modes] = free[:, modes + len(modes), modes + len(modes)] = over.real
    free[:, modes + len(modes), modes], free[:, modes, modes + len(modes)] = over.imag, -over.imag
    return free


def _directions(at: Condition, angle: Array) -> tuple[Array, Array]:
    """u per K_t at angles, and v, which is u per K_n as well, (n, 2) each."""
    along, v = at.tangential_alone.tooth(angle)
    return along / UNIT, v


def factors(residue: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """o and i with R = o·iᵀ of every mode, (samples, modes, axes), states in m; residues have rank one."""
    axes = residue.shape[-1]
    largest = np.argmax(np.abs(residue).reshape(*residue.shape[:2], -1), axis=2)
    row, column = largest // axes, largest % axes
    s, m = np.ogrid[: residue.shape[0], : residue.shape[1]]
    pivot = residue[s, m, row, column]
    pivot = np.where(pivot == 0, 1.0, pivot)
    return residue[s, m, :, column] / pivot[:, :, None], residue[s, m, row, :]


def _felt(seen: Sequence[SingleComplex], inside: SingleComplex, pushed: SingleComplex) -> Single:
    """2·Re Σ over modes of seen_k·I_kl·pushed_l, (samples, n of all that is seen, n)."""
    n = pushed.shape[2]
    out = np.zeros((len(pushed), len(seen) * n, n), dtype=SINGLE)
    for m in range(pushed.shape[1]):
        block = inside[:, m] * (2 * pushed[:, m, None])
        for k, one in enumerate(seen):
            out[:, k * n : k * n + n] += (block * one[:, m, :, None]).real
    return out


def _real_rows(part: SingleComplex) -> Single:
    """2·Re of (samples, modes, n) on complex states, as (samples, n, states) on their real and imaginary parts."""
    return np.asarray(np.concatenate([2 * part.real, -2 * part.imag], axis=1).swapaxes(1, 2))


def _real_columns(part: SingleComplex) -> Single:
    return np.asarray(np.concatenate([part.real, part.imag], axis=1))
