"""Branches followed by arc length: the amplitude map as oracle, several joints, isolas, named ends."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_machine_coupling import lumped
from test_several_joints import GUIDE, chain

import machines
from jointlib.errors import InputError, Outcome
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.polynomial import Polynomial
from machines import AmplitudeMap, ArcLength, Connection, Machine, Newton, Response, read_machine, response
from machines.harmonic_balance.assembly import Assembly
from machines.operating.branches import End, Stability
from machines.operating.solutions import by_amplitude_map

LIBRARY = Path(machines.__file__).parent / "library"


def two_mass() -> Machine:
    return read_machine(LIBRARY / "two_mass.toml")


def folds(found: Response) -> list[float]:
    """Frequencies at which branches end in a fold, each once."""
    at = [b.frequency[i] for b in found.branches[0] for i, end in ((0, b.ends[0]), (-1, b.ends[1])) if end is End.FOLD]
    return sorted({round(float(f), 4) for f in at})


def test_one_joint_folds_where_its_amplitude_map_turns() -> None:
    """The map on closely spaced lines closes in on the fold from one side; arc length meets it exactly."""
    machine = two_mass()
    mapped = response(machine, 125.0, [4900.0, 5200.0])
    followed = response(machine, 125.0, [4900.0, 5200.0], method=ArcLength())
    assert [b.stability for b in followed.branches[0]] == [
        Stability.FOLD_STABLE,
        Stability.UNSTABLE,
        Stability.FOLD_STABLE,
    ]
    middle, expected = (
        next(b for b in found.branches[0] if b.stability is Stability.UNSTABLE) for found in (followed, mapped)
    )
    assert middle.frequency[[0, -1]] == pytest.approx(expected.frequency[[0, -1]], rel=1e-6)
    assert middle.frequency[[0, -1]] == pytest.approx([4921.84, 4952.59], abs=6e-3)
    assert [p.amplitude for p in followed.peaks] == pytest.approx([p.amplitude for p in mapped.peaks], rel=1e-9)


def test_every_point_of_a_curve_is_a_solution_of_the_amplitude_map() -> None:
    machine = two_mass()
    followed = response(machine, 125.0, [4900.0, 5200.0], method=ArcLength())
    assembly = Assembly(machine, ("slide.x",), ("slide.x",))
    for branch in followed.branches[0]:
        inner = branch.frequency[1:-1]
        exact = by_amplitude_map(assembly, np.array([125.0]), np.unique(inner), 150)
        place = np.searchsorted(exact.frequency, inner)
        for i, k in enumerate(place):
            sizes = exact.size[exact.line == k]
            assert np.min(np.abs(sizes / np.abs(branch.joint[i + 1, 0]) - 1)) < 1e-8


def test_all_three_solutions_stand_on_the_lines() -> None:
    found = response(two_mass(), 125.0, [4900.0, 4937.25, 5200.0], method=ArcLength())
    at = [(b.stability, abs(b.joint[i, 0])) for b in found.branches[0] for i in np.flatnonzero(b.frequency == 4937.25)]
    assert sorted(A for s, A in at if s is Stability.FOLD_STABLE) == pytest.approx([2.4763e-6, 5.6177e-6], abs=6e-11)
    assert [A for s, A in at if s is Stability.UNSTABLE] == pytest.approx([4.7618e-6], abs=6e-11)
    smallest = found.frfs[0].receptance[found.frfs[0].frequency == 4937.25, 0, 0]
    assert abs(smallest[0]) < 1e-5


@pytest.mark.thorough
def test_a_limit_ends_the_branch_exactly_and_by_name() -> None:
    found = response(two_mass(), 125.0, method=ArcLength())
    assert found.outcomes == (Outcome.PAST_FORCE_PEAK,)
    ends = [
        abs(b.joint[i, 0])
        for b in found.branches[0]
        for i, end in ((0, b.ends[0]), (-1, b.ends[1]))
        if end is End.LIMIT
    ]
    assert ends == pytest.approx([np.sqrt(654.164e6 / (3 * 1.7083e18))] * 2, rel=1e-8)
    peaks = found.peaks_of("guide", 125.0)
    assert [p.outcome for p in peaks] == [Outcome.PAST_FORCE_PEAK, Outcome.CONVERGED]


@pytest.mark.slow
def test_several_joints_fold_and_no_part_is_lost() -> None:
    """Newton loses this resonance below 1227 Hz; the fold is where two solutions of Newton's meet."""
    machine = chain(10, 5)
    found = response(machine, 50.0, [1150.0, 1300.0], points=200)
    assert found.outcomes == (Outcome.CONVERGED,)
    assert [b.ends for b in found.branches[0]] == [(End.RANGE, End.FOLD), (End.FOLD, End.FOLD), (End.FOLD, End.RANGE)]
    low, high = found.branches[0][1].frequency[[0, -1]]
    line = (low + high) / 2
    three = response(machine, 50.0, [1150.0, line, 1300.0], method=ArcLength()).branches[0]
    sizes = [float(np.max(np.abs(b.joint[b.frequency == line]))) for b in three if line in b.frequency]
    assert len(sizes) == 3
    newton = response(machine, 50.0, [line - 1e-3, line, line + 1e-3], method=Newton()).branches[0]
    on_line = [float(np.max(np.abs(b.joint[b.frequency == line]))) for b in newton if line in b.frequency]
    assert all(np.min(np.abs(np.array(sizes) / size - 1)) < 1e-9 for size in on_line)
    assert len(on_line) >= 1


