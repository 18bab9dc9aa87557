"""First harmonic of the joint force over a sinusoidal cycle: the describing function of one law, numerically."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import prod
from typing import ClassVar, Protocol

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.motion import Motion

_GAUSS_POINTS = 32
_CYCLES = 200
_SETTLED = 1e-10
_FEW = 4096


class Steppable(Protocol):
    """What a cycle needs of a law; every :class:`jointlib.law.JointLaw` has it."""

    kind: ClassVar[str]
    states: ClassVar[tuple[str, ...]]

    def initial_state(self, displacement: Array) -> Array: ...

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]: ...

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]: ...

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array: ...


@dataclass(frozen=True)
class FirstHarmonic:
    """Describing function at amplitudes A and frequencies ω, with what Newton's method needs.

    All arrays have one broadcast shape. For z = z0 + A cos θ the force is N0 + Re(G A e^(jθ)) + higher harmonics.
    """

    gain: ComplexArray
    """G in N/m; Im G > 0 dissipates π A² Im G per cycle."""
    d_amplitude: ComplexArray
    """dG/dA in N/m²."""
    d_omega: ComplexArray
    """dG/dω in N s/m."""
    mean: Array
    """N0, the mean force in N."""
    error: Array
    """Estimated absolute error of the gain in N/m; 0 for a closed form."""

    def __add__(self, other: FirstHarmonic) -> FirstHarmonic:
        return FirstHarmonic(
            self.gain + other.gain,
            self.d_amplitude + other.d_amplitude,
            self.d_omega + other.d_omega,
            self.mean + other.mean,
            self.error + other.error,
        )


def closed_form(
    gain: ArrayLike, d_amplitude: ArrayLike, d_omega: ArrayLike, mean: ArrayLike, shape: tuple[int, ...]
) -> FirstHarmonic:
    """Bring the parts of a closed form to one shape."""

    def full(value: ArrayLike) -> ComplexArray:
        if isinstance(value, float) and value == 0:
            return np.zeros(shape, dtype=complex)
        out = np.empty(shape, dtype=complex)
        out[...] = value
        return out

    N0 = np.empty(shape)
    N0[...] = mean
    return FirstHarmonic(full(gain), full(d_amplitude), full(d_omega), N0, np.zeros(shape))


def broadcast(amplitude: ArrayLike, omega: ArrayLike, bias: ArrayLike) -> tuple[Array, Array, Array]:
    """Amplitude, angular frequency and bias as float arrays of one shape; refuses what no cycle can have."""
    A, w, z0 = (np.asarray(x, dtype=float) for x in (amplitude, omega, bias))
    if not _allowed(A):
        raise InputError(f"describing function: amplitude {amplitude!r}, expected finite values of at least 0 m")
    if not _allowed(w):
        raise InputError(f"describing function: angular frequency {omega!r}, expected finite values of at least 0")
    shape = np.broadcast(A, w, z0).shape
    return _spread(A, shape), _spread(w, shape), _spread(z0, shape)


def _allowed(value: Array) -> bool:
    """Finite and not negative."""
    if value.ndim == 0:
        return 0 <= float(value) < np.inf
    return bool(value.size == 0 or (value.min() >= 0 and value.max() < np.inf))


def _spread(value: Array, shape: tuple[int, ...]) -> Array:
    """The value at every place of a shape; a few numbers are copied faster than a view of them is made."""
    if value.shape == shape:
        return value
    if prod(shape) > _FEW:
        return np.broadcast_to(value, shape)
    out = np.empty(shape)
    out[...] = value
    return out


def numerical_first_harmonic(
    law: Steppable, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0, samples: int | None = None
) -> FirstHarmonic:
    """Describing function of any law that acts in time, by quadrature over one steady cycle.

    Without ``samples`` the cycle is split at the law's kinks and each piece is integrated with Gauss–Legendre
    points: errors near rounding. With ``samples`` = N the cycle is sampled at N equal angles; across a kink the
    error then falls only with a power of N, and ``error`` (the change from N/2 to N) says how large it is.
    A law with memory starts at the displacement maximum and runs whole cycles until its state repeats.
    """
    A, w, z0 = broadcast(amplitude, omega, bias)
    shape = A.shape
    A, w, z0 = (np.atleast_1d(x).ravel() for x in (A, w, z0))
    tiny = 1e-9 * np.max(A, initial=0.0) or 1e-12
    small = A == 0
    a = np.where(small, tiny, A)
    gain, mean, error = _quadrature(law, a, w, z0, samples)
    if law.states:
        da, dw = 1e-4 * a, 1e-4 * np.maximum(w, 1e-3)
        d_amplitude = _difference(lambda h: _quadrature(law, a + h * da, w, z0, samples)[0]) / da
        d_omega = _difference(lambda h: _quadrature(law, a, w + h * dw, z0, samples)[0]) / dw
    else:
        d_amplitude, d_omega = _derivatives(law, a, w, z0, gain, samples)
    d_amplitude = np.where(small, 0.0, d_amplitude)
    return FirstHarmonic(
        gain.reshape(shape),
        d_amplitude.reshape(shape),
        d_omega.reshape(shape),
        mean.reshape(shape),
        error.reshape(shape),
    )


def _difference(f: Callable[[float], ComplexArray]) -> ComplexArray:
    """Fourth-order central difference for unit step."""
    value: ComplexArray = (8 * (f(1.0) - f(-1.0)) - (f(2.0) - f(-2.0))) / 12
    return value


def _nodes(law: Steppable, a: Array, w: Array, z0: Array, points: int, samples: int | None) -> tuple[Array, Array]:
    """Angles (ascending within each cycle, first entry 0) and weights (sum 2π), shape (cases, nodes)."""
    if samples is not None:
        theta = 2 * np.pi * np.arange(samples) / samples
        return np.tile(theta, (len(a), 1)), np.full((len(a), samples), 2 * np.pi / samples)
    quarters = np.tile(np.linspace(0, 2 * np.pi, 5), (len(a), 1))
    edges = np.sort(np.concatenate([quarters, law.kink_angles(a, w, z0)], axis=1), axis=1)
    x, g = np.polynomial.legendre.leggauss(points)
    # A sine map makes the half-integer powers at a kink (lift-off of a Hertz contact) smooth at the ends of a piece.
    x, g = np.sin(np.pi / 2 * x), g * np.pi / 2 * np.cos(np.pi / 2 * x)
    # The ends take part with weight 0: a law with memory must see its turning points.
    x, g = np.concatenate([[-1.0], x, [1.0]]), np.concatenate([[0.0], g, [0.0]])
    half = np.diff(edges, axis=1)[:, :, None] / 2
    middle = (edges[:, 1:] + edges[:, :-1])[:, :, None] / 2
    return (middle + half * x).reshape(len(a), -1), (half * g).reshape(len(a), -1)


def _cycle_force(law: Steppable, a: Array, w: Array, z0: Array, theta: Array) -> Array:
    """Steady force at the angles of the cycle, shape (cases, nodes)."""
    z = z0[:, None] + a[:, None] * np.cos(theta)
    v = -(w * a)[:, None] * np.sin(theta)
    if not law.states:
        return law.step(Motion(z, v), law.initial_state(z))[0]
    step = np.diff(theta, axis=1, prepend=theta[:, -1:] - 2 * np.pi) / np.where(w > 0, w, 1.0)[:, None]
    state = law.initial_state(z[:, 0])
    force = np.empty_like(z)
    for _ in range(_CYCLES):
        before = state
        low, high = state, state
        for i in range(z.shape[1]):
            force[:, i], state = law.step(Motion(z[:, i], v[:, i], step[:, i]), state)
            low, high = np.minimum(low, state), np.maximum(high, state)
        if np.all(np.abs(state - before) <= _SETTLED * (high - low) + 1e-14 * np.abs(high)):
            return force
    raise InputError(
        f"{law.kind}: the state does not repeat within {_CYCLES} cycles; give it more damping or amplitude"
    )


def _project(force: Array, theta: Array, weight: Array, a: Array) -> ComplexArray:
    value: ComplexArray = np.sum(force * weight * np.exp(-1j * theta), axis=1) / (np.pi * a)
    return value


def _quadrature(
    law: Steppable, a: Array, w: Array, z0: Array, samples: int | None
) -> tuple[ComplexArray, Array, Array]:
    theta, weight = _nodes(law, a, w, z0, _GAUSS_POINTS, samples)
    force = _cycle_force(law, a, w, z0, theta)
    gain = _project(force, theta, weight, a)
    mean = np.sum(force * weight, axis=1) / (2 * np.pi)
    coarse, coarse_weight = _nodes(law, a, w, z0, _GAUSS_POINTS - 8, None if samples is None else samples // 2)
    error = np.abs(gain - _project(_cycle_force(law, a, w, z0, coarse), coarse, coarse_weight, a))
    return gain, mean, error


def _derivatives(
    law: Steppable, a: Array, w: Array, z0: Array, gain: ComplexArray, samples: int | None
) -> tuple[ComplexArray, ComplexArray]:
    """dG/dA and dG/dω of a memoryless law, from its slopes along the cycle."""
    theta, weight = _nodes(law, a, w, z0, _GAUSS_POINTS, samples)
    z = z0[:, None] + a[:, None] * np.cos(theta)
    v = -(w * a)[:, None] * np.sin(theta)
    stiffness, damping = law.jacobian(Motion(z, v), law.initial_state(z))
    slope = stiffness * np.cos(theta) - damping * w[:, None] * np.sin(theta)
    d_amplitude = (_project(slope, theta, weight, np.ones_like(a)) - gain) / a
    d_omega = _project(-damping * np.sin(theta), theta, weight, np.ones_like(a))
    return d_amplitude, d_omega
