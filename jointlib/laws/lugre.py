"""LuGre friction: bristles that bend, slip and, past the Stribeck velocity, slide with less force."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.harmonic import FirstHarmonic, broadcast
from jointlib.law import JointLaw, Motion
from jointlib.laws import play
from jointlib.parameter import Role, parameter
from jointlib.pieces import chained

_NODES = 128
_ROUNDS = 30
_NUDGE = 3e-5
_AT_ONCE = 32768
"""Numbers that are stepped together along a path."""
_TOGETHER = 1024
"""Points at once, few enough to stay in the processor's cache."""


@dataclass(frozen=True)
class LuGre(JointLaw):
    """Bristle ẏ = ż − stiffness·abs(ż)·y/g(ż), f = stiffness·y + damping·ẏ (Canudas de Wit et al. 1995).

    g = slip_force + (static_force − slip_force)·e^(−(ż/stribeck_velocity)²). A step follows the bristle along the
    travel, y → sY + (y − sY)·e^(−abs(Δz)/Y) with Y = g/stiffness at the mean velocity of the step: exact at constant
    speed, second order in the time step otherwise, stable for any. Steps without duration take Y at the end
    velocity. With a ``clearance`` (half the play in series) neither bristle nor damper sees the joint cross the play,
    which opens when the bristle is unloaded. Passive where damping·abs(ż)·(x − 1) ≤ g(ż)·x² for every
    x = stiffness·y/g up to static_force/slip_force: always if that is 1, else up to a speed only.
    """

    stiffness: float = parameter("N/m", role=Role.STIFFNESS, above=0.0)
    damping: float = parameter("N s/m", role=Role.DAMPING, lower=0.0)
    slip_force: float = parameter("N", role=Role.SLIP_FORCE, above=0.0)
    static_force: float = parameter("N", role=Role.SLIP_FORCE, above=0.0)
    stribeck_velocity: float = parameter("m/s", above=0.0)
    clearance: float = parameter("m", role=Role.CLEARANCE, lower=0.0, default=0.0)

    kind: ClassVar[str] = "lugre"
    passive: ClassVar[bool] = False
    states: ClassVar[tuple[str, ...]] = ("position", "stretch")

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.any(np.asarray(self.static_force) < np.asarray(self.slip_force)):
            raise InputError(
                f"lugre: static_force is {self.static_force} N, expected at least slip_force = {self.slip_force} N"
            )

    def initial_state(self, displacement: Array) -> Array:
        """Unloaded, in the middle of the play."""
        return play.virgin(displacement)

    def _length(self, velocity: Array) -> Array:
        """Y in m, the deflection at which the bristles slide at a velocity."""
        ratio = velocity / self.stribeck_velocity
        return (self.slip_force + (self.static_force - self.slip_force) * np.exp(-ratio * ratio)) / self.stiffness

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        y, gap, free, _ = self._bristle(motion, state)
        v = motion.velocity
        rate = v - np.abs(v) * y / self._length(v)
        if not play.is_absent(self.clearance):
            rate = np.where(free, 0.0, rate)
        return self.stiffness * y + self.damping * rate, play.remembered(motion.displacement, y + gap)

    def along(self, displacement: Array, velocity: Array, time_step: float) -> Array:
        """Without play a step makes of the bristle what its motion says, y·factor + added, all steps at once."""
        z, v = np.broadcast_arrays(displacement, velocity)
        if not play.is_absent(self.clearance) or any(np.ndim(x) > z.ndim - 1 for x in vars(self).values()):
            return super().along(z, v, time_step)
        force, y, last = np.empty(z.shape), np.zeros(z.shape[1:]), z[:1]
        rows = max(64, _AT_ONCE // max(1, z[0].size))
        for first in range(0, len(z), rows):
            part = slice(first, first + rows)
            move, last = np.diff(z[part], axis=0, prepend=last), z[part][-1:]
            length = self._length(_mean_velocity(move, Motion(z[part], v[part], time_step)))
            decay = np.expm1(-np.abs(move) / length)
            bristle = chained(1 + decay, np.copysign(length * decay, move), y)
            y = bristle[-1]
            rate = v[part] - np.abs(v[part]) * bristle / self._length(v[part])
            force[part] = self.stiffness * bristle + self.damping * rate
        return force

    def _bristle(self, motion: Motion, state: Array) -> tuple[Array, Array | float, play.Mask | bool, Array]:
        """Bristle and play at the end of the step (m), where the joint is then inside the play, and the travel left."""
        move, y = motion.displacement - state[..., 0], state[..., 1]
        length = self._length(_mean_velocity(move, motion))
        gap: Array | float = 0.0
        free: play.Mask | bool = False
        if not play.is_absent(self.clearance):
            y, gap = play.split(y, self.clearance)
            side, travel = np.sign(move), np.abs(move)
            to_zero = length * np.log1p(np.maximum(-side * y, 0.0) / length)
            free = play.is_free(side, travel, to_zero, gap, self.clearance)
            lost = side * play.swallowed(side, travel, to_zero, gap, self.clearance)
            move, gap = move - lost, gap + lost
        decay = np.expm1(-np.abs(move) / length)
        return y + y * decay + np.copysign(length * decay, move), gap, free, move

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        y, _, free, left = self._bristle(motion, state)
        move, v = motion.displacement - state[..., 0], motion.velocity
        mean = _mean_velocity(move, motion)
        Y, Yv, side = self._length(mean), self._length(v), np.sign(left)
        decay = np.expm1(-np.abs(left) / Y)
        by_length = (-side * decay + (y - side * Y) * np.abs(left) / Y**2) * self._bend(mean, Y)
        h = np.asarray(motion.duration)
        timed = h > 0
        by_z = 1 - side * y / Y + np.where(timed, by_length / np.where(timed, h, 1.0), 0.0)
        by_v = np.where(timed, 0.0, by_length)
        force_by_y = self.stiffness - self.damping * np.abs(v) / Yv
        own = self.damping * (1 - np.sign(v) * y / Yv + np.abs(v) * y * self._bend(v, Yv) / Yv**2)
        stiffness, damping = np.broadcast_arrays(force_by_y * by_z, force_by_y * by_v + own)
        return np.where(free, 0.0, stiffness), np.where(free, 0.0, damping)

    def _bend(self, velocity: Array, length: Array) -> Array:
        """dY/dż in s."""
        return -2 * velocity / self.stribeck_velocity**2 * (length - self.slip_force / self.stiffness)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """By quadrature over the steady loop, whose turning points follow from its symmetry, not from waiting."""
        A, w, _ = broadcast(amplitude, omega, bias)
        a, w = (np.maximum(x, tiny).ravel() for x, tiny in ((A, 1e-9 * self._length(np.zeros(()))), (w, 1e-9)))
        known, rough = self._gain(a, w, _NODES), self._gain(a, w, _NODES // 2, slopes=False)
        shape = A.shape
        G, by_amplitude, by_omega = (part.reshape(shape) for part in (known[0], known[1] / a, known[2] / w))
        error = np.abs(known[0] - rough[0]) / 3
        return FirstHarmonic(G, by_amplitude, by_omega, np.zeros(shape), error.reshape(shape))

    def _gain(self, a: Array, w: Array, nodes: int, slopes: bool = True) -> ComplexArray:
        """G, ∂G/∂ln A and ∂G/∂ln ω at amplitudes and angular frequencies (one axis), (3, points), or G alone.

        From the half cycle down, z = A cos θ.
        """
        theta, weight = _half_cycle(nodes)
        wave = weight * np.exp(-1j * theta[1:-1])
        own = play.is_absent(self.clearance)
        if slopes and not own:
            # Second-order differences: truncation near 1e-9, and rounding too.
            near = [(1 - _NUDGE, 1), (1 + _NUDGE, 1), (1, 1 - _NUDGE), (1, 1 + _NUDGE)]
            G, *beside = (self._gain(a * by, w * faster, nodes, slopes=False)[0] for by, faster in [(1, 1), *near])
            return np.array([G, *((high - low) / (2 * _NUDGE) for low, high in (beside[:2], beside[2:]))])
        parts = []
        for first in range(0, len(a), _TOGETHER):
            some = slice(first, first + _TOGETHER)
            on = (a[some], w[some], theta)
            force = self._force_down(*on, slopes) if own else self._searched(*on)[None]
            parts.append(2 / (np.pi * a[some]) * (wave @ force))
        found = np.concatenate(parts, axis=-1)
        if slopes:
            found[1] -= found[0]
        return np.asarray(found, dtype=complex)

    def _force_down(self, a: Array, w: Array, theta: Array, slopes: bool) -> Array:
        """Force at the inner angles of the way down without play and its slopes by ln A and ln ω, (3, angles, points).

        Every step is linear in the deflection, y → e y − (1 − e) Y, so that after all y = P y₀ + Q, and y₀ = −y closes
        the loop: y₀ = −Q/(1 + P). Without slopes the force alone.
        """
        span = np.diff(theta)[:, None]
        move = a * np.diff(np.cos(theta))[:, None]
        mean = move * w / span
        Y = self._length(mean)
        share = move / Y
        fall = np.expm1(share)
        e, lost = 1.0 + fall, fall * Y
        P, Q = _through(e, lost, np.ones_like(a), np.zeros_like(a))
        y0 = -Q[-1] / (1 + P[-1])
        y = Q[:-1] + P[:-1] * y0
        v = -w * a * np.sin(theta[1:-1, None])
        Yv = self._length(v)
        slip = v - np.abs(v) * y / Yv
        force = (self.stiffness * y + self.damping * slip)[None]
        if not slopes:
            return np.asarray(force)
        # Speeds grow with both; how far the joint moves with A alone.
        grown = self._bend(mean, Y) * mean
        rows = [force[0]]
        for own in (1.0, 0.0):
            steeper = e * share * (own - grown / Y)
            dP, dQ = _through(e, steeper * Y + fall * grown, P, Q, steeper)
            start = -(dQ[-1] + dP[-1] * y0) / (1 + P[-1])
            dy = dQ[:-1] + dP[:-1] * y0 + P[:-1] * start
            dslip = slip - np.abs(v) / Yv * (dy - y * self._bend(v, Yv) * v / Yv)
            rows.append(self.stiffness * dy + self.damping * dslip)
        return np.array(rows)

    def _searched(self, a: Array, w: Array, theta: Array) -> Array:
        """Force at the inner angles of the way down where there is play, (angles, points)."""

        def down(stretch: Array) -> tuple[Array, Array]:
            state, rows = play.remembered(a, stretch), []
            for before, angle in pairwise(theta):
                v = -w * a * np.sin(angle)
                force, state = self.step(Motion(a * np.cos(angle), v, (angle - before) / w), state)
                rows.append(force)
            return np.array(rows[:-1]), state[..., 1]

        # Half a cycle later everything has the opposite sign. Regula falsi (Illinois).
        high = np.minimum(a, self._length(np.zeros(())) + self.clearance)
        low = -high
        at_high, at_low = high + down(high)[1], low + down(low)[1]
        last = np.zeros_like(a)
        for _ in range(_ROUNDS):
            rise = at_high - at_low
            start = low - at_low * (high - low) / np.where(rise > 0, rise, 1.0)
            force, end = down(start)
            off = start + end
            if np.all(np.abs(off) <= 1e-12 * a):
                break
            up = off > 0
            at_low = np.where(up, np.where(last > 0, at_low / 2, at_low), off)
            at_high = np.where(up, off, np.where(last < 0, at_high / 2, at_high))
            low, high = np.where(up, low, start), np.where(up, start, high)
            last = np.where(up, 1.0, -1.0)
        return force


@lru_cache(maxsize=8)
def _half_cycle(nodes: int) -> tuple[Array, Array]:
    """Angles of half a cycle with its ends, and the weights of the inner ones."""
    x, g = np.polynomial.legendre.leggauss(nodes)
    theta = np.concatenate([[0.0], np.pi / 2 * (1 + np.sin(np.pi / 2 * x)), [np.pi]])
    return theta, g * np.pi**2 / 4 * np.cos(np.pi / 2 * x)


def _through(e: Array, lost: Array, P: Array, Q: Array, steeper: Array | None = None) -> tuple[Array, Array]:
    """P → e P and Q → e Q + lost after every step, (steps, points); with ``steeper`` how they change as e does."""
    products, sums = np.empty_like(e), np.empty_like(e)
    if steeper is None:
        for k in range(len(e)):
            P, Q = P * e[k], Q * e[k] + lost[k]
            products[k], sums[k] = P, Q
        return products, sums
    dP, dQ = np.zeros_like(e[0]), np.zeros_like(e[0])
    for k in range(len(e)):
        before, pushed = (P[k - 1], Q[k - 1]) if k else (1.0, 0.0)
        dP, dQ = dP * e[k] + before * steeper[k], dQ * e[k] + pushed * steeper[k] + lost[k]
        products[k], sums[k] = dP, dQ
    return products, sums


def _mean_velocity(move: Array, motion: Motion) -> Array:
    """Δz over the duration of the step, m/s; the end velocity where the step has none."""
    h = motion.duration
    if isinstance(h, float | int):
        return move / h if h > 0 else motion.velocity
    timed = h > 0
    return np.where(timed, move / np.where(timed, h, 1.0), motion.velocity)
