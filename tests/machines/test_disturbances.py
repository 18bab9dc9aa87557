"""Stability of motions of joints that remember, beside time steps that share nothing with the monodromy matrix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import Outcome
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.lugre import LuGre
from jointlib.laws.quadratic import Quadratic
from jointlib.laws.structural_damping import StructuralDamping
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, response
from machines.coupling.second_order import machine_equations
from machines.operating.branches import Branch, End, Stability, without_repeats
from machines.stability.disturbances import Disturbances
from machines.stability.monodromy import Poised, largest_multiplier

MASS, STIFFNESS, DAMPING = 20.0, 3e7, 300.0


def single(*laws: JointLaw) -> Machine:
    joint = Joint((Linear(STIFFNESS), Viscous(DAMPING), *laws))
    return Machine(
        (Lumped("m", ("x",), np.array([[MASS]])),), (Connection("j", ("m.x", "ground"), joint),), drive="m.x"
    )


def stepped(
    machine: Machine,
    push: Array,
    frequency: float | Array,
    x: Array,
    v: Array,
    states: Sequence[Array],
    steps: int,
    cycles: int,
) -> tuple[Array, Array, list[Array], Array]:
    """Runge–Kutta on M p̈ + C ṗ + K p + Rᵀ f = push cos ωt, every column of x (n, columns) on its own.

    The states are carried from step to step. Returns p, ṗ, states at the end, and p at the end of every step.
    """
    e, joints = machine_equations(machine), machine.joints()
    inverse, omega, h = np.linalg.inv(e.mass), 2 * np.pi * frequency, 1 / (frequency * steps)
    carried = list(states)

    def rate(t: float, x: Array, v: Array, since: float) -> Array:
        z, speed = e.joints @ x, e.joints @ v
        pull = [j.step(Motion(z[i], speed[i], since), carried[i])[0] for i, j in enumerate(joints)]
        load = push[:, None] * np.cos(omega * t)
        return np.asarray(inverse @ (load - e.damping @ v - e.stiffness @ x - e.joints.T @ np.array(pull)))

    seen = []
    for i in range(cycles * steps):
        t = i * h
        a1 = rate(t, x, v, 1e-12)
        a2 = rate(t + h / 2, x + h / 2 * v, v + h / 2 * a1, h / 2)
        a3 = rate(t + h / 2, x + h / 2 * v + h**2 / 4 * a1, v + h / 2 * a2, h / 2)
        a4 = rate(t + h, x + h * v + h**2 / 2 * a2, v + h * a3, h)
        x, v = x + h * v + h**2 / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        z, speed = e.joints @ x, e.joints @ v
        carried = [
            j.step(Motion(z[k], speed[k], h), s)[1] for k, (j, s) in enumerate(zip(joints, carried, strict=True))
        ]
        seen.append(x)
    return x, v, carried, np.array(seen)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("law", "loose"),
    [
        pytest.param(Jenkins(2e7, 40.0), 0.02, marks=pytest.mark.slow),
        pytest.param(LuGre(2e7, 200.0, 40.0, 50.0, 1e-3), 0.02, marks=pytest.mark.slow),
        # Its second slider sticks; where it stands it stays, which is no instability.
        pytest.param(Iwan((1e7, 1e7), (20.0, 50.0)), 0.02, marks=pytest.mark.slow),
    ],
)
def test_multipliers_of_joints_that_remember_are_those_of_time_steps(law: JointLaw, loose: float) -> None:
    machine, f = single(law), 200.0
    omega = 2 * np.pi * f
    found = response(machine, 50.0, [f - 0.2, f, f + 0.2], harmonics=(1, 3, 5))
    branch = next(b for b in found.branches[0] if f in b.frequency)
    i = int(np.flatnonzero(branch.frequency == f)[0])
    z = np.concatenate([branch.joint[i : i + 1, None], branch.overtones[i : i + 1]], axis=1)
    poised = Poised.of(machine_equations(machine), machine.joints(), omega, np.zeros(1))
    told = largest_multiplier(poised, z, np.array([omega]), branch.harmonics)[0]

    h = np.array(branch.harmonics)
    x, v = np.array([[z[0, :, 0].sum().real]]), np.array([[(1j * h * omega * z[0, :, 0]).sum().real]])
    push, joint = np.array([50.0]), machine.joints()[0]
    x, v, states, _ = stepped(machine, push, f, x, v, [joint.initial_state(np.zeros(1))], 400, 25)
    base, size = np.concatenate([x[:, 0], v[:, 0] / omega, states[0][0]]), 1e-5 * float(np.max(np.abs(z)))
    nudged = base[:, None] + size * np.concatenate([np.eye(len(base)), -np.eye(len(base))], axis=1)
    x, v, states, _ = stepped(machine, push, f, nudged[:1], nudged[1:2] * omega, [nudged[2:].T], 1500, 1)
    ends = np.concatenate([x, v / omega, states[0].T])
    matrix = (ends[:, : len(base)] - ends[:, len(base) :]) / (2 * size)
    multipliers = np.linalg.eigvals(matrix)
    expected = max(abs(m) for m in multipliers if abs(m - 1) > 1e-3)
    assert told == pytest.approx(expected, abs=loose)
    assert told < 0.95


def two_way() -> Machine:
    """A mass in a plane on two joints at 45° to its stiff direction; its soft one has half the frequency."""
    joint = Joint((Linear(3.75e5), Quadratic(6e9), Jenkins(2e4, 0.01), Viscous(4.0)))
    stiff = (2 * np.pi * 200.0) ** 2 - 3.95e5
    part = Lumped("m", ("a", "b"), np.eye(2), None, stiff / 2 * np.ones((2, 2)))
    ends = (("a", ("m.a", "ground")), ("b", ("m.b", "ground")))
    return Machine((part,), tuple(Connection(n, end, joint) for n, end in ends), drive="m.a")


@pytest.mark.slow
def test_a_motion_that_pumps_another_is_unstable_without_a_fold_and_is_so_in_time() -> None:
    """A joint that pulls harder one way lets the motion at ω drive one at ω/2: no fold, no other branch, no peace."""
    machine, force = two_way(), 0.08
    found = response(machine, force, [195.0, 203.0], points=17, stability="auto")
    (branch,) = found.branches[0]
    assert {p.stability for p in found.peaks} == {Stability.UNSTABLE}
    assert {p.outcome for p in found.peaks} == {Outcome.UNSTABLE}
    (sentence,) = [w for w in found.warnings if "no stable motion" in w]
    assert "at 0.08 N no stable motion was found at 19" in sentence
    # In time: kicked by 2 %, does the half of the frequency grow or die out?
    at = [int(np.argmin(np.abs(branch.frequency - f))) for f in (196.0, 198.8, 202.0)]
    assert [branch.labels[i] for i in at] == [Stability.STABLE, Stability.UNSTABLE, Stability.STABLE]
    frequency = branch.frequency[at]
    x, v = branch.joint[at].real.T, (2j * np.pi * frequency * branch.joint[at].T).real
    kick = 0.02 * np.max(np.abs(x), axis=0) * np.array([[1.0], [-1.0]])
    states = [joint.initial_state(0 * x[0]) for joint in machine.joints()]
    steps, cycles = 40, 120
    _, _, _, seen = stepped(machine, np.array([force, 0.0]), frequency, x + kick, v, states, steps, cycles)
    across = (seen[:, 0] - seen[:, 1]).reshape(cycles // 2, 2 * steps, 3)
    half = np.abs(np.mean(across * np.exp(-1j * np.pi * np.arange(2 * steps) / steps)[None, :, None], axis=1))
    grown = np.max(half[-5:], axis=0) / half[2]
    assert np.all(grown[[0, 2]] < 0.5)
    assert grown[1] > 3


def test_one_harmonic_of_a_joint_that_pulls_one_way_is_not_called_stable_by_the_lowest_block() -> None:
    joint = Joint((Linear(3.95e5), Quadratic(6e9), Viscous(4.0)))
    machine = two_way()
    for name in ("a", "b"):
        machine = machine.with_joint(name, joint)
    (branch,) = response(machine, 0.08, np.array([196.0, 199.0, 203.0]), stability="hill").branches[0]
    assert [label is Stability.UNSTABLE for label in branch.labels] == [False, True, False]


def test_stability_says_why_it_is_not_told() -> None:
    machine = single(StructuralDamping(1e6))
    assert "frequency domain only" in str(Disturbances.of(machine))


def test_a_branch_that_is_part_of_another_is_listed_once() -> None:
    n = 7
    z = (np.linspace(1.0, 2.0, n) * 1e-6).astype(complex)[:, None]
    ends = (End.RANGE, End.RANGE)
    whole = Branch(np.linspace(100.0, 106.0, n), z, z, Stability.UNKNOWN, ends, Outcome.CONVERGED)
    inside = Branch(whole.frequency[2:5], z[2:5], z[2:5], Stability.UNKNOWN, ends, Outcome.CONVERGED)
    beside = Branch(whole.frequency[2:5], 1.01 * z[2:5], z[2:5], Stability.UNKNOWN, ends, Outcome.CONVERGED)
    touching = Branch(
        whole.frequency[4:6] + np.array([0.0, 0.5]), z[4:6], z[4:6], Stability.UNKNOWN, ends, whole.outcome
    )
    kept = without_repeats([inside, whole, beside, touching])
    assert [id(b) for b in kept] == [id(whole), id(beside), id(touching)]
