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

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from jointlib.arrays import Array, ComplexArray

from .chart import LobeBranch
from .tool_point import ToolPoint

_STEP = 0.1
_ROUNDS = 16
_MOST_LINES = 200_000
_FLOOR = 1e-4
_ZERO = 1e-12


@dataclass(frozen=True)
class Trace:
    """Loop eigenvalues followed over frequency.

    ``frequency`` in Hz, shape (m,); ``eigenvalue`` in 1/m, shape (m, branches), each column continuous.
    ``resolved`` is false where neighbours stay far apart however fine the lines are.
    """

    frequency: Array
    eigenvalue: ComplexArray
    resolved: bool


@dataclass(frozen=True)
class Minimum:
    """The lowest depth (m) over all speeds, its chatter frequency (Hz) and fraction of a wave."""

    depth: float
    frequency: float
    phase: float
    at_edge: bool


def loop_eigenvalues(stiffness: Array, receptance: ComplexArray) -> ComplexArray:
    """Eigenvalues λ of D·G in 1/m; (n, n) and (nf, n, n) give (nf, n), n = 1 or 2, in no particular order."""
    if stiffness.shape == (1, 1):
        return np.asarray(stiffness[0, 0] * receptance[:, :, 0])
    loop = stiffness @ receptance
    half = (loop[:, 0, 0] + loop[:, 1, 1]) / 2
    difference = (loop[:, 0, 0] - loop[:, 1, 1]) / 2
    root = np.sqrt(difference**2 + loop[:, 0, 1] * loop[:, 1, 0])
    large = half + np.where((half * root.conj()).real >= 0, root, -root)
    product = np.linalg.det(stiffness) * (
        receptance[:, 0, 0] * receptance[:, 1, 1] - receptance[:, 0, 1] * receptance[:, 1, 0]
    )
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


def trace(point: ToolPoint, stiffness: Array) -> Trace:
    """Follow the loop eigenvalues, halving the line spacing until a step is a tenth of the eigenvalue.

    Only where the boundary can lie: steps that stay far from Re λ < 0, or at depths 10⁴ times the lowest one,
    are left coarse.
    """
    f = point.lines
    eigenvalue = _followed(loop_eigenvalues(stiffness, point(f)))
    resolved = False
    for _ in range(_ROUNDS):
        step = np.abs(np.diff(eigenvalue, axis=0))
        size = np.minimum(np.abs(eigenvalue[1:]), np.abs(eigenvalue[:-1]))
        reach = deepest(eigenvalue)
        floor = _FLOOR * max(float(np.max(reach)), 0.0)
        coarse = np.any((step > _STEP * size) & (reach > floor), axis=1)
        resolved = not np.any(coarse)
        if resolved or len(f) > _MOST_LINES:
            break
        middle = (f[:-1][coarse] + f[1:][coarse]) / 2
        order = np.argsort(np.concatenate([f, middle]), kind="stable")
        values = np.concatenate([eigenvalue, loop_eigenvalues(stiffness, point(middle))])
        f, eigenvalue = np.concatenate([f, middle])[order], _followed(values[order])
    return Trace(f, eigenvalue, resolved)


def deepest(eigenvalue: ComplexArray) -> Array:
    """How negative Re λ may get between neighbouring lines, as −Re λ plus one step; (m, n) gives (m − 1, n)."""
    step = np.abs(np.diff(eigenvalue, axis=0))
    return np.asarray(np.maximum(-eigenvalue.real[1:], -eigenvalue.real[:-1]) + step)


def lowest_depth(point: ToolPoint, stiffness: Array, traced: Trace) -> Minimum:
    """Minimum of −1/(2·Re λ) over frequency, refined between the lines; every speed is stable below it."""
    f = traced.frequency
    strength = np.max(-traced.eigenvalue.real, axis=1)
    if np.max(strength) <= 0:
        return Minimum(np.inf, np.nan, np.nan, at_edge=False)
    padded = np.concatenate([[-np.inf], strength, [-np.inf]])
    peak = (strength >= padded[:-2]) & (strength >= padded[2:]) & (strength > 0.9 * np.max(strength))
    candidates = sorted(np.flatnonzero(peak).tolist(), key=lambda j: -strength[j])[:20]

    def strongest(at: float) -> complex:
        values = loop_eigenvalues(stiffness, point(np.array([at])))[0]
        return complex(values[np.argmin(values.real)])

    found: list[float] = []
    for j in candidates:
        low, high = float(f[max(j - 1, 0)]), float(f[min(j + 1, len(f) - 1)])
        refined = minimize_scalar(
            lambda at: strongest(at).real, bounds=(low, high), method="bounded", options={"xatol": 1e-10 * high}
        )
        found += [float(refined.x), float(f[j])]
    values = [strongest(at) for at in found]
    best = min(range(len(values)), key=lambda i: values[i].real)
    at, value = found[best], np.array([values[best]])
    edge = min(at - f[0], f[-1] - at) < 1e-6 * at
    return Minimum(float(limiting_depth(value)[0]), at, float(wave_fraction(value)[0]), bool(edge))


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


def _followed(eigenvalue: ComplexArray) -> ComplexArray:
    """Columns exchanged line by line so that each one runs on smoothly."""
    if eigenvalue.shape[1] == 1:
        return eigenvalue
    before, after = eigenvalue[:-1], eigenvalue[1:]
    straight = np.sum(np.abs(after - before), axis=1)
    crossed = np.sum(np.abs(after[:, ::-1] - before), axis=1)
    swapped = np.concatenate([[False], np.cumsum(crossed < straight) % 2 == 1])
    return np.where(swapped[:, None], eigenvalue[:, ::-1], eigenvalue)
