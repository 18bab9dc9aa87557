"""Cuts of any cutter in time, the two further routes of its tests: semi-discretisation over a revolution, and stepping.

    m q̈ + c q̇ + k q = −b·Σ_j H_j(t)·[q(t) − q(t − τ_j)] − b·(C/v)·Σ_j N_j(t)·q̇,

two directions alike or not. Written from that alone: its own tooth forces, sections along the depth, delays a section,
nothing of the lobe solvers. Many cuts are stepped side by side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from semi_discretization import exponential, tooth_stiffness

from jointlib.arrays import Array


@dataclass(frozen=True)
class Case:
    """A tool (natural frequencies in rad/s, damping ratios and masses of x and y) in a cut at rpm and a depth in m."""

    natural: tuple[float, float]
    ratio: tuple[float, float]
    mass: tuple[float, float]
    tangential: float
    normal: float
    arc: tuple[float, float]
    pitch: tuple[float, ...]
    lag: tuple[float, ...]
    speed: float
    depth: float
    rubbing: float = 0.0
    """C/v in N s/m²."""


@dataclass(frozen=True)
class _Plan:
    """Means over each step of a revolution, and delays in steps, of every flute and section."""

    H: Array
    N: Array
    late: Array


def _plan(case: Case, steps: int, sections: int) -> _Plan:
    edges = 2 * np.pi * np.arange(steps + 1) / steps
    behind, before = np.roll(case.pitch, 1), np.roll(case.lag, 1)
    place = np.concatenate([[0.0], np.cumsum(case.pitch)[:-1]])
    many = sections if len(set(case.lag)) > 1 else 1
    fine = 48 // many
    H, late = np.zeros((len(case.pitch), many, steps, 2, 2)), np.zeros((len(case.pitch), many))
    N = np.zeros_like(H)
    for j, lag in enumerate(case.lag):
        for s in range(many):
            for z in (s + (np.arange(fine) + 0.5) / fine) / many * case.depth:
                low = edges[:-1] - place[j] - lag * z
                for turn in range(-1, 9):
                    a = np.clip(low + 2 * np.pi * turn, *case.arc)
                    b = np.clip(low + 2 * np.pi * turn + edges[1], *case.arc)
                    if np.any(b > a):
                        H[j, s] += tooth_stiffness(a, b, case.tangential, case.normal) / edges[1] / fine / many
                        N[j, s] += tooth_stiffness(a, b, 0.0, 1.0) / edges[1] / fine / many
            middle = (s + 0.5) / many * case.depth
            late[j, s] = (behind[j] + (lag - before[j]) * middle) * steps / (2 * np.pi)
    return _Plan(H.reshape(-1, steps, 2, 2), N.sum(axis=(0, 1)), late.ravel())


def _plans(cases: list[Case], steps: int, sections: int) -> tuple[Array, Array, Array]:
    found = [_plan(case, steps, sections) for case in cases]
    most = max(len(p.late) for p in found)
    H, N, late = (
        np.zeros((len(cases), most, steps, 2, 2)),
        np.zeros((len(cases), steps, 2, 2)),
        np.full((len(cases), most), 3.0),
    )
    for i, p in enumerate(found):
        H[i, : len(p.late)], N[i], late[i, : len(p.late)] = p.H, p.N, p.late
    return H, N, late


def _equations(cases: list[Case]) -> tuple[Array, Array]:
    """A of (q, q̇), (cases, 4, 4), and 1/m on its last rows, (cases, 4, 2)."""
    A, B = np.zeros((len(cases), 4, 4)), np.zeros((len(cases), 4, 2))
    for i, case in enumerate(cases):
        A[i, :2, 2:] = np.eye(2)
        A[i, 2:, :2] = -np.diag(np.square(case.natural))
        A[i, 2:, 2:] = -np.diag(2 * np.array(case.ratio) * case.natural)
        B[i, 2:] = np.diag(1 / np.array(case.mass))
    return A, B


def growth_by_steps(cases: list[Case], steps: int, vectors: int = 10, rounds: int = 12, sections: int = 8) -> Array:
    """Largest |μ| over a revolution by first-order semi-discretisation, (cases,): constant H, held history a step."""
    H, N, late = _plans(cases, steps, sections)
    A, B = _equations(cases)
    c = len(cases)
    b = np.array([case.depth for case in cases])[:, None, None]
    rub = np.array([case.depth * case.rubbing for case in cases])[:, None, None]
    dt = np.array([60 / case.speed / steps for case in cases])[:, None, None]
    turn = []
    for i in range(steps):
        whole = np.zeros((c, 6, 6))
        whole[:, :4, :4] = A
        whole[:, :4, :2] -= B @ (b * H[:, :, i].sum(axis=1))
        whole[:, :4, 2:4] -= B @ (rub * N[:, i])
        whole[:, :4, 4:] = B * b
        turn.append(exponential(dt * whole)[:, :4])
    kept = int(np.ceil(np.max(late))) + 2
    state = np.random.default_rng(0).standard_normal((c, 4 + 2 * kept, vectors))
    state, _ = np.linalg.qr(state)
    rows = np.arange(c)[:, None]
    at = late - 0.5
    whole_steps, share = np.floor(at).astype(int), (at - np.floor(at))[:, :, None, None]
    for _ in range(rounds):
        y = state[:, :4]
        past = np.zeros((c, kept + steps + 1, 2, vectors))
        past[:, :kept] = state[:, 4:].reshape(c, kept, 2, vectors)
        past[:, kept] = y[:, :2]
        for i in range(steps):
            place = kept + i - whole_steps
            old = (1 - share) * past[rows, place] + share * past[rows, place - 1]
            push = np.einsum("cjab,cjbv->cav", H[:, :, i], old)
            y = turn[i] @ np.concatenate([y, push], axis=1)
            past[:, kept + i + 1] = y[:, :2]
        end = np.concatenate([y, past[:, steps : steps + kept].reshape(c, 2 * kept, vectors)], axis=1)
        mu = np.linalg.eigvals(state.swapaxes(1, 2) @ end)
        state, _ = np.linalg.qr(end)
    return np.asarray(np.max(np.abs(mu), axis=1))


def growth_in_time(cases: list[Case], steps: int, revolutions: int = 30, sections: int = 8) -> Array:
    """By what a vibration grows from one revolution to the next, (cases,), stepped by RK4 from a knock.

    The delayed motion is the cubic through positions and velocities. The last third of the revolutions, each a motion
    that follows from the one before it linearly, tell the largest multiplier (dynamic mode decomposition).
    """
    H, N, late = _plans(cases, steps, sections)
    A, B = _equations(cases)
    c = len(cases)
    BH = B[:, None, None] @ (np.array([case.depth for case in cases])[:, None, None, None, None] * H)
    damp = B[:, None] @ (np.array([case.depth * case.rubbing for case in cases])[:, None, None, None] * N)
    own = BH.sum(axis=1)
    dt = np.array([60 / case.speed / steps for case in cases])
    h = dt[:, None]
    kept = int(np.ceil(np.max(late))) + 3
    q, v = np.zeros((kept + steps, c, 2)), np.zeros((kept + steps, c, 2))
    y = np.random.default_rng(1).standard_normal((c, 4)) * np.array([1e-6, 1e-6, 0, 0])
    rows, shapes, grown = np.arange(c)[:, None], list[Array](), list[Array]()
    spot = late[None] - np.array([0.0, 0.5, 1.0])[:, None, None]
    back = np.ceil(spot).astype(int)
    s = (back - spot)[..., None]
    w0, w1 = (1 + 2 * s) * (1 - s) ** 2, s**2 * (3 - 2 * s)
    d0, d1 = s * (1 - s) ** 2 * dt[:, None, None], s**2 * (s - 1) * dt[:, None, None]

    def rate(y: Array, i: int, push: Array) -> Array:
        pulled = A @ y[:, :, None] - own[:, i] @ y[:, :2, None] - damp[:, i] @ y[:, 2:, None]
        return np.asarray(pulled[:, :, 0] + push)

    for _ in range(revolutions):
        for i in range(steps):
            n = kept + i
            q[n], v[n] = y[:, :2], y[:, 2:]
            a, e = n - back, n - back + 1
            old = w0 * q[a, rows] + w1 * q[e, rows] + d0 * v[a, rows] + d1 * v[e, rows]
            push = np.einsum("cjab,mcjb->mca", BH[:, :, i], old)
            k1 = rate(y, i, push[0])
            k2 = rate(y + h / 2 * k1, i, push[1])
            k3 = rate(y + h / 2 * k2, i, push[1])
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + h * k3, i, push[2]))
        norm = np.sqrt(np.mean(q[kept:] ** 2, axis=(0, 2)))
        shapes.append(np.concatenate([q[kept:], v[kept:] * dt[:, None]], axis=2) / norm[:, None])
        grown.append(norm)
        for held in (q, v):
            held[:kept] = held[steps : steps + kept] / norm[:, None]
        y = y / norm[:, None]
    found = np.empty(c)
    last = range(revolutions - revolutions // 3, revolutions)
    for i in range(c):
        before = np.stack([shapes[k - 1][:, i].ravel() for k in last], axis=1)
        after = np.stack([shapes[k][:, i].ravel() * grown[k][i] for k in last], axis=1)
        U, sizes, W = np.linalg.svd(before, full_matrices=False)
        kept = int(np.count_nonzero(sizes > 1e-6 * sizes[0]))
        found[i] = np.max(np.abs(np.linalg.eigvals(U[:, :kept].T @ after @ W[:kept].T / sizes[:kept])))
    return found
