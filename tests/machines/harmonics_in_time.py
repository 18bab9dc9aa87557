"""Two masses on random joints, forced in time: periodic motions by shooting, all cases side by side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.gap import Gap
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.linear import Linear
from jointlib.laws.quadratic_damping import QuadraticDamping
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine

STEPS = 1500


@dataclass(frozen=True)
class Case:
    """m1 (driven) on a joint on m2, which is held by a spring and a damper."""

    m1: float
    m2: float
    k: float
    c: float
    joint: Joint
    force: float
    frequency: float

    @property
    def machine(self) -> Machine:
        parts = (
            Lumped("a", ("x",), np.array([[self.m1]])),
            Lumped("b", ("x",), np.array([[self.m2]]), np.array([[self.c]]), np.array([[self.k]])),
        )
        return Machine(parts, (Connection("j", ("a.x", "b.x"), self.joint),), drive="a.x")


def random_case(rng: np.random.Generator) -> Case:
    """A joint of one of four kinds, a force over two decades, a frequency from well below to well above resonance."""
    stiffness = rng.uniform(2e8, 8e8)
    viscous = Viscous(rng.uniform(300.0, 1500.0))
    kind = rng.integers(4)
    if kind == 0:
        laws = (Linear(stiffness), Cubic(rng.choice([-1, 1]) * stiffness / rng.uniform(8e-6, 20e-6) ** 2), viscous)
    elif kind == 1:
        laws = (HertzGuide(rng.uniform(300.0, 900.0), rng.uniform(3e-8, 5e-8)), viscous)
    elif kind == 2:
        laws = (Linear(stiffness), Gap(0.3 * stiffness, rng.uniform(0.3e-6, 2e-6)), viscous)
    else:
        laws = (Linear(stiffness), QuadraticDamping(rng.uniform(2e3, 3e4)), viscous)
    m1, m2, k = rng.uniform(0.5, 2.0), rng.uniform(1.0, 4.0), rng.uniform(1e8, 4e8)
    first = np.sqrt(k / (m1 + m2)) / (2 * np.pi)
    frequency = float(first * np.exp(rng.uniform(np.log(0.6), np.log(5.0))))
    force = float(np.exp(rng.uniform(np.log(5.0), np.log(500.0))))
    return Case(m1, m2, k, rng.uniform(100.0, 500.0), Joint(laws), force, frequency)


def force_in_time(joint: Joint, z: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, tangent stiffness and damping of one case, written out again without the laws' own code."""
    f, k, c = 0.0 * z, 0.0 * z, 0.0 * z
    for law in joint.laws:
        if isinstance(law, Linear):
            f, k = f + law.stiffness * z, k + law.stiffness
        elif isinstance(law, Viscous):
            f, c = f + law.damping * v, c + law.damping
        elif isinstance(law, Cubic):
            f, k = f + law.stiffness3 * z**3, k + 3 * law.stiffness3 * z**2
        elif isinstance(law, Gap):
            f = f - law.stiffness * np.clip(z, -law.clearance, law.clearance)
            k = k - law.stiffness * (np.abs(z) < law.clearance)
        elif isinstance(law, QuadraticDamping):
            f, c = f + law.damping2 * v * np.abs(v), c + 2 * law.damping2 * np.abs(v)
        elif isinstance(law, HertzGuide):
            d0 = law.kappa * law.preload ** (2 / 3)
            s = np.sin(law.contact_angle)
            up, down = np.maximum(1 + z * s / d0, 0), np.maximum(1 - z * s / d0, 0)
            f = f + 2 * s * law.preload * (up**1.5 - down**1.5)
            k = k + 3 * s * s * law.preload / d0 * (np.sqrt(up) + np.sqrt(down))
        else:
            raise AssertionError(law.kind)
    return f, k, c


def periodic(case: Case, x: np.ndarray, v: np.ndarray, rounds: int = 8) -> tuple[complex, float, np.ndarray]:
    """First harmonic of the relative motion in m, what shooting left of the period's mismatch, and the multipliers.

    Runge–Kutta of fourth order with the variational equations; begins at displacements and velocities x, v (m, m/s).
    """
    w, scale = 2 * np.pi * case.frequency, 1e-6
    h = 2 * np.pi / w / STEPS
    y = np.concatenate([x, v]) / scale
    relative = np.array([1.0, -1.0])

    def rate(t: float, Y: np.ndarray) -> np.ndarray:
        # Columns: the state and, beside it, its derivatives by the initial state.
        z, dz = relative @ Y[:2], relative @ Y[2:]
        f, k, c = force_in_time(case.joint, z[:1] * scale, dz[:1] * scale)
        pull = np.concatenate([f / scale, k * z[1:] + c * dz[1:]])
        drive = np.zeros(5)
        drive[0] = case.force / scale * np.cos(w * t)
        return np.array([Y[2], Y[3], (drive - pull) / case.m1, (pull - case.k * Y[1] - case.c * Y[3]) / case.m2])

    z, mismatch, flow = np.empty(STEPS), np.inf, np.eye(4)
    for _ in range(rounds):
        Y = np.concatenate([y[:, None], np.eye(4)], axis=1)
        for n in range(STEPS):
            z[n] = relative @ Y[:2, 0]
            t = n * h
            a = rate(t, Y)
            b = rate(t + h / 2, Y + h / 2 * a)
            c = rate(t + h / 2, Y + h / 2 * b)
            d = rate(t + h, Y + h * c)
            Y = Y + h / 6 * (a + 2 * b + 2 * c + d)
        flow = Y[:, 1:]
        gap = Y[:, 0] - y
        mismatch = float(np.max(np.abs(gap[:2])) / np.max(np.abs(z)))
        if mismatch < 1e-9:
            break
        y = y - np.linalg.solve(flow - np.eye(4), gap)
    phase = np.exp(-2j * np.pi * np.arange(STEPS) / STEPS)
    return complex(2 * np.mean(z * phase) * scale), mismatch, np.linalg.eigvals(flow)
