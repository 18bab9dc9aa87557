"""Machines of many degrees of freedom, joints and lines: the table of chains, contacts in bundles, memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from test_several_joints import GUIDE, K1, LINES, C, chain

from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import ArcLength, Connection, Lumped, Machine, Measured, Newton, response
from machines.components.component import SecondOrder
from machines.components.rigid import Rigid
from machines.coupling.coordinates import Coordinates
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.newton import solve
from machines.operating.solutions import by_newton, caps_of

KAPPA = 3.931408125e-8


@pytest.mark.parametrize(
    ("masses", "joints", "amplitude", "frequency", "joint"),
    [
        (10, 1, 2.807235, 1240.401, 1),
        (10, 5, 4.472190, 1230.384, 4),
        (50, 5, 1.646353, 1070.117, 5),
        (50, 20, 1.988661, 1070.117, 5),
        (100, 20, 0.964379, 1040.067, 5),
    ],
)
def test_largest_motion_of_a_chain(masses: int, joints: int, amplitude: float, frequency: float, joint: int) -> None:
    """Figures of an independent solution on 600 uniform lines."""
    assembly = Assembly(chain(masses, joints), (), ("row.m1",))
    found = by_newton(assembly, np.array([50.0]), LINES)
    size = np.abs(found.motion[:, :joints]) * 1e6
    line, column = np.unravel_index(np.argmax(size), size.shape)
    assert size[line, column] == pytest.approx(amplitude, abs=6e-7)
    assert LINES[line] == pytest.approx(frequency, abs=6e-4)
    assert column + 1 == joint
    assert not np.any(found.cut)


def test_a_sum_over_poles_is_the_inverse_of_the_dynamic_stiffness() -> None:
    """Damping that couples the modes, overdamped ones, free masses: against a solve refined in extended precision."""
    rng = np.random.default_rng(3)
    row = chain(12, 3).components[0]
    assert isinstance(row, Lumped)
    assert row.damping is not None
    dashpots = rng.uniform(0, 40.0, (9, 9))
    damping = row.damping.copy()
    damping[3:, 3:] += dashpots @ dashpots.T
    damping[-1, -1] += 4e5
    model = SecondOrder(row.mass, damping, np.asarray(row.stiffness), np.eye(12))
    assert model.poles is not None
    assert len(model.poles.free) == 3
    assert len(model.poles.real) > 0
    omega = 2 * np.pi * np.linspace(200.0, 7000.0, 40)
    found = model.poles.receptance(omega, np.eye(12), np.eye(12)[2:9])
    for w, H in zip(omega, found, strict=True):
        exact = model.stiffness - np.longdouble(w) ** 2 * model.mass + 1j * np.longdouble(w) * model.damping
        x = np.zeros((12, 7), dtype=np.clongdouble)
        for _ in range(4):
            x = x + np.linalg.solve(exact.astype(complex), (np.eye(12)[:, 2:9] - exact @ x).astype(complex))
        own = np.sqrt(np.abs(np.diag(np.linalg.inv(exact.astype(complex)))))
        assert np.max(np.abs(H - x) / own[:, None] / own[2:9]) < 1e-12


@pytest.mark.parametrize(
    ("stiffness", "damping"),
    [
        (np.diag([1e6, 4e6]), np.diag([2000.0, 100.0])),
        (np.diag([0.0, 4e6]), np.diag([50.0, 100.0])),
    ],
    ids=["critical damping", "a free mass in oil"],
)
def test_where_a_sum_over_poles_fails_lines_are_solved_one_by_one(stiffness: np.ndarray, damping: np.ndarray) -> None:
    part = Lumped("p", ("x", "y"), np.eye(2), damping, stiffness)
    assert part.second_order().poles is None
    omega = np.array([900.0, 1000.0, 1100.0])
    H = part.receptance(omega)
    k, c = np.diag(stiffness), np.diag(damping)
    assert H[:, [0, 1], [0, 1]] == pytest.approx(1 / (k - omega[:, None] ** 2 + 1j * omega[:, None] * c), rel=1e-13)


def test_a_stiffness_that_yields_energy_has_no_sum_over_poles() -> None:
    assert SecondOrder(np.eye(2), np.eye(2), np.diag([-1e5, 4e6]), np.eye(2)).poles is None


def carriages(rows: int) -> Machine:
    """Two rigid carriages on a row of 288 masses, 300 degrees of freedom in all, each held by guide rows to the other.

    The contact rows lie anywhere between the two bodies, which move against each other in six ways.
    """
    rng = np.random.default_rng(5)
    m = rng.uniform(0.8, 2.2, 288)
    stiffness, damping = np.zeros((288, 288)), np.zeros((288, 288))
    for i in range(287):
        b = np.zeros(288)
        b[i], b[i + 1] = 1.0, -1.0
        stiffness += K1 * np.outer(b, b)
        damping += C * np.outer(b, b)
    stiffness[-1, -1] += 2e8
    damping[-1, -1] += 200.0
    bed = Lumped("bed", tuple(f"m{i + 1}" for i in range(288)), np.diag(m), damping, stiffness)
    bodies = tuple(Rigid(name, 12.0, np.array([0.1, 0.12, 0.15])) for name in ("a", "b"))
    joint = Joint((HertzGuide(630.0, KAPPA), Viscous(60.0)))
    hold = Joint((Linear(2e7), Viscous(300.0)))
    links = []
    for k in range(rows):
        n = rng.normal(size=3)
        at = rng.uniform(-0.1, 0.1, 3)
        links.append(Connection(f"r{k}", ("a", "b"), joint, at=tuple(at.tolist()), direction=tuple(n.tolist())))
    feet = [Connection(f"f{k}", (f"b.{d}", "ground"), hold) for k, d in enumerate(("ux", "uy", "uz"))]
    turns = [
        Connection(f"t{k}", (f"b.{d}", "ground"), Joint((Linear(2e5), Viscous(3.0))))
        for k, d in enumerate(("rx", "ry", "rz"))
    ]
    tie = Connection("tie", ("b.ux", "bed.m1"), hold)
    return Machine((*bodies, bed), (*links, *feet, *turns, tie), drive="a.uz")


def test_48_contact_rows_between_two_bodies_are_six_unknowns() -> None:
    """300 degrees of freedom, 48 joints: solved in the six relative motions and in all 48, the answer is one."""
    machine = carriages(48)
    assert sum(len(c.dofs) for c in machine.components) == 300
    assembly = Assembly(machine, ("a.uz",), ("a.uz",))
    assert len(assembly.nonlinear) == 48
    assert len(assembly.coordinates.rows) == 6
    lines = np.linspace(5700.0, 6300.0, 41)
    found = by_newton(assembly, np.array([150.0]), lines)
    assert not np.any(found.cut)
    every = Assembly(machine, ("a.uz",), ("a.uz",))
    every.__dict__["coordinates"] = Coordinates(np.arange(48), np.eye(48))
    view = every.at(2 * np.pi * lines)
    assert view.Hzz.shape == (41, 48, 48)
    whole = solve(view, every.moving, np.full(41, 150.0), caps_of(every))
    assert np.all(whole.converged)
    z = found.motion[:, list(assembly.nonlinear)]
    assert np.max(np.abs(z - whole.z)) < 1e-9 * np.max(np.abs(z))
    linear = solve(view, every.moving, np.full(41, 0.15), caps_of(every))
    assert np.max(np.abs(1e3 * linear.z - z)) > 0.05 * np.max(np.abs(z))


@pytest.mark.thorough
def test_six_unknowns_satisfy_the_equations_of_motion_of_both_bodies() -> None:
    """Newton's law for every body, the contacts summed row by row, without any receptance."""
    machine = carriages(48)
    line = 6000.0
    found = response(machine, 150.0, [line, line + 5.0, line + 10.0], outputs=machine.dofs, method=Newton())
    branch = found.branches[0][0]
    x, w = branch.output[0], 2 * np.pi * line
    rows = machine.rows(machine.flexible)
    z = rows @ x
    assert np.max(np.abs(z - branch.joint[0])) < 1e-9 * np.max(np.abs(z))
    joints = machine.joints()
    g = np.array([complex(j.first_harmonic(abs(s), w).gain) * s for j, s in zip(joints, z, strict=True)])
    pull = -rows.T @ g
    pull[machine.dofs.index("a.uz")] += 150.0
    start = 0
    for component in machine.components:
        model = component.second_order()
        assert model is not None
        own = slice(start, start + len(component.dofs))
        inertia = (model.stiffness + 1j * w * model.damping - w**2 * model.mass) @ x[own]
        scale = np.abs(rows[:, own].T) @ np.abs(g) + w**2 * np.abs(model.mass) @ np.abs(x[own])
        assert np.all(np.abs(inertia - pull[own]) < 1e-7 * (np.max(scale) + 1.0))
        start += len(component.dofs)


