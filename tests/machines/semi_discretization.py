"""Milling stability by first-order semi-discretisation (Insperger & Stépán), the second route of the lobe tests.

Written from the equation of motion alone, M q̈ + C q̇ + K q = −w·H(t)·[q(t) − q(t − τ)]: its own tooth forces, its own
time stepping, nothing of the lobe solvers. Steps average H; the delayed position is the mean of its two neighbours.
"""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array


def tooth_stiffness(start: Array, end: Array, tangential: float, normal: float) -> Array:
    """∫H₁dφ of one tooth from ``start`` to ``end``, from the primitives of s², s·c and c², shape (…, 2, 2)."""

    def primitive(angle: Array) -> Array:
        ss, cc = angle / 2 - np.sin(2 * angle) / 4, angle / 2 + np.sin(2 * angle) / 4
        sc = np.sin(angle) ** 2 / 2
        rows = (
            [tangential * sc + normal * ss, tangential * cc + normal * sc],
            [
                -tangential * ss + normal * sc,
                -tangential * sc + normal * cc,
            ],
        )
        return np.moveaxis(np.array(rows), (0, 1), (-2, -1))

    return np.asarray(primitive(end) - primitive(start))


def mean_stiffness(
    steps: int, teeth: int, tangential: float, normal: float, arc: tuple[float, float], axes: int
) -> Array:
    """H averaged over each step of a tooth period, shape (steps, axes, axes)."""
    pitch = 2 * np.pi / teeth
    edges = np.linspace(0, pitch, steps + 1)
    total = np.zeros((steps, 2, 2))
    for j in range(teeth):
        for turn in (0.0, 2 * np.pi):
            low = np.clip(edges[:-1] + j * pitch - turn, *arc)
            high = np.clip(edges[1:] + j * pitch - turn, *arc)
            total += tooth_stiffness(low, high, tangential, normal)
    return total[:, :axes, :axes] * steps / pitch


def largest_multiplier(
    mass: Array, damping: Array, stiffness: Array, H: Array, speed: float, teeth: int, depth: Array
) -> Array:
    """Largest |μ| at depths in m, shape (d,), of a tool with these matrices on its axes; H per step."""
    n, steps = len(mass), len(H)
    dt = 60 / (teeth * speed) / steps
    inverse = np.linalg.inv(mass)
    size = 2 * n + steps * n
    # Rows that give y and the positions from what was there at the beginning: y_0, then q_(−1) … q_(−steps).
    y = np.zeros((len(depth), 2 * n, size))
    y[:, :, : 2 * n] = np.eye(2 * n)
    past = [np.zeros((n, size)) for _ in range(steps)]
    for k, row in enumerate(past):
        row[:, 2 * n + (steps - 1 - k) * n : 2 * n + (steps - k) * n] = np.eye(n)
    position = [np.broadcast_to(row, (len(depth), n, size)) for row in past] + [y[:, :n]]
    for i in range(steps):
        w = depth[:, None, None] * H[i]
        system = np.zeros((len(depth), 3 * n, 3 * n))
        system[:, :n, n : 2 * n] = np.eye(n)
        system[:, n : 2 * n, :n] = -inverse @ (stiffness + w)
        system[:, n : 2 * n, n : 2 * n] = -inverse @ damping
        system[:, n : 2 * n, 2 * n :] = inverse @ w
        step = exponential(dt * system)
        late = (position[i] + position[i + 1]) / 2
        y = step[:, : 2 * n, : 2 * n] @ y + step[:, : 2 * n, 2 * n :] @ late
        position.append(y[:, :n])
    whole = np.concatenate([y, *position[-2 : -steps - 2 : -1]], axis=1)
    return np.asarray(np.max(np.abs(np.linalg.eigvals(whole)), axis=1))


def exponential(matrices: Array) -> Array:
    """e^M by Taylor's series of M/2⁶, squared six times."""
    scaled, term = matrices / 64, np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape)
    total = term.copy()
    for k in range(1, 12):
        term = term @ scaled / k
        total = total + term
    for _ in range(6):
        total = total @ total
    return np.asarray(total)


def extrapolated(coarse: Array, fine: Array) -> Array:
    """Richardson's value from steps and twice as many, the error being of second order."""
    return (4 * fine - coarse) / 3