@pytest.mark.thorough
def test_outside_a_fold_newton_and_arc_length_agree() -> None:
    machine = chain(10, 5)
    lines = np.linspace(1240.0, 1400.0, 41)
    a, b = (response(machine, 20.0, lines, method=m) for m in (ArcLength(), Newton()))
    here = np.isin(a.frfs[0].frequency, lines)
    difference = np.abs(a.frfs[0].receptance[here] - b.frfs[0].receptance)
    assert np.max(difference) < 1e-8 * np.max(np.abs(b.frfs[0].receptance))


@pytest.mark.slow
def test_an_isola_is_found_by_raising_the_force_where_the_map_has_it() -> None:
    """Two equal hardening springs on one mass act as one of twice the size, which the map solves without following.

    Damping c0 + c2 z² + c4 z⁴ that falls and rises again needs F = ω A (c0 + c2 A²/4 + c4 A⁴/8) at resonance, with a
    maximum at 4 µm and a minimum at 8 µm: between the two forces a closed curve floats above the resonance.
    """
    u, v, c0 = 4e-6**2, 8e-6**2, 200.0
    c2, c4 = -4 / 3 * c0 * (1 / u + 1 / v), 8 / 5 * c0 / (u * v)

    def joint(share: float) -> Joint:
        damping = Polynomial(tuple((0.0, share * c) for c in (c0, 0.0, c2, 0.0, c4)))
        return Joint((Linear(share * 1e8), Cubic(share * 1e17), damping))

    mass, half = lumped("m", [[1.0]]), joint(0.5)
    two = Machine((mass,), tuple(Connection(n, ("m.x", "ground"), half) for n in ("a", "b")), drive="m.x")
    one = Machine((mass,), (Connection("a", ("m.x", "ground"), joint(1.0)),), drive="m.x")
    single, double = (response(m, 3.4, [1450.0, 1800.0]) for m in (one, two))
    closed = [b for b in double.branches[0] if b.ends == (End.FOLD, End.FOLD)]
    assert {b.stability for b in closed} == {Stability.UNKNOWN, Stability.UNSTABLE}
    assert folds(double) == pytest.approx(folds(single), rel=1e-6)
    assert len(folds(double)) == 2
    highest = [max(p.amplitude for p in found.peaks_of("a", 3.4)) for found in (single, double)]
    assert highest[1] == pytest.approx(highest[0], rel=1e-8)


def test_joint_that_stands_still_has_no_peak_and_a_range_without_top_says_so() -> None:
    found = response(two_mass(), 10.0, [1500.0, 2000.0], method=ArcLength())
    assert [p.outcome for p in found.peaks] == [Outcome.PEAK_AT_EDGE]


@pytest.mark.thorough
def test_limit_of_one_of_several_joints_is_named() -> None:
    machine = chain(10, 5)
    machine = machine.with_joint("j4", replace(GUIDE, validity={"amplitude": (0.0, 2e-6)}))
    found = response(machine, 50.0, (1150.0, 1300.0), points=100)
    (peak,) = [p for p in found.peaks_of("j4", 50.0) if p.outcome is not Outcome.CONVERGED]
    assert peak.outcome is Outcome.OUT_OF_RANGE
    assert peak.amplitude == pytest.approx(2e-6, rel=1e-8)


@pytest.mark.slow
def test_every_point_says_what_it_is() -> None:
    found = response(chain(10, 5), 50.0, [1150.0, 1300.0], points=50)
    for branch in found.branches[0]:
        count = len(branch.frequency)
        assert branch.error.shape == (count,)
        assert len(branch.labels) == len(branch.outcomes) == count
        assert set(branch.labels) <= {Stability.UNKNOWN, Stability.UNSTABLE}
        assert not np.any(np.isnan(branch.error))


def test_bad_stability_and_maps_of_several_joints_are_refused() -> None:
    with pytest.raises(InputError, match="expected 'folds', 'hill' or 'auto'"):
        response(two_mass(), 10.0, stability="floquet")
    with pytest.raises(InputError, match="takes one nonlinear joint and there are 5"):
        response(chain(10, 5), 10.0, [1200.0, 1300.0], method=AmplitudeMap())


@pytest.mark.thorough
def test_next_to_a_fold_the_estimated_error_bounds_that_found_with_more_harmonics() -> None:
    machine = read_machine(LIBRARY / "two_mass.toml")
    lines = np.linspace(4900, 5000, 120)
    one, several = (response(machine, 120.0, lines, method=ArcLength(), harmonics=h) for h in (1, (1, 3, 5)))
    compared = 0
    for b in one.branches[0]:
        for k in range(len(b.frequency)):
            same = [c.joint[c.frequency == b.frequency[k]] for c in several.branches[0]]
            apart = [abs(z[0] - b.joint[k, 0]) / abs(b.joint[k, 0]) for z in np.concatenate(same)]
            # Larger ones may be those of the next solution.
            if apart and 1e-3 < b.error[k] < 0.05:
                assert 0.6 * b.error[k] < min(apart) < 1.05 * b.error[k]
                compared += b.error[k] > 5e-3
    assert compared > 5
