"""Bouc–Wen hysteresis: a smooth loop between elastic and sliding, its roundness and shape free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import JointLaw, Motion
from jointlib.laws import play
from jointlib.parameter import Role, parameter

_TINY = 1e-300
_FIVE, _WEIGHTS = (x / 2 for x in np.polynomial.legendre.leggauss(5))
_SATURATED = 9.0
"""Past 1 − u = e^(−9) travel and work follow their series in 1 − u."""


@dataclass(frozen=True)
class BoucWen(JointLaw):
    """df/dt = stiffness·ż·[1 − abs(f/slip_force)^exponent·(shape + (1 − shape)·sign(f·ż))].

    Rate independent: integrated over the travel by an exponential step that is exact for exponent 1, third order in
    Δz·stiffness/slip_force otherwise, and never leaves abs(f) ≤ slip_force. ``shape`` = 0 unloads stiffer than it
    loads (exponent 1: Dahl), ½ unloads along the elastic line, 1 is nonlinear elastic without a loop. Passive for
    every shape in [0, 1]: unloading is never softer than loading, so V(f) = ∫ f dz along the unloading line bounds
    what comes back. (The narrower range shape ≤ ½ of Erlicher and Point 2004 belongs to a quadratic V.) With a
    ``clearance`` (half the play in series) the element sees no load while the joint crosses the play.
    """

    stiffness: float = parameter("N/m", role=Role.STIFFNESS, above=0.0)
    slip_force: float = parameter("N", role=Role.SLIP_FORCE, above=0.0)
    exponent: float = parameter("1", lower=1.0, default=1.0)
    shape: float = parameter("1", lower=0.0, upper=1.0, default=0.5)
    clearance: float = parameter("m", role=Role.CLEARANCE, lower=0.0, default=0.0)

    kind: ClassVar[str] = "bouc-wen"
    states: ClassVar[tuple[str, ...]] = ("position", "stretch")

    def initial_state(self, displacement: Array) -> Array:
        """Unloaded, in the middle of the play."""
        return play.virgin(displacement)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        length = self.slip_force / self.stiffness
        side, u, travel, gap, bound = self._start(motion, state, length)
        after = side * np.minimum(self._slope_and_end(u, travel)[1], bound)
        return self.slip_force * after, play.remembered(motion.displacement, length * after + gap)

    def _start(
        self, motion: Motion, state: Array, length: float
    ) -> tuple[Array, Array, Array, Array | float, Array | float]:
        """Sign of the motion, f·sign/slip_force, the travel in L, the play after it, and what f may not pass."""
        move, u = motion.displacement - state[..., 0], state[..., 1]
        # A joint at rest keeps its force: any side does.
        side = np.copysign(1.0, move)
        if play.is_absent(self.clearance):
            return side, side * u / length, np.abs(move) / length, 0.0, 1.0
        deflection, gap = play.split(u, self.clearance)
        u, travel = side * deflection / length, np.abs(move)
        to_zero = length * self._to_zero(u)
        lost = play.swallowed(side, travel, to_zero, gap, self.clearance)
        past = travel >= to_zero
        unloaded = past & (u < 0)
        left = np.maximum(travel - lost - np.where(unloaded, to_zero, 0.0), 0.0)
        free = play.is_free(side, travel, to_zero, gap, self.clearance)
        bound = np.where(free | np.asarray(~past & (u < 0)), 0.0, 1.0)
        return side, np.where(unloaded, 0.0, u), left / length, gap + side * lost, bound

    def _to_zero(self, u: Array) -> Array:
        """Travel in L that unloads from u < 0: ∫ du/(1 − (2·shape − 1)·abs(u)^exponent), five Gauss points."""
        size = np.maximum(-u, 0.0)
        total: Array | float = 0.0
        for x, w in zip(_FIVE + 0.5, _WEIGHTS, strict=True):
            total = total + w / (1 - (2 * self.shape - 1) * (x * size) ** self.exponent)
        return size * total

    def _rate(self, u: Array) -> Array:
        """du over travel in L, for motion to the positive side."""
        return 1 - np.abs(u) ** self.exponent * (self.shape + (1 - self.shape) * np.sign(u))

    def _slope_and_end(self, u: Array, travel: Array) -> tuple[Array, Array]:
        """Exponent r of the step, and u after it: u + travel·F·(e^r − 1)/r, r by the secant over two thirds of it."""
        F = np.maximum(self._rate(u), _TINY)
        shrink = 1 + self.exponent * travel
        r = 1.5 * (self._rate(u + travel * F / (1.5 * shrink)) - F) * shrink / F
        r = np.minimum(r, 30.0) + _TINY
        return r, np.minimum(u + travel * F * np.expm1(r) / r, 1.0)

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        """Derivative of the step itself, ∂u/∂travel·stiffness."""
        length, n = self.slip_force / self.stiffness, self.exponent
        _, u, travel, _, bound = self._start(motion, state, length)
        r, after = self._slope_and_end(u, travel)
        F, shrink = np.maximum(self._rate(u), _TINY), 1 + n * travel
        ahead = u + travel * F / (1.5 * shrink)
        bend = -n * np.abs(ahead) ** (n - 1) * np.sign(ahead) * (self.shape + (1 - self.shape) * np.sign(ahead))
        dr = bend / shrink + 1.5 * n * (self._rate(ahead) - F) / F
        small = np.abs(r) < 1e-3
        x = np.where(small, 1.0, r)
        phi = np.expm1(r) / r
        d_phi = np.where(small, 0.5 + r / 3 + r**2 / 8, (np.exp(x) - np.expm1(x) / x) / x)
        stiffness = self.stiffness * np.where(after < bound, F * (phi + travel * d_phi * dr), 0.0)
        return stiffness, np.zeros_like(stiffness)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        A = np.broadcast_arrays(amplitude, omega, bias)[0]
        return loop_kinks(self.stiffness, self.slip_force, self.exponent, self.shape, self.clearance, A)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """From the steady loop, whose branches z(f) are hypergeometric functions; the play drops out of the integrals.

        Im G = 2·(work of loading − work of unloading)/(π A²), in closed form; Re G = (2/(π A)) ∫ √(1 − (z/A)²) df.
        """
        A = broadcast(amplitude, omega, bias)[0]
        return loop_harmonic(self.stiffness, self.slip_force, self.exponent, self.shape, self.clearance, A)


def loop_harmonic(
    stiffness: float, slip_force: float, exponent: float, shape: float, clearance: float, A: Array
) -> FirstHarmonic:
    """Describing function of a steady Bouc–Wen loop with play in series; 0 where the play is not crossed."""
    length = slip_force / stiffness
    size = np.maximum(A, 1e-9 * length)
    steps = np.array([0.0, -2.0, -1.0, 1.0, 2.0]).reshape(5, *(1,) * A.ndim)
    # Fourth-order difference: truncation and rounding near 1e-11.
    G = stiffness * _loop_gain(exponent, 2 * shape - 1, clearance / length, (1 + 1e-3 * steps) * size / length)
    slope = (8 * (G[3] - G[2]) - (G[4] - G[1])) / (12e-3 * size)
    return closed_form(G[0], slope, 0.0, 0.0, A.shape)


def loop_kinks(stiffness: float, slip_force: float, exponent: float, shape: float, clearance: float, A: Array) -> Array:
    """Angles of z = A cos θ at which a steady Bouc–Wen loop is unloaded, and loaded again behind the play."""
    length, b = slip_force / stiffness, 2 * shape - 1
    unloading = length * _travel(
        _turning_point(exponent, b, 2 * np.maximum(A - clearance, 0.0) / length), exponent, b, 1
    )
    cosines = [1 - travel / np.maximum(A, 1e-300) for travel in (unloading, unloading + 2 * clearance)]
    angles = [np.arccos(np.clip(c, -1, 1)) for c in cosines]
    return np.stack([*angles, *(np.pi + a for a in angles)], axis=-1)


def _turning_point(n: float, b: float, reach: Array) -> Array:
    """y = −ln(1 − u) at the ends of a steady loop whose element travels ``reach`` (in L) from one to the other."""
    # The travel from one turning point to the other is concave in y, slope 2 at first: Newton comes from below.
    reach = np.maximum(reach, 1e-12)
    y = reach / 2
    for _ in range(100):
        rest = np.exp(-np.minimum(y, 30.0))
        loaded = -np.expm1(n * np.log1p(-rest))
        slope = rest * (1 / loaded + 1 / ((1 - b) + b * loaded))
        change = (reach - _travel(y, n, 1.0, 1) - _travel(y, n, b, 1)) / slope
        y = np.maximum(y + change, 0.5 * reach)
        if np.all(np.abs(change) <= 1e-15 * y):
            break
    return y


def _loop_gain(n: float, b: float, clearance: float, A: Array) -> Array:
    """G over stiffness at amplitudes in units of L; b = 2·shape − 1."""
    reach = 2 * (A - clearance)
    moving = reach > 0
    y = _turning_point(n, b, np.where(moving, reach, 1.0))
    work = _travel(y, n, 1.0, 2) - _travel(y, n, b, 2)
    x, w = np.polynomial.legendre.leggauss(64)
    x, w = (1 + np.sin(np.pi / 2 * x)) / 2, w * np.pi / 4 * np.cos(np.pi / 2 * x)
    top = np.minimum(y, 36.0)[..., None]
    nodes = top * x
    total = np.zeros(A.shape)
    for branch in (1.0, b):
        fallen = (_travel(y, n, branch, 1)[..., None] - _travel(nodes, n, branch, 1)) / A[..., None]
        root = np.sqrt(np.maximum(fallen * (2 - fallen), 0.0))
        total = total + np.sum(root * np.exp(-nodes) * top * w, axis=-1)
    G = 2 / (np.pi * A) * (total + 1j * work / A)
    return np.asarray(np.where(moving, G, 0.0))


def _travel(y: Array, n: float, b: float, power: int) -> Array:
    """∫ u^(power − 1) du/(1 − b·u^n) from 0 to u = 1 − e^(−y): travel in L, or for power 2 work in slip_force·L."""
    bounded = b < 1
    near = y if bounded else np.minimum(y, _SATURATED)
    u = -np.expm1(-near)
    inside = u**power / power * scipy.special.hyp2f1(1.0, power / n, 1 + power / n, b * u**n)
    if bounded:
        return np.asarray(inside)
    # 1/(1 − u^n) = (1/n)/e + (n − 1)/(2n) + e (n² − 1)/(12n) + …, e = 1 − u; times 1 − e for the work.
    first = (n - 1) / (2 * n) - (power - 1) / n
    second = (n * n - 1) / (12 * n) - (power - 1) * (n - 1) / (2 * n)
    e, start = np.exp(-y), np.exp(-near)
    return np.asarray(inside + (y - near) / n + first * (start - e) + second / 2 * (start**2 - e**2))