@pytest.mark.slow
def test_parallel_joints_curve_together_by_arc_length_too() -> None:
    """Three equal springs on one mass are one coordinate; harmonics and folds are those of one spring of their sum."""
    mass = Lumped("m", ("x",), np.array([[1.0]]))

    def machine(count: int) -> Machine:
        part = Joint((Linear(1e8 / count), Cubic(3e17 / count), Viscous(120.0 / count)))
        links = tuple(Connection(f"k{i}", ("m.x", "ground"), part) for i in range(count))
        return Machine((mass,), links, drive="m.x")

    one, three = (response(machine(n), 20.0, [1500.0, 1800.0], method=ArcLength(), harmonics=(1, 3, 5)) for n in (1, 3))
    tops = [max(found.peaks_of("k0", 20.0), key=lambda p: p.amplitude) for found in (one, three)]
    assert tops[1].amplitude == pytest.approx(tops[0].amplitude, rel=1e-8)
    assert tops[1].frequency == pytest.approx(tops[0].frequency, rel=1e-8)
    assert [b.ends for b in one.branches[0]] == [b.ends for b in three.branches[0]]
    assert np.ptp([np.max(np.abs(three.branches[0][0].joint[:, k])) for k in range(3)]) < 1e-18


def hammered(lines: int, dofs: int) -> Measured:
    """A record of every pair of dofs; its matrix is a view of one row per line, so that it need not be held itself."""
    f = np.linspace(100.0, 2000.0, lines)
    w = 2 * np.pi * f
    base = np.zeros((lines, 2 * dofs - 1), dtype=complex)
    for natural, share in zip(np.linspace(180.0, 1700.0, 8), np.linspace(-0.9, 0.95, 8), strict=True):
        wr = 2 * np.pi * natural
        base += share ** np.arange(2 * dofs - 1) / (wr**2 - w[:, None] ** 2 + 0.04j * wr * w[:, None])
    strides = (base.strides[0], base.strides[1], base.strides[1])
    H = np.lib.stride_tricks.as_strided(base, (lines, dofs, dofs), strides, writeable=False)
    return Measured("part", tuple(f"d{i}" for i in range(dofs)), f, H)


