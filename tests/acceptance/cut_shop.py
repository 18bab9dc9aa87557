"""Test cuts of drawn mills, stepped in time all at once: every flute over what all earlier passes left, as it sounds.

Nothing of this is shared with the program: modes and flutes in time, no chart, no receptance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EFFECTS = (
    "coefficient",
    "process-damping",
    "missing-mode",
    "spindle-softening",
    "mode-damping",
    "mode-frequency",
    "joint-slip",
    "run-out",
)
LADDER = 1.3
"""Times the depth from one rung to the next."""
RUNGS = 9
_STEPS, TURNS = 160, 80
"""Steps from a tooth to the next, and revolutions of a cut."""


@dataclass(frozen=True)
class Mill:
    """A mill as it is. ``modes`` are (axis, Hz, damping ratio, kg); SI.

    Parameters
    ----------
    softens
        Share by which the frequency of each mode falls per 10 000 rpm.
    slips
        Of each mode: the share of its stiffness that slips, and the displacement in m at which it does.
    flutes
        By how much each flute stands out, m.
    """

    modes: tuple[tuple[int, float, float, float], ...]
    tangential: float
    normal: float
    teeth: int
    direction: str
    immersion: float
    diameter: float
    feed: float
    rubbing: float = 0.0
    softens: tuple[float, ...] = ()
    slips: tuple[tuple[float, float], ...] = ()
    flutes: tuple[float, ...] = ()

    @property
    def arc(self) -> tuple[float, float]:
        """Angles from the normal of the feed between which a flute is in the workpiece."""
        wide = float(np.arccos(1 - 2 * self.immersion))
        return (np.pi - wide, np.pi) if self.direction == "down" else (0.0, wide)


@dataclass(frozen=True)
class Campaign:
    """A mill as it is, what its file says of it, and where cuts are tried.

    Parameters
    ----------
    told
        The mill of the file; its modes lie off the true ones by their standard errors.
    speeds
        rpm.
    first
        m, the depth of the lowest rung.
    cuts
        That the shop has time for.
    """

    seed: int
    effect: str
    size: str
    mill: Mill
    told: Mill
    speeds: tuple[float, ...]
    first: float
    cuts: int
    begun: tuple[int, ...] = ()
    """The rung that the shop begins with at each speed."""
    step: float = LADDER
    rungs: int = RUNGS

    @property
    def depths(self) -> Array:
        """m, all rungs."""
        return np.asarray(self.first * self.step ** np.arange(self.rungs))


FREQUENCY_ERROR, DAMPING_ERROR = 0.01, 0.08


def drawn(seed: int, effect: str) -> Campaign:
    """A mill with an effect that its file does not have, or none (empty)."""
    rng = np.random.default_rng([seed, 1 + EFFECTS.index(effect) if effect else 0])
    teeth = 3 if effect == "run-out" else int(rng.integers(2, 5))
    f = float(rng.uniform(450, 900))
    pair = (f, f * float(rng.choice([-1, 1]) * rng.uniform(0.06, 0.25) + 1))
    modes = tuple((axis, pair[axis], float(rng.uniform(0.018, 0.045)), float(rng.uniform(0.4, 1.2))) for axis in (0, 1))
    K = float(rng.uniform(5e8, 1.2e9))
    told = Mill(
        modes=modes,
        tangential=K,
        normal=K * float(rng.uniform(0.2, 0.45)),
        teeth=teeth,
        direction=str(rng.choice(["up", "down"])),
        immersion=float(rng.choice([0.2, 0.35, 0.5])),
        diameter=float(rng.uniform(0.012, 0.025)),
        feed=5e-5,
    )
    off = rng.standard_normal((2, 2))
    true = tuple(
        (a, f * (1 + FREQUENCY_ERROR * off[a, 0]), z * (1 + DAMPING_ERROR * off[a, 1]), m) for a, f, z, m in modes
    )
    mill, size = _altered(replace(told, modes=true), effect, rng)
    count = int(rng.integers(8, 31))
    places = max(3, round(count / 2.6))
    tooth = np.exp(np.linspace(np.log(0.17 * f), np.log(0.75 * f), places)) * rng.uniform(0.95, 1.05, places)
    speeds = np.round(tooth * 60 / teeth, -1)
    stiff = min(m * (2 * np.pi * f) ** 2 * 2 * z for _, f, z, m in modes)
    low, high = told.arc
    first = 1.1 * stiff / (0.6 * K * teeth * (high - low) / (2 * np.pi))
    begun = tuple(int(i) for i in rng.integers(1, 5, places))
    return Campaign(seed, effect, size, mill, told, tuple(float(n) for n in speeds), first, count, begun)


def _altered(mill: Mill, effect: str, rng: np.random.Generator) -> tuple[Mill, str]:
    """The mill with the effect, and its size in words."""
    mode = int(rng.integers(2))
    modes = list(mill.modes)
    axis, f, zeta, mass = modes[mode]
    if effect == "coefficient":
        by = float(rng.choice([rng.uniform(0.5, 0.7), rng.uniform(1.4, 2.0)]))
        return replace(mill, tangential=mill.tangential * by, normal=mill.normal * by), f"{by:.2f}"
    if effect == "process-damping":
        C = float(np.exp(rng.uniform(np.log(8e4), np.log(4e5))))
        return replace(mill, rubbing=C), f"{C:.2g} N/m"
    if effect == "missing-mode":
        at = float(rng.choice([rng.uniform(0.7, 0.85), rng.uniform(1.25, 1.5)])) * max(modes[0][1], modes[1][1])
        damped, peak = float(rng.uniform(0.015, 0.04)), float(rng.uniform(0.7, 1.6))
        k = mass * (2 * np.pi * f) ** 2 * zeta / damped / peak
        modes.append((axis, at, damped, k / (2 * np.pi * at) ** 2))
        return replace(mill, modes=tuple(modes)), f"{at:.0f} Hz along {'xy'[axis]}, {peak:.1f} times as compliant"
    if effect == "spindle-softening":
        share = float(rng.uniform(0.03, 0.09))
        top = 0.75 * f * 60 / mill.teeth / 1e4
        per = share / top
        return replace(mill, softens=tuple(per if i == mode else 0.0 for i in range(2))), f"{100 * share:.1f} %"
    if effect == "mode-damping":
        by = float(rng.choice([rng.uniform(0.35, 0.55), rng.uniform(1.8, 2.8)]))
        modes[mode] = axis, f, zeta * by, mass
        return replace(mill, modes=tuple(modes)), f"{by:.2f}"
    if effect == "mode-frequency":
        by = 1 + float(rng.choice([-1, 1])) * float(rng.uniform(0.05, 0.1))
        modes[mode] = axis, f * by, zeta, mass / by**2
        return replace(mill, modes=tuple(modes)), f"{by:.3f}"
    if effect == "joint-slip":
        share, at = float(rng.uniform(0.15, 0.35)), float(rng.uniform(2e-6, 8e-6))
        return replace(mill, slips=tuple((share, at) if i == mode else (0.0, 1.0) for i in range(2))), f"{share:.2f}"
    if effect == "run-out":
        e = float(rng.uniform(0.8, 1.5)) * mill.feed
        angle = 2 * np.pi * (np.arange(mill.teeth) / mill.teeth + rng.uniform())
        return replace(mill, flutes=tuple(float(h) for h in e * np.cos(angle))), f"{1e6 * e:.0f} um"
    return mill, ""


def sounds(campaigns: Sequence[Campaign], noise: float = 0.02) -> list[list[list[tuple[Array, float]]]]:
    """A record of every rung at every speed of every campaign, with its rate in Hz: [campaign][speed][rung].

    All mills have as many teeth. The microphone hears the speed of the tool's surface, with noise.
    """
    teeth = campaigns[0].mill.teeth
    which = [(c, n, b) for c in campaigns for n in c.speeds for b in c.depths]
    mills = [c.mill for c, _, _ in which]
    heard = _stepped(mills, np.array([n for _, n, _ in which]), np.array([b for _, _, b in which]), teeth)
    out, k = [], 0
    for c in campaigns:
        rng = np.random.default_rng([c.seed, 7])
        rows = []
        for n in c.speeds:
            row = []
            for _ in range(c.rungs):
                x = heard[:, k]
                row.append((x + noise * np.std(x) * rng.standard_normal(len(x)), teeth * n / 60 * _STEPS / _EVERY))
                k += 1
            rows.append(row)
        out.append(rows)
    return out


_EVERY = 8
"""Steps to a sample of the microphone."""


def _stepped(mills: Sequence[Mill], speed: Array, depth: Array, teeth: int) -> Array:
    """Sound of the second half of every cut, (samples, cuts).

    A mode under a force that is constant over a step moves exactly; the force is that in the middle of the step, where
    the tool stands half a step after it was last looked at.
    """
    most = max(len(m.modes) for m in mills)
    padded = [[*m.modes, *[(0, 100.0, 0.5, 1e12)] * (most - len(m.modes))] for m in mills]
    axis = np.array([[mode[0] for mode in row] for row in padded]).T
    f, zeta, mass = (np.array([[mode[i] for mode in row] for row in padded]).T for i in (1, 2, 3))
    soft = np.array([[*m.softens, *[0.0] * (most - len(m.softens))] for m in mills]).T
    slips = np.array([[*m.slips, *[(0.0, 1.0)] * (most - len(m.slips))] for m in mills]).transpose(2, 1, 0)
    w = 2 * np.pi * f * (1 - soft * speed / 1e4)
    dt = 60 / (speed * teeth * _STEPS)
    a, wd = zeta * w, w * np.sqrt(1 - zeta**2)
    e, c, s = np.exp(-a * dt), np.cos(wd * dt), np.sin(wd * dt)
    zz, zv = e * (c + a / wd * s), e * s / wd
    vz, vv = -e * w**2 / wd * s, e * (c - a / wd * s)
    k = mass * w**2
    arcs = np.array([m.arc for m in mills]).T
    feed = np.array([m.feed for m in mills])
    out = np.array([[*(m.flutes or (0.0,) * teeth)] for m in mills]).T
    Kt, Kn = (np.array([getattr(m, name) for m in mills]) * depth for name in ("tangential", "normal"))
    rubs = np.array([m.rubbing / (np.pi * m.diameter) for m in mills]) * depth / (speed / 60)
    on_x, on_y = (axis == 0).astype(float), (axis == 1).astype(float)
    light = np.sum(on_x / mass, axis=0), np.sum(on_y / mass, axis=0)
    z, v = np.zeros_like(w), np.zeros_like(w)
    slider = np.zeros_like(w)
    left = np.zeros((teeth * _STEPS, 2, len(mills)))
    total = TURNS * teeth * _STEPS
    sound = np.zeros(((total - total // 2) // _EVERY + 1, len(mills)))
    heard = 0
    slipping = bool(np.any(slips[0] > 0))
    for i in range(total):
        middle = z + 0.5 * dt * v
        qx, qy = np.sum(on_x * middle, axis=0), np.sum(on_y * middle, axis=0)
        vx, vy = np.sum(on_x * v, axis=0), np.sum(on_y * v, axis=0)
        Fx, Fy = np.zeros(len(mills)), np.zeros(len(mills))
        for j in range(teeth):
            phi = (2 * np.pi * ((i + 0.5) / (_STEPS * teeth) + j / teeth)) % (2 * np.pi)
            inside = (arcs[0] < phi) & (phi < arcs[1])
            if not np.any(inside):
                continue
            sn, cs = np.sin(phi), np.cos(phi)
            here = qx * sn + qy * cs
            chip = np.full(len(mills), np.inf)
            for m in range(1, teeth + 1):
                old = left[(i - m * _STEPS) % (teeth * _STEPS)] if i >= m * _STEPS else np.zeros((2, len(mills)))
                over = m * feed * sn + out[j] - out[(j + m) % teeth] + here - old[0] * sn - old[1] * cs
                chip = np.minimum(chip, over)
            cuts = inside & (chip > 0)
            Ft = np.where(cuts, Kt * chip, 0.0)
            rubbed = rubs / (1 + 0.5 * dt * rubs * (light[0] * sn**2 + light[1] * cs**2))  # of the speed half a step on
            Fn = np.where(cuts, Kn * chip + rubbed * (vx * sn + vy * cs), 0.0)
            Fx += -Ft * cs - Fn * sn
            Fy += Ft * sn - Fn * cs
        left[i % (teeth * _STEPS), 0], left[i % (teeth * _STEPS), 1] = qx, qy
        force = on_x * Fx + on_y * Fy
        if slipping:
            stretch = np.clip(middle - slider, -slips[1], slips[1])
            slider = middle - stretch
            force = force + slips[0] * k * (middle - stretch)
        rest = force / k
        z, v = rest + zz * (z - rest) + zv * v, vz * (z - rest) + vv * v
        if i >= total // 2 and i % _EVERY == 0:
            sound[heard] = np.sum(on_x * v, axis=0) + 0.7 * np.sum(on_y * v, axis=0)
            heard += 1
    return sound[:heard]
