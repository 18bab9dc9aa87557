"""Newton's method on several joints: a published-size chain, an independent solver, named failures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve

from jointlib.errors import Outcome
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, response
from machines.operating.branches import End, Stability

K1, K3, C = 654.164e6, -1.7083e18, 463.062
GUIDE = Joint((Linear(K1), Cubic(K3), Viscous(C)))
LINES = np.linspace(1000.0, 7000.0, 600)


def chain(masses: int, joints: int) -> Machine:
    """Masses in a row, 654 N/µm and dampers between neighbours, the first springs softening, the last mass held."""
    m = np.random.default_rng(0).uniform(0.8, 2.2, masses)
    stiffness, damping = np.zeros((masses, masses)), np.zeros((masses, masses))
    for i in range(joints, masses - 1):
        b = np.zeros(masses)
        b[i], b[i + 1] = 1.0, -1.0
        stiffness += K1 * np.outer(b, b)
        damping += C * np.outer(b, b)
    stiffness[-1, -1] += 2e8
    damping[-1, -1] += 200.0
    dofs = tuple(f"m{i + 1}" for i in range(masses))
    links = tuple(Connection(f"j{i + 1}", (f"row.m{i + 1}", f"row.m{i + 2}"), GUIDE) for i in range(joints))
    return Machine((Lumped("row", dofs, np.diag(m), damping, stiffness),), links, drive="row.m1")


# Largest joint amplitude in µm on 600 uniform lines, where and in which joint, from an independent solution.
CASES = [(10, 1, 2.807235, 1240.401, 1), (10, 5, 4.472190, 1230.384, 4), (50, 5, 1.646353, 1070.117, 5)]


@pytest.mark.thorough
@pytest.mark.parametrize(("masses", "joints", "amplitude", "frequency", "joint"), CASES)
def test_chain_of_masses(masses: int, joints: int, amplitude: float, frequency: float, joint: int) -> None:
    branch = response(chain(masses, joints), 50.0, LINES).branches[0][0]
    size = np.abs(branch.joint) * 1e6
    line, column = np.unravel_index(np.argmax(size), size.shape)
    assert size[line, column] == pytest.approx(amplitude, abs=6e-7)
    assert branch.frequency[line] == pytest.approx(frequency, abs=6e-4)
    assert column + 1 == joint
    assert len(branch.frequency) == 600
    assert branch.stability is (Stability.FOLD_STABLE if joints == 1 else Stability.UNKNOWN)


def test_solution_satisfies_the_equations_of_motion_of_every_mass() -> None:
    """A general root finder, started at the solution and given only masses, springs and dampers, stays there."""
    machine = chain(10, 5)
    row = machine.components[0]
    assert isinstance(row, Lumped)
    assert row.stiffness is not None
    assert row.damping is not None
    stiffness, damping, mass = row.stiffness, row.damping, row.mass
    line = 1240.0
    branch = response(machine, 50.0, [line - 1, line, line + 1], outputs=machine.dofs).branches[0][0]
    x0, w = branch.output[1] * 1e6, 2 * np.pi * line

    def balance(y):  # type: ignore[no-untyped-def]
        x = (y[:10] + 1j * y[10:]) * 1e-6
        r = (stiffness + 1j * w * damping - w**2 * mass) @ x
        r[0] -= 50.0
        for i in range(5):
            z = x[i] - x[i + 1]
            g = (K1 + 0.75 * K3 * abs(z) ** 2 + 1j * w * C) * z
            r[i], r[i + 1] = r[i] + g, r[i + 1] - g
        return np.concatenate([r.real, r.imag]) / 50.0

    y, info, _, _ = fsolve(balance, np.concatenate([x0.real, x0.imag]), full_output=True, xtol=1e-13)
    assert np.max(np.abs(info["fvec"])) < 1e-8
    assert np.max(np.abs(y - np.concatenate([x0.real, x0.imag]))) < 1e-8 * np.max(np.abs(x0))


@pytest.mark.thorough
def test_peaks_of_every_joint_are_refined() -> None:
    machine = chain(10, 5)
    found = response(machine, 20.0, (1000.0, 2000.0), points=100)
    dense = response(machine, 20.0, np.linspace(1224.0, 1244.0, 2001)).branches[0][0]
    for k in range(5):
        top = max(found.peaks_of(f"j{k + 1}", 20.0), key=lambda p: p.amplitude)
        on_lines = np.max(np.abs(dense.joint[:, k]))
        assert top.outcome is Outcome.CONVERGED
        assert on_lines <= top.amplitude * (1 + 1e-12)
        assert top.amplitude == pytest.approx(on_lines, rel=1e-6)


def test_resonance_that_folds_over_is_lost_and_says_so() -> None:
    """At 50 N the response jumps near 1227 Hz; below the jump the tall solution cannot be reached line by line."""
    found = response(chain(10, 5), 50.0, np.linspace(1226.0, 1236.0, 101))
    assert found.outcomes == (Outcome.STALLED,)
    assert {b.outcome for b in found.branches[0]} == {Outcome.STALLED}
    assert any(End.LOST in b.ends for b in found.branches[0])


@pytest.mark.thorough
def test_point_outside_the_identified_range_is_named_and_left_out() -> None:
    machine = chain(10, 5)
    machine = machine.with_joint("j4", replace(GUIDE, validity={"amplitude": (0.0, 2e-6)}))
    found = response(machine, 50.0, (1150.0, 1300.0), points=100)
    assert found.outcomes == (Outcome.OUT_OF_RANGE,)
    assert all(np.max(np.abs(b.joint[:, 3])) <= 2e-6 for b in found.branches[0])
    peak = max(found.peaks_of("j4", 50.0), key=lambda p: p.amplitude)
    assert peak.outcome is Outcome.OUT_OF_RANGE
    assert np.isnan(found.frfs[0].receptance).any()


def test_linear_joints_beside_one_nonlinear_joint_leave_all_branches_in_reach() -> None:
    """A linear joint is coupled beforehand; with it in the component's own matrices the answer is the same."""
    inside = chain(4, 1)
    row = inside.components[0]
    assert isinstance(row, Lumped)
    assert row.stiffness is not None
    assert row.damping is not None
    stiffness, damping = row.stiffness.copy(), row.damping.copy()
    stiffness[-1, -1] -= 2e8
    damping[-1, -1] -= 200.0
    foot = Connection("foot", ("row.m4", "ground"), Joint((Linear(2e8), Viscous(200.0))))
    outside = Machine(
        (Lumped("row", row.dofs, row.mass, damping, stiffness),), (*inside.connections, foot), drive="row.m1"
    )
    a, b = (response(m, [20.0, 100.0], (1000.0, 3000.0)) for m in (inside, outside))
    for p in a.peaks:
        near = min(b.peaks_of("j1", p.force), key=lambda q: abs(q.frequency - p.frequency))
        assert near.amplitude == pytest.approx(p.amplitude, rel=1e-9)
    assert len(b.peaks_of("foot", 20.0)) >= 1