def on_its_lines(part: Measured, joints: int) -> Machine:
    joint = Joint((Linear(2e5), Cubic(1e15), Viscous(20.0)))
    links = tuple(Connection(f"j{i}", (f"part.d{i}", "ground"), joint) for i in range(joints))
    return Machine((part,), links, drive="part.d50")


@pytest.mark.slow
def test_a_record_of_many_dofs_is_never_held_whole() -> None:
    """10 000 lines of 200 by 200 receptances are 6.4 GB; 40 joints need 41 columns and rows, a block at a time."""
    part = hammered(10_000, 200)
    machine = on_its_lines(part, 40)
    tracemalloc.start()
    try:
        assembly = Assembly(machine, ("part.d50",), ("part.d50",))
        found = by_newton(assembly, np.array([5.0]), part.frequency)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert part.value.size * 16 > 6e9
    assert peak < 2**30
    assert not np.any(found.cut)


@pytest.mark.slow
def test_what_is_held_grows_with_the_lines_only_by_the_motions() -> None:
    peaks = []
    for lines in (4000, 8000):
        part = hammered(lines, 60)
        machine = on_its_lines(part, 20)
        tracemalloc.start()
        found = response(machine, 5.0, part.frequency, method=Newton())
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert any("largest values on them" in sentence for sentence in found.warnings)
    receptances = 4000 * 21 * 21 * 16
    assert peaks[1] - peaks[0] < receptances


def test_only_the_columns_of_joints_and_forces_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = carriages(48)
    asked = []
    genuine = Rigid.between

    def between(self: Rigid, omega: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        asked.append((len(rows), len(columns)))
        return genuine(self, omega, rows, columns)

    monkeypatch.setattr(Rigid, "between", between)
    Assembly(machine, machine.dofs, ("a.uz",)).at(np.array([6000.0]))
    # Body a: six coordinates and the force; all its motions are wanted.
    assert asked[0] == (12, 7)


def test_a_part_known_on_its_lines_shows_the_largest_values_there() -> None:
    part = hammered(600, 8)
    machine = Machine((part,), (Connection("j", ("part.d0", "ground"), GUIDE),), drive="part.d1")
    found = response(machine, 5.0, part.frequency)
    size = np.abs(found.branches[0][0].joint[:, 0])
    for peak in found.peaks_of("j", 5.0):
        k = int(np.argmin(np.abs(part.frequency - peak.frequency)))
        assert part.frequency[k] == peak.frequency
        assert size[k] == pytest.approx(peak.amplitude, rel=1e-12)
        assert size[k] >= max(size[k - 1], size[k + 1])


@pytest.mark.thorough
def test_chain_of_300_masses_with_48_joints_moves_as_its_masses_demand() -> None:
    """A general root finder given masses, springs and dampers only, at the solution of 48 joint unknowns, stays."""
    machine = chain(300, 48)
    row = machine.components[0]
    assert isinstance(row, Lumped)
    lines = np.array([1040.0, 3000.0])
    assembly = Assembly(machine, machine.dofs, ("row.m1",))
    found = by_newton(assembly, np.array([50.0]), lines)
    stiffness, damping = np.asarray(row.stiffness), np.asarray(row.damping)
    for line, motion in zip(lines, found.motion, strict=True):
        x, w = motion[48:], 2 * np.pi * line
        z = x[:48] - x[1:49]
        g = (K1 + 0.75 * GUIDE.laws[1].stiffness3 * np.abs(z) ** 2 + 1j * w * C) * z  # type: ignore[attr-defined]
        r = (stiffness + 1j * w * damping - w**2 * row.mass) @ x
        r[:48] += g
        r[1:49] -= g
        r[0] -= 50.0
        assert np.max(np.abs(r)) < 1e-7 * 50.0
