"""Random machines in random cuts, what is told of them, and whether a simulation of its own denies it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from cut_in_time import Body, Case, Course, cut_in_time

from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine
from machines.lobes import AmplitudeLimits, Cutting, amplitude_limits
from machines.lobes.frozen_modes import multipliers

NEAR = 0.1
"""Share by which an amplitude may be missed, and within which of a threshold nothing is asked."""
SLOW = 3e-3
"""Change of an amplitude from window to window, as a logarithm, below which it stands."""
EARLY = 2
KICKS = 7


@dataclass(frozen=True)
class Cut:
    """A machine, a speed in rpm and a depth in m, with the limits and the multiplier that sentences are made of."""

    machine: Machine
    limits: AmplitudeLimits
    depth: float
    multiplier: float

    @property
    def name(self) -> str:
        """For a reader of the count."""
        laws = "+".join(law.kind for joint in self.machine.joints() for law in joint.laws[2:])
        cutting = Cutting(**dict(self.machine.cutting or {}))
        cut = f"{cutting.process} {''.join(self.machine.tool_axes)}{' fed' if cutting.feed else ''}"
        return f"{cut} {laws} {self.limits.speed[0]:.0f} rpm {self.depth * 1e3:.3g} mm"


def bent(rng: np.random.Generator, stiffness: float, mass: float, size: float) -> JointLaw:
    """A law that changes a spring by some percent at a size in m: cubic of both signs, elastic slip, friction."""
    omega = np.sqrt(stiffness / mass)
    kind = rng.integers(4)
    if kind < 2:
        return Cubic((1 - 2 * float(kind)) * rng.uniform(0.02, 0.15) * stiffness / (0.75 * size**2))
    if kind == 2:
        stick = rng.uniform(0.05, 0.2) * stiffness
        return Jenkins(stick, stick * size * rng.uniform(0.1, 0.5))
    speed = omega * size
    return Coulomb(rng.uniform(0.005, 0.02) * stiffness * size, smoothing_velocity=rng.uniform(0.1, 0.5) * speed)


def machine(rng: np.random.Generator, milled: bool) -> Machine:
    """One or two moving masses along x, in half of the mills one along y, and a joint that is not linear."""
    size = 10 ** rng.uniform(-5.3, -4.2)
    mass, natural, ratio = 10 ** rng.uniform(-1, 1.5), rng.uniform(80, 900), rng.uniform(0.015, 0.05)
    k = mass * (2 * np.pi * natural) ** 2
    c = 2 * ratio * np.sqrt(k * mass)
    joint = Joint((Linear(k), Viscous(c), bent(rng, k, mass, size)))
    one = np.ones((1, 1))
    parts: list[Lumped] = [Lumped("slide", ("x",), mass * one)]
    tool = {"x": "slide.x"}
    if not milled and rng.random() < 0.4:
        small, stiff = 0.2 * mass, 2.0 * k
        spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
        parts = [
            Lumped(
                "slide",
                ("x", "tip"),
                np.diag([mass, small]),
                2 * ratio * np.sqrt(stiff * small) * spring,
                stiff * spring,
            )
        ]
        tool = {"x": "slide.tip"}
    if milled and rng.random() < 0.5:
        other = k * rng.uniform(1.2, 2.5)
        parts.append(Lumped("cross", ("y",), mass * one, 2 * ratio * np.sqrt(other * mass) * one, other * one))
        tool["y"] = "cross.y"
    feed = {"feed": size * rng.uniform(0.5, 4.0)} if rng.random() < 0.6 else {}
    if milled:
        mode = str(rng.choice(["up", "down", "slot"]))
        arc = {} if mode == "slot" else {"immersion": float(rng.choice([0.1, 0.3, 0.5]))}
        cutting = {"process": "milling", "teeth": int(rng.integers(2, 5)), "tangential": 1.5e9, "normal": 0.5e9}
        cutting |= {"mode": mode, **arc, **feed}
    else:
        cutting = {"process": "turning", "specific": 1.5e9, **feed}
        if feed and rng.random() < 0.3:
            cutting["exponent"] = float(rng.uniform(0.7, 0.9))
    return Machine(
        tuple(parts),
        (Connection("guide", ("slide.x", "ground"), joint),),
        tool=tool,
        frequency=(0.4 * natural, 4.0 * natural),
        cutting=cutting,
    )


def random_cut(rng: np.random.Generator, milled: bool) -> Cut | None:
    """In the first few lobes: just below the safe depth, in the bistable zone, just or far above the onset."""
    made = machine(rng, milled)
    cutting = Cutting(**dict(made.cutting or {}))
    assert made.frequency is not None
    natural = made.frequency[0] / 0.4
    speed = 60 * natural / cutting.cuts_per_revolution / rng.uniform(0.8, 4.0)
    size = 2 * (cutting.feed or 5e-5)
    limits = amplitude_limits(made, [speed], np.geomspace(0.02, 1.0, 7 if milled else 10) * size)
    safe, onset = float(limits.safe_up_to(float(limits.known[0]))), float(limits.onset[0])
    if not np.isfinite(onset) or limits.known[0] <= 0:
        return None
    which = rng.integers(4)
    depth = (
        0.96 * safe,
        (safe + onset) / 2 if onset > 1.02 * safe else 0.9 * safe,
        1.03 * onset,
        onset * rng.uniform(1.1, 2.5),
    )[which]
    return Cut(made, limits, depth, float(multipliers(made, [speed], [depth])[0, 0]))


def courses(cuts: list[Cut], windows: int = 10, periods: int = 20) -> list[tuple[np.ndarray, np.ndarray]]:
    """Chatter, (window, kick), and which kicks escaped, of every cut; those with as many waves are stepped together."""
    waves = [
        float(c.limits.onset_frequency[0])
        * 60
        / c.limits.speed[0]
        / Cutting(**dict(c.machine.cutting or {})).cuts_per_revolution
        for c in cuts
    ]
    found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for low, high in ((0, 1.4), (1.4, 2.4), (2.4, np.inf)):
        chosen = [i for i, w in enumerate(waves) if low <= w < high]
        if not chosen:
            continue
        steps = max(48, int(30 * max(waves[i] for i in chosen)))
        cases = []
        for i in chosen:
            c = cuts[i]
            cutting = Cutting(**dict(c.machine.cutting or {}))
            kicks = np.geomspace(0.02, 1.0, KICKS) * float(c.limits.known[0])
            cases.append(
                Case(
                    Body.of(c.machine),
                    cutting,
                    float(c.limits.speed[0]),
                    c.depth,
                    kicks.tolist(),
                    float(c.limits.onset_frequency[0]),
                )
            )
        course: Course = cut_in_time(cases, windows, periods, steps, reach=5e-3)
        for n, i in enumerate(chosen):
            found[i] = course.chatter[:, n], course.escaped[n]
    return [found[i] for i in range(len(cuts))]


def denied(cut: Cut, chatter: np.ndarray, escaped: np.ndarray) -> list[str]:
    """What of the fate that is told of each kick the simulation does not bear out; what is not told denies nothing."""
    limits, reach = cut.limits, float(cut.limits.known[0])
    if cut.multiplier < 1 and cut.depth > limits.onset[0]:
        return []
    cycles = [c for c in limits.cycles(cut.depth) if c.amplitude < reach]
    grows = cycles[0].stable if cycles else cut.depth > limits.depth[0, 0]
    thresholds = [c.amplitude for c in cycles if not c.stable]
    ends = [0.0, *thresholds, np.inf]
    said = []
    for k in range(chatter.shape[1]):
        start, end = chatter[EARLY, k], chatter[-1, k]
        if start > reach / (1 + NEAR) or any(abs(np.log(start / t)) < NEAR for t in thresholds):
            continue
        trend = float(np.log(end / chatter[-3, k])) / 2 if end > 0 else -1.0
        basin = int(np.searchsorted(thresholds, start))
        settles = [c.amplitude for c in cycles if c.stable and ends[basin] < c.amplitude < ends[basin + 1]]
        if settles:
            S = settles[0]
            fine = abs(np.log(end / S)) < NEAR if end > 0 and not escaped[k] else False
            fine = fine or (abs(trend) > SLOW and (trend > 0) == (end < S) and not escaped[k])
            told = f"settles at {S * 1e6:.3g}"
        elif basin == 0 and not grows:
            fine = not escaped[k] and (end < 0.8 * start or trend < -SLOW / 3)
            told = "dies out"
        else:
            fine = bool(escaped[k]) or end > 0.9 * reach or trend > SLOW / 3
            told = "grows"
        if not fine:
            said.append(
                f"{told}: {start * 1e6:.3g} to {end * 1e6:.3g} µm, {trend:+.4f}{' escaped' if escaped[k] else ''}"
            )
    return said
