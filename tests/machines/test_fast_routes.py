"""The quick ways of a forced response against the plain ones they stand for."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from jointlib.joint import Joint
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.jenkins import Jenkins
from machines import frf, read_machine, response
from machines.continuation import overtones
from machines.forced_response.response import Response
from machines.forced_response.tool_peaks import tool_peaks
from machines.harmonic_balance import harmonics as harmonics_of
from machines.harmonic_balance import remembering, tangent
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.balance import Balance
from machines.harmonic_balance.cycle import Cycle
from machines.harmonic_balance.tangent import Tangent
from machines.model.machine import Machine
from machines.operating.branches import Branch, End, Stability
from machines.operating.tops import tops

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from bench_commands import chain

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


@pytest.fixture(scope="module")
def row(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    """Masses in a row on springs, of which two soften."""
    return read_machine(chain(tmp_path_factory.mktemp("chain") / "chain.toml", 10, 2))


def assembly_of(machine: Machine, low: float = 20.0, high: float = 2e3) -> Assembly:
    drive = machine.driven_dof()
    return Assembly(machine, tuple(machine.tool.values()), (drive,), (2 * np.pi * low, 2 * np.pi * high))


@pytest.mark.parametrize("name", ["chain", "column_mill_a.toml", "lathe.toml", "three_joints.toml"])
def test_one_sum_over_poles_is_what_the_components_say_line_by_line(name: str, row: Machine) -> None:
    assembly = assembly_of(row if name == "chain" else read_machine(LIBRARY / name))
    assert assembly._whole is not None
    omega = 2 * np.pi * np.geomspace(20, 4e3, 40)
    quick, plain = assembly.at(omega), assembly.by_components(omega)
    for ours, theirs in (
        (quick.Hzz, plain.Hzz),
        (quick.Hzf, plain.Hzf),
        (quick.Hoz, plain.Hoz),
        (quick.Hof, plain.Hof),
    ):
        most = np.max(np.abs(theirs), axis=(1, 2), keepdims=True)
        assert np.all(np.abs(ours - theirs) <= 1e-9 * most)


def test_a_machine_with_a_measured_part_is_asked_line_by_line() -> None:
    assert assembly_of(read_machine(LIBRARY / "end_mill.toml"), 300.0, 3e3)._whole is None


def motions_of(found: Response) -> dict[float, np.ndarray]:
    """Motions of the joints on the lines that one branch alone has."""
    every = np.concatenate([b.frequency for b in found.branches[0]])
    once = {f for f, n in zip(*np.unique(every, return_counts=True), strict=True) if n == 1}
    pairs = [(f, z) for b in found.branches[0] for f, z in zip(b.frequency, b.joint, strict=True)]
    return {float(f): z for f, z in pairs if f in once}


@pytest.mark.slow
def test_harmonics_carried_over_beside_a_fold_are_those_of_the_whole_curve(row: Machine) -> None:
    with patch.object(overtones, "pieced", wraps=overtones.pieced) as spy:
        quick = response(row, 200.0, harmonics="auto")
    assert spy.called
    assert {b.harmonics for b in quick.branches[0]} == {(1, 3, 5)}
    assert len(quick.branches[0]) > 1
    with patch.object(overtones, "pieced", return_value=None):
        plain = response(row, 200.0, harmonics="auto")
    assert [len(b) for b in quick.branches] == [len(b) for b in plain.branches]
    ours, theirs = motions_of(quick), motions_of(plain)
    shared = ours.keys() & theirs.keys()
    assert len(shared) > 500
    for f in shared:
        assert np.max(np.abs(ours[f] - theirs[f])) <= 1e-6 * np.max(np.abs(theirs[f]))
    assert len(quick.peaks) == len(plain.peaks)
    for one, other in zip(quick.peaks, plain.peaks, strict=True):
        assert (one.connection, one.outcome) == (other.connection, other.outcome)
        assert one.amplitude == pytest.approx(other.amplitude, rel=1e-6)
        assert one.frequency == pytest.approx(other.frequency, rel=1e-6)


def test_products_with_the_tangent_solve_what_elimination_solves() -> None:
    assembly = assembly_of(read_machine(LIBRARY / "lathe.toml"))
    omega = 2 * np.pi * np.linspace(100, 2000, 7)
    balance = Balance.of(assembly, omega, np.full(7, 10.0), (1, 2, 3, 0))
    start = np.zeros((7, 4, len(assembly.coordinates.rows)), dtype=complex)
    start[:, 0] = balance.driven * 10.0
    own = Tangent(balance, balance.forces(start, 64))
    rng = np.random.default_rng(1)
    right = 1e-9 * (rng.normal(size=start.shape) + 1j * rng.normal(size=start.shape))
    right[:, 3] = right[:, 3].real
    quick = own.solve(right)
    with patch.object(tangent, "_DIRECT", 10**6):
        plain = own.solve(right)
    assert np.max(np.abs(quick - plain)) <= 1e-9 * np.max(np.abs(plain))


def test_every_top_in_doubt_is_closed_in_on_however_many_lie_together() -> None:
    poles = 1000 + 4.0 * np.arange(8)

    def amplitude(w: np.ndarray) -> np.ndarray:
        return np.abs(1 / (poles**2 - w[:, None] ** 2 + 2j * 0.01 * poles * w[:, None]))

    omega = np.linspace(700, 1300, 40)
    for _ in range(8):
        further = tops(omega, amplitude(omega)).wanted(omega)
        omega = np.union1d(omega, further)
    found = tops(omega, amplitude(omega))
    assert np.all(found.sure)
    assert found.omega == pytest.approx(poles * np.sqrt(1 - 2 * 0.01**2), rel=1e-6)
    assert found.width == pytest.approx(0.01 * poles, rel=1e-2)


def test_branches_whose_points_lie_in_turn_have_one_peak_of_the_tool(row: Machine) -> None:
    found = response(row, 20.0, (100.0, 200.0), points=60)
    (low,) = found.branches[0]
    f = np.linspace(100.0, 200.0, 41)
    high = 1 / np.abs(1 - (f / 150.0) ** 2 + 0.1j * f / 150.0)

    def branch(rows: slice, size: np.ndarray) -> Branch:
        joint = np.tile(size[rows, None] + 0j, low.joint.shape[1])
        return Branch(f[rows], joint, size[rows, None] + 0j, Stability.UNKNOWN, (End.RANGE, End.FOLD), low.outcome)

    both = (branch(slice(None, None, 2), high), branch(slice(1, None, 2), 0.1 * high))
    assert len(tool_peaks(replace(found, branches=(both,)))) == 1


@pytest.mark.slow
def test_what_sliders_may_hold_does_not_jump_from_line_to_line() -> None:
    machine = read_machine(LIBRARY / "column_mill_a.toml")
    lines = np.concatenate([[20.0], np.linspace(2240.0, 2260.0, 6)])
    held = response(machine, 10.0, lines, machine.tool["x"]).branches[0][0].held
    assert np.all(held < 1e-4)
    assert np.ptp(held[1:]) <= 0.1 * np.max(held[1:])


@pytest.mark.slow
def test_what_takes_long_is_said() -> None:
    said: list[str] = []

    class Told:
        def step(self, what: str) -> nullcontext[None]:
            said.append(what)
            return nullcontext()

    frf(LIBRARY / "lathe.toml", frequency=(300.0, 500.0), progress=Told())
    assert any(what.startswith("solving 600 lines") for what in said)
    assert any("further harmonics" in what for what in said)


def test_a_slider_that_sticks_pulls_as_its_steps_say() -> None:
    joint, harmonics = Joint((Jenkins(stiffness=1e7, slip_force=50.0),)), (1, 3, 0)
    z = np.array([[2e-6, 1e-7j, 1e-6], [4e-6 + 1e-6j, 3e-7, 0.0], [9e-6, 0.0, 0.0]], dtype=complex)
    omega, cycle = np.full(3, 1e3), Cycle.of(harmonics, 512)
    quick = remembering.with_memory(joint, cycle, z, omega, True)
    plain = remembering._stepped(joint, cycle, z, omega, True)
    x = cycle.displacement(z)
    assert remembering.stays(joint, np.max(x, axis=1), np.min(x, axis=1)).tolist() == [True, True, False]
    for ours, theirs in zip(quick, plain, strict=True):
        assert np.max(np.abs(ours - theirs)) <= 1e-8 * np.max(np.abs(theirs))


def test_few_samples_tell_a_contact_that_stays_far_from_where_it_is_lost() -> None:
    joint, harmonics = Joint((HertzContact(preload=500.0, kappa=4e-8),)), (1, 2, 3, 0)
    depth = joint.laws[0].indentation
    z = np.array([[0.4, 0.02, 0.01j, -0.05], [0.6, 0.02, 0.01j, -0.05]])[:, :, None] * depth
    omega = np.full(2, 1e3)
    assert harmonics_of._is_smooth(joint, z[:, :, 0], harmonics).tolist() == [True, False]
    quick = harmonics_of.joint_forces([joint], z, omega, harmonics)
    with patch.object(harmonics_of, "_is_smooth", return_value=np.zeros(2, dtype=bool)):
        plain = harmonics_of.joint_forces([joint], z, omega, harmonics)
    for ours, theirs in ((quick.force, plain.force), (quick.by_z, plain.by_z), (quick.travel, plain.travel)):
        assert np.max(np.abs(ours - theirs)) <= 1e-12 * np.max(np.abs(theirs))
