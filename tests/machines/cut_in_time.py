"""A cut in time by plain Runge-Kutta steps on the delay equation: the second route of every sentence about chatter.

    M q̈ + C q̇ + K q = −Σ rᵀ f(z, ż) + Tᵀ F(t),   z = r q,   F = −b Σ_teeth u(φ)·h,   h = s(φ)·feed + v(φ)ᵀT q − S(φ)

S is the deepest surface that any earlier pass left at the same angle (multiple regeneration), h is cut off at 0.
Written from these equations alone: of ``machines.cutting`` only the numbers of a `Cutting` are used. Machines, cuts
and kicks are stepped side by side, (case, …, kick); a tooth period has the same number of steps in all, and teeth enter
and leave the cut between two of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, null_space

from jointlib.arrays import Array
from machines import Machine
from machines.lobes import Cutting


@dataclass(frozen=True)
class Bend:
    """What of a joint is not linear: stiffness3·z³, a spring stuck up to a slip force, smoothed friction, balls.

    z is ``row`` times the dofs; N/m³, N/m and N, N and m/s. Two rows of balls push with ``balls``·(1 ± z/lift)^(3/2)
    in N while they touch, without what is linear of it.
    """

    row: Array
    cubic: float = 0.0
    stick: float = 0.0
    slip: float = 0.0
    friction: float = 0.0
    smoothing: float = 1.0
    balls: float = 0.0
    lift: float = 1.0


@dataclass(frozen=True)
class Body:
    """M, C, K over n dofs with every linear spring and damper in it, its bent joints, and the tool's x and y.

    ``tool`` is (2, n); the row of an axis that does not move is zero.
    """

    mass: Array
    damping: Array
    stiffness: Array
    bends: tuple[Bend, ...]
    tool: Array

    @classmethod
    def of(cls, machine: Machine) -> Body:
        """Of a machine of masses and joints: linear, viscous, cubic, Jenkins, smoothed Coulomb and ball guide laws."""
        parts = [part for c in machine.components if (part := c.second_order()) is not None]
        assert len(parts) == len(machine.components)
        M, C, K, shapes = (
            block_diag(*(getattr(p, k) for p in parts)) for k in ("mass", "damping", "stiffness", "shapes")
        )
        held = [c.row(machine.components) @ shapes for c in machine.connections if c.rigid]
        N = null_space(np.array(held)) if held else np.eye(len(M))
        M, C, K, shapes = N.T @ M @ N, N.T @ C @ N, N.T @ K @ N, shapes @ N
        bends = []
        for connection in machine.connections:
            if connection.joint is None:
                continue
            row = connection.row(machine.components) @ shapes
            for law in connection.joint.laws:
                if law.kind == "linear":
                    K = K + law.stiffness * np.outer(row, row)
                elif law.kind == "viscous":
                    C = C + law.damping * np.outer(row, row)
                elif law.kind == "cubic":
                    bends.append(Bend(row, cubic=law.stiffness3))
                elif law.kind == "jenkins" and not law.clearance:
                    bends.append(Bend(row, stick=law.stiffness, slip=law.slip_force))
                elif law.kind == "hertz-guide":
                    sine, d = np.sin(law.contact_angle), law.kappa * law.preload ** (2 / 3)
                    K = K + 6 * sine**2 * law.preload / d * np.outer(row, row)
                    bends.append(Bend(row, balls=2 * sine * law.preload, lift=d / sine))
                elif law.kind == "coulomb" and law.smoothing_velocity:
                    bends.append(Bend(row, friction=law.slip_force, smoothing=law.smoothing_velocity))
                else:
                    raise AssertionError(f"not known in time: {law}")
        tool = np.zeros((2, len(shapes[0])))
        names = [f"{c.name}.{dof}" for c in machine.components for dof in c.dofs]
        for axis, dof in machine.tool.items():
            tool["xy".index(axis)] = shapes[names.index(dof)]
        return cls(M, C, K, tuple(bends), tool)


@dataclass(frozen=True)
class Case:
    """A machine in a cut at a speed (rpm) and depth (m), and the kicks it starts from.

    A kick (m) is how far the tool is bent aside and let go: along the chip in turning, along x, or y where x is rigid,
    in milling. With a ``frequency`` (Hz) the surface before it is that of a vibration of this size, else it is smooth.
    With ``mean`` the mean cutting force is left in; else the motion is that about where it holds the machine.
    """

    body: Body
    cutting: Cutting
    speed: float
    depth: float
    kicks: Sequence[float]
    frequency: float | None = None
    mean: bool = False


@dataclass(frozen=True)
class Course:
    """What became of every kick of every case in windows of whole tooth periods.

    ``chatter`` and ``forced`` are amplitudes in m, (window, case, kick), of the axis that moves more: √2 times the
    effective value of what does not repeat with every tooth under a Hann window, and half the height of what does. In
    turning nothing is forced. ``time`` in s, (window, case), is where windows end. ``frequency`` in Hz, (case, kick),
    is that of the chatter in the last window, by how often it passes through zero. ``lost`` says in which windows an
    edge that should cut left the cut, ``escaped`` which motions passed the bound and were stopped, (case, kick).
    """

    time: Array
    chatter: Array
    forced: Array
    frequency: Array
    lost: np.ndarray
    escaped: np.ndarray


def cut_in_time(cases: Sequence[Case], windows: int, periods: int = 40, steps: int = 90, reach: float = 2e-3) -> Course:
    """Step all cases, with as many kicks each, through ``windows`` of so many tooth periods (revolutions in turning).

    ``steps`` in a tooth period are shared out among its up to three parts with the same teeth in the cut; 25 for a wave
    of the chatter keep depths to 0.1 %. Motions of more than ``reach`` (m) at the tool are stopped.
    """
    plans = [_plan(case, steps) for case in cases]
    cut = _stacked(plans)
    A, B, P, bends = _equations([case.body for case in cases])
    m, s = len(cases), len(cases[0].kicks)
    nodes = cut.h.shape[0]
    u, surface = _kicked(cases, A, B, P, cut, bends)
    slider = np.zeros((m, bends.shape[1], s))
    place, motion = slice(2 * bends.shape[1], -2), slice(-2, None)
    depth = np.array([case.depth for case in cases])[:, None, None]
    fed = np.array([case.cutting.feed is not None for case in cases])
    feed = np.array([case.cutting.feed or 0.0 for case in cases])[:, None, None]
    floor = np.where(fed, 0.0, -np.inf)[:, None, None]
    q = np.array([case.cutting.exponent for case in cases])[:, None, None]
    power = bool(np.any(q != 1))
    gain = np.where(fed[:, None, None], np.where(fed[:, None, None], feed, 1.0) ** (1 - q) / q, 1.0)
    cubic, stick, slip, friction, smoothing, balls, lift = (bends[:, :, i, None] for i in range(7))
    clamp = np.where(stick > 0, slip / np.where(stick > 0, stick, 1.0), 0.0)
    j = bends.shape[1]
    bent, rubbed = bool(np.any(cubic)) or bool(np.any(stick)), bool(np.any(friction))
    rolled = bool(np.any(balls))

    def bite(chip: Array) -> Array:
        thick = np.maximum(chip, floor)
        return gain * np.where(fed[:, None, None], np.abs(thick) ** q, thick) if power else thick

    nominal = np.stack(
        [[cut.U[k, i] @ bite(cut.share[k, i][:, :, None] * feed) for i in range(3)] for k in range(nodes)]
    )
    simpson = np.array([1, 4, 1])[None, :, None, None, None] / 6 * cut.h[:, None, :, None, None]
    bias = depth * np.sum(simpson * nominal, axis=(0, 1)) / np.sum(cut.h, axis=0)[:, None, None]
    bias *= np.array([fed[i] and not case.mean for i, case in enumerate(cases)])[:, None, None]

    def rate(state: Array, V: Array, U: Array, met: Array) -> Array:
        y = P @ state
        f = np.zeros((m, j + 2, s))
        if bent:
            z = y[:, :j]
            f[:, :j] = -cubic * z * z * z - stick * np.minimum(np.maximum(z - slider, -clamp), clamp)
        if rolled:
            w = y[:, :j] / lift
            f[:, :j] -= balls * (np.maximum(1 + w, 0) ** 1.5 - np.maximum(1 - w, 0) ** 1.5 - 3 * w)
        if rubbed:
            f[:, :j] -= friction * np.tanh(y[:, j : 2 * j] / smoothing)
        f[:, j:] = bias - depth * (U @ bite(V @ y[:, place] - met))
        return np.asarray(A @ state + B @ f)

    x, v = np.empty((nodes + 1, m, 2, s)), np.empty((nodes + 1, m, 2, s))
    kept = np.empty((periods, nodes, m, 2, s), dtype=np.float32)
    escaped = np.zeros((m, s), dtype=bool)
    chatter, forced, lost = (np.empty((windows, m, s)) for _ in range(3))
    frequency = np.zeros((m, s))
    with np.errstate(over="ignore", invalid="ignore"):
        for window in range(windows):
            lost[window] = 0
            for period in range(periods):
                met = surface - feed * cut.share[..., None]
                y = P @ u
                x[0], v[0] = y[:, place], y[:, motion]
                for k in range(nodes):
                    h = cut.h[k][:, None, None]
                    V, U, S = cut.V[k], cut.U[k], met[k]
                    k1 = rate(u, V[0], U[0], S[0])
                    k2 = rate(u + h / 2 * k1, V[1], U[1], S[1])
                    k3 = rate(u + h / 2 * k2, V[1], U[1], S[1])
                    k4 = rate(u + h * k3, V[2], U[2], S[2])
                    u = u + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
                    y = P @ u
                    slider = y[:, :j] - np.minimum(np.maximum(y[:, :j] - slider, -clamp), clamp)
                    x[k + 1], v[k + 1] = y[:, place], y[:, motion]
                surface, off = _left(cut, fed, met, x, v)
                lost[window] = np.maximum(lost[window], off)
                kept[period] = x[:-1]
                gone = ~(np.max(np.abs(x), axis=(0, 2)) < reach)
                if np.any(gone):
                    escaped |= gone
                    for array in (u, slider, surface):
                        np.copyto(array, 0.0, where=gone[:, None, :])
                    kept[:, :, gone[:, None, :].repeat(2, 1)] = 0.0
            chatter[window], forced[window], frequency = _sizes(kept, cut.h, [case.cutting for case in cases])
    total = np.cumsum(np.full(windows, float(periods)))[:, None] * np.sum(cut.h, axis=0)
    return Course(total, chatter, forced, frequency, lost > 0, escaped)


@dataclass(frozen=True)
class _Plan:
    """Steps h (node, case) of a tooth period; v, u and the share of the feed at start, middle and end of each step.

    V (node, 3, case, tooth, axis), U (node, 3, case, axis, tooth), share (node, 3, case, tooth).
    """

    h: Array
    V: Array
    U: Array
    share: Array


def _plan(case: Case, steps: int) -> _Plan:
    cut, turn = case.cutting, 2 * np.pi * case.speed / 60
    along = np.array([np.cos(cut.feed_direction), np.sin(cut.feed_direction)])
    normal = np.array([-along[1], along[0]])
    if cut.process != "milling":
        V = np.broadcast_to(along, (steps, 3, 1, 1, 2))
        U = cut.specific * np.swapaxes(V, 3, 4)
        return _Plan(np.full((steps, 1), 60 / case.speed / steps), V, U, np.ones((steps, 3, 1, 1)))
    radius = cut.immersion if cut.mode != "slot" else 1.0
    first = np.pi - np.arccos(1 - 2 * radius) if cut.mode == "down" else 0.0
    last = np.arccos(1 - 2 * radius) if cut.mode == "up" else np.pi
    pitch = 2 * np.pi / cut.teeth
    inner = sorted({round(float(a % pitch), 12) for a in (first, last)} - {0.0, round(pitch, 12)})
    ends = np.array([0.0, *(a for a in inner if 1e-9 < a < pitch - 1e-9), pitch])
    count = np.maximum(8, np.round(steps * np.diff(ends) / pitch).astype(int))
    count[np.argmax(count)] += steps - int(np.sum(count))
    edges = np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], count, strict=True)]
    )
    width = np.repeat(np.diff(ends) / count, count)
    theta = edges[:, None] + width[:, None] * np.array([0.0, 0.5, 1.0])
    phi = theta[:, :, None] + pitch * np.arange(cut.teeth)
    middle = phi[:, 1:2]
    inside = (middle > first) & (middle < last)
    sin, cos = np.sin(phi), np.cos(phi)
    V = sin[..., None] * along + cos[..., None] * normal
    push = (cut.tangential * cos + cut.normal * sin)[..., None] * along
    push = push + (cut.normal * cos - cut.tangential * sin)[..., None] * normal
    U = np.swapaxes(np.where(inside[..., None], push, 0.0), 2, 3)
    # An end of the arc, where the chip begins or ends with nothing, stands for what lies a quarter of a step inside.
    share = np.sin(np.clip(phi, width[:, None, None] / 4, np.pi - width[:, None, None] / 4))
    return _Plan((width / turn)[:, None], V[:, :, None], U[:, :, None], share[:, :, None])


def _stacked(plans: Sequence[_Plan]) -> _Plan:
    """Cases side by side; a case with fewer teeth gets some that never cut."""
    teeth = max(p.V.shape[3] for p in plans)
    padded = []
    for p in plans:
        more = teeth - p.V.shape[3]
        V = np.pad(p.V, [(0, 0)] * 3 + [(0, more), (0, 0)])
        U = np.pad(p.U, [(0, 0)] * 4 + [(0, more)])
        padded.append((p.h, V, U, np.pad(p.share, [(0, 0)] * 3 + [(0, more)])))
    h, V, U, share = zip(*padded, strict=True)
    return _Plan(
        np.concatenate(h, axis=1),
        np.ascontiguousarray(np.concatenate(V, axis=2)),
        np.ascontiguousarray(np.concatenate(U, axis=2)),
        np.concatenate(share, axis=2),
    )


def _equations(bodies: Sequence[Body]) -> tuple[Array, Array, Array, Array]:
    """A, B over states (q, q̇) and forces (joints, tool), P to (z, ż, tool, its speed), and what bends each joint."""
    n, j = max(len(b.mass) for b in bodies), max(len(b.bends) for b in bodies)
    m = len(bodies)
    A, B = np.zeros((m, 2 * n, 2 * n)), np.zeros((m, 2 * n, j + 2))
    P, bends = np.zeros((m, 2 * j + 4, 2 * n)), np.zeros((m, j, 7))
    bends[:, :, [4, 6]] = 1.0
    for i, body in enumerate(bodies):
        size = len(body.mass)
        here, speeds = slice(0, size), slice(n, n + size)
        A[i, here, speeds] = np.eye(size)
        A[i, speeds, here] = -np.linalg.solve(body.mass, body.stiffness)
        A[i, speeds, speeds] = -np.linalg.solve(body.mass, body.damping)
        rows = np.zeros((j + 2, size))
        rows[j:] = body.tool
        for k, bend in enumerate(body.bends):
            rows[k] = bend.row
            bends[i, k] = (
                bend.cubic, bend.stick, bend.slip, bend.friction, bend.smoothing, bend.balls, bend.lift
            )  # fmt: skip
        B[i, speeds] = np.linalg.solve(body.mass, rows.T)
        P[i, :j, here] = P[i, j : 2 * j, speeds] = rows[:j]
        P[i, 2 * j : 2 * j + 2, here] = P[i, 2 * j + 2 :, speeds] = rows[j:]
    return A, B, P, bends


def _kicked(cases: Sequence[Case], A: Array, B: Array, P: Array, cut: _Plan, bends: Array) -> tuple[Array, Array]:
    """States at time 0, and the surface that the edges meet in the first period."""
    n = A.shape[1] // 2
    s = len(cases[0].kicks)
    u = np.zeros((len(cases), 2 * n, s))
    surface = np.zeros((*cut.share.shape, s))
    for i, case in enumerate(cases):
        size = len(case.body.mass)
        angle = case.cutting.feed_direction
        push = np.array([np.cos(angle), np.sin(angle)]) if case.cutting.process != "milling" else np.array([1.0, 0.0])
        if not np.any(push @ case.body.tool):
            push = push[::-1]
        stuck = sum((b.stick * np.outer(b.row, b.row) for b in case.body.bends), np.zeros((size, size)))
        bent = np.linalg.solve(case.body.stiffness + stuck, case.body.tool.T @ push)
        moved = case.body.tool @ bent
        top = float(np.max(np.abs(moved)))
        u[i, :size] = np.outer(bent / top, case.kicks)
        if case.frequency is not None:
            ends = np.cumsum(cut.h[:, i])
            time = (ends - cut.h[:, i])[:, None] + cut.h[:, i, None] * np.array([0, 0.5, 1.0]) - ends[-1]
            wave = np.cos(2 * np.pi * case.frequency * time)[:, :, None]
            surface[:, :, i] = (wave * (cut.V[:, :, i] @ (moved / top)))[..., None] * np.array(case.kicks)
    return u, surface


def _left(cut: _Plan, fed: Array, met: Array, x: Array, v: Array) -> tuple[Array, Array]:
    """The surface after a period, and whether an edge left the cut in it, (case, kick)."""
    h = cut.h[:, :, None, None]
    middle = (x[:-1] + x[1:]) / 2 + h / 8 * (v[:-1] - v[1:])
    new = cut.V @ np.stack([x[:-1], middle, x[1:]], axis=1)
    deepest = np.where(fed[:, None, None], np.maximum(new, met), new)
    cuts = np.any(cut.U != 0, axis=3) & (cut.share > 0.02)
    return deepest, np.any((deepest > new) & cuts[..., None], axis=(0, 1, 3)).astype(float)


def _sizes(kept: Array, h: Array, cuttings: Sequence[Cutting]) -> tuple[Array, Array, Array]:
    """Chatter and forced amplitude in m and the frequency of the chatter in Hz, (case, kick) each."""
    periods = len(kept)
    hann = np.sin(np.pi * (np.arange(periods) + 0.5) / periods) ** 2
    hann = (hann / np.sum(hann)).astype(np.float32)
    share = (h / np.sum(h, axis=0))[:, :, None, None]
    repeating = np.tensordot(hann, kept, axes=1)
    milled = np.array([c.process == "milling" for c in cuttings])[:, None, None]
    repeating = np.where(milled, repeating, np.sum(share * repeating, axis=0))
    rest = kept - repeating.astype(np.float32)
    square = np.sum(share * np.tensordot(hann, rest**2, axes=1), axis=0)
    axis = np.argmax(square, axis=1)[:, None]
    path = np.take_along_axis(rest, axis[None, None], 3)[:, :, :, 0].reshape(-1, *axis.shape[::2])
    crossings = np.count_nonzero(np.diff(path > 0, axis=0), axis=0)
    frequency = crossings / 2 / (periods * np.sum(h, axis=0))[:, None]
    height = np.max(np.ptp(repeating, axis=0), axis=1) / 2
    return np.sqrt(2 * np.max(square, axis=1)), height, frequency
