"""Joints that share parts with few others, solved as a chain: against the full matrix that they stand for."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, response
from machines.banded import Banded
from machines.continuation.arclength import Path
from machines.coupling.parts import Parts
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.balance import Balance
from machines.harmonic_balance.newton import Elimination
from machines.operating.tops import apart, tops
from machines.statics.asked_together import Several

LOW, HIGH = 2 * np.pi * 30.0, 2 * np.pi * 900.0
OMEGA = np.linspace(LOW, HIGH, 9)


def row(count: int, shuffled: bool = False, slips: int = 5) -> Machine:
    """Bodies of two masses each between hardening joints, the first one held; one joint in ``slips`` slips instead."""
    rng = np.random.default_rng(count)
    bodies, links = [], []
    for i in range(count):
        k, c = (value * np.array([[1.0, -1.0], [-1.0, 1.0]]) for value in (2e8 * rng.uniform(0.7, 1.3), 200.0))
        held = np.diag([3e7, 0.0]) if i == 0 else np.zeros((2, 2))
        mass = np.diag(rng.uniform(1.0, 3.0, 2))
        bodies.append(Lumped(f"b{i}", ("left", "right"), mass, c + 1e-5 * held, k + held))
        bends = Jenkins(stiffness=2e7, slip_force=3.0) if i % slips == 2 else Cubic(rng.uniform(0.5, 1.5) * 4e17)
        joint = Joint((Linear(rng.uniform(0.8, 1.2) * 3e8), Viscous(250.0), bends))
        links += [] if i == 0 else [Connection(f"j{i}", (f"b{i}.left", f"b{i - 1}.right"), joint)]
    order = rng.permutation(len(links)) if shuffled else np.arange(len(links))
    return Machine(tuple(bodies), tuple(links[i] for i in order), drive=f"b{count - 1}.right", force=(20.0,))


def assemblies(machine: Machine) -> tuple[Assembly, Assembly]:
    """As a chain, and with all receptances between joints."""
    drive = machine.driven_dof()
    chain, full = (Assembly(machine, (drive,), (drive,), swept) for swept in ((LOW, HIGH), None))
    assert chain.at_rest(OMEGA[:1]).chain is not None
    assert full.at_rest(OMEGA[:1]).chain is None
    return chain, full


def balances(machine: Machine, harmonics: tuple[int, ...]) -> tuple[Balance, Balance]:
    one, other = (Balance.of(each, OMEGA, np.full(len(OMEGA), 20.0), harmonics) for each in assemblies(machine))
    return one, other


def motions(balance: Balance, size: float = 2e-7) -> np.ndarray:
    rng = np.random.default_rng(3)
    shape = (*balance.base.shape[:2], len(balance.joints))
    return size * (rng.normal(size=shape) + 1j * rng.normal(size=shape))


def assert_close(one: np.ndarray, other: np.ndarray, rel: float) -> None:
    assert np.max(np.abs(one - other)) <= rel * np.max(np.abs(other))


@pytest.mark.parametrize("shuffled", [False, True])
def test_receptances_of_a_chain_are_those_of_the_components(shuffled: bool) -> None:
    chain, full = assemblies(row(14, shuffled))
    one, other = chain.at_rest(OMEGA), full.at_rest(OMEGA)
    assert one.chain is not None
    assert_close(one.Hzf, other.Hzf, 1e-10)
    assert_close(one.chain.full, other.Hzz, 1e-10)
    force = motions(Balance.of(full, OMEGA, np.ones(len(OMEGA)), (1,)))[:, 0]
    assert_close(one.chain.times(force), (other.Hzz @ force[..., None])[..., 0], 1e-10)
    assert_close(chain.moved(OMEGA, np.full(9, 3.0), force), full.moved(OMEGA, np.full(9, 3.0), force), 1e-9)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5), (1, 2, 3)])
@pytest.mark.parametrize("shuffled", [False, True])
def test_newton_steps_of_a_chain_are_those_of_the_full_jacobian(harmonics: tuple[int, ...], shuffled: bool) -> None:
    chain, full = balances(row(14, shuffled), harmonics)
    z = motions(chain)
    forces = chain.forces(z)
    assert_close(chain.residual(z, forces.force), full.residual(z, full.forces(z).force), 1e-9)
    right = motions(chain, 1.0)[::-1]
    one, other = chain.tangent(forces), full.tangent(full.forces(z))
    assert isinstance(other, Elimination)
    assert_close(one.solve(right), other.solve(right), 1e-8)
    assert_close(chain.jacobian(forces), other.J, 1e-9)
    assert np.array_equal(one.turned(slice(None)), other.turned(slice(None)))


def test_a_fold_turns_the_determinant_of_a_chain() -> None:
    chain, full = balances(row(14), (1,))
    signs = [
        [each.tangent(each.forces(z)).turned(slice(None)) for each in (chain, full)]
        for z in (motions(chain, size) for size in np.geomspace(1e-6, 1e-3, 40))
    ]
    one, other = np.array(signs).swapaxes(0, 1)
    assert np.array_equal(one, other)
    assert 0 < np.sum(one) < one.size


def test_a_border_keeps_a_singular_chain_solvable() -> None:
    """On a fold the Jacobian alone has no inverse, with a row and a column more it has."""
    chain, _ = balances(row(14), (1,))
    z = motions(chain, 1e-8)
    tangent = chain.tangent(chain.forces(z))
    J = chain.jacobian(chain.forces(z))
    rng = np.random.default_rng(5)
    column, border, right = (
        rng.normal(size=shape) for shape in ((9, J.shape[1]), (9, J.shape[1] + 1), (9, J.shape[1] + 1, 2))
    )
    u = tangent.bordered(column, border, right)
    matrix = np.concatenate([np.concatenate([J, column[:, :, None]], axis=2), border[:, None]], axis=1)
    assert_close(matrix @ u, right, 1e-8)
    along = tangent.along(column)
    assert np.max(np.abs(matrix[:, :-1] @ along[:, :, None])) < 1e-8
    assert np.linalg.norm(along, axis=1) == pytest.approx(1.0)


def test_response_of_a_chain_is_that_of_all_pairs() -> None:
    """More lines than a few are solved as a chain, a few with all receptances."""
    machine = row(12, slips=1)
    lines = np.linspace(60.0, 700.0, 60)
    whole = response(machine, 20.0, lines)
    few = response(machine, 20.0, lines[::3])
    assert_close(whole.branches[0][0].joint[::3], few.branches[0][0].joint, 1e-8)
    assert_close(whole.branches[0][0].error[::3], few.branches[0][0].error, 1e-6)
    least = np.max(np.abs(response(machine, 0.02, lines[::3]).branches[0][0].joint)) * 1000
    assert abs(np.max(np.abs(few.branches[0][0].joint)) / least - 1) > 1e-4  # the joints are not linear there


def test_parts_are_for_joints_that_share_bodies_with_few_others() -> None:
    """All joints on one body are a full matrix, whatever their number."""
    bed = Lumped("bed", tuple(f"x{i}" for i in range(12)), np.diag(np.ones(12)), np.eye(12), 1e8 * (np.eye(12) + 0.1))
    joint = Joint((Linear(1e8), Cubic(1e17)))
    loose = tuple(Lumped(f"m{i}", ("x",), np.eye(1), np.zeros((1, 1)), np.zeros((1, 1))) for i in range(12))
    star = Machine((bed, *loose), tuple(Connection(f"j{i}", (f"m{i}.x", f"bed.x{i}"), joint) for i in range(12)))
    assembly = Assembly(star, ("m0.x",), ("m0.x",), (LOW, HIGH))
    assert assembly.at_rest(OMEGA).chain is None
    few = row(8)
    assert Assembly(few, ("b0.left",), ("b0.left",), (LOW, HIGH)).at_rest(OMEGA).chain is None


def test_a_matrix_without_an_inverse_leaves_those_beside_it_as_they_are() -> None:
    rng = np.random.default_rng(2)
    points, n, k = 6, 12, 2
    A = rng.normal(size=(points, n, n)) * (np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= k)
    A[1], A[3, 4, 4] = 0.0, np.nan
    columns = np.zeros((points, n, 3 * k + 1))
    for i in range(n):
        for j in range(max(i - k, 0), min(i + k + 1, n)):
            columns[:, j, i - j + 2 * k] = A[:, i, j]
    found, right = Banded.of(columns), rng.normal(size=(points, n))
    x, fine = found.solve(right), np.array([0, 2, 4, 5])
    assert np.all(np.isnan(x[[1, 3]]))
    assert_close(x[fine], np.linalg.solve(A[fine], right[fine, :, None])[:, :, 0], 1e-9)
    turned = np.linalg.solve(np.swapaxes(A[fine], 1, 2), right[fine, :, None])[:, :, 0]
    assert_close(found.at(fine).solve(right[fine], transposed=True), turned, 1e-9)
    assert np.array_equal(found.negative[fine], np.linalg.slogdet(A[fine])[0] < 0)


def test_curves_over_frequency_are_followed_in_a_chain() -> None:
    """A step along the curve ends on it, as the full matrix has it."""
    chain, full = assemblies(row(12, slips=1))
    start = [Path(each, (1, 3), LOW, HIGH) for each in (chain, full)]
    omega, force = np.array([2 * np.pi * 200.0]), np.array([60.0])
    balance = start[0].balance(omega, force)
    linear = np.stack([balance.driven * force[:, None], 0 * balance.driven], axis=1)
    z, done = balance.settle(linear)
    assert done[0]
    points = [path.begin(z, omega, force, np.ones(1, dtype=bool)) for path in start]
    assert_close(points[0].tangent, points[1].tangent, 1e-8)
    here = [
        path.correct(p, p.tangent, np.array([0.02]), p.moved(0.02 * p.tangent))
        for path, p in zip(start, points, strict=True)
    ]
    assert here[0][2][0]
    assert here[1][2][0]
    assert_close(here[0][0].z, here[1][0].z, 1e-8)
    assert here[0][0].p == pytest.approx(here[1][0].p, rel=1e-9)


def test_equal_parts_share_their_poles() -> None:
    """Twenty masses alike are one kind of part, so that their number costs no eigenvalues."""
    mass = tuple(Lumped(f"m{i}", ("x",), 2 * np.eye(1), np.zeros((1, 1)), np.zeros((1, 1))) for i in range(20))
    joint = Joint((Linear(1e8), Viscous(100.0), Cubic(1e17)))
    ends = [("ground", "m0.x"), *((f"m{i}.x", f"m{i + 1}.x") for i in range(19))]
    machine = Machine(mass, tuple(Connection(f"j{i}", (b, a), joint) for i, (a, b) in enumerate(ends)))
    parts = Assembly(machine, ("m19.x",), ("m19.x",), (LOW, HIGH))._parts
    assert isinstance(parts, Parts)
    assert len(parts.kinds) == 1
    assert parts.reach == 1


def test_equal_laws_are_asked_together_whatever_their_joints_are_called() -> None:
    laws = Linear(1e8), Cubic(1e17)
    joints = Joint(laws, name="one"), Joint((Linear(1e8), Viscous(3.0)), name="other"), Joint(laws, name="third")
    assert Several(joints).alike == [[0, 2], [1]]


def test_points_that_all_but_coincide_tell_nothing_of_a_top() -> None:
    """What rounding makes of two points side by side outweighs their distance."""
    omega = np.array([0.9, 0.95, 0.98, 1.0, 1.0 + 1e-9, 1.03, 1.06, 1.1, 1.15])
    rounding = 1e-10 * np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    size = (1 + rounding) / np.abs(1 - omega**2 + 0.1j * omega)
    top = 1 / (0.1 * np.sqrt(1 - 0.1**2 / 4))
    kept = apart(omega)
    assert kept.tolist() == [0, 1, 2, 3, 5, 6, 7, 8]
    assert tops(omega[kept], size[kept, None]).amplitude == pytest.approx([top], rel=1e-6)
    assert abs(tops(omega, size[:, None]).amplitude[0] / top - 1) > 1e-5
